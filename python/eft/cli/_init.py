"""`eft init`: a rig file to begin with."""

from __future__ import annotations

from pathlib import Path

import click

import eft
from eft._files import write_text
from eft._test_file import TEMPLATE
from eft.cli._output import FILE, epilog
from eft.traces._write import check_folder


@click.command(
    short_help="Write a rig file to begin with.",
    epilog=epilog(
        "eft init                      the paper's rig as rig.toml",
        "eft init test.toml --test     the same with a command: ready for `eft run`",
    ),
)
@click.argument("file", type=FILE, default=Path("rig.toml"))
@click.option("--test", is_flag=True, help="Add a section [command], which makes it a test.")
@click.option("--force", is_flag=True, help="Replace a file that is there.")
def init(file: Path, test: bool, force: bool) -> None:
    """Write the paper's rig to FILE (rig.toml), every key with its meaning, unit and range."""
    check_folder(file)
    if file.exists() and not force:
        raise click.UsageError(f"{file} is there already; --force replaces it")
    text = eft.Rig.zhao2005().to_toml(comments=True)
    write_text(file, text.rstrip() + "\n" + (TEMPLATE if test else ""))
    click.echo(f"{file} written")
