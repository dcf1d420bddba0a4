"""The lead network that the learner publishes, for any estimates that the learner keeps."""

from __future__ import annotations

from cut import nearest
from ir import Refused
from lemma import Case, Formulas, Lemma, Twin
from refine import Operation
from rounding import LESS
from terms import Float

from lemmas.bounds import lead_bounds
from lemmas.learning import LAG, LARGEST_DEFICIT, configured, kept, longest, start


def estimates(v: Case) -> tuple[list[Float], Formulas]:
    """The estimates and the guard's level, bounded by the lemma on them, and sums that are not bounded."""
    after = v.after["state"]
    found = [
        getattr(part, kind).value for part in (after.flow, after.valve.found) for kind in ("gain", "delay")
    ]
    sums = after.evidence.valve.matrix
    shown = {f"kept: {name}": formula for name, formula in kept(v, after).items()}
    del shown["kept: null offset"], shown["kept: asymmetry"]
    return [*found, after.guard.level, sums[0][0], sums[1][1]], shown


def of(v: Case, operation: Operation, op: str) -> Operation:
    """The operation of this kind that makes an operand."""
    made = (v.run.abstraction.by_result.get(operand.term.id()) for operand in operation.operands)
    for other in made:
        if other and other.op == op:
            return other
    raise Refused(f"no {op} before {operation.op}")


def coefficients_show(v: Case) -> Formulas:
    """Pole and rate, which are over `lag + sample`."""
    lead, sample = v.after["out"].lead, v.config.valve.sample
    pole = v.made(lead.pole)
    difference = of(v, pole, "fsub").result
    sum_ = of(v, of(v, pole, "fdiv"), "fadd")
    product = of(v, sum_, "fmul")
    lag, sum_ = product.result, sum_.result
    # The other factor, `lag_per_delay`, is not computed.
    delay = next(operand for operand in product.operands if nearest(v.run.abstraction, [operand.term]))
    longest_delay, longest_lag = longest(v)
    of_valve, of_velocity = (
        start(priors)["delay"][1] for priors in (v.config.valve.priors, v.config.flow.priors)
    )
    velocity_delay = v.after["state"].flow.delay.value
    sums = [one for one in nearest(v.run.abstraction, [delay.term]) if one.op == "fadd"]
    added = next(of(v, one, "fmul") for one in sums)
    short = added.operands[0]
    both_longest = v.run.compute("fadd", of_valve, of_velocity)
    added_longest = v.run.compute("fmul", Float.of(LARGEST_DEFICIT, v.size), of_velocity)
    between = v.run.compute("fadd", velocity_delay, start(v.config.valve.priors)["delay"][1])
    bounds = lead_bounds(lead)
    v.steps = {
        "delay with the valve's longest": between <= both_longest,
        "share of the velocity's delay": short.within(0.0, LARGEST_DEFICIT),
        "delay for the phase": added.result <= added_longest,
        "whole delay": (delay >= sample + sample) & (delay <= longest_delay),
        "lag": (lag >= sample * 2.0**-8) & (lag <= longest_lag),
        "lag in samples": lag <= sample * LAG,
        "sum of lag and sample": sum_.within(sample, sample * 2.0**21),
        "lag less a sample": (abs(difference) <= sum_) & (difference <= sum_ - sum_ * LESS[v.size]),
    }
    return {name: bounds[name] for name in ("pole", "decay", "rate")}


def amplitude(v: Case, name: str, operation: Operation) -> Formulas:
    """Square of an amplitude, `(1 + square·lead²)/(1 + square·lag²)`."""
    parts = [of(v, v.run.abstraction.by_result[part.term.id()], "fmul") for part in operation.operands]
    (longer, above), (shorter, below) = ((of(v, part, "fmul"), part.result) for part in parts)
    lead, lag = longer.operands[0], shorter.operands[0]
    over, under = operation.operands
    return {
        f"{name}, lag": lag.within(0.0, 2.0**15),
        f"{name}, lead": (lag <= lead) & (lead <= 2.0**15),
        f"{name}, squares": (shorter.result >= 0.0)
        & (shorter.result <= longer.result)
        & (longer.result <= 2.0**30),
        f"{name}, squares of the phase": (below >= 0.0) & (below <= above) & (above <= 2.0**70),
        f"{name}, quotient": (under >= 1.0) & (under <= over) & (over <= 2.0**71),
        name: operation.result.within(1.0, 2.0**71),
    }


def gain_shows(v: Case) -> Formulas:
    quotient = v.made(v.after["out"].lead.gain)
    signal, divisor = quotient.operands
    root = of(v, v.made(divisor), "sqrt")
    added = v.made(root.operands[0])
    longer, shorter = (v.run.abstraction.by_result[part.term.id()] for part in added.operands)
    v.steps = {
        **amplitude(v, "amplitude at the whole delay", longer),
        **amplitude(v, "amplitude at the valve's delay", shorter),
        "added amplitude": added.result.within(2.0**-72, 2.0**72),
        "its root": root.result.within(2.0**-36, 2.0**36),
        "divisor": divisor >= 2.0**-43,
        "signal": signal.within(0.0, 2.0**40),
    }
    return {"gain": lead_bounds(v.after["out"].lead)["gain"]}


LEMMAS = [
    Lemma("learner, pole and rate of the lead network", "learner", configured, coefficients_show, Twin(without="lag"),
          refined=True, cut=estimates),
    Lemma("learner, gain of the lead network", "learner", configured, gain_shows, Twin(without="lead gain"), refined=True,
          cut=estimates),
]  # fmt: skip
