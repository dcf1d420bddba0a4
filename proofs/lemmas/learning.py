"""The learner."""

from __future__ import annotations

from lemma import Case, Formulas, Lemma, Twin
from terms import Bool, Float, Word

from lemmas.bounds import LARGEST, lead_bounds, nothing, untouched

#: Bounds of each gain (1), and the longest delay (s), that `Learner::new` accepts.
GAINS = (0.01, 100.0)
LONGEST = 10.0
#: Longest lag of the lead network (samples): its pole stays below 1 in single precision.
LAG = 2.0**20
#: Largest share of the velocity's delay that is added for the phase of the lead network.
LARGEST_DEFICIT = 0.5
#: Lowest level of the guard (1), farthest known null bias (1), null offset beyond it (1), and asymmetry (1).
LEVEL = 0.5
KNOWN_NULL = 0.5
NULL = 0.05
ASYMMETRY = 0.3


def larger(a: Float, b) -> Float:
    b = Float.of(b, a.size) if isinstance(b, float) else b
    return (a > b).pick(a, b)


def smaller(a: Float, b) -> Float:
    b = Float.of(b, a.size) if isinstance(b, float) else b
    return (a < b).pick(a, b)


def control_shows(v: Case) -> Formulas:
    c, s, after, out = v.config, v.state, v.after["state"], v.after["out"]
    lost = ~v.window.lost.same(0)
    fixed = c.adapts.same(0)
    kept, left = s.evidence, after.evidence
    null_offset = v.run.compute("fadd", c.curve.known_null, left.curve.null)
    return {
        "the calibration is that of the window": out.window.same(v.window.number),
        "without adaptation the estimates keep their bits": fixed.implies(
            untouched(s.flow, after.flow) & untouched(s.valve.found, after.valve.found)
        ),
        "without adaptation the sums keep their bits": fixed.implies(untouched(s.evidence, after.evidence)),
        "a window with a lost sample leaves the sums": lost.implies(
            untouched(kept, left, ("evidence.curve.asymmetry", "evidence.curve.null"))
        ),
        "without the guard the level keeps its bits": c.guards.same(0).implies(
            s.guard.level.same(after.guard.level)
        ),
        "the estimates are published bit for bit": out.flow_gain.same(after.flow.gain.value)
        & out.valve_gain.same(after.valve.found.gain.value)
        & out.response_delay.same(after.valve.found.delay.value)
        & out.level.same(after.guard.level),
        "the null offset is published beyond the known bias": out.null_offset.same(null_offset),
    }


def corrects_given(v: Case) -> Formulas:
    return {"corrects": (v.config.corrects <= v.config.adapts)}


def start(priors) -> dict[str, tuple]:
    """The estimates' bounds: those of the configuration, and the value at the start, which may lie outside them."""
    (least, most), (shortest, longest) = (
        (range_.bounds[0], range_.bounds[1]) for range_ in (priors.gain, priors.delay)
    )
    nominal = priors.nominal_delay
    return {
        "gain": (smaller(least, 1.0), larger(most, 1.0)),
        "delay": (smaller(shortest, nominal), larger(longest, nominal)),
    }


def longest(v: Case) -> tuple[Float, Float]:
    """The longest delay of a lead network (s), for valve, velocity and phase, and the network's lag (s)."""
    valve, late = v.config.valve, start(v.config.flow.priors)["delay"][1]
    both = v.run.compute("fadd", start(valve.priors)["delay"][1], late)
    added = v.run.compute("fmul", Float.of(LARGEST_DEFICIT, v.size), late)
    delay = v.run.compute("fadd", both, added)
    return delay, v.run.compute("fmul", valve.lag_per_delay, delay)


