"""Runs the tests of a batch on this machine's cores, and makes a row for each."""

from __future__ import annotations

import math

import numpy as np

from eft import _native
from eft._finding import Grade
from eft._findings import Facts, of_facts, worst
from eft._native import BatchResult, Command, Rig, __version__, simulate_batch
from eft._run import TestRun
from eft._simulate import simulate
from eft._status import CAUSE_BITS, Status, status_of
from eft._study._plan import Batch, StructureMaker, Test, scaled
from eft._study._rows import ADAPTS, ESTIMATES, Outcome, WrongVersionError, failed_row, row_of
from eft._study._values import SCALE, Changes
from eft._table import METRICS


def run_batch(batch: Batch, threads: int | None = None) -> list[Outcome]:
    """Run some tests, here or on a worker; a failure affects its own test only."""
    if batch.version != __version__:
        raise WrongVersionError(f"eft {__version__} on the worker: must be {batch.version}, as here")
    if batch.structure is not None:
        # One after another, because a process has only one model of OpenSees.
        return [_outside(batch, test, batch.structure) for test in batch.tests]
    return _together(batch, threads)


def _changes(test: Test) -> Changes:
    return {key: value for key, value in test.changes.items() if key != SCALE}


def _together(batch: Batch, threads: int | None) -> list[Outcome]:
    outcomes: dict[int, Outcome] = {}
    ready: list[tuple[Test, Rig, Command]] = []
    for test in batch.tests:
        try:
            rig = batch.rig.replace(_changes(test))
            ready.append((test, rig, scaled(batch.commands[test.command], test.changes)))
        except ValueError as error:
            outcomes[test.index] = Outcome(failed_row(test, "refused", error), None)
    if ready:
        tests, rigs, commands = zip(*ready, strict=True)
        results = simulate_batch(
            rigs, commands, dtype=batch.dtype, threads=threads, traces=batch.traces, fft=batch.fft
        )
        for test, rig, command, result in zip(tests, rigs, commands, results, strict=True):
            outcomes[test.index] = _outcome(batch, test, rig, command, result)
    return [outcomes[test.index] for test in batch.tests]


def _outcome(batch: Batch, test: Test, rig: Rig, command: Command, result: BatchResult | str) -> Outcome:
    if isinstance(result, str):
        return Outcome(failed_row(test, "refused", ValueError(result)), None)
    flags = result.status & ~CAUSE_BITS
    status, reason = status_of(Status(flags))
    told = result.metrics | (result.estimates or {})
    grade = _grade(rig, command, status, flags, result.metrics)
    row = row_of(test, told, status, flags, result.samples, reason, grade)
    if result.traces is None:
        return Outcome(row, None)
    return Outcome(row, TestRun._of(rig, command, batch.dtype, result.traces))


def _grade(rig: Rig, command: Command, status: str, flags: int, metrics: dict[str, float]) -> Grade:
    """The grade of `TestRun.verdict`, from the results of a test without its traces."""
    if status != "completed":
        return "no"
    told = {name: math.nan if metrics.get(name) is None else metrics[name] for name in METRICS}
    peak = float(np.abs(command.values).max())
    # For a building the largest story drift is known, but not the motion of each actuator.
    moved = told["drift"] if command.values.ndim == 1 else math.nan
    facts = Facts(rig, command.sample_rate, Status(flags), told, peak, moved, mass=command.mass)
    return worst(one.grade for one in of_facts(facts))


def _outside(batch: Batch, test: Test, maker: StructureMaker) -> Outcome:
    """A test with an external structure; each metric is that of the actuator with the largest value."""
    try:
        command = scaled(batch.commands[test.command], test.changes)
        rig = batch.rig.replace(_changes(test))
        run = simulate(rig, command, batch.dtype, structure=maker(rig))
        metrics = _metrics(run, batch.fft)
    except ValueError as error:
        return Outcome(failed_row(test, "refused", error), None)
    except Exception as error:
        return Outcome(failed_row(test, "failed", error), None)
    status, reason = status_of(run.flags)
    told = metrics | _estimates(run)
    reason = run.stopped or reason
    row = row_of(test, told, status, int(run.flags), len(run), reason, run.verdict.grade)
    return Outcome(row, run if batch.traces else None)


def _estimates(run: TestRun) -> dict[str, float]:
    """The controllers' estimates at the end, each of the floor where it changed most."""
    if not any(run.rig[key] for key in ADAPTS):
        return {}
    told = {}
    for name in ESTIMATES:
        trace = getattr(run, name)
        # Before the first window it is the configured value or unknown.
        start = trace.flat[0] if np.isfinite(trace.flat[0]) else 0.0
        told[name] = start + _native.worst(trace[..., -1] - start)
    return told


def _metrics(run: TestRun, fft: bool) -> dict[str, float]:
    try:
        return {name: _native.worst(values) for name, values in run.metrics(fft=fft).items()}
    except ValueError:
        if run.success and not run.stopped:
            raise
        # A diverged test can have values too large for the metrics, one that ended at once no command.
        return {"max_spool": _native.worst(np.abs(run.spool).max(axis=-1))}
