"""Writes the table of wrong inputs, from the tests, with the answers of the command line."""

import contextlib
import io
import os
import shlex
import sys
import tempfile
from pathlib import Path

from eft._files import write_text
from eft.cli import main

sys.path.append(str(Path(__file__).parents[2] / "tests" / "python"))

from mistakes import WRONG


def write(folder: Path) -> None:
    """Run every wrong input of the tests in a separate folder and tabulate the answers."""
    lines = ["| wrong | command | answer |", "| --- | --- | --- |"]
    for name, (arguments, files, _) in WRONG.items():
        said = _said(arguments, files)
        cells = (name, f"`{shlex.join(['eft', *arguments])}`", f"`{said.replace('`', '´')}`")
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    write_text(folder / "wrong-input.md", "\n".join(lines) + "\n")


def _said(arguments: list[str], files: dict[str, str | bytes]) -> str:
    here = Path.cwd()
    with tempfile.TemporaryDirectory() as place, contextlib.redirect_stderr(io.StringIO()) as said:
        os.chdir(place)
        try:
            for file, text in files.items():
                Path(file).write_bytes(text if isinstance(text, bytes) else text.encode())
            if main(arguments) != 2:
                raise RuntimeError(f"eft {shlex.join(arguments)} did not end with 2")
        finally:
            os.chdir(here)
    return said.getvalue().strip()
