"""Common options of the commands that read measurements."""

from __future__ import annotations

import math
from pathlib import Path

import click

from eft._native import Rig
from eft._test_file import read_rig
from eft.cli._output import FILE, F
from eft.traces import Traces, read_traces

_OPTIONS = (
    click.option(
        "--column",
        "columns",
        multiple=True,
        metavar="QUANTITY=HEADER",
        help="Header of the column that has a quantity.",
    ),
    click.option(
        "--unit",
        "units",
        multiple=True,
        metavar="QUANTITY=UNIT",
        help="Unit of a quantity that has none in the file.",
    ),
    click.option(
        "--sample-rate", type=float, metavar="HZ", help="Sample rate of a file without a time column."
    ),
)


rig_option = click.option("--rig", type=FILE, help="Rig file, for the sensor of a spool opening in V.")
"""The option of a command that needs a rig for this purpose only."""


def data_options(function: F) -> F:
    """Add the options to a command; their values are arguments of `read_data`."""
    for option in reversed(_OPTIONS):
        function = option(function)
    return function


def read_data(
    file: Path,
    *,
    columns: tuple[str, ...],
    units: tuple[str, ...],
    sample_rate: float | None,
    rig: Path | Rig | None = None,
    gaps: bool = False,
) -> Traces:
    """Read a file of measurements with these options; `gaps` is that of `read_traces`."""
    if sample_rate is not None and not (math.isfinite(sample_rate) and sample_rate > 0.0):
        raise click.UsageError(f"--sample-rate {sample_rate:g}: must be a finite number above zero, in Hz")
    return read_traces(
        file,
        columns=_pairs("--column", columns),
        units=_pairs("--unit", units),
        sample_rate=sample_rate,
        gaps=gaps,
        rig=read_rig(rig, {}) if isinstance(rig, Path) else rig,
    )


def _pairs(option: str, values: tuple[str, ...]) -> dict[str, str]:
    """`QUANTITY=TEXT` options as a mapping."""
    answer = {}
    for value in values:
        key, equals, text = value.partition("=")
        if not (equals and key.strip() and text.strip()):
            raise click.UsageError(f"{option} `{value}`: must be QUANTITY=TEXT, as in force=kN")
        answer[key.strip()] = text.strip()
    return answer
