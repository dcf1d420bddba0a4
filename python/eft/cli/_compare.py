"""`eft compare`: two tests side by side."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

import eft
from eft._files import atomic_write
from eft._test_file import read_rig
from eft.cli._data import data_options, read_data, rig_option
from eft.cli._output import FILE, as_json, emit_json, epilog, table, units_option
from eft.traces import Traces
from eft.traces import compare as compare_traces
from eft.traces._compare import BAND
from eft.traces._write import check_folder

_PICTURES = (".png", ".svg", ".pdf")
_RUNS = (".eft", ".npz")


@click.command(
    short_help="Compare two tests, signal by signal.",
    epilog=epilog(
        "eft compare nonlinear.eft linear.eft",
        "eft compare measured.csv run.eft",
        "eft compare measured.csv run.eft --align --plot out.png --units us",
        "eft compare measured.csv run.eft --column force='Load cell 3' --unit force=kip",
    ),
)
@click.argument("reference", type=FILE)
@click.argument("other", type=FILE)
@click.option("--align", is_flag=True, help="Shift OTHER in time by its delay after REFERENCE.")
@click.option(
    "--band", type=float, nargs=2, default=BAND, show_default=True, metavar="HZ HZ", help="Band of the ratio."
)
@click.option("--plot", "picture", type=FILE, help="Draw both tests and their difference: .png, .svg, .pdf.")
@rig_option
@units_option
@data_options
@as_json
def compare(
    reference: Path,
    other: Path,
    align: bool,
    band: tuple[float, float],
    picture: Path | None,
    rig: Path | None,
    as_json: bool,
    **data: Any,
) -> None:
    """Compare the signals of OTHER with those of REFERENCE.

    Each is a run that `eft run` saved, or a file of measurements whose columns name their units:
    `time (s),force (kip),displacement (in)`. --column and --unit hold for every such file. A spool opening
    in V takes the sensor of the other test's rig, or of --rig.
    """
    if picture is not None:
        if picture.suffix.lower() not in _PICTURES:
            raise click.UsageError(f"--plot {picture}: the suffix must be one of {', '.join(_PICTURES)}")
        check_folder(picture)
    runs = [eft.TestRun.load(path) if path.suffix.lower() in _RUNS else None for path in (reference, other)]
    sensors = read_rig(rig, {}) if rig else next((run.rig for run in runs if run is not None), None)
    one, two = (
        Traces.from_run(run, str(path)) if run is not None else read_data(path, rig=sensors, **data)
        for path, run in zip((reference, other), runs, strict=True)
    )
    found = compare_traces(one, two, align=align, band=band)
    if picture is not None:
        with atomic_write(picture) as temporary:
            found.plot().savefig(temporary)
    if as_json:
        about = {
            "reference": one.name,
            "other": two.name,
            "shift": found.shift,
            "aligned_by": found.aligned_by,
        }
        emit_json(about | {"band": found.band, "signals": [asdict(signal) for signal in found.values()]})
        return
    click.echo(f"{two.name} against {one.name}\n")
    header, *rows = found.table()
    click.echo(table(rows, header))
    if align:
        click.echo(f"\n{two.name} moved by {-found.shift:.6g} s, by the {found.aligned_by}")
    if picture is not None:
        click.echo(f"{picture} written")
