"""`eft init`: a rig file to begin with."""

from __future__ import annotations

from pathlib import Path

import click

import eft
from eft import _study_file, _test_file
from eft._files import write_text
from eft.cli._output import FILE, epilog
from eft.traces._write import check_folder


@click.command(
    short_help="Write a rig file to begin with.",
    epilog=epilog(
        "eft init                      the paper's rig as rig.toml",
        "eft init test.toml --test     the same with a command: ready for `eft run`",
        "eft init study.toml --study   and with settings to vary: ready for `eft study`",
    ),
)
@click.argument("file", type=FILE, default=Path("rig.toml"))
@click.option("--test", is_flag=True, help="Add a section [command], which makes it a test.")
@click.option("--study", is_flag=True, help="Add a command and settings to vary, which makes it a study.")
@click.option("--force", is_flag=True, help="Replace a file that is there.")
def init(file: Path, test: bool, study: bool, force: bool) -> None:
    """Write the paper's rig to FILE (rig.toml), every key with its meaning, unit and range."""
    if test and study:
        raise click.UsageError("give --test or --study: a study is a test already")
    check_folder(file)
    if file.exists() and not force:
        raise click.UsageError(f"{file} is there already; --force replaces it")
    text = eft.Rig.zhao2005().to_toml(comments=True)
    more = (_test_file.TEMPLATE if test or study else "") + (_study_file.TEMPLATE if study else "")
    write_text(file, text.rstrip() + "\n" + more)
    click.echo(f"{file} written")
