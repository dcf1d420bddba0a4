"""The controller and the whole tick."""

from __future__ import annotations

import rules
from lemma import Case, Formulas, Lemma, Twin
from terms import all_of

from lemmas.bounds import (
    EVERYTHING,
    LARGEST,
    is_set,
    limiter_bounds,
    protection_bounds,
    protection_state,
    untouched,
)
from lemmas.compensation import accepted

DIGITAL = 0


def rounding(v: Case, limiter) -> Formulas:
    """Rules only where they are needed: at the rate limit, and at the last products."""
    said = []
    products = [done for done in v.run.done if done[0] == "fmul"][-4:]
    for op, operands, result in v.run.done:
        if any(operand.term == limiter.change.term for operand in operands):
            said += rules.sign(op, operands, result, [])
    for op, operands, result in products:
        said += rules.never_grows(op, operands, result, [])
    return {"rounding": all_of(said)}


def supply_bounds(state):
    """A ratio to the configured pressure between 1/20 and 4, to within rounding; less 1."""
    return (state.supply >= -0.96) & (state.supply <= 3.0)


def controller_given(v: Case) -> Formulas:
    return {
        **limiter_bounds(v.config.limiter),
        **rounding(v, v.config.limiter),
        "digital": v.config.realization.same(DIGITAL),
        "last command": abs(v.state.valve_command) <= v.config.limiter.amplitude,
        "supply": supply_bounds(v.state),
    }


def controller_shows(v: Case) -> Formulas:
    out, after, amplitude = v.after["out"], v.after["state"], v.config.limiter.amplitude
    valid = accepted(v.config.compensation, v.input) & (abs(v.input.command) <= LARGEST)
    kept = untouched(v.state, after, ("feedforward", "refused_samples", "supply"))
    unmeasured = v.config.measures_supply.same(0)
    return {
        "every input, NaN too: finite and within the amplitude": abs(out.valve_command) <= amplitude,
        "the command kept lies within it": abs(after.valve_command) <= amplitude,
        "an invalid sample leaves the state's bits, but for its count and the supply": (~valid).implies(kept),
        "the supply stays within its bounds": supply_bounds(after),
        "and keeps its bits where it is not measured": unmeasured.implies(after.supply.same(v.state.supply)),
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
        "variants": (c.velocity.variant <= 3)
        & (c.stuck.variant <= 1)
        & (c.protection.variant <= 2)
        & (c.plausibility.variant <= 2),
        "last command": abs(s.controller.valve_command) <= c.controller.limiter.amplitude,
    }


def channel_shows(v: Case) -> Formulas:
    s, after, amplitude = v.state, v.after["state"], v.config.controller.limiter.amplitude
    protected = v.config.protection.variant <= 1
    return {
        "every input, NaN too: the valve command lies within the amplitude": abs(
            after.controller.valve_command
        )
        <= amplitude,
        "a trip is not forgotten": is_set(s.protection.tripped).implies(is_set(after.protection.tripped)),
        "nor a shutdown": is_set(s.protection.shut_down).implies(is_set(after.protection.shut_down)),
        "ramps stay within their ends": protected.implies(protection_state(after.protection)["positions"]),
    }


LEMMAS = [
    Lemma("controller, one step", "controller", controller_given, controller_shows, Twin(without="change"),
          havoc=EVERYTHING),
    Lemma("controller, invalid samples", "controller", controller_given, controller_shows, Twin(swap=("and i1", "or i1")),
          havoc=EVERYTHING),
    Lemma("whole tick", "channel", channel_given, channel_shows, Twin(without="last command"), refined=True),
]  # fmt: skip
