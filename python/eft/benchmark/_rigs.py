"""The rigs of the benchmark: named deviations of the paper's rig, and rigs as laboratories have them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from eft._native import Rig
from eft._numbers import whole_number

RATE = 4096.0
"""Sample rate of every test of the benchmark, Hz."""

_BASE = Rig.zhao2005()
_RANGES = {"force": 156e3, "displacement": 0.127, "spool": 1.0, "velocity": 1.05}
"""Range of the sensors on each side, SI."""
_NOISE = 5e-4
"""Standard deviation of a sensor's noise per sample, as a share of its range."""

Changes = dict[str, object]


@dataclass(frozen=True)
class Case:
    """A rig that deviates from its controller's configuration: changes of the paper's rig."""

    name: str
    """Description of the deviation."""
    changes: Mapping[str, object]
    """Keys and values; the controller does not know those under ``truth``."""
    drawn: Mapping[str, float] = field(default_factory=dict)
    """The drawn numbers of a random rig."""

    @property
    def rig(self) -> Rig:
        """The rig, with the paper's controller."""
        return _BASE.replace(dict(self.changes))


def sensors(seed: int, noise: float = 1.0) -> Changes:
    """Sensors of 16 bits with noise of 0.05 % of their range times a factor, with a seed."""
    changes: Changes = {"truth.sensors.seed": seed}
    for name, size in _RANGES.items():
        changes[f"truth.sensors.{name}.noise"] = noise * _NOISE * size
        changes[f"truth.sensors.{name}.range"] = size
        changes[f"truth.sensors.{name}.bits"] = 16
    return changes


def late(sensor: str, delay: float) -> Changes:
    """A sensor with a delay (s) of whole samples."""
    return {f"truth.sensors.{sensor}.delay": round(delay * RATE)}


def flow_table(direction: float, bend: float) -> Changes:
    """A valve whose flow depends on the direction and bends with the opening, both as shares."""
    openings = np.asarray(_BASE["servovalve.flow_table.openings"])
    flows = np.asarray(_BASE["servovalve.flow_table.flows"])
    factor = 1.0 + direction * np.sign(openings) + bend * (2.0 * np.abs(openings) - 1.0)
    return {"truth.servovalve.flow_table.flows": (flows * factor).tolist()}


def _times(key: str, factor: float) -> Changes:
    return {f"truth.{key}": _BASE[key] * factor}


def _oil(stiffness: float) -> Changes:
    # The oil column's stiffness is A²/K_a.
    return _times("actuator.compressibility", 1.0 / stiffness)


def _supply(factor: float) -> Changes:
    return {
        "truth.supply.schedule.times": [0.0],
        "truth.supply.schedule.pressures": [factor * _BASE["supply.pressure"]],
    }


def _damping(ratio: float) -> Changes:
    critical = 2.0 * np.sqrt(_BASE["structure.stiffness"] * _BASE["structure.mass"])
    return {"truth.structure.damping": float(ratio * critical)}


def _bandwidth(frequency: float) -> Changes:
    return {f"truth.sensors.{name}.bandwidth": frequency for name in _RANGES}


def named_cases() -> list[Case]:
    """Return the named rigs of the benchmark.

    Returns
    -------
    list of Case
        The first has ideal sensors. All others have 16 bits and noise of 0.05 % of the range.

    Examples
    --------
    >>> import eft
    >>> [case.name for case in eft.benchmark.named_cases()][:2]
    ['ideal sensors', 'nominal']
    """
    deviations: dict[str, Changes] = {
        "nominal": {},
        "oil 0.75 times as stiff": _oil(0.75),
        "oil 1.5 times as stiff": _oil(1.5),
        "pilot 0.6 times as slow": _times("servovalve.pilot_time_constant", 0.6),
        "pilot 1.7 times as slow": _times("servovalve.pilot_time_constant", 1.7),
        "valve delay 6.5 ms": _times("servovalve.pilot_flow_gain", 5.18 / 6.5),
        "flow gain 0.93": {"truth.servovalve.flow_gain_scale": 0.93},
        "flow gain 1.07": {"truth.servovalve.flow_gain_scale": 1.07},
        "flow ±4 % by direction": flow_table(0.04, 0.0),
        "flow bent by 4 %": flow_table(0.0, 0.04),
        "velocity 1.5 ms late": late("velocity", 1.5e-3),
        "spool 1.5 ms late": late("spool", 1.5e-3),
        "load cell 1.5 ms late": late("force", 1.5e-3),
        "sensors of 300 Hz": _bandwidth(300.0),
        "mass 1.3 times": _times("structure.mass", 1.3),
        "damping 1 %": _damping(0.01),
        "supply 10 % lower": _supply(0.9),
        "overlap 0.1 %, friction 1 %": {
            "truth.servovalve.overlap": 1e-3,
            "truth.actuator.friction": 0.01 * _RANGES["force"],
        },
    }
    cases = [Case("ideal sensors", {})]
    cases += [
        Case(name, sensors(seed) | changes) for seed, (name, changes) in enumerate(deviations.items(), 1)
    ]
    return [*cases, Case("twice the noise", sensors(len(cases), 2.0))]


