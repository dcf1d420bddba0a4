"""Sensor faults within the first second of a test, on random rigs of data sheets.

``python docs/evidence/safety_early.py [COUNT] [SEED]`` draws rigs as `safety_random_rigs` does, and runs the
same faults, but at random moments within the first 1.2 s. Each rig runs with a velocity sensor, with a null
bias of up to 0.5 % of opening and of up to 2 %, and with an estimate of the velocity and the smaller bias. It
writes ``data/safety_early_rigs.csv`` and ``data/safety_early.csv``, from which
`safety_rig_tables` makes a table of the page. The same seed makes the same tests on every machine.
"""

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import safety
from safety_random_rigs import DATA, SENSOR, faults_of

RIGS, FAULTS = DATA / "safety_early_rigs.csv", DATA / "safety_early.csv"
SEED, COUNT = 6, 200
EARLY = (0.05, 1.2)
"""Times (s) between which a fault begins."""
VARIANTS = ((SENSOR, 1.0), (SENSOR, 4.0), ("estimate", 1.0))
"""Sources of the velocity, and factors on the null bias of up to 0.5 % of opening."""

Rows = list[dict[str, object]]


def early(number: int, seed: int = SEED) -> tuple[Rows, Rows]:
    """A row for each variant of a rig, and a row for each of its faults."""
    rigs: Rows = []
    faults: Rows = []
    for source, off in VARIANTS:
        row, found = faults_of(number, source, seed, EARLY, off)
        rigs.append({"rig": number, "off": off} | row)
        faults += ({"off": off} | fault for fault in found)
    return rigs, faults


def main(count: int, seed: int) -> None:
    """Run everything."""
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        found = list(pool.map(partial(early, seed=seed), range(count)))
    safety.write(RIGS, iter([row for rigs, _ in found for row in rigs]))
    safety.write(FAULTS, iter([row for _, faults in found for row in faults]))


if __name__ == "__main__":
    main(*[*map(int, sys.argv[1:]), *(COUNT, SEED)[len(sys.argv) - 1 :]])
