"""Identification from measured arrays: estimates with their uncertainty, one module for each subject."""

from eft._identification._damping import DampingEstimate, identify_damping
from eft._identification._delay import DelayEstimate, identify_delay
from eft._identification._estimate import Estimate
from eft._identification._fine_tuning import FineTuning, fine_tune
from eft._identification._flow import identify_flow_curve, identify_flow_gain
from eft._identification._force_loop import ForceLoopEstimate, identify_force_loop
from eft._identification._friction import FrictionEstimate, identify_friction
from eft._identification._load_cell import LoadCellEstimate, identify_load_cell
from eft._identification._overlap import OverlapEstimate, identify_overlap
from eft._identification._virtual_tests import FlowTest, ValveTest, flow_test, free_vibration, valve_test

__all__ = [
    "DampingEstimate",
    "DelayEstimate",
    "Estimate",
    "FineTuning",
    "FlowTest",
    "ForceLoopEstimate",
    "FrictionEstimate",
    "LoadCellEstimate",
    "OverlapEstimate",
    "ValveTest",
    "fine_tune",
    "flow_test",
    "free_vibration",
    "identify_damping",
    "identify_delay",
    "identify_flow_curve",
    "identify_flow_gain",
    "identify_force_loop",
    "identify_friction",
    "identify_load_cell",
    "identify_overlap",
    "valve_test",
]
