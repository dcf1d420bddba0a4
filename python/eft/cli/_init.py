"""`eft init`: a first rig, test or study file, or a data sheet."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import click

import eft
from eft import _study_file, _test_file
from eft._files import write_text
from eft._test_file import parse_toml, read_text
from eft.cli._output import FILE, epilog
from eft.data_sheets import Question
from eft.data_sheets._values import above_zero
from eft.traces._write import check_folder


@click.command(
    short_help="Write a rig file to begin with.",
    epilog=epilog(
        "eft init                      the paper's rig as rig.toml",
        "eft init test.toml --test     the same with a command: ready for `eft run`",
        "eft init study.toml --study   and with settings to vary: ready for `eft study`",
        "eft init sheet.toml --data-sheet            a data sheet to fill in",
        "eft init --from-data-sheet sheet.toml       the rig of that sheet",
    ),
)
@click.argument("file", type=FILE, default=Path("rig.toml"))
@click.option("--test", is_flag=True, help="Add a section [command], which makes it a test.")
@click.option("--study", is_flag=True, help="Add a command and settings to vary, which makes it a study.")
@click.option("--data-sheet", is_flag=True, help="Write an empty data sheet instead of a rig.")
@click.option(
    "--from-data-sheet", "sheet", type=FILE, help="Make the rig from this data sheet, not the paper's."
)
@click.option("--force", is_flag=True, help="Replace an existing file.")
def init(file: Path, test: bool, study: bool, data_sheet: bool, sheet: Path | None, force: bool) -> None:
    """Write a rig to FILE (rig.toml), every key with its meaning, unit and range.

    It is the paper's rig, or that of a data sheet. On a terminal, eft prompts for numbers that the sheet does
    not contain. Without a terminal it names the missing keys and ends with exit code 2.
    """
    if test and study:
        raise click.UsageError("give --test or --study: a study is a test already")
    if data_sheet and (test or study or sheet):
        raise click.UsageError("--data-sheet writes no rig: leave out --test, --study and --from-data-sheet")
    check_folder(file)
    if file.exists() and not force:
        raise click.UsageError(f"{file} exists already; --force replaces it")
    if data_sheet:
        text = eft.data_sheets.TEMPLATE
    else:
        rig = eft.Rig.zhao2005() if sheet is None else _from(sheet)
        text = ("" if rig["compensation.adaptive"] else _FIRST) + rig.to_toml(comments=True).rstrip() + "\n"
        text += (_test_file.TEMPLATE if test or study else "") + (_study_file.TEMPLATE if study else "")
    write_text(file, text)
    click.echo(f"{file} written")


_FIRST = """\
# Recommended: set `adaptive`, `feedforward` and `look_ahead` in [compensation] to true. The controller then
# calibrates itself during the test, and corrects an error of the valve's flow of up to 30 %.

"""


def _from(sheet: Path) -> eft.Rig:
    """The rig of a data sheet; on a terminal the user enters missing values."""
    given: dict[str, Any] = parse_toml(sheet, read_text(sheet))
    questions = eft.data_sheets.missing(given)
    sections = {question.key.partition(".")[0] for question in questions}
    sound = all(isinstance(given.get(name, {}), dict) for name in sections)
    if not (questions and sound and sys.stdin.isatty()):
        return eft.data_sheets.rig(sheet)
    for question in questions:
        section, _, key = question.key.partition(".")
        text = f"{question.text} (such as {question.example})"
        given.setdefault(section, {})[key] = click.prompt(text, value_proc=_checked(question))
    return eft.data_sheets.rig(given)


def _checked(question: Question) -> Callable[[str], float | str]:
    """The answer to a question: a number or a text with its unit. The question is repeated after others."""

    def check(answer: str) -> float | str:
        value: float | str = answer
        with suppress(ValueError):
            value = float(answer)
        try:
            above_zero(question.key, value, question.unit)
        except ValueError as error:
            raise click.UsageError(str(error)) from None
        return value

    return check
