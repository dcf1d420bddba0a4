"""Tests without a fault on rigs as laboratories have them, with the whole protection.

``python docs/evidence/safety_laboratory.py [COUNT] [SEED]`` runs a sweep, El Centro, a sine and El Centro on
a yielding specimen, one for each rig in turn. All four levels are set, and the plausibility watch is on. The
noise of each rig is stated. Half of the rigs have the designed loop. The others have the paper's with lower
gains, because with the paper's gains the oil column of most of these rigs is unstable. It writes
``data/safety_laboratory.csv``, from which `safety_sound_tables` makes a sentence of the page. The same seed
makes the same tests on every machine.
"""

import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import random_rigs
import safety
from safety import RATE

import eft
from eft.benchmark import Case, drawn_cases
from eft.benchmark._excitations import within_the_rig

LABORATORY = Path(__file__).parent / "data" / "safety_laboratory.csv"
SEED, COUNT = 2613, 1000
DURATION = 10.0
"""Duration (s) of a test."""
LOOPS: dict[str, dict[str, object]] = {
    "designed": {"controller.force_loop": "robust", "controller.realization": "digital"},
    "detuned": {
        "controller.realization": "digital",
        "controller.proportional_gain": 0.45,
        "controller.derivative_gain": 6e-4,
    },
}
TESTS = ("sweep", "quake", "sine", "yielding")
MARGIN = 1.5
"""Levels over the largest expected values."""
LARGEST_LEVELS = {"force": 78e3, "displacement": 0.126, "velocity": 1.5}
SMALLEST_LEVELS = {"force": 10e3, "displacement": 0.02, "velocity": 0.1}
OIL_COLUMN = 30.0
"""Frequency (Hz) below that of every oil column, and above that of every specimen."""


def specimen(case: Case, test: str) -> eft.Rig:
    """The rig; a yielding specimen has the drawn mass, stiffness and damping."""
    rig = case.rig
    if test == "yielding":
        rig = rig.replace({**safety.YIELDS, "structure.bouc_wen.yield_displacement": 0.01})
    return rig


def command(known: eft.Rig, test: str, amplitude: float) -> eft.Command:
    """The force, as far as the rig reaches."""
    if test in ("quake", "yielding"):
        forces = safety.quake(known["structure.mass"])[: int(DURATION * RATE)]
    elif test == "sine":
        own = float(np.sqrt(known["structure.stiffness"] / known["structure.mass"])) / (2 * np.pi)
        forces = eft.sine_sweep(amplitude, 0.95 * own, 0.95 * own, DURATION, RATE)
    else:
        forces = eft.sine_sweep(amplitude, 0.0, 10.0, DURATION, RATE)
    return within_the_rig(known, forces)


def levels(known: eft.Rig, forces: eft.Command) -> dict[str, object]:
    """Levels a margin above the ideal response."""
    ideal = eft.ideal_response(known, forces)
    expected = {
        "force": safety.largest(np.asarray(forces.values)),
        "displacement": safety.largest(ideal.displacement),
        "velocity": safety.largest(ideal.velocity),
    }
    return {
        f"protection.{name}_trip": float(np.clip(MARGIN * value, SMALLEST_LEVELS[name], LARGEST_LEVELS[name]))
        for name, value in expected.items()
    }


def protected(number: int, case: Case) -> tuple[eft.Rig, eft.Command, str, str]:
    """A rig and its test."""
    test = TESTS[number % len(TESTS)]
    loop = list(LOOPS)[number // len(TESTS) % 2]
    scheme = ({}, random_rigs.ADAPTIVE)[number // (2 * len(TESTS)) % 2]
    rig = specimen(case, test)
    known = rig.replace({"truth": None})
    forces = command(known, test, (2200.0, 8900.0)[number // (4 * len(TESTS)) % 2])
    noise: dict[str, object] = {
        f"protection.{name}_noise": 5e-4 * size * case.drawn["noise"]
        for name, size in random_rigs.RANGES.items()
    }
    changes = LOOPS[loop] | scheme | levels(known, forces) | noise
    changes |= {"protection.enabled": True, "protection.spool_trip": 0.95, "limits.valve_command": 10.0}
    return rig.replace(changes), forces, test, loop


def unstable(rig: eft.Rig) -> bool:
    """Whether the linear model of the true loop has an unstable oil column."""
    modes = eft.linearize(rig, sampled=True).modes()
    return bool(((modes.pole.real > 0.0) & (modes.frequency > OIL_COLUMN)).any())


def sound(count: int, seed: int) -> Iterator[dict[str, object]]:
    """One row per test without a fault: its cause, and whether loop and range explain it."""
    cases = drawn_cases(count, seed)

    def judged(number: int) -> dict[str, object]:
        rig, forces, test, loop = protected(number, cases[number])
        run = eft.simulate(rig, forces)
        ended = any(safety.largest(getattr(run, name)) > limit for name, limit in random_rigs.RANGES.items())
        drawn = cases[number].drawn
        return {
            "rig": number,
            "test": test,
            "loop": loop,
            "latency_difference": drawn["velocity_delay"] - drawn["displacement_delay"],
            "cause": run.cause.name.lower(),
            "unstable": int(unstable(rig)),
            "out_of_range": int(ended),
        }

    with ThreadPoolExecutor(1) as pool:
        yield from pool.map(judged, range(count))


if __name__ == "__main__":
    chosen = [int(text) for text in sys.argv[1:]] + [COUNT, SEED][len(sys.argv) - 1 :]
    safety.write(LABORATORY, sound(*chosen))
