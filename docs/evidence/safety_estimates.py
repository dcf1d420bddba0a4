"""Sensor faults on rigs without a velocity sensor, with the designed force loop.

``python docs/evidence/safety_estimates.py [MOMENTS]`` runs faults of the other sensors with each estimate of
the velocity, on the rigs and under the commands of `safety_sizes`. It also runs tests without a fault, with a
valve's null that is 2 % off, and with a displacement of 12 bits without noise as well. It writes
``data/safety_estimates.csv``, from which `safety_tables` makes a table of the page.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import coverage
import numpy as np
import safety
from safety import KINDS, RATE
from safety_sizes import LOOP, commands, drawn, noticed, protected, summary

import eft

ESTIMATES = Path(__file__).parent / "data" / "safety_estimates.csv"
SEED, MOMENTS = 79, 30
G = 9.80665
SOURCES = ("derivative", "observer", "accelerometer")
FAULTS = tuple((signal, kind) for signal in ("force", "displacement", "spool") for kind in KINDS)
OFF: dict[str, object] = {"truth.servovalve.null_bias": 0.02}
COARSE: dict[str, object] = {
    "truth.sensors.displacement.noise": 0.0,
    "truth.sensors.displacement.bits": 12,
    "protection.displacement_noise": None,
}
SOUND: dict[tuple[str, str], dict[str, object]] = {
    ("none", "sound"): {},
    ("none", "null bias"): OFF,
    ("none", "null bias, 12 bits"): OFF | COARSE,
}


def estimate(known: eft.Rig, source: str, reach: float = 2 * G) -> dict[str, object]:
    """What a rig needs to estimate its velocity, with an accelerometer that reaches so far (m/s²).

    The displacement of a derivative has a twentieth of the noise of `safety_sizes`, because the how-to
    advises against a derivative of a noisy displacement. It is stated, except for that of 12 bits. An
    accelerometer has 0.05 % of its range.
    """
    changes: dict[str, object] = {
        "controller.velocity_source": source,
        "controller.observer_mass": known["structure.mass"],
    }
    if source == "derivative":
        noise = 2.5e-5 * float(known["actuator.stroke"])
        changes |= {"truth.sensors.displacement.noise": noise, "truth.sensors.displacement.bits": 20}
        changes["protection.displacement_noise"] = noise
    if source == "accelerometer":
        sensor = {"noise": 5e-4 * reach, "range": reach, "bits": 16}
        changes |= {f"truth.sensors.acceleration.{key}": value for key, value in sensor.items()}
        changes["controller.observer_acceleration_noise"] = 5e-4 * reach
    return changes


def leading(rig: eft.Rig, rate: float) -> eft.Rig:
    """The rig, whose lead network compensates for the delay of its estimate as well."""
    delay = float(rig["compensation.response_delay"]) + eft.linear.delay_budget(rig, rate).sensor
    return rig.replace({"compensation.response_delay": delay})


def estimating(known: eft.Rig, source: str) -> tuple[eft.Rig, float, float]:
    """A protected rig that estimates its velocity, and its two levels."""
    rig, force_level, displacement_level = protected(known)
    return leading(rig.replace(LOOP | estimate(known, source)), RATE), force_level, displacement_level


def estimates(moments: int) -> Iterator[dict[str, object]]:
    """One row per rig, source and fault: detection, and the largest force and displacement over levels."""
    for size, known in coverage.RIGS.items():
        excitations = commands(known)
        for source in SOURCES:
            rig, force_level, displacement_level = estimating(known, source)
            for signal, kind in (*FAULTS, *SOUND):
                starts, begins, values = drawn(SEED, f"{signal} {kind} {size}", excitations, moments)

                def rig_of(
                    moment: int,
                    rig: eft.Rig = rig,
                    case: tuple[str, str] = (signal, kind),
                    starts: list[float] = starts,
                    begins: list[int] = begins,
                    values: list[np.ndarray] = values,
                ) -> tuple[eft.Rig, eft.Command]:
                    changes: dict[str, object] = {"sensors.seed": moment}
                    changes |= SOUND[case] if case in SOUND else safety.fault(*case, starts[moment])
                    end = begins[moment] + int(2.0 * RATE)
                    return rig.replace(changes), eft.Command(values[moment][:end], RATE)

                found = safety.runs(rig_of, moments)
                alarms = sum(
                    run.cause != eft.Cause.NONE
                    and not run.cause.name.endswith("LEVEL")
                    and (signal == "none" or noticed(run, begin) < 0.0)
                    for run, begin in zip(found, begins, strict=True)
                )
                yield {
                    "size": size,
                    "source": source,
                    "signal": signal,
                    "kind": kind,
                    "moments": moments,
                    "alarms": alarms,
                    **summary(found, begins, force_level, displacement_level),
                }


if __name__ == "__main__":
    safety.write(ESTIMATES, estimates(int(sys.argv[1]) if len(sys.argv) > 1 else MOMENTS))
