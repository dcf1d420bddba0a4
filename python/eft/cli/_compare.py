"""`eft compare`: two tests side by side."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from eft.cli._data import data_options, read_data
from eft.cli._output import FILE, as_json, emit_json, epilog, table
from eft.traces import Comparison
from eft.traces import compare as compare_traces


@click.command(
    short_help="Compare two tests, signal by signal.",
    epilog=epilog(
        "eft compare nonlinear.eft linear.eft",
        "eft compare measured.csv run.eft",
        "eft compare measured.csv run.eft --column force='Load cell 3' --unit force=kip",
    ),
)
@click.argument("reference", type=FILE)
@click.argument("other", type=FILE)
@data_options
@as_json
def compare(
    reference: Path,
    other: Path,
    as_json: bool,
    **data: Any,
) -> None:
    """Compare the signals of OTHER with those of REFERENCE.

    Each is a run that `eft run` saved, or a CSV, MAT, HDF5 or Parquet file whose columns carry their units:
    `time (s),force (kip),displacement (in)`. --column and --unit hold for every such file.
    """
    one, two = (read_data(path, **data) for path in (reference, other))
    answer = compare_traces(one, two)
    if as_json:
        emit_json({"reference": one.name, "other": two.name, "signals": [asdict(c) for c in answer]})
        return
    click.echo(f"{two.name} against {one.name}\n")
    header = ("signal", "reference peak", "peak", "difference, rms", "largest", "delay, ms")
    click.echo(table([_row(c) for c in answer], header))


def _row(c: Comparison) -> tuple[str, ...]:
    unit = "" if c.unit == "1" else f" ({c.unit})"
    numbers = (f"{c.nrmse:.2%}", f"{c.peak_error:.2%}", f"{c.delay * 1e3:z.2f}")
    answers = tuple("-" if text.startswith("nan") else text for text in numbers)
    return (f"{c.quantity}{unit}", f"{c.reference_peak:.4g}", f"{c.peak:.4g}", *answers)
