"""`eft run`: a test on the virtual rig."""

from __future__ import annotations

import json
import math
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np

import eft
from eft._run_parts import first
from eft._table import Metrics
from eft._test_file import TestPlan
from eft._verdict import Verdict, told_delay
from eft._watch import show
from eft.cli._calibration import (
    calibration_option,
    check_save_calibration,
    save_calibration,
    start_from,
)
from eft.cli._output import FILE, as_json, emit_json, epilog, progress, table, units_option
from eft.cli._plan import plan_of, test_options
from eft.cli._save_rig import check_save_rig, save_rig
from eft.traces import write_run
from eft.traces._write import check_output


@click.command(
    short_help="Run a test on the virtual rig.",
    epilog=epilog(
        "eft run test.toml",
        "eft run --record elcentro --scale 1.3 --set compensation.mode=linear -o linear.eft",
        "eft run --rig rig.toml --sweep 8900 0 10 32 -o sweep.csv",
        "eft run test.toml --save-rig corrected.toml",
        "eft run test.toml --calibration monday.toml --save-calibration tuesday.toml",
        "eft run test.toml --set controller.force_loop=robust --watch",
    ),
)
@test_options
@click.option(
    "--dtype", type=click.Choice(["f64", "f32"]), default="f64", help="Precision of the controller."
)
@click.option(
    "-o",
    "--output",
    type=FILE,
    help="File of the traces: .eft (the whole run), .csv, .h5, .parquet, .mat, .tdms; default: TEST.eft",
)
@click.option(
    "--save-rig",
    "corrected",
    type=FILE,
    metavar="FILE",
    help="Write the rig with the flow curve that compensation.curve_correction found.",
)
@calibration_option
@click.option(
    "--save-calibration",
    "learned",
    type=FILE,
    metavar="FILE",
    help="Write the calibration that was learned, for --calibration of the next test.",
)
@click.option("--watch", is_flag=True, help="Show force, error, spool and estimates as the test runs.")
@units_option
@as_json
def run(
    test: Path | None,
    rig: Path | None,
    changes: dict[str, Any],
    dtype: Any,
    output: Path | None,
    corrected: Path | None,
    calibration: Path | None,
    learned: Path | None,
    watch: bool,
    as_json: bool,
    **command: Any,
) -> None:
    """Run a test, from the file TEST or from options, and write its traces.

    A test file is a rig file with a section [command]; `eft init test.toml --test` writes one.
    """
    plan = plan_of(test, rig, changes, command)
    target = output or (test.with_suffix(".eft") if test else Path("run.eft"))
    check_output(target, building=plan.command.values.ndim > 1)
    if corrected is not None:
        check_save_rig(corrected, plan, (test, target))
    if calibration is not None:
        plan = start_from(plan, calibration)
    if learned is not None:
        check_save_calibration(learned, plan, (test, target, corrected))
    if watch:
        show(plan.rig, plan.command, dtype, stream=sys.stderr)
    result = _simulate(plan, dtype)
    interrupted = result.interrupted
    with _held_back():
        write_run(result, target)
        refused = save_rig(corrected, result, interrupted) if corrected is not None else None
        unlearned = save_calibration(learned, result) if learned is not None else None
    saved = str(corrected) if corrected is not None and refused is None else None
    kept = str(learned) if learned is not None and unlearned is None else None
    about = {"command": plan.about, "output": str(target), "interrupted": interrupted, "saved_rig": saved}
    about["saved_calibration"] = kept
    answer = describe(result) | about
    if as_json:
        emit_json(answer)
    else:
        click.echo(f"{plan.about}\non {result.rig['name']}: {result.message}")
        floors = result.command.shape[0] if result.command.ndim > 1 else 1
        header = ("", *(f"floor {i + 1}" for i in range(floors))) if floors > 1 else None
        judged = answer["judged_samples"]
        if judged < len(result):
            click.echo(f"\nuntil it ended, after {judged / result.sample_rate:.4g} s:")
        click.echo(f"\n{table(_rows(answer['metrics']), header)}\n")
        click.echo("\n".join(filter(None, (result.verdict.summary, graded(result.verdict)))))
        for key, value in answer["remedies"].items():
            click.echo(f"may help: {key} = {json.dumps(value)}")
        for idle in answer["idle_keys"]:
            click.echo(f"without effect: {idle}")
        click.echo(f"{target} written" + (", up to the interruption" if interrupted else ""))
        if saved is not None:
            click.echo(f"{saved} written: the rig with the flow curve that was found, for the next test")
        if kept is not None:
            click.echo(f"{kept} written: what was learned, for --calibration of the next test")
    if refused is not None:
        click.echo(f"{corrected} not written: {refused}", err=True)
    if unlearned is not None:
        click.echo(f"{learned} not written: {unlearned}", err=True)
    if interrupted:
        raise KeyboardInterrupt
    if refused is not None or unlearned is not None or not result.verdict.ok:
        raise click.exceptions.Exit(1)


