"""`eft compare`: two tests side by side."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from eft.cli._output import FILE, as_json, emit_json, epilog, table
from eft.traces import Comparison, read_traces
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
@click.option("--column", "columns", multiple=True, metavar="QUANTITY=HEADER", help="Which column holds it.")
@click.option("--unit", "units", multiple=True, metavar="QUANTITY=UNIT", help="Its unit, if not in the file.")
@click.option("--sample-rate", type=float, metavar="HZ", help="For files without a time column.")
@as_json
def compare(
    reference: Path,
    other: Path,
    columns: tuple[str, ...],
    units: tuple[str, ...],
    sample_rate: float | None,
    as_json: bool,
) -> None:
    """Compare the signals of OTHER with those of REFERENCE.

    Each is a run that `eft run` saved, or a CSV, MAT, HDF5 or Parquet file whose columns carry their units:
    `time (s),force (kip),displacement (in)`. --column and --unit hold for every such file.
    """
    if sample_rate is not None and not (math.isfinite(sample_rate) and sample_rate > 0.0):
        raise click.UsageError(f"--sample-rate {sample_rate:g}: must be a finite number above zero, in Hz")
    options: dict[str, Any] = {
        "columns": pairs("--column", columns),
        "units": pairs("--unit", units),
        "sample_rate": sample_rate,
    }
    one, two = (read_traces(path, **options) for path in (reference, other))
    answer = compare_traces(one, two)
    if as_json:
        emit_json({"reference": one.name, "other": two.name, "signals": [asdict(c) for c in answer]})
        return
    click.echo(f"{two.name} against {one.name}\n")
    header = ("signal", "reference peak", "peak", "difference, rms", "largest", "delay, ms")
    click.echo(table([_row(c) for c in answer], header))


def pairs(option: str, values: tuple[str, ...]) -> dict[str, str]:
    """`QUANTITY=TEXT` options as a mapping."""
    answer = {}
    for value in values:
        key, equals, text = value.partition("=")
        if not (equals and key.strip() and text.strip()):
            raise click.UsageError(f"{option} `{value}`: must be QUANTITY=TEXT, as in force=kN")
        answer[key.strip()] = text.strip()
    return answer


def _row(c: Comparison) -> tuple[str, ...]:
    unit = "" if c.unit == "1" else f" ({c.unit})"
    numbers = (f"{c.nrmse:.2%}", f"{c.peak_error:.2%}", f"{c.delay * 1e3:.2f}")
    answers = tuple("-" if text.startswith("nan") else text for text in numbers)
    return (f"{c.quantity}{unit}", f"{c.reference_peak:.4g}", f"{c.peak:.4g}", *answers)
