"""Names that have moved out of `eft`. They work for one more release, with a warning."""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable
from typing import Any

from eft._maps import delay_rate_map, level_damping_map, rate_realization_map
from eft._native import FlowTable, Record

_MOVED = {
    "Estimate": "eft.identification",
    "FineTuning": "eft.identification",
    "Identification": "eft.identification",
    "LatinHypercube": "eft.studies",
    "LinearModel": "eft.linear",
    "ProcessorInTheLoop": "eft.firmware",
    "STABILITY_MAPS": "eft.linear",
    "Sobol": "eft.studies",
    "StabilityMap": "eft.linear",
    "delay_budget": "eft.linear",
    "displacement_spectrum": "eft.records",
    "export": "eft.firmware",
    "fine_tune": "eft.identification",
    "flow_test": "eft.identification",
    "free_vibration": "eft.identification",
    "identify_damping": "eft.identification",
    "identify_flow_gain": "eft.identification",
    "inverse_dynamics": "eft.linear",
    "observer_gains": "eft.linear",
    "stability_map": "eft.linear",
    "stability_margins": "eft.linear",
    "valve_test": "eft.identification",
}


class FlowCurveEstimate:
    """A flow curve with data of each control point, as the former result of `flow_curve_estimate`."""

    def __init__(self, table: FlowTable) -> None:
        """Take the table's parts."""
        self.table, self.uncertainty, self.measured = table, table.uncertainty, table.measured


def _flow_curve_estimate(*args: Any, **kwargs: Any) -> FlowCurveEstimate:
    from eft._identification import identify_flow_curve

    return FlowCurveEstimate(identify_flow_curve(*args, **kwargs))


def _of_record(name: str) -> Callable[..., Record]:
    def prepared(record: Record, *args: Any, **kwargs: Any) -> Record:
        answer: Record = getattr(record, name)(*args, **kwargs)
        return answer

    return prepared


_REPLACED: dict[str, tuple[Any, str]] = {
    "FlowCurveEstimate": (FlowCurveEstimate, "the FlowTable of eft.identify_flow_curve"),
    "flow_curve_estimate": (_flow_curve_estimate, "eft.identify_flow_curve"),
    "level_damping_map": (level_damping_map, 'eft.linear.stability_map(rig, "level-damping")'),
    "delay_rate_map": (delay_rate_map, 'eft.linear.stability_map(rig, "delay-rate")'),
    "rate_realization_map": (rate_realization_map, 'eft.linear.stability_map(rig, "rate-realization")'),
    **{
        name: (_of_record(name), f"record.{name}(...)")
        for name in ("band_passed", "baseline_corrected", "resampled", "scaled", "tapered")
    },
}


def moved(name: str) -> Any:
    """Return a moved name, with a warning that names its new place."""
    if name in _MOVED:
        there = _MOVED[name]
        _warn(f"eft.{name} has moved: write {there}.{name}")
        return getattr(importlib.import_module(there), name)
    if name in _REPLACED:
        thing, instead = _REPLACED[name]
        _warn(f"eft.{name} is removed in the next release: write {instead}")
        return thing
    raise AttributeError(f"module 'eft' has no attribute {name!r}")


def _warn(text: str) -> None:
    warnings.warn(text, DeprecationWarning, stacklevel=4)
