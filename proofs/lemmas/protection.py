"""The protection of the specimen."""

from __future__ import annotations

import rules
from lemma import Case, Formulas, Lemma, Twin

from lemmas.bounds import LARGEST, MOST, is_set, protection_bounds, protection_state, untouched

REFUSED = 32 | 64


def _given(v: Case) -> Formulas:
    return {**protection_bounds(v.config), **protection_state(v.state)}


def _shows(v: Case) -> Formulas:
    s, after, out = v.state, v.after["state"], v.after["out"]
    tripped, force = is_set(s.tripped), v.config.force
    return {
        "the permitted command is finite": abs(out.command) <= LARGEST,
        "authority within [0, 1]": out.authority.within(0.0, 1.0),
        "level within [0, 1]": out.level.within(0.0, 1.0),
        **{f"kept: {name}": formula for name, formula in protection_state(after).items()},
        "a trip is not forgotten": tripped.implies(is_set(after.tripped)),
        "nor a shutdown": is_set(s.shut_down).implies(is_set(after.shut_down)),
        "a shutdown is a trip": is_set(after.shut_down).implies(is_set(after.tripped)),
        "a trip lets the command down": tripped.implies(after.command_ramp.__0 <= s.command_ramp.__0),
        "and no further command is followed": tripped.implies(after.command.same(s.command)),
        "a shutdown gives nothing back": is_set(s.shut_down).implies(
            after.valve_ramp.__0 >= s.valve_ramp.__0
        ),
        "the first cause stays": tripped.implies(after.cause.same(s.cause)),
        "a force beyond its trip level trips": ((abs(v.force) > force.trip) & (abs(v.force) <= MOST)).implies(
            is_set(after.tripped)
        ),
        "and far beyond it shuts down": (
            (abs(v.force) > force.shutdown)
            & (abs(v.force) > force.trip)
            & (abs(v.force) <= MOST)
            & (s.motion_by_flow.same(0) | s.command_ramp.__0.same(0))
        ).implies(is_set(after.shut_down)),
        "lost measurements shut down": (
            v.force.is_nan() & (s.lost_measurements >= v.config.lost_samples)
        ).implies(is_set(after.shut_down)),
        "a lost command trips": (
            (~(abs(v.command) <= LARGEST)) & (s.lost_commands >= v.config.lost_samples)
        ).implies(is_set(after.tripped)),
        "a flipped bit of a latch shuts down": (~s.tripped.set.same(s.tripped.unset ^ 0xFFFFFFFF)).implies(
            is_set(after.shut_down)
        ),
    }


def watch_shows(v: Case) -> Formulas:
    s, after = v.state, v.after["state"]
    refused = ~(v.flags & REFUSED).same(0)
    return {
        "a trip is not forgotten": is_set(s.tripped).implies(is_set(after.tripped)),
        "nor a shutdown": is_set(s.shut_down).implies(is_set(after.shut_down)),
        "refused samples shut down": (refused & (s.refused_samples >= v.config.lost_samples)).implies(
            is_set(after.shut_down) & is_set(after.tripped)
        ),
        "a sound sample changes nothing": v.flags.same(0).implies(
            untouched(s, after, ("refused_samples", "faulty_samples"))
        )
        | (s.refused_samples > v.config.lost_samples),
        **{f"kept: {name}": formula for name, formula in protection_state(after).items()},
    }


def preview_given(v: Case) -> Formulas:
    # `Plausibility::brake` makes at most 40 % of a level.
    return {**_given(v), "brake": abs(v.state.brake) <= LARGEST}


def preview_shows(v: Case) -> Formulas:
    return {
        "finite": abs(v.result) <= 2.0 * LARGEST,
        "after a trip no further command is followed": (
            is_set(v.state.tripped) & v.state.brake.within(0.0, 0.0)
        ).implies(abs(v.result) <= abs(v.state.command)),
    }


LEMMAS = [
    Lemma("protection, one step", "protection", _given, _shows, Twin(without="force levels")),
    Lemma("protection, ramps", "protection", _given, _shows, Twin(swap=("usub", "uadd"))),
    Lemma("protection, what the controller reports", "watch", _given, watch_shows,
          Twin(swap=("icmp ugt", "icmp ult"))),
    Lemma("protection, preview", "preview", preview_given, preview_shows, Twin(without="last command"),
          havoc=frozenset({"fmul"}), rules=(rules.never_grows,)),
]  # fmt: skip
