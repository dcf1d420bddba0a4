"""The attributes and metrics of a run, made from the tables of traces and metrics in Rust.

`_table.pyi` declares the same for type checkers; ``tests/python/test_table.py`` writes and checks it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from eft import _native


class Trace(NamedTuple):
    """Description of a trace."""

    unit: str
    doc: str
    otherwise: str
    """Its value in a test that does not record it: "recorded" (always), "constant", "nominal" (of the
    learner), "absent", or another trace's name."""


class Metric(NamedTuple):
    """Description of a metric."""

    unit: str
    doc: str
    costly: bool
    """Whether it needs Fourier transforms or the ideal response, and so longer than the test."""


TRACES: dict[str, Trace] = {name: Trace(*about) for name, *about in _native.trace_table()}
METRICS: dict[str, Metric] = {name: Metric(*about) for name, *about in _native.metric_table()}
OPTIONAL = tuple(name for name, trace in TRACES.items() if trace.otherwise == "absent")
"""Traces that only some rigs have."""


class UnrecordedTraceError(AttributeError, ValueError):
    """A trace that the version of eft which wrote a file did not record.

    It is an `AttributeError`, so ``hasattr`` is false for the trace. It is a `ValueError` like every other
    error of an input, which a command reports in one sentence.
    """


class Channels:
    """The traces of a run as attributes, with a leading axis for several actuators."""

    version: str
    _values: Mapping[str, Any]
    _unrecorded: frozenset[str]


def _channel(run: Channels, name: str) -> Any:
    if name in run._unrecorded:
        raise UnrecordedTraceError(
            f"{name} is not in this file: eft {run.version}, which ran the test, did not record it. "
            "Run the test again to get it"
        )
    return run._values.get(name)


class Metrics(Mapping[str, Any]):
    """The metrics of a run by name, as items and as attributes; they never change.

    The values are numbers; for several actuators they are arrays with one number each. An undefined metric is
    NaN, such as the delay of a force that stays zero. Without ``fft`` the metrics that take longer than a
    test are absent as items and NaN as attributes.
    """

    __slots__ = ("_values",)

    def __init__(self, values: Mapping[str, Any]) -> None:
        """Keep the values by name."""
        object.__setattr__(self, "_values", dict(values))

    def __getitem__(self, name: str) -> Any:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"{name}: metrics cannot be changed")

    def __reduce__(self) -> tuple[Any, ...]:
        return Metrics, (self._values,)

    def __repr__(self) -> str:
        return f"Metrics({self._values!r})"


def _unit(unit: str) -> str:
    return f", {unit}." if unit else "."


for _name, _trace in TRACES.items():
    _doc = f"{_trace.doc}{_unit(_trace.unit)}"
    setattr(Channels, _name, property(lambda run, name=_name: _channel(run, name), doc=_doc))
for _name, _metric in METRICS.items():
    _doc = f"{_metric.doc[:1].upper()}{_metric.doc[1:]}{_unit(_metric.unit)}"
    setattr(Metrics, _name, property(lambda of, name=_name: of._values.get(name, float("nan")), doc=_doc))
