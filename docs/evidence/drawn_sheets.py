"""Rigs from drawn data sheets."""

from collections.abc import Mapping
from typing import Any

import numpy as np


def log_uniform(random: np.random.Generator, low: float, high: float) -> float:
    """A number whose logarithm is uniform."""
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def specimen(drawn: Mapping[str, Any]) -> dict[str, Any]:
    """The sheet of one mass, or of a shear building of equal stories with the same lowest mode."""
    floors = int(drawn.get("floors", 1))
    if floors == 1:
        return {name: drawn[name] for name in ("mass", "frequency", "damping_ratio")}
    mass = drawn["mass"] / floors
    modes = 2.0 * np.sin(np.pi * np.arange(1, 2 * floors, 2) / (4 * floors + 2))
    stiffness = mass * (2.0 * np.pi * drawn["frequency"] / modes[0]) ** 2
    # Dampers that are proportional to the columns.
    ratios = drawn["damping_ratio"] * modes / modes[0]
    return {"masses": [mass] * floors, "stiffnesses": [stiffness] * floors, "damping_ratios": ratios.tolist()}


def data_sheets(drawn: Mapping[str, Any], pressure: float, flow: float, accumulator: float) -> dict[str, Any]:
    """The sheets of a rig: supply pressure in Pa, flow in m³/s, volume of the accumulator in m³."""
    return {
        "structure": specimen(drawn),
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
