"""The row of one test: its settings, its metrics and its status."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

from eft._finding import Grade
from eft._native import Rig, rig_keys
from eft._run import TestRun
from eft._study._plan import Test
from eft._study._values import kind_of
from eft._table import METRICS, TRACES

ESTIMATES = {
    name: (trace.unit, f"{trace.doc}, at the end")
    for name, trace in TRACES.items()
    if trace.otherwise == "nominal"
}
"""Unit and meaning of each estimate. They are columns if the rig adapts or guards, or the study varies
that."""

ADAPTS = ("compensation.adaptive", "compensation.guard", "compensation.supply_correction")
"""Keys that select the adaptive controller."""

Row = dict[str, Any]


class Column(NamedTuple):
    """A column of the table."""

    name: str
    type: str
    """"int", "flags", "float", "bool", "str" or "list"."""
    unit: str
    doc: str


class Outcome(NamedTuple):
    """A row, and the traces if requested."""

    row: Row
    run: TestRun | None


class WrongVersionError(Exception):
    """A worker has another version of eft, and its rows must not be mixed with others."""


def columns(keys: Iterable[str], rig: Rig) -> list[Column]:
    """The columns of a study over some keys."""
    keys = list(keys)
    known = {entry["key"]: entry for entry in rig_keys()}
    settings = []
    for key in keys:
        doc = known[key]["doc"] if key in known else "factor on the command"
        settings.append(Column(key, *kind_of(key, rig), doc))
    numbers = {name: (metric.unit, metric.doc) for name, metric in METRICS.items()}
    if any(key in keys or rig[key] for key in ADAPTS):
        numbers |= ESTIMATES
    return [
        Column("index", "int", "", "number of the test, from 0"),
        Column("command", "str", "", "name of the command"),
        *settings,
        *(Column(name, "float", *about) for name, about in numbers.items()),
        Column("status", "str", "", "completed, stroke_exceeded, tripped, diverged, refused or failed"),
        Column("flags", "flags", "", "bits of eft.Status raised at any time"),
        Column("samples", "int", "", "samples of the test that were done"),
        Column("error", "str", "", "why the status is not completed"),
        Column("verdict", "str", "", "go, caution or no, by the limits of the rig's verdict section"),
    ]


def failed_row(test: Test, status: str, error: BaseException) -> Row:
    """The row of a test without a result: "refused" by the rig, or "failed" with an unexpected error."""
    reason = " ".join(str(error).split()) or type(error).__name__
    return row_of(
        test, {}, status, 0, 0, reason if status == "refused" else f"{type(error).__name__}: {reason}"
    )


def row_of(
    test: Test,
    told: dict[str, float],
    status: str,
    flags: int,
    samples: int,
    reason: str | None,
    grade: Grade = "no",
) -> Row:
    """A row of the table; `told` has the metrics and estimates."""
    numbers = {name: _known(told.get(name)) for name in (*METRICS, *ESTIMATES)}
    return {
        "index": test.index, "command": test.command, **test.changes, **numbers,
        "status": status, "flags": flags, "samples": samples, "error": reason,
        "verdict": grade,
    }  # fmt: skip


def _known(value: float | None) -> float | None:
    """An undefined number is an empty cell, and so is a deviation if nothing was learned."""
    return None if value is None or not math.isfinite(value) else value
