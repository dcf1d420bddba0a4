"""`eft study`: many tests from one file."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

import eft
from eft._extras import need
from eft._files import atomic_write
from eft._memory import StudyMemory, check_memory
from eft._study._driver import chunk_of
from eft._study._summary import SHOWN, reasons, summary
from eft._study_file import StudyPlan, read_study
from eft.cli._output import FILE, as_json, beside, emit_json, epilog, settings, table
from eft.cli._plan import memory_option
from eft.traces._write import check_folder


@click.command(
    short_help="Run a test for every combination of some settings.",
    epilog=epilog(
        "eft init robustness.toml --study    a study to begin with",
        "eft study robustness.toml",
        "eft study robustness.toml --table robustness.csv",
        "eft study robustness.toml --dask tcp://head-node:8786",
        "eft report robustness.study",
    ),
)
@click.argument("file", type=FILE)
@settings
@click.option("-o", "--output", type=FILE, help="Folder for the rows; default: FILE with .study")
@click.option("--table", "sheet", type=FILE, help="Also write the table as one file (.csv, .parquet).")
@click.option("--dask", "scheduler", metavar="ADDRESS", help="Run on the workers of a Dask scheduler.")
@memory_option
@as_json
def study(
    file: Path,
    changes: dict[str, Any],
    output: Path | None,
    sheet: Path | None,
    scheduler: str | None,
    memory: float,
    as_json: bool,
) -> None:
    """Run a test for every combination that FILE names, on all cores, and write one row for each.

    FILE is a test file with a section [study.grid], [[study.list]], [study.latin_hypercube] or [study.sobol].
    The rows go to a folder of Parquet files. After an interruption or a kill the same command resumes. The
    exit code is 1 if a test failed unexpectedly. A combination that the rig refuses is not a failure.
    """
    target = output or beside(file, ".study")
    check_folder(target / "rows" if target.is_dir() else target)
    if sheet is not None:
        if sheet.suffix.lower() not in _SHEETS:
            raise click.UsageError(f"--table {sheet}: the suffix must be one of {', '.join(_SHEETS)}")
        check_folder(sheet)
    plan = read_study(file, changes)
    _check_memory(file, plan, memory, remote=scheduler is not None)
    began = time.monotonic()
    try:
        with _executor(scheduler) as executor:
            found = eft.study(
                plan.rig, plan.commands, plan.parameters, executor=executor, output=target,
                dtype=plan.dtype, traces=plan.traces, fft=plan.fft,
            )  # fmt: skip
    except KeyboardInterrupt:
        _tell_what_is_kept(target)
        raise
    seconds = time.monotonic() - began
    if sheet is not None:
        with atomic_write(sheet) as temporary:
            _SHEETS[sheet.suffix.lower()](found, temporary)
    answer = summary(found) | {"output": str(target), "seconds": seconds}
    if as_json:
        emit_json(answer)
    else:
        click.echo(f"{len(found)} tests over {', '.join(found.parameters)} in {seconds:.1f} s\n")
        click.echo(_text(found, answer))
        click.echo(f"\n{target} written" + (f", {sheet} too" if sheet else ""))
    if answer["status"].get("failed"):
        raise click.exceptions.Exit(1)


def _check_memory(file: Path, plan: StudyPlan, allowed: float, remote: bool) -> None:
    """Refuse a study of too much memory, of this machine or of a Dask worker, which has one thread."""
    of = plan.parameters
    grid = math.prod(len(list(values)) for values in of.values()) if isinstance(of, dict) else None
    tests = len(plan.commands) * (len(of) if isinstance(of, list) else grid or sys.maxsize)
    samples = max(map(len, plan.commands.values()))
    workers = 1 if remote else None
    memory = StudyMemory.of(tests, samples, chunk_of(tests), traces=plan.traces, folder=True, workers=workers)
    check_memory(f"{file}: {memory}", memory.needed(plan.rig), allowed)


def _tell_what_is_kept(target: Path) -> None:
    try:
        kept = eft.Study.load(target)
    except (OSError, ValueError):
        return  # interrupted before the first result
    said = f"{len(kept)} of {kept.tests} tests are kept in {target}; the same command resumes"
    click.echo(said, err=True)


@contextmanager
def _executor(scheduler: str | None) -> Iterator[Executor | None]:
    if scheduler is None:
        yield None
        return
    need("distributed")
    import distributed

    try:
        connect: Any = distributed.Client  # the package has no annotations
        client = connect(scheduler, timeout="20s", set_as_default=False)
    except (OSError, ValueError) as error:
        raise ValueError(f"--dask {scheduler}: no scheduler answers there: {error}") from None
    with client:
        yield client.get_executor()


def _text(found: eft.Study, answer: dict[str, Any]) -> str:
    parts = [table([(word, f"{number}") for word, number in answer["status"].items()])]
    rows = []
    for name, (words, form, scale) in SHOWN.items():
        if numbers := answer["metrics"].get(name):
            cells = (form.format(numbers[key] * scale) for key in ("median", "95%", "largest"))
            rows.append((words, *cells, str(numbers["test"])))
    if rows:
        parts.append(table(rows, ("of the completed tests", "median", "95%", "largest", "in test")))
        worst = dict.fromkeys(numbers["test"] for numbers in answer["metrics"].values())
        parts.append("\n".join(_settings(found.row(test), found) for test in worst))
    told = reasons(found)
    parts += ["\n".join(f"{number} × {reason}" for reason, number in told[:5])] if told else []
    if len(told) > 5:
        parts.append(f"and {len(told) - 5} other reasons, in the column `error`")
    return "\n\n".join(parts)


def _settings(row: dict[str, Any], found: eft.Study) -> str:
    """The settings of a test in words."""
    command = [f"command {row['command']}"] if len(found.description["commands"]) > 1 else []
    changes = [f"{key} = {_short(row[key])}" for key in found.parameters]
    return f"test {row['index']}: {', '.join(command + changes)}"


def _short(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


_SHEETS = {
    ".csv": lambda found, path: found.to_pandas().to_csv(path, index=False),
    ".parquet": lambda found, path: found.to_pandas().to_parquet(path, index=False),
}
