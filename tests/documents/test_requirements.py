"""Each requirement of the page on them is named at a test, and the reverse."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/reference/safety-requirements.md"
NAME = re.compile(r"\bSR-\d\d\b")


def held():
    """Requirements named right before a test, in a comment of its own."""
    folders = [ROOT / "tests", *(ROOT / "crates").glob("*/src"), *(ROOT / "crates").glob("*/tests")]
    marked = re.compile(r"^ *// (SR-\d\d(?:, SR-\d\d)*)\n *#\[test\]\n", re.MULTILINE)
    named = set()
    for folder in folders:
        for path in folder.rglob("*.rs"):
            for names in marked.findall(path.read_text(encoding="utf-8")):
                named |= set(NAME.findall(names))
    return named


def test_each_requirement_of_the_page_has_a_test():
    page = PAGE.read_text(encoding="utf-8")
    asked = set(NAME.findall(page))
    assert asked
    assert asked == held()


def test_the_table_has_a_row_each():
    page = PAGE.read_text(encoding="utf-8")
    rows = [line.split()[1] for line in page.splitlines() if line.startswith("| SR-")]
    assert rows == sorted(held())


def test_the_tests_of_the_table_exist():
    page = PAGE.read_text(encoding="utf-8")
    named = re.findall(r"`([\w/-]+\.rs)`: `(\w+)`", page)
    assert named
    for file, test in named:
        assert f"fn {test}(" in (ROOT / file).read_text(encoding="utf-8"), (file, test)
