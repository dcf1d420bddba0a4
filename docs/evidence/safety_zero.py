"""A load cell that reads about zero with its own noise, as one without its bridge's supply does.

``python docs/evidence/safety_zero.py`` lets it fail at many moments of a sine, with and without a measured
load pressure. It writes ``data/safety_zero.csv``, from which `safety_tables` makes a table of the page. The
failed reading has an offset that it did not have before, so plant and controller are stepped one by one.
"""

import os
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from pathlib import Path

import numpy as np
import safety
from safety import FORCE_TRIP, RATE

import eft

ZERO = Path(__file__).parent / "data" / "safety_zero.csv"
FREQUENCIES = (0.8, 1.4, 2.2)
"""Frequencies (Hz) of the sine."""
MOMENTS = 120
NOISE = {"force": 78.0, "displacement": 6e-5, "velocity": 5e-4, "spool": 5e-4}
PRESSURE_NOISE = 1e4
"""Standard deviation (Pa)."""
OFFSET = 780.0
"""Largest offset (N) of the reading, 0.5 % of the range."""
AMPLITUDE, RISE, LASTS = 6000.0, 0.5, 0.4
"""Of the command (N, s), and the time (s) after the fault."""
RIG = eft.Rig.zhao2005().replace(
    safety.LEVELS
    | {"controller.force_loop": "robust", "compensation.adaptive": True, "compensation.feedforward": True}
    | {"controller.realization": "digital"}
    | {f"protection.{signal}_noise": deviation for signal, deviation in NOISE.items()}
)
MEASURED = {"protection.load_pressure_tolerance": 500.0}


def tested(case: tuple[float, bool, int]) -> dict[str, object]:
    """One fault: when it is noticed, and the largest force over its level."""
    frequency, measured, moment = case
    rig = RIG.replace(MEASURED) if measured else RIG
    plant, controller = eft.Plant(rig), eft.Controller(rig)
    begins = int(RATE * (2.0 + moment / MOMENTS) / frequency)
    random = np.random.default_rng([moment, int(10 * frequency)])
    noise = random.standard_normal((begins + int(LASTS * RATE), 5))
    offset = random.uniform(-OFFSET, OFFSET)
    time = np.arange(len(noise)) / RATE
    command = AMPLITUDE * np.minimum(time / RISE, 1.0) * np.sin(2 * np.pi * frequency * time)
    before, largest, noticed = 0.0, 0.0, np.inf
    for tick, (wanted, (v, f, s, x, p)) in enumerate(zip(command, noise, strict=True)):
        now, failed = plant.state, tick >= begins
        pressure = now.load_pressure + PRESSURE_NOISE * p if measured else None
        voltage = controller.step(
            wanted,
            now.velocity + NOISE["velocity"] * v,
            (offset if failed else now.force) + NOISE["force"] * f,
            now.spool + NOISE["spool"] * s,
            displacement=now.displacement + NOISE["displacement"] * x,
            load_pressure=pressure,
        )
        if controller.status & eft.Status.TRIPPED:
            noticed = min(noticed, (tick - begins) / RATE)
        plant.step(voltage)
        if failed:
            largest = max(largest, abs(now.force))
        else:
            before = now.force
    return {
        "frequency": frequency,
        "pressure": int(measured),
        "moment": moment,
        "offset": offset,
        "before": before,
        "time": noticed,
        "force": largest / FORCE_TRIP,
    }


if __name__ == "__main__":
    cases = product(FREQUENCIES, (False, True), range(MOMENTS))
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        safety.write(ZERO, pool.map(tested, cases, chunksize=10))
