"""Faults of displacement and velocity at every moment of a swing, with a wrong flow gain.

``python docs/evidence/safety_swing.py [MOMENTS]`` begins each fault at equally spaced moments of one period
of the sine of `safety_sizes`, on the same three rigs. Every second test is self-calibrating. The valve's flow
is that of the table times a gain. It writes ``data/safety_swing.csv``, of which `safety_tables` makes a
table.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import coverage
import numpy as np
import safety
from safety import CASES, RATE
from safety_sizes import SCHEMES, commands, protected, summary

import eft

RESULTS = Path(__file__).parent / "data" / "safety_swing.csv"
MOMENTS = 400
GAINS = (0.95, 0.97, 1.0, 1.03, 1.05)
"""Flow of the valve over that of the table (1)."""
FAULTS = tuple(case for case in CASES if case[0] == "displacement" or case == ("velocity", "sign"))
START, AFTER = 3.0, 1.2
"""Begin of the swing, and duration of a test after its fault (s)."""


def swing(known: eft.Rig) -> tuple[np.ndarray, float]:
    """The sine (N) near the structure's frequency, and its period (s)."""
    own = float(np.sqrt(known["structure.stiffness"] / known["structure.mass"])) / (2 * np.pi)
    return commands(known)[0][0], 1.0 / (0.95 * own)


def faults(moments: int) -> Iterator[dict[str, object]]:
    """One row per flow gain, rig and fault."""
    for gain in GAINS:
        for size, known in coverage.RIGS.items():
            rig, force_level, displacement_level = protected(known)
            rig = rig.replace({"truth.servovalve.flow_gain_scale": gain})
            values, period = swing(known)
            begins = [int(np.ceil((START + period * n / moments) * RATE)) for n in range(moments)]
            for case in FAULTS:

                def rig_of(
                    moment: int,
                    rig: eft.Rig = rig,
                    case: tuple[str, str] = case,
                    begins: list[int] = begins,
                    values: np.ndarray = values,
                ) -> tuple[eft.Rig, eft.Command]:
                    begin = begins[moment]
                    changes = safety.fault(*case, begin / RATE) | SCHEMES[moment % 2]
                    command = eft.Command(values[: begin + int(AFTER * RATE)], RATE)
                    return rig.replace(changes | {"sensors.seed": moment}), command

                found = safety.runs(rig_of, moments)
                row = {"gain": gain, "size": size, "signal": case[0], "kind": case[1], "moments": moments}
                yield row | summary(found, begins, force_level, displacement_level)


if __name__ == "__main__":
    safety.write(RESULTS, faults(int(sys.argv[1]) if len(sys.argv) > 1 else MOMENTS))
