"""The paper's force loop and the limits of the valve command."""

from __future__ import annotations

import rules
from lemma import Case, Formulas, Lemma, Twin

from lemmas.bounds import LARGEST, limiter_bounds, nothing, raised

COMMAND_LIMITED = 8


def limiter_shows(v: Case) -> Formulas:
    limiter = v.config
    flags = v.after["flags"]
    return {
        "every command and last command, NaN too: within the amplitude": abs(v.result) <= limiter.amplitude,
        "NaN is flagged": v.command.is_nan().implies(raised(flags, COMMAND_LIMITED)),
        "what lies beyond is flagged": (abs(v.command) > limiter.amplitude).implies(
            raised(flags, COMMAND_LIMITED)
        ),
    }


def rate_shows(v: Case) -> Formulas:
    limiter = v.config
    lowest, highest = -limiter.amplitude, limiter.amplitude
    # The last command within the amplitude, from which the rate counts.
    raised_ = (v.last > lowest).pick(v.last, lowest)
    back = (raised_ < highest).pick(raised_, highest)
    last = (~(abs(v.last) <= limiter.amplitude)).pick(back, v.last)
    down, up = v.run.compute("fsub", last, limiter.change), v.run.compute("fadd", last, limiter.change)
    return {"no further than the rate": (v.result <= up) & (v.result >= down)}


def force_loop_given(v: Case) -> Formulas:
    c = v.config
    return {
        "force_sensitivity": c.force_sensitivity.within(0.0, LARGEST),
        "proportional_gain": c.proportional_gain.within(0.0, LARGEST),
        "derivative_per_sample": abs(c.derivative_per_sample) <= LARGEST,
        "command": abs(v.command) <= LARGEST,
        "force": abs(v.force) <= LARGEST,
        "compensation": abs(v.compensation) <= 1e24,
        "last error": abs(v.state.error) <= 2.1e24,
    }


def force_loop_shows(v: Case) -> Formulas:
    return {
        "output finite": v.result.is_finite(),
        "the error stays bounded": abs(v.after["state"].error) <= 2.1e24,
    }


LEMMAS = [
    Lemma("limits, amplitude", "limiter", lambda v: limiter_bounds(v.config), limiter_shows, Twin(without="amplitude"),
          havoc=frozenset({"fadd", "fsub"}), rules=(rules.sign,)),
    Lemma("limits, rate", "limiter", lambda v: limiter_bounds(v.config), rate_shows, Twin(swap=("fcmp olt", "fcmp ogt")),
          havoc=frozenset({"fadd", "fsub"}), rules=(rules.sign,)),
    Lemma("limits, constructor", "limiter_new", nothing,
          lambda v: {name: v.result.implies(bound) for name, bound in limiter_bounds(v.after["out"]).items()},
          Twin(swap=("fcmp oge", "fcmp ole"))),
    Lemma("force loop, one step", "force_loop", force_loop_given, force_loop_shows, Twin(without="command")),
]  # fmt: skip
