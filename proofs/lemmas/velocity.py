"""Velocity from the displacement, and stuck sensors."""

from __future__ import annotations

import rules
from lemma import Case, Formulas, Lemma, Twin

from lemmas.bounds import LARGEST, nothing, untouched

#: More than the largest slope, 2·10²⁴ m/s. A power of two, so that rounding does not exceed it.
SLOPE = 2.0**82


def derivative_given(v: Case) -> Formulas:
    c, s = v.config, v.state
    return {
        "sample_rate": c.sample_rate.within(0.0, LARGEST),
        "share": c.share.within(0.0, 1.0),
        "last displacement": abs(s.displacement) <= LARGEST,
        "first": abs(s.first) <= SLOPE,
        "second": abs(s.second) <= SLOPE,
    }


def derivative_shows(v: Case) -> Formulas:
    after, valid = v.after["state"], abs(v.displacement) <= LARGEST
    return {
        "finite for a valid displacement": valid.implies(v.result.is_finite()),
        "an invalid one leaves the state's bits": (~valid).implies(
            untouched(v.state, after) & v.result.is_nan()
        ),
        "the displacement stays bounded": abs(after.displacement) <= LARGEST,
        "the first low-pass stays bounded": abs(after.first) <= SLOPE,
        "the second low-pass stays bounded": abs(after.second) <= SLOPE,
    }


def observer_shows(v: Case) -> Formulas:
    after = v.after["state"]
    valid = (abs(v.displacement) <= LARGEST) & (abs(v.acceleration) <= LARGEST)
    return {
        "an invalid sample leaves the state's bits": (~valid).implies(
            untouched(v.state, after) & v.result.is_nan()
        ),
        "a valid one gives the velocity of the state": valid.implies(v.result.same(after.velocity)),
    }


def stuck_given(v: Case) -> Formulas:
    return {
        "stuck_samples": (v.config.repeats >= 1) & (v.config.repeats <= 1_000_000),
        **{f"repeats {n}": v.state.repeats[n] <= v.config.repeats for n in range(3)},
    }


def stuck_shows(v: Case) -> Formulas:
    after = v.after["state"]
    nan = v.velocity.is_nan() & v.force.is_nan() & v.spool.is_nan()
    return {
        **{f"the count stays bounded, {n}": after.repeats[n] <= v.config.repeats for n in range(3)},
        "NaN is never stuck": nan.implies(v.result.same(0)),
    }


LEMMAS = [
    Lemma("filtered derivative, one step", "derivative", derivative_given, derivative_shows, Twin(without="share"),
          havoc=frozenset({"fmul"}), rules=(rules.never_grows, rules.sign, rules.product(2e12, 1e12))),
    Lemma("filtered derivative, constructor", "derivative_new", nothing, lambda v: {
        "share": v.result.implies(v.after["out"].share.within(0.0, 1.0)),
        "sample_rate": v.result.implies(v.after["out"].sample_rate.within(0.0, 1.00001 * LARGEST)),
    }, Twin(swap=("fcmp ole", "fcmp oge"))),
    Lemma("velocity observer, invalid samples", "observer", nothing, observer_shows, Twin(swap=("fcmp ule|fcmp ugt", "fcmp oge")),
          havoc=frozenset({"fadd", "fsub", "fmul"})),
    Lemma("stuck sensors", "stuck", stuck_given, stuck_shows, Twin(swap=("fcmp oeq", "fcmp ueq"))),
]  # fmt: skip
