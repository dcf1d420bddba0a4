"""`eft iterate`: the drive that gives the desired force."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import numpy as np

import eft
from eft._files import atomic_write
from eft._test_file import drive_files
from eft.cli._output import FILE, as_json, emit_json, epilog, table
from eft.cli._plan import plan_of, test_options
from eft.traces import read_traces
from eft.traces._write import check_folder


@click.command(
    short_help="Improve a command by repeating the test.",
    epilog=epilog(
        "eft iterate test.toml",
        "eft iterate --sweep 8900 0 10 32 --repeats 5 -o drive.csv",
        "eft iterate test.toml --measured measured.csv -o next.csv",
    ),
)
@test_options
@click.option("--measured", type=FILE, help="A measured test (command, force): one step, no virtual rig.")
@click.option(
    "--repeats",
    type=click.IntRange(1, 100),
    default=5,
    show_default=True,
    help="Number of repeats on the virtual rig.",
)
@click.option(
    "--relaxation",
    type=float,
    default=0.8,
    show_default=True,
    help="Share of the correction that is applied.",
)
@click.option(
    "--band", type=float, nargs=2, metavar="HZ HZ", help="Band to correct; default: that of the command."
)
@click.option(
    "--coherence",
    type=float,
    default=0.8,
    show_default=True,
    help="Frequencies with less coherence are not corrected.",
)
@click.option(
    "-o", "--output", type=FILE, default=Path("drive.csv"), show_default=True, help="CSV of the drive."
)
@as_json
def iterate(
    test: Path | None,
    rig: Path | None,
    changes: dict[str, Any],
    measured: Path | None,
    repeats: int,
    relaxation: float,
    band: tuple[float, float] | None,
    coherence: float,
    output: Path,
    as_json: bool,
    **command: Any,
) -> None:
    """Find the drive with which the force follows the command of a TEST, and write it as a CSV file.

    Each repeat corrects the drive by the remaining error. The correction inverts the response of the force to
    the drive, at every frequency with a high coherence. A specimen that yields is refused. A test file runs
    a drive with `kind = "drive"` and `file = "drive.csv"` in its section [command].

    With several actuators each one has a file, the ground floor's first: drive-1.csv, drive-2.csv, and so
    on. `file = "drive.csv"` reads all of them.
    """
    check_folder(output)
    plan = plan_of(test, rig, changes, command)
    if plan.command.values.ndim > 1 and measured is not None:
        raise click.UsageError(
            "--measured: must be a test of one actuator; of several, use eft.iterate in Python"
        )
    source = plan.rig if measured is None else read_traces(measured)
    found = eft.iterate(
        source, plan.command, repeats=repeats, relaxation=relaxation, band=band, least_coherence=coherence
    )
    drives = np.atleast_2d(found.drive.values)
    files = drive_files(output, len(drives))
    for file, values in zip(files, drives, strict=True):
        with atomic_write(file) as temporary:
            columns = np.column_stack([found.drive.time, values])
            np.savetxt(temporary, columns, "%.9g", ",", header="time (s),command (N)", comments="")
    written = ", ".join(map(str, files))
    if as_json:
        emit_json({"errors": list(found.errors), "stopped": found.stopped, "drive": written})
        return
    rows = [(f"{i}", f"{error:.2%}") for i, error in enumerate(found.errors)]
    click.echo(f"{plan.about}\non {measured or plan.rig['name']}\n")
    click.echo(table(rows, ("repeat", "force error")))
    click.echo(f"\n{found.stopped}; {written} written")
