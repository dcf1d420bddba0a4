"""The benchmark problem of real-time hybrid simulation: its criteria J1 to J9, and a model of it.

Silva, Gómez, Maghareh, Dyke, Spencer: *Benchmark control problem for real-time hybrid simulation*, Mechanical
Systems and Signal Processing 135 (2020) 106381. A real-time hybrid simulation applies a displacement, an
effective force test a force. The criteria compare any two signals, so they apply to both.
"""

from eft.rths._benchmark import BUILDINGS, Building, SampleController, Simulation, TransferSystem, simulate
from eft.rths._criteria import Criteria, criteria, delay, peak_error, rms_error

__all__ = [
    "BUILDINGS",
    "Building",
    "Criteria",
    "SampleController",
    "Simulation",
    "TransferSystem",
    "criteria",
    "delay",
    "peak_error",
    "rms_error",
    "simulate",
]
