"""A second sensor that fails after the first one, on random rigs of data sheets.

``python docs/evidence/safety_second.py [COUNT] [SEED]`` draws rigs as `safety_random_rigs` does, with a
digital loop. Each pair of sensors fails once, with a random kind of either fault: the first one in a running
test, the second one 0.02 to 0.5 s later. It writes ``data/safety_second.csv``, from which `safety_rig_tables`
makes a table of the page. The same seed makes the same tests on every machine.
"""

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import permutations
from typing import Any

import numpy as np
import safety
from safety import KINDS, SIGNALS, largest
from safety_random_rigs import DATA, LATER, SENSOR, Protected, draw, protected

import eft

SECOND = DATA / "safety_second.csv"
SEED, COUNT = 8, 200
BETWEEN = (0.02, 0.5)
"""Times (s) between which the second fault follows the first."""
LASTS = 2.0
"""Time (s) of a test after the second fault."""


class Failing:
    """The controller of a rig, whose sensors fail one after the other.

    ``faults`` has a sensor, a kind and a first sample for each.
    """

    def __init__(self, rig: eft.Rig, rate: float, faults: list[tuple[str, str, int]]) -> None:
        self.controller = eft.Controller(rig, sample_rate=rate)
        self.faults, self.sample = faults, 0
        self.last: dict[str, float] = dict.fromkeys(SIGNALS, 0.0)

    def step(
        self, command: float, velocity: float, force: float, spool: float, *others: Any, **more: Any
    ) -> float:
        """The valve command (V) for the readings with their faults."""
        readings = {
            "force": force,
            "displacement": more.pop("displacement"),
            "velocity": velocity,
            "spool": spool,
        }
        for signal, kind, first in self.faults:
            if self.sample >= first:
                readings[signal] = failed(kind, readings[signal], self.last[signal])
        self.sample += 1
        self.last = readings
        more = {name: more.get(name) for name in ("next_command", "acceleration")}
        return float(self.controller.step(command, **readings, **more))


def failed(kind: str, reading: float, last: float) -> float:
    """A failed sensor's reading, from the true one and the last one."""
    return {"lost": np.nan, "zero": 0.0, "stuck": last, "sign": -reading}[kind]


def seconds_of(number: int, seed: int = SEED) -> list[dict[str, object]]:
    """A row for each pair of sensors of a rig, with a velocity sensor and with an estimate."""
    rows: list[dict[str, object]] = []
    for source in (SENSOR, "estimate"):
        drawn, random = draw(number, seed)
        drawn["loop"] = "robust" if drawn["loop"] == "robust" else "pd digital"
        found = protected(drawn, SENSOR if source == SENSOR else drawn["estimate"], number)
        if found.runs:
            signals = [signal for signal in SIGNALS if source == SENSOR or signal != "velocity"]
            rows += (
                {"rig": number, "source": found.row["source"]} | second(found, pair, number, random)
                for pair in permutations(signals, 2)
            )
    return rows


def second(
    found: Protected, pair: tuple[str, str], number: int, random: np.random.Generator
) -> dict[str, object]:
    """The test with both faults: the largest force after the second one over its level, and at the end."""
    rate = float(found.rig["controller.sample_rate"])
    kinds = [str(random.choice(KINDS)) for _ in pair]
    start = random.uniform(*LATER)
    times = start, start + random.uniform(*BETWEEN)
    begins = [int(np.ceil(time * rate)) for time in times]
    rig = found.rig.replace({"sensors.seed": number + 7})
    controller = Failing(rig, rate, list(zip(pair, kinds, begins, strict=True)))
    run = eft.simulate(rig, found.command[: begins[1] + int(LASTS * rate)], controller=controller)
    force = np.abs(run.force[begins[1] :]) / found.level["force"]
    return {
        "first": pair[0],
        "kind": kinds[0],
        "second": pair[1],
        "second_kind": kinds[1],
        "between": times[1] - times[0],
        "cause": eft.Cause(controller.controller.cause).name.lower(),
        "before": largest(run.force[begins[0] : begins[1]]) / found.level["force"],
        "force": float(force.max()),
        "end": float(force[-int(0.5 * rate) :].max()),
        "displacement": largest(run.displacement[begins[1] :]) / found.level["displacement"],
    }


def main(count: int, seed: int) -> None:
    """Run everything."""
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        found = list(pool.map(partial(seconds_of, seed=seed), range(count)))
    safety.write(SECOND, iter([row for rows in found for row in rows]))


if __name__ == "__main__":
    main(*[*map(int, sys.argv[1:]), *(COUNT, SEED)[len(sys.argv) - 1 :]])
