"""Every Python block and `eft` command of README and docs runs, and prints the output on the page.

The blocks of a page run one after another in one folder and share their names. A block ```text output```
directly after a Python block is its output.
"""

import contextlib
import importlib
import inspect
import io
import re
import runpy
import shlex
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from eft.cli import main

pytestmark = pytest.mark.usefixtures("quick_pictures")

ROOT = Path(__file__).resolve().parents[2]
PAGES = [
    ROOT / "README.md",
    *(
        page
        for page in sorted((ROOT / "docs").rglob("*.md"))
        if not any(part.startswith("_") for part in page.relative_to(ROOT).parts)
    ),
]


def name(page):
    """`how-to/studies.md` and `reference/python/studies.md` are two pages."""
    return page.relative_to(ROOT).as_posix().removeprefix("docs/")


FENCE = re.compile(r"^```(?P<info>[^\n`]+)\n(?P<body>.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclass
class Block:
    """A Python block with its output (None: anything), or `eft` commands with their exit codes."""

    line: int
    source: str = ""
    output: str | None = None
    commands: list[tuple[list[str], int]] = field(default_factory=list)


def commands(source):
    # A comment after the command states another exit code.
    return [
        (shlex.split(line, comments=True)[1:], int("exit code 1" in line))
        for line in source.splitlines()
        if line.startswith("eft ")
    ]


def blocks(text):
    found = []
    for fence in FENCE.finditer(text):
        line = text.count("\n", 0, fence.start()) + 1
        if fence["info"] == "python":
            found.append(Block(line, fence["body"]))
        elif fence["info"] == "sh" and (them := commands(fence["body"])):
            found.append(Block(line, commands=them))
        elif fence["info"] == "text output":
            assert found and found[-1].source, "an output that follows no Python block"
            found[-1].output = fence["body"]
    return found


WITH_CODE = [page for page in PAGES if blocks(page.read_text(encoding="utf-8"))]


def test_the_collector_sees_blocks_lines_and_output():
    text = "words\n\n```python\nprint(1)\n```\n\n```text output\n1\n```\n\n```sh\nmake\n```\n"
    text += "```sh\neft init\neft run a.toml  # exit code 1\n```\n"
    ran = [(["init"], 0), (["run", "a.toml"], 1)]
    assert blocks(text) == [Block(3, "print(1)\n", "1\n"), Block(14, commands=ran)]


COMMANDS_ELSEWHERE = {"how-to/data-sheet.md"}  # test_data_sheet_page.py compares their answers


@pytest.mark.parametrize("page", WITH_CODE, ids=name)
def test_page_runs_as_printed(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "__main__"}
    for block in blocks(page.read_text(encoding="utf-8")):
        for arguments, code in block.commands * (name(page) not in COMMANDS_ELSEWHERE):
            assert main(arguments) == code, arguments
        # Padded, so that a traceback points at the line of the page.
        code = compile("\n" * block.line + block.source, str(page), "exec")
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(code, names)
        if block.output is not None:
            assert printed.getvalue() == block.output, f"{name(page)}, line {block.line}"


# Where the other blocks are run.
FOLLOWED = {"how-to/firmware-rust.md", "how-to/firmware-c.md"}  # `make firmware`, to the letter
RUN_ELSEWHERE = (
    "eft ",  # above
    "make ",  # .ci/run
    "pip install .",  # .ci/dist-check
)
TOML = {"reference/command-line.md"}  # test_cli_docs.py
NOT_RUN = {
    ("how-to/firmware-boards.md", "{code-block} sh"),  # there is no board
    ("how-to/firmware-zephyr.md", "{code-block} sh"),  # there is no Zephyr
    ("how-to/release.md", "{code-block} sh"),  # it publishes
    ("how-to/cluster.md", "{code-block} python"),  # there is no SLURM, and the page says so
    ("how-to/fmu.md", "{code-block} python"),  # test_statements.py, where FMPy is installed
    ("how-to/fmu.md", "text"),  # what it prints
    ("tutorial/explore.md", "{code-block} python"),  # test_explore_start.py makes the widget
    ("how-to/opensees.md", "{code-block} python"),  # test_opensees_page.py, where OpenSees is installed
}


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_every_block_is_run_by_something(page):
    if name(page) in FOLLOWED:
        return
    text = page.read_text(encoding="utf-8")
    assert text.count("\n```") % 2 == 0
    for fence in FENCE.finditer(text):
        info, where = fence["info"], (name(page), text.count("\n", 0, fence.start()) + 1)
        if info == "sh":
            lines = [line for line in fence["body"].splitlines() if line and not line.startswith("#")]
            assert all(line.startswith(RUN_ELSEWHERE) for line in lines), where
        elif info == "toml":
            assert name(page) in TOML, where
        elif info.startswith("{code-block}"):
            assert (name(page), info) in NOT_RUN and "Not run" in fence["body"], where
        else:
            known = info in ("python", "text output") or info.startswith("{")
            assert known or (name(page), info) in NOT_RUN, where


def test_readme_has_its_example():
    assert any(block.output for block in blocks((ROOT / "README.md").read_text(encoding="utf-8")))


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_make_targets_named_on_a_page_exist(page):
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    named = set(re.findall(r"(?:^|`)make ([a-z-]+)", page.read_text(encoding="utf-8"), re.MULTILINE))
    assert named <= targets


OTHERS = [
    ROOT / name
    for name in (
        "CONTRIBUTING.md",
        "CODE_OF_CONDUCT.md",
        "SECURITY.md",
        "CHANGELOG.md",
        "llms.txt",
        "paper.md",
    )
]


@pytest.mark.parametrize("page", PAGES + OTHERS, ids=name)
def test_relative_links_lead_somewhere(page):
    links = re.findall(r"\]\((?!https?:|#)([^)#\s]+)", page.read_text(encoding="utf-8"))
    # `make docs` makes the generated pictures, and fails without them.
    kept = [link for link in links if "_generated/" not in link]
    assert not [link for link in kept if not (page.parent / link).exists()]


def test_every_page_is_in_llms_txt():
    listed = set(re.findall(r"\]\(([^)]+\.md)\)", (ROOT / "llms.txt").read_text(encoding="utf-8")))
    pages = {str(page.relative_to(ROOT)) for page in PAGES if page.name != "index.md"}
    python = {page for page in pages if page.startswith("docs/reference/python/")}
    assert pages - python - listed == set()


def test_parameter_table_of_the_theory_is_that_of_the_rig():
    import eft

    rig = eft.Rig.zhao2005().to_dict()
    rows = re.findall(
        r"^\| \$[^|]+\| `([\w.]+)` \| ([\d.e+-]+)",
        (ROOT / "docs" / "explanation" / "theory.md").read_text(encoding="utf-8"),
        re.MULTILINE,
    )
    assert len(rows) == 19
    for key, value in rows:
        section, leaf = key.split(".")
        assert rig[section][leaf] == pytest.approx(float(value), rel=1e-12), key


def test_every_public_name_is_in_the_reference():
    topics = tomllib.loads((ROOT / "docs/reference/python/topics.toml").read_text(encoding="utf-8"))
    shown = [f"{module}.{each}" for topic in topics.values() for module in topic for each in topic[module]]
    assert len(shown) == len(set(shown))
    modules = {module for topic in topics.values() for module in topic}
    # A name of two modules is on the page of one of them.
    public = {
        id(thing): f"{module}.{each}"
        for module in sorted(modules)
        for each in importlib.import_module(module).__all__
        if not each.startswith("__")
        and not inspect.ismodule(thing := getattr(importlib.import_module(module), each))
    }
    found = {
        id(getattr(importlib.import_module(each.rpartition(".")[0]), each.rpartition(".")[2]))
        for each in shown
    }
    assert {name for key, name in public.items() if key not in found} == set()
    assert len(found) == len(shown)
    index = (ROOT / "docs/reference/python/index.md").read_text(encoding="utf-8")
    assert {f"{topic}.md" for topic in topics} == set(re.findall(r"\]\((\w+\.md)\)", index))


def test_schematics_are_what_their_script_draws():
    folder = ROOT / "docs" / "images"
    drawings = runpy.run_path(str(folder / "schematics.py"))["DRAWINGS"]
    for file, draw in drawings.items():
        assert (folder / file).read_text(encoding="utf-8") == draw().svg(), file


def test_every_work_that_the_paper_cites_is_in_its_bibliography():
    cited = set(re.findall(r"@(\w+)", (ROOT / "paper.md").read_text(encoding="utf-8")))
    listed = set(re.findall(r"^@\w+\{(\w+),", (ROOT / "paper.bib").read_text(encoding="utf-8"), re.MULTILINE))
    assert cited == listed


def test_citation_names_the_version_of_the_package():
    version = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["package"][
        "version"
    ]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
