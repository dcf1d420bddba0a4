"""`eft demo`: the paper's tests."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import click

from eft.cli._output import FILE, epilog, units_option


@click.command(
    short_help="Run the paper's tests and compare them with the paper.",
    epilog=epilog("eft demo", "eft demo --record northridge.at2 --scale 0.6 --output northridge"),
)
@click.option("--record", metavar="FILE", type=FILE, help="Ground motion instead of El Centro.")
@click.option("--unit", metavar="UNIT", help="Unit of the record, if not in the file: g, m/s2, cm/s2, ...")
@click.option("--scale", type=float, help="Factor on the ground acceleration.")
@click.option("--short", is_flag=True, help="Omit the sweeps of Fig. 11.")
@click.option(
    "--output", type=FILE, default=Path("demo-output"), show_default=True, help="Folder to write to."
)
@units_option
def demo(record: Path | None, unit: str | None, scale: float | None, short: bool, output: Path) -> int:
    """Run the paper's tests and an earthquake on the virtual rig, and compare them with the paper's numbers.

    Prints a table and writes figures and a report. Exit code 1 when a number misses its reference.
    """
    # Imported here, because matplotlib is slow to import.
    from eft.demo.__main__ import run

    if scale is not None and (not math.isfinite(scale) or scale == 0.0):
        raise click.UsageError(f"--scale {scale:g}: must be a finite factor other than zero")
    return run(argparse.Namespace(record=record, unit=unit, scale=scale, short=short, output=output))
