"""Effective force testing: the controller, the virtual rig and the analysis between them.

All quantities are in SI units. Positive force pulls the structure (+x).
"""

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
    inverse_dynamics,
    linearize,
    read_record,
    rig_keys,
    sine_sweep,
    stability_margin,
    stability_margins,
)
from eft._run import FftRatio, IdealResponse, TestRun, ideal_response, simulate
from eft._status import Status

__all__ = [
    "Command",
    "Compensator",
    "Controller",
    "FftRatio",
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
    "ideal_response",
    "inverse_dynamics",
    "linearize",
    "read_record",
    "rig_keys",
    "simulate",
    "sine_sweep",
    "stability_margin",
    "stability_margins",
]
