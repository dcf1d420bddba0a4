"""Sensor faults with the designed force loop, on rigs of three sizes.

``python docs/evidence/safety_sizes.py [MOMENTS]`` runs each fault of each sensor at random moments of a sine
near the structure's frequency, a sweep and El Centro, all as far as the rig reaches. Every second test is
self-calibrating. It writes ``data/safety_sizes.csv``, from which `safety_tables` makes a table of the page.
"""

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import coverage
import numpy as np
import random_rigs
import safety
from safety import CASES, RATE

import eft
from eft.benchmark._excitations import within_the_rig

SIZES = Path(__file__).parent / "data" / "safety_sizes.csv"
SEED, MOMENTS = 77, 40
LOOP: dict[str, object] = {"controller.force_loop": "robust", "controller.realization": "digital"}
SCHEMES = (
    {"compensation.adaptive": False, "compensation.feedforward": False},
    random_rigs.ADAPTIVE,
)


def protected(known: eft.Rig) -> tuple[eft.Rig, float, float]:
    """The rig with levels and noise that are shares of its ranges as on the paper's rig, and two levels."""
    ranges = {
        "force": coverage.capacity(known),
        "displacement": float(known["actuator.stroke"]),
        "velocity": float(np.max(known["servovalve.flow_table.flows"]) / known["actuator.piston_area"]),
        "spool": 1.0,
    }
    force, displacement = 20 / 156 * ranges["force"], 0.905 * ranges["displacement"]
    changes: dict[str, object] = {
        "protection.enabled": True,
        "protection.force_trip": force,
        "protection.displacement_trip": displacement,
        "protection.velocity_trip": 1.15 * ranges["velocity"],
        "protection.spool_trip": 0.8,
        "limits.valve_command": 10.0,
    }
    for sensor, reach in ranges.items():
        noise = {"noise": 5e-4 * reach, "range": reach, "bits": 16}
        changes |= {f"truth.sensors.{sensor}.{key}": value for key, value in noise.items()}
    return known.replace(LOOP | changes), force, displacement


def commands(known: eft.Rig, rate: float = RATE) -> list[tuple[np.ndarray, float, float]]:
    """Commands, and the time within which faults begin (s)."""
    capacity = coverage.capacity(known)
    own = float(np.sqrt(known["structure.stiffness"] / known["structure.mass"])) / (2 * np.pi)
    sine = eft.sine_sweep(6 / 156 * capacity, 0.95 * own, 0.95 * own, 8.0, rate)
    sweep = eft.sine_sweep(8.9 / 156 * capacity, 0.0, 10.0, 32.0, rate)
    quake = safety.quake(known["structure.mass"], rate)
    times = ((2.0, 6.0), (3.0, 28.0 if own > 4.0 else 5.76 * own), (1.5, 20.0))
    values = (np.asarray(within_the_rig(known, one).values) for one in (sine, sweep, quake))
    return [(one, *time) for one, time in zip(values, times, strict=True)]


def drawn(
    seed: int,
    case: str,
    excitations: Sequence[tuple[np.ndarray, float, float]],
    moments: int,
    rate: float = RATE,
) -> tuple[list[float], list[int], list[np.ndarray]]:
    """Random starts (s) of the faults of a case, the first sample of each, and its command in turn."""
    random = np.random.default_rng([seed, *case.encode()])
    chosen = [excitations[moment % len(excitations)] for moment in range(moments)]
    starts = [random.uniform(first, last) for _, first, last in chosen]
    return starts, [int(np.ceil(start * rate)) for start in starts], [values for values, _, _ in chosen]


def noticed(run: eft.TestRun, begin: int, rate: float = RATE) -> float:
    """Time (s) from a fault's first sample to the trip; negative if it tripped before."""
    tripped = (run.status & eft.Status.TRIPPED) != 0
    return float(tripped.argmax() - begin) / rate if tripped.any() else np.inf


def summary(
    found: Sequence[eft.TestRun],
    begins: Sequence[int],
    force_level: float,
    displacement_level: float,
    rate: float = RATE,
) -> dict[str, object]:
    """Time to notice the faults, and the largest force and displacement over their levels."""
    pairs = list(zip(found, begins, strict=True))
    times = np.array([noticed(run, begin, rate) for run, begin in pairs])
    forces = np.array([safety.largest(run.force[begin:]) for run, begin in pairs]) / force_level
    moved = max(safety.largest(run.displacement[begin:]) for run, begin in pairs)
    return {
        "unnoticed": int((times > 0.6).sum()),
        "median": float(np.median(times)),
        "worst": float(times.max()),
        "force": float(forces.max()),
        "beyond": int((forces > 1.75).sum()),
        "displacement": moved / displacement_level,
    }


def sizes(
    moments: int,
    cases: Sequence[tuple[str, str]] = CASES,
    rate: float = RATE,
    further: dict[str, object] | None = None,
) -> Iterator[dict[str, object]]:
    """One row per rig and fault: detection, and the largest force and displacement over their levels."""
    for size, known in coverage.RIGS.items():
        rig, force_level, displacement_level = protected(known)
        rig = rig.replace(further or {})
        excitations = commands(known, rate)
        for signal, kind in cases:
            starts, begins, forces_of = drawn(SEED, f"{signal} {kind} {size}", excitations, moments, rate)

            def rig_of(
                moment: int,
                rig: eft.Rig = rig,
                case: tuple[str, str] = (signal, kind),
                starts: list[float] = starts,
                begins: list[int] = begins,
                values: list[np.ndarray] = forces_of,
            ) -> tuple[eft.Rig, eft.Command]:
                changes = safety.fault(*case, starts[moment]) | SCHEMES[moment // 3 % 2]
                end = begins[moment] + int(2.0 * rate)
                return rig.replace(changes | {"sensors.seed": moment}), eft.Command(
                    values[moment][:end], rate
                )

            found = safety.runs(rig_of, moments)
            yield {
                "size": size,
                "signal": signal,
                "kind": kind,
                "moments": moments,
                **summary(found, begins, force_level, displacement_level, rate),
            }


if __name__ == "__main__":
    safety.write(SIZES, sizes(int(sys.argv[1]) if len(sys.argv) > 1 else MOMENTS))
