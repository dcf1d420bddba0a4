"""The tests of the page that compares the fixed scheme with self-calibration."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
from random_rigs import RATE, damping_ratio, noise, true, valve_delay

import eft
from eft.demo.experiments import EL_CENTRO

GAINS = np.round(np.arange(0.90, 1.1001, 0.01), 2).tolist()
DELAYS = np.round(np.arange(3e-3, 8.001e-3, 0.5e-3), 4).tolist()
SEED = 1
STIFFNESS = 693.8e3


@dataclass(frozen=True)
class Case:
    """One test: the true values of the rig, the command, and the noise (seed 0: none)."""

    row: str
    label: str
    command: str
    seed: int = 0
    flow_gain: float = 1.0
    response_delay: float | None = None
    changes: dict[str, object] = field(default_factory=dict)

    def rig(self) -> eft.Rig:
        """The rig; its controller has the paper's values."""
        changes = true({"servovalve.flow_gain_scale": self.flow_gain}) | self.changes
        if self.response_delay is not None:
            changes |= valve_delay(self.response_delay)
        return eft.Rig.zhao2005().replace(changes | (noise(self.seed) if self.seed else {}))


def cases() -> Iterator[Case]:
    """Every test of the study."""
    sweeps = ("2.2 kN", "8.9 kN")
    for gain in GAINS:
        for delay in DELAYS:
            for command in sweeps:
                yield Case("map", "", command, SEED, gain, delay)
    transducer = {"compensation.supply_correction": True}
    for duration, label, more in ((10.0, "10 s", {}), (5.0, "5 s", {}), (5.0, "measured", transducer)):
        yield Case("faster", label, "El Centro", changes=falling_supply(duration) | more)
    for seed in (0, SEED):
        yield Case("sweep", "sound calibration", "8.9 kN", seed)
        for command in sweeps:
            for gain in GAINS[::2]:
                yield Case("gain", f"flow gain {gain:.2f}", command, seed, gain)
            for delay in DELAYS[::2]:
                yield Case("delay", f"delay {1e3 * delay:.0f} ms", command, seed, 1.0, delay)
        yield from structures(seed)
        yield from buildings(seed)
        for label, changes in supplies():
            yield Case("supply", label, "El Centro", seed, changes=changes)
        for command, level in (("2.2 kN", 1.05), ("2.2 kN", 1.1), ("8.9 kN", 1.1)):
            yield Case("level", f"level {level:.2f}", command, seed, changes={"compensation.level": level})


def structures(seed: int) -> Iterator[Case]:
    """Values that the controller does not know. With half the stiffness 8.9 kN would leave the stroke."""
    halved = true({"structure.kind": "linear", "structure.stiffness": STIFFNESS / 2})
    yield Case("structure", "half the stiffness", "2.2 kN", seed, changes=halved)
    softening = {"displacement": 0.015, "stiffness": STIFFNESS / 2}
    hysteresis = {"yield_displacement": 0.010, "post_yield_ratio": 0.5, "exponent": 2.0, "shape": 0.5}
    springs: dict[str, dict[str, object]] = {
        "the paper's spring": {},
        "yields at 15 mm, elastic": {f"structure.softening.{key}": v for key, v in softening.items()},
        "yields at 10 mm, hysteretic": {"structure.kind": "bouc_wen"}
        | {f"structure.bouc_wen.{key}": v for key, v in hysteresis.items()},
    }
    for spring, changes in springs.items():
        for ratio in (0.01, 0.05, 0.20):
            label = f"{spring}, damping {100 * ratio:.0f} %"
            yield Case("structure", label, "8.9 kN", seed, changes=true(changes) | damping_ratio(ratio))


def buildings(seed: int) -> Iterator[Case]:
    """Three equal stories, with the same errors at all actuators."""
    each = {"masses": 7040.0, "dampings": 4330.0, "stiffnesses": STIFFNESS}
    stories: dict[str, object] = {"structure.kind": "shear_building"}
    stories |= {f"structure.stories.{key}": [value] * 3 for key, value in each.items()}
    for gain, delay in ((1.0, None), (0.93, 6.5e-3), (1.07, 3.5e-3)):
        label = "" if delay is None else f", delay {1e3 * delay:g} ms"
        yield Case("building", f"flow gain {gain:.2f}{label}", "three floors", seed, gain, delay, stories)


def supplies() -> Iterator[tuple[str, dict[str, object]]]:
    """Constant pressure first, as reference for the others."""
    yield "constant", {}
    yield "with a transducer", falling_supply() | {"compensation.supply_correction": True}
    yield "without a transducer", falling_supply()


def falling_supply(duration: float = 20.0) -> dict[str, object]:
    """A decrease by 20 % in a number of seconds."""
    pressure = eft.Rig.zhao2005()["supply.pressure"]
    changes: dict[str, object] = {
        "supply.schedule.times": [0.0, 2.0, 2.0 + duration],
        "supply.schedule.pressures": [pressure, pressure, 0.8 * pressure],
    }
    return true(changes)


@cache
def command(name: str) -> eft.Command:
    """The force command."""
    if name == "El Centro":
        record = eft.read_record(Path(eft.__file__).parent / "data" / EL_CENTRO)
        return eft.effective_force(record, eft.Rig.zhao2005()["structure.mass"], RATE)
    if name == "three floors":
        return eft.Command(np.tile(eft.sine_sweep(2000.0, 0.0, 10.0, 32.0, RATE).values, (3, 1)), RATE)
    return eft.sine_sweep(1e3 * float(name.removesuffix(" kN")), 0.0, 10.0, 32.0, RATE)
