"""Errors of the compressibility that a sweep identifies by noise of the sensors and by friction.

``python docs/evidence/compressibility_errors.py [COUNT]`` runs sweeps to 10 and 40 Hz on each rig and writes
``data/compressibility_errors.csv`` (two minutes of one core). `bias` has the numbers of the how-to and of the
docstrings. The same seed makes the same rigs on every machine.
"""

import csv
import itertools
import sys
from pathlib import Path

import numpy as np
from random_rigs import RANGES, RATE, true

import eft
from eft._files import write_text

RESULTS = Path(__file__).parent / "data" / "compressibility_errors.csv"
SEED, COUNT = 11, 50
AMPLITUDES = (2200.0, 8900.0)
"""Force of the sweeps, N."""
FRICTIONS = (0.0, 800.0)
"""Friction that the controller does not know, N."""
SWEEPS = {"force_loop": 40.0, "friction": 10.0}
"""Highest frequency (Hz) of the sweep for each identification."""
SHARE = 1e-3
"""Noise per sample over the range of each sensor."""
DURATION = 32.0
"""Duration of a sweep, s."""
RIG = eft.Rig.zhao2005().replace({"controller.force_loop": "robust"})
Row = dict[str, float]


def tested(number: int, amplitude: float, friction: float) -> Row:
    """The error of each identification as a share of the true compressibility, and its stated deviation."""
    ratio = np.random.default_rng([SEED, number]).uniform(0.7, 1.4)
    oil = ratio * RIG["actuator.compressibility"]
    noise = {f"sensors.{sensor}.noise": SHARE * RANGES[sensor] for sensor in ("force", "velocity", "spool")}
    plant = {"actuator.compressibility": oil, "actuator.friction": friction}
    truth = true(noise | plant | {"sensors.seed": number})
    row: Row = {"rig": number, "amplitude": amplitude, "friction": friction, "compressibility": ratio}
    for name, highest in SWEEPS.items():
        run = eft.simulate(RIG.replace(truth), eft.sine_sweep(amplitude, 0.0, highest, DURATION, RATE))
        motion = run.measured_spool, run.measured_velocity, run.measured_force
        identification = eft.identification
        found = (
            identification.identify_force_loop(RIG, run.valve_command, *motion, RATE)
            if name == "force_loop"
            else identification.identify_friction(RIG, *motion, RATE)
        ).compressibility
        row |= {f"{name}_error": found / oil - 1.0, f"{name}_uncertainty": found.uncertainty / oil}
    return row


def read() -> list[Row]:
    """The kept rows."""
    with RESULTS.open(encoding="utf-8") as file:
        return [{name: float(cell) for name, cell in row.items()} for row in csv.DictReader(file)]


def bias(rows: list[Row], name: str, amplitude: float, friction: float = 0.0) -> tuple[float, float]:
    """The mean error of an identification as a share, and over its root-mean-square uncertainty."""
    chosen = [row for row in rows if (row["amplitude"], row["friction"]) == (amplitude, friction)]
    mean = float(np.mean([row[f"{name}_error"] for row in chosen]))
    stated = np.mean([row[f"{name}_uncertainty"] ** 2 for row in chosen])
    return mean, mean / float(np.sqrt(stated))


def main(count: int) -> None:
    """Run every test and store its results."""
    cases = list(itertools.product(range(1, count + 1), AMPLITUDES, FRICTIONS))
    rows = [tested(*case) for case in cases]
    lines = [",".join(rows[0]), *(",".join(f"{value:.4g}" for value in row.values()) for row in rows)]
    write_text(RESULTS, "\n".join(lines) + "\n")
    for name, amplitude, friction in itertools.product(SWEEPS, AMPLITUDES, FRICTIONS):
        mean, stated = bias(rows, name, amplitude, friction)
        print(f"{name}, {amplitude:.0f} N, friction {friction:.0f} N: {mean:+.2%}, {stated:+.1f} deviations")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else COUNT)
