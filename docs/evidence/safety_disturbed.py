"""Sensors that are dead, have an offset, drift or have more noise, with the protection.

``python docs/evidence/safety_disturbed.py [MOMENTS] [COUNT] [SEED]`` lets each sensor of the paper's rig fail
at random moments of the tests of `safety`, by each kind and size, and with a measured load pressure the load
cell and this pressure. Sensors of random rigs, drawn as in `safety_random_rigs`, fail once by each kind, with
a random size. It writes ``data/safety_disturbed.csv`` and ``data/safety_disturbed_rigs.csv``, from which
`safety_tables` makes tables of the page. The same seed makes the same tests on every machine.
"""

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import cache, partial
from itertools import product

import numpy as np
import random_rigs
import safety
from safety import DATA, FORCE_TRIP, RATE, SIGNALS, largest
from safety_random_rigs import SENSOR, draw, protected

import eft

DISTURBED, RIGS = DATA / "safety_disturbed.csv", DATA / "safety_disturbed_rigs.csv"
SEED, MOMENTS, COUNT = 9, 60, 260
SHARES = {
    "dead": (0.0,),
    "offset": (0.02, 0.05, 0.1, 0.2, 0.5),
    "drift": (0.01, 0.05, 0.2, 1.0),
    "noise": (5e-3, 0.05),
}
"""Kinds and their sizes as shares of the range, a drift per second. The sensors' own noise is 0.05 %."""
CASES = tuple((kind, share) for kind, shares in SHARES.items() for share in shares)
FAILING = (*((signal, False) for signal in SIGNALS), ("force", True), ("load_pressure", True))
"""Sensors, without and with a measured load pressure."""
PRESSURE = 1.9e7
"""Range (Pa) of the load pressure."""
TOLERANCE = 0.01
"""The tolerance of a random rig's load pressure over the capacity, because its gain is 2 % off."""
BEFORE = 0.25
"""Time (s) before the fault over which the size of the command is averaged."""
LASTS, AFTER = 6.0, 2.0
"""Times (s) of a test after the fault, and after a trip, in which the hardware must have acted."""
WITHIN = (2.0, 8.0)
"""Times (s) between which a fault of a random rig begins."""


@cache
def tests() -> list[tuple[eft.Command, float, float, float]]:
    """Commands, the times within which faults begin (s), and the largest ideal displacement (m)."""
    sine = eft.sine_sweep(6000.0, 1.5, 1.5, 12.0, RATE)
    (_, first, last), *others = safety.tests()
    commands = [(sine, first, last), *((eft.Command(values, RATE), *times) for values, *times in others)]
    rig = eft.Rig.zhao2005()
    return [(one, *times, largest(eft.ideal_response(rig, one).displacement)) for one, *times in commands]


def fault(signal: str, kind: str, size: float, start: float) -> dict[str, object]:
    """Changes that make a sensor fail."""
    return safety.fault(signal, kind, start) | ({f"sensors.fault.{kind}": size} if size else {})


def judged(run: eft.TestRun, begin: int, signal: str, level: float, moved: float) -> dict[str, object]:
    """When a fault is noticed, the cause, and the largest force and displacement until `AFTER` the trip.

    The force is over its level, and the displacement over the largest ideal one. A load pressure that fails
    raises a flag, and the test continues.
    """
    rate = run.sample_rate
    tripped = (run.status & eft.Status.TRIPPED) != 0
    flags = eft.Status.TRIPPED | (eft.Status.STUCK_MEASUREMENT if signal == "load_pressure" else 0)
    noticed = (run.status & flags) != 0
    end = int(tripped.argmax() + AFTER * rate) if tripped.any() else len(tripped)
    cause = run.cause.name.lower()
    return {
        "time": (noticed.argmax() - begin) / rate if noticed.any() else np.inf,
        "cause": cause,
        "named": int(cause.startswith(signal)),
        "force": largest(run.force[begin:end]) / level,
        "displacement": largest(run.displacement[begin:end]) / moved,
    }


def tested(case: tuple[tuple[str, bool], tuple[str, float], int]) -> dict[str, object]:
    """One fault of the paper's rig: when it is noticed, and the largest force and displacement."""
    (signal, measured), (kind, share), moment = case
    random = np.random.default_rng([SEED, moment])
    command, first, last, moved = tests()[moment % 3]
    start, sign = random.uniform(first, last), random.choice((-1.0, 1.0))
    realization = ("digital", "analog")[moment // 3 % 2]
    scheme = ("fixed", "adaptive")[moment // 6 % 2]
    size = share * (random_rigs.RANGES | {"load_pressure": PRESSURE})[signal]
    rig = eft.Rig.zhao2005().replace(
        safety.LEVELS
        | safety.STOPS
        | random_rigs.noise(moment)
        | random_rigs.SCHEMES[scheme]
        | {"controller.realization": realization}
        | (safety.PRESSURE if measured else {})
        | fault(signal, kind, size if kind == "noise" else sign * size, start)
    )
    begin = int(np.ceil(start * RATE))
    run = eft.simulate(rig, command[: begin + int(LASTS * RATE)])
    return {
        "signal": signal,
        "pressure": int(measured),
        "kind": kind,
        "share": share,
        "moment": moment,
        "scheme": scheme,
        "realization": realization,
        "size": size if kind == "noise" else sign * size,
        "start": start,
        **judged(run, begin, signal, FORCE_TRIP, moved),
    }


def measuring(capacity: float) -> dict[str, object]:
    """Changes of a random rig that measure its load pressure, from its capacity (N)."""
    return safety.PRESSURE | {"protection.load_pressure_tolerance": TOLERANCE * capacity}


def faults_of(number: int, seed: int = SEED) -> list[dict[str, object]]:
    """A row for each sensor of a random rig and each kind of fault."""
    drawn, random = draw(number, seed)
    found = protected(drawn, SENSOR, number)
    if not found.runs:
        return []
    rate, capacity, rows = float(drawn["sample_rate"]), float(drawn["capacity"]), []
    moved = largest(eft.ideal_response(found.rig, found.command).displacement)
    for (signal, measured), (kind, shares) in product(FAILING[:-1], SHARES.items()):
        start, share = random.uniform(*WITHIN), float(random.choice(shares))
        size = share * float(found.rig.plant[f"sensors.{signal}.range"])
        size *= 1.0 if kind == "noise" else random.choice((-1.0, 1.0))
        begin = int(np.ceil(start * rate))
        changes = fault(signal, kind, size, start) | safety.STOPS | {"sensors.seed": number + 7}
        rig = found.rig.replace(changes)
        if measured:
            rig = rig.replace(measuring(capacity))
        run = eft.simulate(rig, found.command)
        rows.append(
            {
                "rig": number,
                "signal": signal,
                "pressure": int(measured),
                "kind": kind,
                "share": share,
                "size": size,
                "start": start,
                "command": float(np.abs(run.command[begin - int(BEFORE * rate) : begin]).mean()) / capacity,
                **judged(run, begin, signal, found.level["force"], moved),
            }
        )
    return rows


def main(moments: int, count: int, seed: int) -> None:
    """Run everything."""
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        cases = product(FAILING, CASES, range(moments))
        safety.write(DISTURBED, pool.map(tested, cases, chunksize=20))
        found = pool.map(partial(faults_of, seed=seed), range(count))
        safety.write(RIGS, (row for rows in found for row in rows))


if __name__ == "__main__":
    main(*[*map(int, sys.argv[1:]), *(MOMENTS, COUNT, SEED)[len(sys.argv) - 1 :]])
