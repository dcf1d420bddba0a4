"""The controller and the whole tick."""

from __future__ import annotations

import rules
from lemma import Case, Formulas, Lemma, Twin
from lemmas.bounds import EVERYTHING, LARGEST, is_set, limiter_bounds, protection_bounds, protection_state, untouched
from lemmas.compensation import accepted

DIGITAL = 0


def controller_given(v: Case) -> Formulas:
    return {
        **limiter_bounds(v.config.limiter),
        "digital": v.config.realization.same(DIGITAL),
        "last command": abs(v.state.valve_command) <= v.config.limiter.amplitude,
    }


def controller_shows(v: Case) -> Formulas:
    out, after, amplitude = v.after["out"], v.after["state"], v.config.limiter.amplitude
    valid = accepted(v.config.compensation, v.input) & (abs(v.input.command) <= LARGEST)
    kept = untouched(v.state, after, ("feedforward",))
    return {
        "every input, NaN too: finite and within the amplitude": abs(out.valve_command) <= amplitude,
        "the command kept lies within it": abs(after.valve_command) <= amplitude,
        "an invalid sample leaves the state's bits": (~valid).implies(kept),
        "and holds the output": (~valid).implies(out.valve_command.same(v.state.valve_command)),
        "and is flagged": (~valid).implies(~(out.status & (32 | 64)).same(0)),
    }


def channel_given(v: Case) -> Formulas:
    c, s = v.config, v.state
    return {
        **limiter_bounds(c.controller.limiter),
        **protection_bounds(c.protection.Some.__0),
        **protection_state(s.protection),
        "digital": c.controller.realization.same(DIGITAL) & c.realization.same(DIGITAL),
        "variants": (c.velocity.variant <= 3) & (c.stuck.variant <= 1) & (c.protection.variant <= 2) & (c.plausibility.variant <= 2),
        "last command": abs(s.controller.valve_command) <= c.controller.limiter.amplitude,
    }


def channel_shows(v: Case) -> Formulas:
    s, after, amplitude = v.state, v.after["state"], v.config.controller.limiter.amplitude
    protected = v.config.protection.variant <= 1
    return {
        "every input, NaN too: the voltage is finite and within the amplitude": abs(v.result) <= amplitude,
        "the command kept lies within it": abs(after.controller.valve_command) <= amplitude,
        "a trip is not forgotten": is_set(s.protection.tripped).implies(is_set(after.protection.tripped)),
        "nor a shutdown": is_set(s.protection.shut_down).implies(is_set(after.protection.shut_down)),
        **{f"kept: {name}": protected.implies(formula) for name, formula in protection_state(after.protection).items()},
    }


LEMMAS = [
    Lemma("controller, one step", "controller", controller_given, controller_shows, Twin(without="change"),
          havoc=EVERYTHING, rules=(rules.sign,)),
    Lemma("controller, invalid samples", "controller", controller_given, controller_shows, Twin(swap=("and i1", "or i1")),
          havoc=EVERYTHING, rules=(rules.sign,)),
    Lemma("whole tick", "channel", channel_given, channel_shows, Twin(without="last command"), havoc=EVERYTHING,
          rules=(rules.sign, rules.never_grows)),
]  # fmt: skip
