"""`eft export`: a rig's controller as source for firmware, and rig or controller as an FMU."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import click

import eft
from eft._files import write_bytes, write_text
from eft._test_file import read_rig
from eft.cli._output import FILE, epilog
from eft.traces._write import check_folder


@click.command(
    short_help="Write a rig's controller as source for firmware, or the rig as an FMU.",
    epilog=epilog(
        "eft export rig.toml --target rust -o controller.rs",
        "eft export rig.toml --target c --name north -o north.h",
        "eft export rig.toml --target fmu --fmi 3",
    ),
)
@click.argument("rig", type=FILE)
@click.option(
    "--target",
    type=click.Choice(["rust", "c", "fmu"]),
    required=True,
    help="Language of the source, or an FMU.",
)
@click.option(
    "--name",
    help="Name in the C constant EFT_RIG_NAME, for several rigs, or the FMU's. Default: the rig's.",
)
@click.option(
    "--part",
    type=click.Choice(["rig", "controller"]),
    help="Part to write as an FMU. Default: both, one file each.",
)
@click.option("--fmi", type=click.Choice(["2", "3"]), help="The FMU's version of FMI. Default: 2.")
@click.option(
    "-o", "--output", type=FILE, help="File to write; default: RIG with the ending .rs, .h or -PART.fmu."
)
def export(
    rig: Path,
    target: Literal["rust", "c", "fmu"],
    name: str | None,
    part: Literal["rig", "controller"] | None,
    fmi: str | None,
    output: Path | None,
) -> None:
    """Write the controller of the rig file RIG, or of a test's rig, as source or as an FMU.

    The controller runs at the rig's `controller.sample_rate`. The first comment of a source lists the duties
    of the firmware, for example to close the force loop or to start the soft end. A computation delay is
    refused, because it follows from the firmware's own timing. An FMU is for co-simulation. It contains the
    virtual rig, with the valve command as its input, or the digital controller. Its step is one sample.
    """
    source = read_rig(rig, {})
    if target != "fmu":
        if part or fmi:
            option = f"--part {part}" if part else f"--fmi {fmi}"
            raise click.UsageError(f"{option}: only with --target fmu; a source holds the controller")
        path = output or rig.with_suffix(".rs" if target == "rust" else ".h")
        check_folder(path)
        write_text(path, eft.firmware.export(source, target, name))
        click.echo(f"{path} written")
        return
    if output and not part:
        raise click.UsageError("-o names one FMU: choose it with --part rig or --part controller")
    parts: tuple[Literal["rig", "controller"], ...] = (part,) if part else ("rig", "controller")
    files = {
        output or rig.with_name(f"{rig.stem}-{one}.fmu"): eft.firmware.export(
            source, target, name, part=one, fmi=int(fmi or 2)
        )
        for one in parts
    }
    for path, content in files.items():
        check_folder(path)
        write_bytes(path, content)
        click.echo(f"{path} written")
