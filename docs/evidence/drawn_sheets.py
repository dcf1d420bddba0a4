"""Rigs from drawn data sheets."""

from collections.abc import Mapping
from typing import Any

import numpy as np


def log_uniform(random: np.random.Generator, low: float, high: float) -> float:
    """A number whose logarithm is uniform."""
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def data_sheets(drawn: Mapping[str, Any], pressure: float, flow: float, accumulator: float) -> dict[str, Any]:
    """The sheets of a rig: supply pressure in Pa, flow in m³/s, volume of the accumulator in m³."""
    return {
        "structure": {name: drawn[name] for name in ("mass", "frequency", "damping_ratio")},
        "actuator": {"force": drawn["capacity"], "stroke": drawn["stroke"]},
        "servovalve": {
            "rated_flow": flow,
            "rated_drop": "1000 psi",
            "phase_90_frequency": drawn["corner"],
        },
        "supply": {
            "pressure": pressure,
            "pump_flow": flow,
            "accumulator_volume": accumulator,
            "precharge": "1500 psi",
        },
    }
