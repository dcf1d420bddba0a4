"""Identification of a rig from measurements, and virtual tests for such measurements.

`eft.identify` does all of this from files. It is a function, so this module has the longer name.
"""

from eft._frequency_response import FrequencyResponse, ValveEstimate, identify_valve, read_frequency_response
from eft._identification import (
    DampingEstimate,
    DelayEstimate,
    Estimate,
    FineTuning,
    FlowTest,
    ForceLoopEstimate,
    FrictionEstimate,
    LoadCellEstimate,
    OverlapEstimate,
    ValveTest,
    fine_tune,
    flow_test,
    free_vibration,
    identify_damping,
    identify_delay,
    identify_flow_curve,
    identify_flow_gain,
    identify_force_loop,
    identify_friction,
    identify_load_cell,
    identify_overlap,
    valve_test,
)
from eft._laboratory import Identification, identify

__all__ = [
    "DampingEstimate",
    "DelayEstimate",
    "Estimate",
    "FineTuning",
    "FlowTest",
    "ForceLoopEstimate",
    "FrequencyResponse",
    "FrictionEstimate",
    "Identification",
    "LoadCellEstimate",
    "OverlapEstimate",
    "ValveEstimate",
    "ValveTest",
    "fine_tune",
    "flow_test",
    "free_vibration",
    "identify",
    "identify_damping",
    "identify_delay",
    "identify_flow_curve",
    "identify_flow_gain",
    "identify_force_loop",
    "identify_friction",
    "identify_load_cell",
    "identify_overlap",
    "identify_valve",
    "read_frequency_response",
    "valve_test",
]
