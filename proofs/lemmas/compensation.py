"""Lead network, load pressure, inverse flow, feedforward, and the compensation made of them."""

from __future__ import annotations

import rules
from lemma import Case, Formulas, Lemma, Twin

from lemmas.bounds import (
    EVERYTHING,
    LARGEST,
    LEAD_GAIN,
    lead_bounds,
    nothing,
    raised,
    untouched,
    washout_bound,
)
from lemmas.tables import evaluation


def lead_given(v: Case) -> Formulas:
    return {
        **lead_bounds(v.config),
        "input": abs(v.input) <= 1.0,
        "last input": abs(v.state.input) <= 1.0,
        "washout": abs(v.state.washout) <= washout_bound(v.size),
    }


def lead_shows(v: Case) -> Formulas:
    after = v.after["state"]
    return {
        "the washout stays bounded": abs(after.washout) <= washout_bound(v.size),
        "the input is remembered": after.input.same(v.input),
        "output finite": v.result.is_finite(),
    }


def lead_new_shows(v: Case) -> Formulas:
    # The bound of the rate, (1 − α)/α, follows by hand: the solver does not find it in minutes.
    out = v.after["out"]
    return {name: v.result.implies(bound) for name, bound in lead_bounds(out).items() if name != "rate"}


def root_shows(v: Case) -> Formulas:
    return {"every input, NaN too: at least √0.05": v.result >= 0.2236}


def pressure_new_shows(v: Case) -> Formulas:
    return {
        "per_newton": v.result.implies(
            (v.after["out"].per_newton >= 0.0) & v.after["out"].per_newton.is_finite()
        )
    }


def table_value(v: Case, table) -> Formulas:
    """By the lemma on the table, whose evaluation this is: between its ends, which `scale_to_limit` keeps within ±1."""
    return {
        "value of the table": abs(evaluation(v, table)) <= 1.0,
        "ends of the table": (abs(table.below) <= 1.0) & (abs(table.above) <= 1.0),
    }


def opening_given(v: Case) -> Formulas:
    return table_value(v, v.config.table)


def opening_shows(v: Case) -> Formulas:
    return {"every flow, force, spool and supply, NaN too: within ±1": abs(v.result) <= 1.0}


def feedforward_given(v: Case) -> Formulas:
    c = v.config
    return {
        "flow_per_force": c.flow_per_force.within(0.0, LARGEST),
        "flow_per_change": c.flow_per_change.within(0.0, LARGEST),
        "last command": abs(v.state.command) <= LARGEST,
        "last friction": abs(v.state.friction) <= LARGEST,
        "friction": abs(v.friction) <= LARGEST,
    }


def feedforward_shows(v: Case) -> Formulas:
    valid = abs(v.command) <= LARGEST
    return {
        "flow finite": v.result.is_finite(),
        "the command stays bounded": abs(v.after["state"].command) <= LARGEST,
        "so does the friction": abs(v.after["state"].friction) <= LARGEST,
        "an invalid command leaves the last one": (~valid).implies(
            v.after["state"].command.same(v.state.command)
        ),
    }


def accepted(config, v) -> Formulas:
    return (
        (abs(v.velocity) <= config.velocity_range)
        & (abs(v.force) <= config.force_range)
        & (abs(v.spool) <= config.spool_range)
    )


def refused_shows(v: Case) -> Formulas:
    valid = accepted(v.config, v.input) & (abs(v.input.further_flow) <= LARGEST)
    out = v.after["out"]
    return {
        "an invalid sample leaves the state's bits": (~valid).implies(untouched(v.state, v.after["state"])),
        "and repeats the last output": (~valid).implies(out.value.same(v.state.output)),
        "and is flagged": (~valid).implies(raised(out.status, 32)),
    }


def compensation_given(v: Case) -> Formulas:
    lead, state = v.calibration.lead, v.state.lead
    return {
        **table_value(v, v.config.inverse.table),
        **lead_bounds(lead),
        "last input": abs(state.input) <= 1.0,
        "washout": abs(state.washout) <= washout_bound(v.size),
        "last output": v.state.output.is_finite(),
    }


def compensation_shows(v: Case) -> Formulas:
    after = v.after["state"]
    return {
        "output finite": v.after["out"].value.is_finite(),
        "the output kept is finite": after.output.is_finite(),
        "the lead's input stays within ±1": abs(after.lead.input) <= 1.0,
    }


_MAGNITUDES = (
    rules.never_grows,
    rules.product(1024.0, 2.0),
    rules.total(1.0),
    *tuple(rule for big in (2.0**36, 2.0**65) for rule in (rules.total(big), rules.total(2.0 * big))),
    rules.product(LEAD_GAIN, 2.0**68),
    rules.product(LEAD_GAIN, 2.0**39),
)

LEMMAS = [
    Lemma("lead network, one step", "lead", lead_given, lead_shows, Twin(without="pole")),
    Lemma("lead network, constructor", "lead_new", nothing, lead_new_shows, Twin(swap=("fcmp ole", "fcmp oge"))),
    Lemma("load pressure, root", "root", nothing, root_shows, Twin(swap=("fcmp oge", "fcmp ole"))),
    Lemma("load pressure, factor", "factor", nothing, lambda v: {"within [0, 4.48]": v.result.within(0.0, 4.48)},
          Twin(swap=("fdiv", "fmul"))),
    Lemma("load pressure, constructor", "load_pressure_new", nothing, pressure_new_shows, Twin(swap=("fcmp oge", "fcmp ole"))),
    Lemma("inverse flow", "opening", opening_given, opening_shows, Twin(without="ends of the table"), havoc=EVERYTHING),
    Lemma("feedforward", "feedforward", feedforward_given, feedforward_shows, Twin(without="last command")),
    Lemma("compensation, invalid samples", "compensation", nothing, refused_shows, Twin(swap=("and i1", "or i1")), havoc=EVERYTHING),
    Lemma("compensation, valid samples", "compensation", compensation_given, compensation_shows, Twin(without="rate"),
          havoc=EVERYTHING, rules=_MAGNITUDES),
]  # fmt: skip
