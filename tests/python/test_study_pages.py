"""The study pages are made from the results that were kept."""

import importlib
import re
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"


@pytest.fixture(scope="module")
def script():
    """The modules stand beside each other in docs and import one another by name."""
    known = set(sys.modules)
    sys.path.insert(0, str(DOCS))
    yield importlib.import_module
    sys.path.remove(str(DOCS))
    for name in set(sys.modules) - known:
        if str(DOCS) in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]


def test_pages_are_made_from_what_was_kept(script, tmp_path):
    study = script("fixed_against_adaptive")
    study.report(tmp_path)
    table = (tmp_path / "fixed_against_adaptive_table.md").read_text(encoding="utf-8")
    lines = [line.split(" | ") for line in table.splitlines()[2:]]
    # One line without noise and one with, two for the supply, and what chance decides.
    assert len(lines) == 2 * (len(study.ROWS) + 1) + 2 + 4
    text = (tmp_path / "fixed_against_adaptive.md").read_text(encoding="utf-8")
    pictures = re.findall(r"\(_generated/(\S+\.png)\)", text)
    assert sorted(pictures) == sorted(path.name for path in tmp_path.glob("*.png"))


def test_a_row_that_misses_what_is_asked_says_so(script):
    study = script("fixed_against_adaptive")
    rows = study.read()
    worse = next(row for row in rows if row["row"] == "delay" and row["seed"] == "0")
    worse["adaptive_highest"] = "1.06"
    missed = [line for line in study.table(rows).splitlines() if line.endswith("| **no** |")]
    met = study.table(study.read()).splitlines()
    assert [line.split("|")[1] for line in missed] == [
        " response delay 3 … 8 ms, the same sweeps, 1.2–2.0 Hz "
    ]
    assert not [line for line in met if line.endswith("| **no** |")]
    worse["adaptive_unstable"] = "1"
    assert "0.994 … unstable" in study.table(rows)
