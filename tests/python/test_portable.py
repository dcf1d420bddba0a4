"""What the package asks of the operating system."""

import ast
from pathlib import Path

import pytest

import eft

UNIX_ONLY = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "termios", "tty"}
MODULES = sorted(Path(eft.__file__).parent.rglob("*.py"))


@pytest.mark.parametrize("folder", sorted({path.parent for path in MODULES}), ids=lambda path: path.name)
def test_no_module_needs_unix_to_be_imported(folder):
    for path in folder.glob("*.py"):
        for statement in ast.parse(path.read_text(encoding="utf-8")).body:
            names = [alias.name for alias in getattr(statement, "names", [])]
            names.append(getattr(statement, "module", None) or "")
            assert UNIX_ONLY.isdisjoint(names), f"{path}: imports {UNIX_ONLY.intersection(names)}"