@contextmanager
def _held_back() -> Iterator[None]:
    """Delays Ctrl-C until a finished test is written; the command then ends."""
    stopped = False

    def remember(_signal: int, _frame: object) -> None:
        nonlocal stopped
        stopped = True

    before = signal.signal(signal.SIGINT, remember)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if stopped:
        raise KeyboardInterrupt


def _simulate(plan: TestPlan, dtype: Any) -> eft.TestRun:
    done = 0
    try:
        with progress("test") as update:

            def watch(samples: int, total: int) -> None:
                nonlocal done
                done = samples
                update(samples, total)

            return eft.simulate(plan.rig, plan.command, dtype, progress=watch)
    except KeyboardInterrupt:
        if done < 2:
            raise
        click.echo("interrupted: writing the finished part; a second interrupt exits without it", err=True)
        if not (plan.rig["protection.enabled"] and plan.rig["protection.soft_end"]):
            # The repeated samples have the same bits, because later commands do not affect them.
            part = eft.simulate(plan.rig, plan.command[:done], dtype)
        else:
            # A soft end depends on the length of the command.
            ending = math.ceil(plan.rig["protection.ramp_time"] * plan.command.sample_rate) + 1
            part = first(eft.simulate(plan.rig, plan.command[: done + ending], dtype), done)
        return replace(part, interrupted=True)


def describe(result: eft.TestRun) -> dict[str, Any]:
    """The answer of a test, for scripts."""
    verdict = result.verdict
    return {
        "version": result.version,
        "rig": result.rig["name"],
        "samples": len(result),
        "sample_rate": result.sample_rate,
        "success": result.success,
        "message": result.message,
        "usable": verdict.ok,
        "grade": verdict.grade,
        "verdict": verdict.text,
        "reasons": list(verdict.reasons),
        "remedies": remedies_of(verdict),
        "idle_keys": result.rig.idle_keys(),
        "flags": [str(flag.name).lower() for flag in result.flags],
        "judged_samples": len(result.to_its_end()),
        "metrics": metrics_of(result),
    }


def graded(verdict: Verdict) -> str:
    """The grade with a line for each reason."""
    reasons = "".join(f"\n- {reason}" for reason in verdict.reasons)
    return f"{verdict.grade.capitalize()}{':' if reasons else '.'}{reasons}"


def remedies_of(verdict: Verdict) -> dict[str, Any]:
    """The remedies as keys with values."""
    return {remedy.key: remedy.value for remedy in verdict.remedies}


def metrics_of(result: eft.TestRun) -> dict[str, Any]:
    """The metrics up to the end of the test; for a zero command those that need no command."""
    result = result.to_its_end()
    if not result.command.any():
        return {"max_spool": float(abs(result.spool).max())}
    return {str(name): value for name, value in result.metrics().items()}


def _rows(metrics: dict[str, Any]) -> list[tuple[str, ...]]:
    """The metrics in words, a column for each actuator."""
    shown = {
        "nrmse": ("force error, rms over rms", "{:.2%}"),
        "nrmse_delay_removed": ("  without the delay", "{:.2%}"),
        "peak_error": ("largest force error over largest command", "{:.2%}"),
        "delay": ("delay of the force, ms", "{:.2f}"),
        "max_spool": ("largest spool opening", "{:.1%}"),
    }
    if "delay" in metrics:
        metrics = metrics | {"delay": told_delay(Metrics(metrics)) * 1e3}

    def cell(form: str, value: float) -> str:
        return "–" if math.isnan(value) else form.format(value)

    return [
        (words, *(cell(form, value) for value in np.atleast_1d(metrics[key])))
        for key, (words, form) in shown.items()
        if key in metrics
    ]
