"""`eft export`: a rig's controller as source for firmware."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import click

import eft
from eft._files import write_text
from eft._test_file import read_rig
from eft.cli._output import FILE, epilog
from eft.traces._write import check_folder


@click.command(
    short_help="Write a rig's controller as source for firmware.",
    epilog=epilog(
        "eft export rig.toml --target rust -o controller.rs",
        "eft export rig.toml --target c --name north -o north.h",
    ),
)
@click.argument("rig", type=FILE)
@click.option("--target", type=click.Choice(["rust", "c"]), required=True, help="The language.")
@click.option(
    "--name", help="Name in the C constant EFT_RIG_NAME, to tell several rigs apart. Default: the rig's own."
)
@click.option("-o", "--output", type=FILE, help="Default: RIG with the ending .rs or .h.")
def export(rig: Path, target: Literal["rust", "c"], name: str | None, output: Path | None) -> None:
    """Write the controller of the rig file RIG, or of a test's rig, as source ready to be compiled.

    The controller runs at the rig's `controller.sample_rate`. The file's first comment says what the firmware
    must do itself: close the force loop, pass the measured supply pressure, start the soft end. A computation
    delay is refused, because it follows from the firmware's own timing.
    """
    path = output or rig.with_suffix(".rs" if target == "rust" else ".h")
    check_folder(path)
    write_text(path, eft.firmware.export(read_rig(rig, {}), target, name))
    click.echo(f"{path} written")
