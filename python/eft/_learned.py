"""The rig as self-calibration will have tuned it."""

from __future__ import annotations

import math

import numpy as np

from eft import _native
from eft._force_loop import design_force_loop
from eft._native import Rig

_MOTION = np.geomspace(0.2, 12.0, 100)
"""Frequencies of the motion, Hz."""
_LONGEST = 1.0
"""Longest response delay that a rig may have, s."""


def learned(rig: Rig, rate: float) -> Rig:
    """The rig after self-calibration, with the gains that were designed for the configured rig.

    Its lead network has the phase and the amplitude that make valve, controller and velocity exact at the
    frequency of the motion.
    """
    changes: dict[str, object] = {"compensation.adaptive": False}
    if rig["controller.force_loop"] == "robust":
        changes |= design_force_loop(rig, rate).coefficients
        changes |= {"controller.force_loop": "pd", "controller.realization": "digital"}
    plant = rig.plant.replace(changes)
    if not rig["compensation.curve_correction"]:
        plant = plant.replace({"servovalve.true_flow_table": plant["servovalve.flow_table"]})
    omega, seen = _motion(plant, rate)
    valve = _native.inverse_dynamics(plant, [0.0, omega / math.tau])[0]
    passed = valve[1] / valve[0] * seen
    # The velocity's delay that is found ends twice the configured response delay above the known one.
    configured = rig["compensation.response_delay"]
    known = rig["compensation.velocity_delay"] + _native.estimate_delay(rig, rate)
    unfound = max(-np.angle(seen) / omega - known - 2.0 * configured, 0.0)
    if rig["controller.force_loop"] == "pd" and rig["controller.realization"] == "analog":
        # The valve command is measured behind the converter, whose delay must be told.
        unfound += (plant["dac.delay"] - rig["dac.delay"]) / rate
    budget = _native.delay_budget(rig, rate)
    late = budget["hold"] + budget["computation"] - unfound
    delay, amplitude = _network(omega * late - float(np.angle(passed)), rig["compensation.lead_alpha"])
    return plant.replace(
        {
            "compensation.response_delay": min(delay / omega, _LONGEST),
            "compensation.velocity_delay": 0.0,
            "compensation.level": plant["compensation.level"] / (_flow_gain(plant) * amplitude * abs(passed)),
        }
    )


def _flow_gain(plant: Rig) -> float:
    """Flow of the valve at the start of a test over that of which the controller knows."""
    gain, times = plant["servovalve.flow_gain_scale"], plant["supply.schedule.times"]
    if times is None:
        return float(gain)
    known = plant["supply.pressure"]
    pressure = np.interp(0.0, times, plant["supply.schedule.pressures"])
    if plant["compensation.supply_correction"]:
        known = plant["sensors.supply_pressure.gain"] * pressure + plant["sensors.supply_pressure.bias"]
    return float(gain * np.sqrt(pressure / known))


def _motion(rig: Rig, rate: float) -> tuple[float, complex]:
    """Root-mean-square frequency (1/s) of a motion, and there the velocity in use over the true one."""
    model = _native.linearize(rig, sampled=True, sample_rate=rate)
    velocity = next(name for name in model.outputs if name.startswith("velocity"))
    command = model.inputs[0]
    squares = np.abs(model.response(_MOTION, velocity, command)) ** 2
    frequency = float(np.sqrt(np.average(_MOTION**2, weights=squares)))
    used, true = (
        model.response([frequency], name, command)[0] for name in (f"measured_{velocity}", velocity)
    )
    return math.tau * frequency, complex(used / true)


def _network(phase: float, alpha: float) -> tuple[float, float]:
    """Delay (rad) of the lead network with a phase (rad), as far as it reaches, and its amplitude there."""
    if phase <= 0.0:
        return 0.0, 1.0
    lag = alpha / (1.0 - alpha)
    # tan(phase) = x/(1 + lag·(1 + lag)·x²); beyond the largest phase x is that of the largest.
    slope, curve = math.tan(min(phase, 1.5)), lag * (1.0 + lag)
    root = math.sqrt(max(1.0 - 4.0 * slope**2 * curve, 0.0))
    x = min(2.0 * slope / (1.0 + root), 1.0 / math.sqrt(curve)) if curve > 0.0 else slope
    return x, math.hypot(1.0, x * (1.0 + lag)) / math.hypot(1.0, x * lag)
