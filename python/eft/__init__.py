"""Effective force testing: the controller, the virtual rig and the analysis between them.

All quantities are in SI units. Positive force pulls the structure (+x). This module has what every test
needs; the rest is in `eft.data_sheets`, `eft.records`, `eft.linear`, `eft.identification`, `eft.studies`,
`eft.benchmark`, `eft.firmware`, `eft.opensees`, `eft.rths`, `eft.traces`, `eft.report` and `eft.plots`.
"""

from typing import TYPE_CHECKING, Any

from eft import benchmark, data_sheets, firmware, identification, linear, opensees, records, rths, studies
from eft._display import use_units
from eft._energy import EnergyBalance
from eft._feasibility import Feasibility, check_feasibility
from eft._force_loop import ForceLoop, ForceLoopMargins, design_force_loop
from eft._identification import identify_delay, identify_flow_curve
from eft._iteration import DriveIteration, iterate
from eft._laboratory import identify
from eft._largest_scale import LargestScale, largest_scale
from eft._memory import MemoryUseWarning
from eft._native import (
    Command,
    Compensator,
    Controller,
    FlowTable,
    Plant,
    PlantState,
    Record,
    Rig,
    __version__,
    effective_force,
    linearize,
    read_record,
    sine_sweep,
    stability_margin,
)
from eft._notebook import teach_native
from eft._replay import Replay, replay
from eft._run import Coherence, FftRatio, Metrics, TestRun
from eft._sections import (
    Calibration,
    CalibrationDistances,
    CalibrationEvidence,
    CurveCorrection,
    RigKey,
    rig_keys,
)
from eft._simulate import IdealResponse, StepController, energy_balance, ideal_response, simulate
from eft._status import Cause, Status
from eft._structure import StructureError
from eft._study import Study, study
from eft._tuning import ForceLoopTuning, tune_force_loop
from eft._valve_choice import ValveChoice, ValveSheet, ValveTable, compare_valves, read_valves
from eft._verdict import Remedy, Verdict
from eft._watch import Watched, watch
from eft.data_sheets import actuator, servovalve
from eft.traces._compare import Comparison, compare

__all__ = [
    "Calibration",
    "CalibrationDistances",
    "CalibrationEvidence",
    "Cause",
    "Coherence",
    "Command",
    "Comparison",
    "Compensator",
    "Controller",
    "CurveCorrection",
    "DriveIteration",
    "EnergyBalance",
    "Feasibility",
    "FftRatio",
    "FlowTable",
    "ForceLoop",
    "ForceLoopMargins",
    "ForceLoopTuning",
    "IdealResponse",
    "LargestScale",
    "MemoryUseWarning",
    "Metrics",
    "Plant",
    "PlantState",
    "Record",
    "Remedy",
    "Replay",
    "Rig",
    "RigKey",
    "Status",
    "StepController",
    "StructureError",
    "Study",
    "TestRun",
    "ValveChoice",
    "ValveSheet",
    "ValveTable",
    "Verdict",
    "Watched",
    "__version__",
    "actuator",
    "benchmark",
    "check_feasibility",
    "compare",
    "compare_valves",
    "data_sheets",
    "design_force_loop",
    "effective_force",
    "energy_balance",
    "firmware",
    "ideal_response",
    "identification",
    "identify",
    "identify_delay",
    "identify_flow_curve",
    "iterate",
    "largest_scale",
    "linear",
    "linearize",
    "opensees",
    "read_record",
    "read_valves",
    "records",
    "replay",
    "rig_keys",
    "rths",
    "servovalve",
    "simulate",
    "sine_sweep",
    "stability_margin",
    "studies",
    "study",
    "tune_force_loop",
    "use_units",
    "watch",
]

teach_native()

if not TYPE_CHECKING:
    # For a type checker, names that moved do not exist here.
    def __getattr__(name: str) -> Any:
        if name in ("plots", "report"):  # slow to load
            from importlib import import_module

            return import_module(f"eft.{name}")
        from eft._moved import moved

        return moved(name)
