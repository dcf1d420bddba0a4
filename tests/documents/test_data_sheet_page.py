"""From data sheets to a verdict: the page's numbers are those of the command line."""

import re
from pathlib import Path

import pytest

import sheets
from eft.cli import main
from sheets import INIT, QUAKE, answer
from test_docs import blocks

PAGE = Path(__file__).resolve().parents[2] / "docs" / "how-to" / "data-sheet.md"


@pytest.fixture(autouse=True)
def rigs(tmp_path):
    with sheets.rigs(tmp_path):
        yield


def test_the_page_s_numbers_are_those_of_its_commands(capsys):
    text = PAGE.read_text(encoding="utf-8")
    outputs = re.findall(r"```text output\n(.*?)```", text, re.DOTALL)
    given = [arguments for block in blocks(text) for arguments, _ in block.commands]
    assert given[:2] == INIT  # the fixture has run them
    check, test, report = given[2:]
    told, most = outputs[0].splitlines()
    large = answer(capsys, *check)
    assert told == f"{large['verdict']}: {' '.join(large['reasons'])} {large['summary']}"
    # The page gives the factor on the record, the command that on the test, to 2 %.
    factor = float(re.search(r"at most ([\d.]+)", most).group(1))
    assert 0.5 * large["largest_scale"] == pytest.approx(factor, rel=0.03)
    run = answer(capsys, *test)
    assert (run["grade"], run["reasons"]) == (large["verdict"], large["reasons"])
    assert main(report) == 0
    page = Path("large.html").read_text(encoding="utf-8")
    assert all(reason in page for reason in large["reasons"])
    small = answer(capsys, "check", "--rig", "small.toml", *QUAKE)
    assert outputs[2] == f"{small['verdict']}: {' '.join([*small['reasons'], small['summary']])}\n"
