"""`eft report`: one HTML file about one test, several, or a study."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

import eft
from eft.cli._data import data_options, read_data
from eft.cli._output import FILE, beside, epilog, units_option
from eft.report import write_report, write_study_report
from eft.report._page import DIFFERENT, commands_differ
from eft.traces._read import MEASURED
from eft.traces._write import check_folder


@click.command(
    short_help="Write a report of tests or of a study, as one HTML file.",
    epilog=epilog(
        "eft report run.eft",
        "eft report run.eft measured.csv",
        "eft report robustness.study",
        "eft report nonlinear.eft linear.eft -o schemes.html --title 'El Centro'",
    ),
)
@click.argument("runs", type=FILE, nargs=-1, required=True)
@click.option("-o", "--output", type=FILE, help="File to write; default: the first run's name with .html")
@click.option("--title", help="Heading of the page.")
@units_option
@data_options
def report(runs: tuple[Path, ...], output: Path | None, title: str | None, **data: Any) -> None:
    """Write a report of the RUNS that `eft run` saved, or of a study's folder: one HTML file, no network.

    A report of runs has the verdict, the metrics, time histories with zoom, and force over command by
    frequency. It also has the spool opening with the advised 60 %, the restoring force, the configuration
    and the versions. Several runs share the charts. A file of measurements, such as CSV or TDMS, is aligned
    in time and compared with the first run. --column, --unit and --sample-rate describe it. A report of a
    study has the number of tests by status, each metric over each setting, and the worst tests.
    """
    target = output or beside(runs[0], ".html")
    if target.suffix.lower() not in (".html", ".htm"):
        raise click.UsageError(f"{target}: the suffix must be .html")
    check_folder(target)
    if twice := [path for number, path in enumerate(runs) if path in runs[:number]]:
        raise click.UsageError(f"{twice[0]} is given twice")
    heading = {} if title is None else {"title": title}
    if any(path.is_dir() for path in runs):
        if len(runs) > 1:
            raise click.UsageError("a study is reported alone: give one folder, or files of runs")
        write_study_report(eft.Study.load(runs[0]), target, **heading)
        click.echo(f"{target} written")
        return
    named: dict[str, eft.TestRun] = {}
    files = [path for path in runs if path.suffix.lower() in MEASURED]
    if len(files) == len(runs):
        raise click.UsageError(f"{runs[0]} is a measured test: give a run as well, as in `run.eft {runs[0]}`")
    for path in runs:
        if path not in files:
            name = path.stem if path.stem not in named else str(path)
            named[name] = eft.TestRun.load(path)
    rig = next(iter(named.values())).rig
    measured = {path.name: read_data(path, rig=rig, **data) for path in files}
    write_report(named, target, measured=measured, **heading)
    if commands_differ(named):
        click.echo(DIFFERENT, err=True)
    click.echo(f"{target} written")
