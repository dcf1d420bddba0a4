"""Tests without a fault on laboratory rigs whose piston is attached with a play or through a spring.

``python docs/evidence/safety_play.py [COUNT] [SEED]`` runs the tests of `safety_laboratory` on rigs of
another seed. Each play is run with the motion measured at the piston, and at the structure. About two thirds
of the attachments are springs, which half of the controllers know. No controller knows the play. Each test is
run once more without the plausibility watch. It writes ``data/safety_play.csv``, from which
`safety_sound_tables` makes a table of the page. The same seed makes the same tests on every machine.
"""

import os
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import random_rigs
import safety
import safety_laboratory

import eft
from eft.benchmark import Case, drawn_cases

PLAY = Path(__file__).parent / "data" / "safety_play.csv"
SEED, COUNT = 2614, 1536
PLAYS = (0.0, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4)
"""Plays (m) of the attachment."""
SIDES = ("piston", "structure")
"""Where the motion is measured."""
KINDS = 32
"""Combinations of test, loop, scheme and amplitude of the laboratory's tests."""
ATTACHMENTS = ("rigid", "known", "unknown")
STIFFNESS = (2e8, 2e9)
"""Range of the attachment's stiffness (N/m). The oil of the paper's rig has 0.9e8 N/m."""


def attached(number: int, seed: int) -> tuple[float, str, str, float]:
    """The play (m), the side of the motion's sensors, the attachment and its stiffness (N/m)."""
    random = np.random.default_rng([seed, number])
    stiffness = float(np.exp(random.uniform(*np.log(STIFFNESS))))
    group = number // KINDS
    attachment = ATTACHMENTS[random.integers(len(ATTACHMENTS))]
    return PLAYS[group % len(PLAYS)], SIDES[group // len(PLAYS) % len(SIDES)], attachment, stiffness


def protected(number: int, case: Case, seed: int) -> tuple[eft.Rig, eft.Command, str, str]:
    """A rig and its test."""
    play, side, attachment, stiffness = attached(number, seed)
    rig, forces, test, loop = safety_laboratory.protected(number, case)
    changes: dict[str, object] = {"truth.actuator.attachment_play": play, "sensors.motion_at": side}
    if attachment != "rigid":
        known = "" if attachment == "known" else "truth."
        changes[f"{known}actuator.attachment_stiffness"] = stiffness
    return rig.replace(changes), forces, test, loop


def judged(number: int, case: Case, seed: int) -> dict[str, object]:
    """One test without a fault: its cause, whether loop and range explain it, and how it runs unwatched."""
    play, side, attachment, stiffness = attached(number, seed)
    rig, forces, test, loop = protected(number, case, seed)
    run = eft.simulate(rig, forces)
    ended = any(safety.largest(getattr(run, name)) > limit for name, limit in random_rigs.RANGES.items())
    tripped = (run.status & eft.Status.TRIPPED) != 0
    trip = int(tripped.argmax())
    # A reading that jumps is refused until the trip.
    jumped = trip > 0 and run.status[trip - 1] & eft.Status.INVALID_MEASUREMENT
    unwatched = eft.simulate(rig.replace({"protection.plausibility": False}), forces)
    error = np.linalg.norm(unwatched.force - unwatched.command) / np.linalg.norm(unwatched.command)
    return {
        "rig": number,
        "test": test,
        "loop": loop,
        "adaptive": int(rig["compensation.adaptive"]),
        "play": play,
        "side": side,
        "attachment": attachment,
        "stiffness": np.inf if attachment == "rigid" else stiffness,
        "cause": run.cause.name.lower(),
        "jumped": int(bool(jumped)),
        "time": trip / safety.RATE if trip else np.inf,
        "unwatched": unwatched.cause.name.lower(),
        "error": float(error),
        "force": safety.largest(unwatched.force) / safety.largest(np.asarray(forces.values)),
        "unstable": int(safety_laboratory.unstable(rig)),
        "out_of_range": int(ended),
    }


def sound(count: int, seed: int) -> Iterator[dict[str, object]]:
    """One row per test."""
    cases = drawn_cases(count, seed)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        yield from pool.map(lambda number: judged(number, cases[number], seed), range(count))


if __name__ == "__main__":
    chosen = [int(text) for text in sys.argv[1:]] + [COUNT, SEED][len(sys.argv) - 1 :]
    safety.write(PLAY, sound(*chosen))