def drawn_cases(count: int, seed: int = 1) -> list[Case]:
    """Draw rigs as laboratories have them.

    The controller knows the specimen and has the paper's numbers for everything else.

    These numbers have a uniform distribution:

    - latency of each sensor: 0 to 1.5 ms; its gain: ±2 %
    - stiffness of the oil: 0.75 to 1.5 times; piston area: ±2 %; supply pressure: ±5 %
    - flow by direction, and by bend of the curve: ±4 %; overlap: up to 0.1 %
    - friction: up to 1 % of the capacity; mass: 4 to 18 t

    The logarithms of these numbers have a uniform distribution:

    - bandwidth of each sensor: 0.3 to 3 kHz; its noise: 0.5 to 2 times 0.05 % of the range
    - pilot time constant: 0.6 to 1.7 times
    - natural frequency: 0.8 to 4 Hz; damping ratio: 0.5 to 10 %

    Parameters
    ----------
    count : int
        Number of rigs.
    seed : int
        Seed of the draws; the sensors' noise has separate seeds.

    Returns
    -------
    list of Case
        The drawn numbers are in ``case.drawn``.

    Raises
    ------
    ValueError
        If the number is negative.

    Examples
    --------
    >>> import eft
    >>> [case] = eft.benchmark.drawn_cases(1)
    >>> 4000.0 <= case.rig["structure.mass"] <= 18000.0
    True
    """
    count, seed = whole_number("count", count), whole_number("seed", seed)
    if count < 0:
        raise ValueError(f"count = {count}: must be at least 0")
    random = np.random.default_rng(seed)
    return [_drawn(random, f"random {seed}.{number}", 1000 * seed + number) for number in range(count)]


def _drawn(random: np.random.Generator, name: str, noise_seed: int) -> Case:
    def between(low: float, high: float) -> float:
        return float(random.uniform(low, high))

    def log_between(low: float, high: float) -> float:
        return float(np.exp(random.uniform(np.log(low), np.log(high))))

    drawn = {
        "oil_stiffness": between(0.75, 1.5),
        "pilot_time_constant": log_between(0.6, 1.7),
        "direction": between(-0.04, 0.04),
        "bend": between(-0.04, 0.04),
        "overlap": between(0.0, 1e-3),
        "friction": between(0.0, 0.01),
        "mass": between(4e3, 18e3),
        "frequency": log_between(0.8, 4.0),
        "damping_ratio": log_between(0.005, 0.10),
        "piston_area": between(0.98, 1.02),
        "supply": between(0.95, 1.05),
        "noise": log_between(0.5, 2.0),
    }
    for sensor in _RANGES:
        drawn[f"{sensor}_delay"] = between(0.0, 1.5e-3)
        drawn[f"{sensor}_bandwidth"] = log_between(300.0, 3000.0)
        drawn[f"{sensor}_gain"] = between(0.98, 1.02)
    return Case(name, laboratory(drawn, noise_seed), drawn)


def laboratory(drawn: Mapping[str, float], noise_seed: int) -> Changes:
    """The changes of a random rig from its drawn numbers and the seed of its noise."""
    stiffness = drawn["mass"] * (2.0 * np.pi * drawn["frequency"]) ** 2
    softer = _BASE["structure.softening.stiffness"] / _BASE["structure.stiffness"]
    changes: Changes = {
        "structure.mass": drawn["mass"],
        "structure.stiffness": stiffness,
        "structure.softening.stiffness": softer * stiffness,
        "structure.damping": 2.0 * drawn["damping_ratio"] * float(np.sqrt(stiffness * drawn["mass"])),
        "truth.servovalve.overlap": drawn["overlap"],
        "truth.actuator.friction": drawn["friction"] * _RANGES["force"],
    }
    changes |= sensors(noise_seed, drawn["noise"]) | _oil(drawn["oil_stiffness"])
    changes |= flow_table(drawn["direction"], drawn["bend"]) | _supply(drawn["supply"])
    changes |= _times("servovalve.pilot_time_constant", drawn["pilot_time_constant"])
    changes |= _times("actuator.piston_area", drawn["piston_area"])
    for sensor in _RANGES:
        changes |= late(sensor, drawn[f"{sensor}_delay"])
        changes[f"truth.sensors.{sensor}.bandwidth"] = drawn[f"{sensor}_bandwidth"]
        changes[f"truth.sensors.{sensor}.gain"] = drawn[f"{sensor}_gain"]
    return changes
