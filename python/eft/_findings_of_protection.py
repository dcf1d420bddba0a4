"""Findings on the protection: what makes faults worse, and what makes false alarms."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

from eft._display import shown
from eft._finding import ROUNDED, Finding
from eft._floors import floor_frequencies
from eft._native import Rig

LEAST_LEVEL = 1 / 8
"""The lowest advised level of the force over the actuator's capacity."""
LEAST_SAMPLES = 250.0
"""The lowest advised sample rate over the natural frequency, with the protection."""

FALSE_ALARMS = {
    "piston": {2e-5: 23, 5e-5: 49, 1e-4: 97, 2e-4: 109, 5e-4: 107},
    "structure": {1e-4: 5, 2e-4: 57, 5e-4: 106},
}
"""False alarms of `SOUND_TESTS` tests by the play (m), with the motion measured at one side of it."""
SOUND_TESTS = 128


def of_protection(
    rig: Rig, rate: float, outside: bool = False, floor: int | None = None
) -> Iterator[Finding]:
    """Cautions on conditions with which faults exceeded the force's level, or sound tests were tripped."""
    if not (rig["protection.enabled"] and rig["protection.plausibility"]):
        return
    yield from _of_play(rig)
    form, level = shown("force"), rig["protection.force_trip"]
    capacity = rig["actuator.piston_area"] * rig["supply.pressure"]
    if level is not None and level < ROUNDED * LEAST_LEVEL * capacity:
        yield Finding(
            "caution",
            f"The level protection.force_trip = {form(level)} is {100 * level / capacity:.1f} % of the "
            f"actuator's capacity, advised at least {100 * LEAST_LEVEL:.1f} % "
            f"({form(LEAST_LEVEL * capacity)}): on random rigs 22 % of the faults of the load cell drove the "
            "force beyond 1.75 times lower levels, and 2.8 % beyond 1.75 times this one.",
        )
    own = floor_frequencies(rig)
    floors = range(len(own)) if floor is None else [floor]
    fast = [] if outside else [i for i in floors if rate < ROUNDED * LEAST_SAMPLES * own[i]]
    if fast:
        named = (f"{own[i]:.3g} Hz" + (f" of floor {i + 1}" if len(own) > 1 else "") for i in fast)
        times = (f"{rate / own[i]:.0f} times " for i in fast)
        what = itertools.chain(["the natural frequency of "], itertools.repeat("that of "))
        rates = " and ".join(map("".join, zip(times, what, named, strict=False)))
        yield Finding(
            "caution",
            f"The sample rate {rate:g} Hz is {rates}, advised at least {LEAST_SAMPLES:.0f} times "
            f"({LEAST_SAMPLES * max(own[i] for i in fast):.0f} Hz) with the protection: on random rigs 2.9 % "
            "of the faults drove the force beyond 1.75 times its level below this rate, and 0.6 % above it.",
        )


def _of_play(rig: Rig) -> Iterator[Finding]:
    """A caution about a play of the attachment with which the protection blamed sound sensors."""
    side, play = rig.plant["sensors.motion_at"], rig.plant["actuator.attachment_play"] or 0.0
    tried = [one for one in FALSE_ALARMS[side] if one <= play]
    if tried:
        alarms = FALSE_ALARMS[side][max(tried)]
        measured = f"{1e3 * max(tried):.2g} mm and the motion measured at the {side}"
        remedy = ", or measure the motion at the structure" if side == "piston" else ""
        yield Finding(
            "caution",
            f"With the play of {1e3 * play:.2g} mm between piston and structure the protection may blame a "
            f"sound sensor: with {measured} it did in {alarms} of {SOUND_TESTS} tests. "
            f"Shim the clevises{remedy}.",
        )