def configured(v: Case) -> Formulas:
    """As `Learner::new` leaves it, by the Rust test `what_the_proofs_take_for_granted`."""
    flow, valve = v.config.flow.priors, v.config.valve.priors
    sample = v.config.valve.sample
    given = {
        "sample": sample.within(1e-13, 0.0051),
        "lowest level": v.config.guard.lowest.equals(LEVEL),
        "lead gain": v.config.valve.lead_gain.within(0.0, LARGEST),
        "lag per delay": v.config.valve.lag_per_delay.within(2.0**-9, 2.0**11),
        "share of the phase": v.config.valve.phase_deficit.within(0.0, 2.0**21),
        "null gain": v.config.null_gain.within(0.0, LARGEST),
        "known null bias": abs(v.config.curve.known_null) <= KNOWN_NULL,
        "its signal": abs(v.config.known_signal) <= LARGEST,
        "null change": v.config.curve.null_change.within(0.0, 1.0),
        "asymmetry change": v.config.curve.change.within(0.0, 1.0),
        **{f"configured {name}": formula for name, formula in lead_bounds(v.config.lead).items()},
    }
    for name, priors in (("flow", flow), ("valve", valve)):
        for kind, range_ in (("gain", priors.gain), ("delay", priors.delay)):
            given[f"{name} {kind} range"] = (range_.bounds[0] <= range_.bounds[1]) & range_.change.within(
                0.0, 100.0
            )
        lowest, highest = GAINS
        given[f"{name} gain"] = (priors.gain.bounds[0] >= lowest) & (priors.gain.bounds[1] <= highest)
    shortest, slowest = start(valve)["delay"]
    given["response delay"] = (shortest >= sample + sample) & (slowest <= LONGEST)
    least, most = start(flow)["delay"]
    given["velocity delay"] = (least >= -LONGEST) & most.within(0.0, 2.0 * LONGEST + 1.0)
    _, lag = longest(v)
    given["lag"] = lag <= sample * LAG
    return given


def kept(v: Case, state) -> Formulas:
    """What each window keeps."""
    said = {
        "level": state.guard.level.within(LEVEL, 1.0),
        "null offset": abs(state.evidence.curve.null) <= NULL,
        "asymmetry": abs(state.evidence.curve.asymmetry) <= ASYMMETRY,
    }
    for name, priors, found in (
        ("flow", v.config.flow.priors, state.flow),
        ("valve", v.config.valve.priors, state.valve.found),
    ):
        for kind, (lowest, highest) in start(priors).items():
            said[f"{name} {kind}"] = getattr(found, kind).value.within(lowest, highest)
    return said


def estimates_given(v: Case) -> Formulas:
    # Checkpoints keep evidence, and a rejection restores it.
    before = kept(v, v.state)
    for name, checkpoint in (("first", v.state.checkpoints.first), ("second", v.state.checkpoints.second)):
        before[f"{name} null offset"] = abs(checkpoint.curve.null) <= NULL
        before[f"{name} asymmetry"] = abs(checkpoint.curve.asymmetry) <= ASYMMETRY
    return {**configured(v), **{f"before: {name}": formula for name, formula in before.items()}}


def estimates_shows(v: Case) -> Formulas:
    out = v.after["out"]
    return {
        **{f"kept: {name}": formula for name, formula in kept(v, v.after["state"]).items()},
        "reciprocal of the flow gain": out.per_flow_gain.within(2.0**-7, 2.0**7),
        "null offset": abs(out.null_offset) <= KNOWN_NULL + NULL,
        "null signal": out.null_signal.is_finite(),
    }


def published_shows(v: Case) -> Formulas:
    """Each scalar of the calibration is stored bit for bit in the place that is not in use, or it has no effect."""
    before, after = v.state, v.after["state"]
    age = before.window.number - v.calibration.window
    other_test = age > Word.of(2**31 - 1, 4)
    put = Bool(True)
    for path, value in v.calibration.all().items():
        slots = [after.calibrations[n].all()[f"calibrations.{n}.{path}"] for n in range(2)]
        put = put & (value.same(slots[0]) | value.same(slots[1]))
    used = after.in_use.slot.__0 & 1
    kept_ = [used.same(n).implies(untouched(before.calibrations[n], after.calibrations[n])) for n in range(2)]
    return {
        "the calibration is put in one place": put | other_test,
        "one of another test changes nothing": other_test.implies(untouched(before, after)),
        "the one in use keeps its bits": kept_[0] & kept_[1],
        "the controller keeps its state": untouched(before.controller, after.controller),
        "the protection keeps its state": untouched(before.protection, after.protection),
    }


LEMMAS = [
    Lemma("publication", "publish", nothing, published_shows, Twin(swap=("xor", "or")), refined=True),
    Lemma("learner, any state and window", "learner", corrects_given, control_shows, Twin(without="corrects"), refined=True),
    Lemma("learner, estimates", "learner", estimates_given, estimates_shows, Twin(without="before: valve delay"), refined=True),
]  # fmt: skip
