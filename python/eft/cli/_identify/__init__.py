"""`eft identify`: a rig's parameters from measurements."""

from __future__ import annotations

import click

from eft.cli._identify._rig import damping, force_loop, friction, load_cell
from eft.cli._identify._valve import curve, delay, overlap, valve
from eft.cli._output import epilog


@click.group(
    short_help="Find a rig's parameters in measured data.",
    epilog=epilog(
        "eft identify delay test.csv", "eft identify curve slow.csv fast.csv --rig rig.toml -o curve.toml"
    ),
    commands=[delay, curve, overlap, friction, force_loop, load_cell, damping, valve],
)
def identify() -> None:
    """Find parameters of a rig in CSV, MAT, HDF5 or Parquet files, whose columns name their units."""
