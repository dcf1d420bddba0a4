"""Sensor faults on random rigs with the curve correction.

``python docs/evidence/safety_curve.py [COUNT] [SEED]`` runs the self-calibrating rigs of `safety_random_rigs`
that have a velocity sensor once more, with the same faults. The curve correction replaces the one flow gain.
It writes ``data/safety_curve_rigs.csv`` and ``data/safety_curve.csv``.
"""

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import safety
from safety_random_rigs import COUNT, DATA, SEED, SENSOR, draw, faults_of

RIGS, FAULTS = DATA / "safety_curve_rigs.csv", DATA / "safety_curve.csv"


def main(count: int, seed: int) -> None:
    """Run everything."""
    numbers = [number for number in range(count) if draw(number, seed)[0]["scheme"] == "adaptive"]
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        tested = partial(faults_of, source=SENSOR, seed=seed, scheme="curve")
        found = list(pool.map(tested, numbers))
    safety.write(RIGS, ({"rig": number} | row for number, (row, _) in zip(numbers, found, strict=True)))
    safety.write(FAULTS, (fault for _, faults in found for fault in faults))


if __name__ == "__main__":
    main(*[*map(int, sys.argv[1:]), *(COUNT, SEED)[len(sys.argv) - 1 :]])
