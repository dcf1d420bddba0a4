"""Trips by a load cell on a rig with a null bias, in four schemes.

``python docs/evidence/safety_null.py`` runs each fault at eight moments of a sine, and from the first sample
on. It writes ``data/safety_null.csv``, from which `safety_tables` makes a table of the page.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import random_rigs
import safety
from safety import RATE

import eft

NULL = Path(__file__).parent / "data" / "safety_null.csv"
BIASES = (0.0, 0.01, -0.02, 0.02, 0.03)
SCHEMES: dict[str, dict[str, object]] = {
    "paper's gains": {},
    "integral part": {"controller.integral_gain": 4.0},
    "designed loop": {"controller.force_loop": "robust"},
    "self-calibrating": {"compensation.adaptive": True, "compensation.feedforward": True},
}
SETTLES = 1.5
"""Time (s) until the valve closes, within which the peaks are taken."""
CLOSED, LASTS = 2.5, 12.0
"""Times (s) after a fault between which the force of the closed valve is taken."""
AT_FIRST, LATER = (0.0,), tuple(3.0 + moment / 12.0 for moment in range(8))


def null() -> Iterator[dict[str, object]]:
    """One row per scheme, fault and bias: the worst of the moments."""
    sine = np.asarray(eft.sine_sweep(6000.0, 1.5, 1.5, 6.0, RATE).values)
    values = np.pad(sine, (0, int(LASTS * RATE)))
    stops = {"actuator.stop_stiffness": 1e8, "controller.realization": "digital"}
    base = eft.Rig.zhao2005().replace(safety.LEVELS | random_rigs.noise(1) | stops)
    for scheme, changes in SCHEMES.items():
        for kind in ("none", "lost", "sign"):
            for starts in (AT_FIRST,) if kind == "none" else (LATER, AT_FIRST):
                for bias in BIASES:
                    rig = base.replace(changes | {"truth.servovalve.null_bias": bias})
                    forces, motions, closed, causes = [], [], [], []
                    for start in starts:
                        failing = rig if kind == "none" else rig.replace(safety.fault("force", kind, start))
                        end = 6.0 if kind == "none" else start + SETTLES
                        length = int((end if kind == "none" else start + LASTS) * RATE)
                        run = eft.simulate(failing, eft.Command(values[:length], RATE))
                        after = slice(int(start * RATE), int(end * RATE))
                        if kind != "none":
                            closed.append(safety.largest(run.force[int((start + CLOSED) * RATE) :]))
                        forces.append(safety.largest(run.force[after]))
                        motions.append(safety.largest(run.displacement[after]))
                        causes.append(run.cause.name.lower())
                    yield {
                        "scheme": scheme,
                        "kind": kind,
                        "start": min(starts),
                        "bias": bias,
                        "force": max(forces),
                        "displacement": max(motions),
                        "closed": max(closed, default=0.0),
                        "causes": " ".join(sorted(set(causes))),
                    }


if __name__ == "__main__":
    safety.write(NULL, null())
