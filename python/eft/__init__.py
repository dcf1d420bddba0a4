"""Effective force testing: the controller, the virtual rig and the analysis between them.

All quantities are in SI units. Positive force pulls the structure (+x).
"""

from eft._identification import (
    Estimate,
    FlowCurveEstimate,
    flow_curve_estimate,
    identify_damping,
    identify_delay,
    identify_flow_curve,
    identify_flow_gain,
)
from eft._native import (
    Command,
    Compensator,
    Controller,
    FlowTable,
    LinearModel,
    Record,
    Rig,
    __version__,
    delay_budget,
    effective_force,
    flow_test,
    free_vibration,
    inverse_dynamics,
    linearize,
    read_record,
    rig_keys,
    sine_sweep,
    stability_margin,
    stability_margins,
    valve_test,
)
from eft._run import FftRatio, IdealResponse, TestRun, ideal_response, simulate
from eft._status import Status

__all__ = [
    "Command",
    "Compensator",
    "Controller",
    "Estimate",
    "FftRatio",
    "FlowCurveEstimate",
    "FlowTable",
    "IdealResponse",
    "LinearModel",
    "Record",
    "Rig",
    "Status",
    "TestRun",
    "__version__",
    "delay_budget",
    "effective_force",
    "flow_curve_estimate",
    "flow_test",
    "free_vibration",
    "ideal_response",
    "identify_damping",
    "identify_delay",
    "identify_flow_curve",
    "identify_flow_gain",
    "inverse_dynamics",
    "linearize",
    "read_record",
    "rig_keys",
    "simulate",
    "sine_sweep",
    "stability_margin",
    "stability_margins",
    "valve_test",
]
