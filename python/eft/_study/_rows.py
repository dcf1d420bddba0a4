"""What one test leaves in the table: its settings, its metrics, and how it went."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from eft._native import BatchResult, Command, Rig, __version__, rig_keys, simulate_batch
from eft._run import TestRun, simulate
from eft._status import Status
from eft._study._plan import Batch, Test, scaled
from eft._study._values import SCALE, Changes, type_of

METRICS: dict[str, tuple[str, str]] = {
    "nrmse": ("", "rms force error over rms command"),
    "nrmse_delay_removed": ("", "the same without the delay"),
    "nrmse_bias_free": ("", "the same without the offset"),
    "peak_error": ("", "largest force error over the largest command"),
    "delay": ("s", "delay of the force, positive when it lags"),
    "fei_amplitude": ("", "frequency-domain evaluation index: amplitude"),
    "fei_delay": ("s", "frequency-domain evaluation index: delay"),
    "fei_frequency": ("Hz", "frequency-domain evaluation index: frequency"),
    "tracking_indicator": ("N²", "tracking indicator, negative when the force lags"),
    "max_spool": ("", "largest spool opening"),
}
"""Unit and meaning of each metric, in the order of the columns."""

Row = dict[str, Any]


class Column(NamedTuple):
    """A column of the table."""

    name: str
    type: str
    """"int", "flags", "float", "bool", "str" or "list"."""
    unit: str
    doc: str


class Outcome(NamedTuple):
    """A row, and the traces where they were asked for."""

    row: Row
    run: TestRun | None


class WrongVersionError(Exception):
    """A worker runs another version of eft, whose rows must not mix with ours."""


def columns(keys: Iterable[str], rig: Rig) -> list[Column]:
    """The columns of a study over some keys."""
    known = {entry["key"]: entry for entry in rig_keys()}
    settings = []
    for key in keys:
        entry = known.get(key)
        unit, doc = (entry["unit"], entry["doc"]) if entry else ("", "factor on the command")
        settings.append(Column(key, type_of(key, rig), unit, doc))
    return [
        Column("index", "int", "", "number of the test, from 0"),
        Column("command", "str", "", "name of the command"),
        *settings,
        *(Column(name, "float", *about) for name, about in METRICS.items()),
        Column("status", "str", "", "completed, stroke_exceeded, tripped, diverged, refused or failed"),
        Column("flags", "flags", "", "bits of eft.Status raised at any time"),
        Column("samples", "int", "", "samples of the test that were done"),
        Column("error", "str", "", "why the status is not completed"),
    ]


def run_batch(batch: Batch, threads: int | None = None) -> list[Outcome]:
    """Run some tests, here or on a worker; each failure stays with its own test."""
    if batch.version != __version__:
        raise WrongVersionError(f"eft {__version__} on the worker: must be {batch.version}, as here")
    outcomes: dict[int, Outcome] = {}
    ready: list[tuple[Test, Rig, Command]] = []
    for test in batch.tests:
        changes = {key: value for key, value in test.changes.items() if key != SCALE}
        if batch.of_buildings:
            outcomes[test.index] = _building(batch, test, changes)
            continue
        try:
            ready.append(
                (test, batch.rig.replace(changes), scaled(batch.commands[test.command], test.changes))
            )
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


def _building(batch: Batch, test: Test, changes: Changes) -> Outcome:
    """One test with an actuator on every floor; each metric is that of the floor where it is largest."""
    try:
        command = scaled(batch.commands[test.command], test.changes)
        run = simulate(batch.rig.replace(changes), command, batch.dtype)
        floors = run.metrics()
    except ValueError as error:
        return Outcome(failed_row(test, "refused", error), None)
    metrics = {name: _worst(values) for name, values in floors.items()}
    status, reason = status_of(run.flags)
    row = _row(test, metrics, status, int(run.flags), len(run), reason)
    return Outcome(row, run if batch.traces else None)


def _worst(values: Any) -> float:
    numbers = np.atleast_1d(values)
    numbers = numbers[~np.isnan(numbers)]
    return float(numbers[np.argmax(np.abs(numbers))]) if numbers.size else math.nan


def _outcome(batch: Batch, test: Test, rig: Rig, command: Command, result: BatchResult | str) -> Outcome:
    if isinstance(result, str):
        return Outcome(failed_row(test, "refused", ValueError(result)), None)
    status, reason = status_of(Status(result.status))
    row = _row(test, result.metrics, status, result.status, result.samples, reason)
    if result.traces is None:
        return Outcome(row, None)
    return Outcome(
        row,
        TestRun(
            rig=rig,
            sample_rate=command.sample_rate,
            dtype=batch.dtype,
            version=__version__,
            **result.traces,
        ),
    )


def failed_row(test: Test, status: str, error: BaseException) -> Row:
    """The row of a test without a result: "refused" for what is not allowed, "failed" for an accident."""
    reason = " ".join(str(error).split()) or type(error).__name__
    return _row(
        test, {}, status, 0, 0, reason if status == "refused" else f"{type(error).__name__}: {reason}"
    )


def _row(
    test: Test, metrics: dict[str, float], status: str, flags: int, samples: int, reason: str | None
) -> Row:
    numbers = {name: _known(metrics.get(name)) for name in METRICS}
    return {
        "index": test.index, "command": test.command, **test.changes, **numbers,
        "status": status, "flags": flags, "samples": samples, "error": reason,
    }  # fmt: skip


def _known(value: float | None) -> float | None:
    """No answer is an empty cell, not a NaN."""
    return None if value is None or math.isnan(value) else value


_UNUSABLE: tuple[tuple[Status, str, str], ...] = (
    (Status.DIVERGED, "diverged", "the simulated state diverged"),
    (Status.STROKE_EXCEEDED, "stroke_exceeded", "the piston left its stroke"),
    (Status.TRIPPED | Status.SHUT_DOWN, "tripped", "the protection ended the test"),
)


def status_of(flags: Status) -> tuple[str, str | None]:
    """In a word whether there is a whole test, and why not."""
    for flag, word, reason in _UNUSABLE:
        if flags & flag:
            return word, reason
    return "completed", None
