"""The plausibility watch, in the whole tick."""

from __future__ import annotations

from lemma import Case, Formulas, Lemma, Twin
from terms import Bool, Float, all_of

from lemmas.bounds import untouched

#: Upper limit of the counts.
MOST = 1 << 20
SIGNALS = range(4)
#: All but those of travel and ratio, whose limits increase with the motion.
SUMS = (
    ("balance", "slow"),
    ("balance", "fast"),
    ("balance", "wrong_sign"),
    ("stroke", "difference"),
    ("stroke", "against"),
)
READINGS = ("force", "displacement", "velocity", "spool")


def counts(watch) -> Bool:
    signals = [watch.signals[n] for n in SIGNALS]
    return all_of((signal.lost <= MOST) & (signal.repeats <= MOST) for signal in signals)


def named(watch) -> list:
    """The sums, or their limits."""
    return [getattr(getattr(watch, part), name) for part, name in SUMS]


def summed(watch) -> list:
    """All sums."""
    return [*named(watch), watch.motion.travel, watch.motion.ratio]


def sums(v: Case, watch) -> Bool:
    """Between 0 and twice their limit."""
    two, limits = Float.of(2.0, v.size), named(v.config.plausibility.Some.__0)
    most = [v.run.compute("fmul", limit, two) for limit in limits]
    sides = [(sum_.above, sum_.below) for sum_ in named(watch)]
    return all_of(side.within(0.0, limit) for pair, limit in zip(sides, most, strict=True) for side in pair)


def given(v: Case) -> Formulas:
    c = v.config
    return {
        "variants": (c.velocity.variant <= 3)
        & (c.stuck.variant <= 1)
        & (c.protection.variant <= 2)
        & (c.plausibility.variant <= 2),
        "digital": c.controller.realization.same(0) & c.realization.same(0),
        "counts": counts(v.state.plausibility),
        "sums": sums(v, v.state.plausibility),
        "limits": all_of(limit.within(0.0, 1e30) for limit in named(c.plausibility.Some.__0)),
    }


def shows(v: Case) -> Formulas:
    before, after = v.state.plausibility, v.after["state"].plausibility
    said = {
        "counts stay bounded": counts(after),
        "a distrusted sensor stays distrusted": all_of(
            before.distrusted[n].same(1).implies(after.distrusted[n].same(1)) for n in SIGNALS
        ),
        "the blame of a balance stays": before.balance_blame.same(1).implies(after.balance_blame.same(1)),
        "a failed pressure stays failed": before.load_pressure.failed.same(1).implies(
            after.load_pressure.failed.same(1)
        ),
    }
    for n, reading in enumerate(READINGS):
        lost = getattr(v.input, reading).is_nan()
        signal, left = before.signals[n], after.signals[n]
        counted = tuple(
            f"plausibility.signals.{n}.{name}" for name in ("lost", "jumps", "confirmed", "jumped")
        )
        said[f"{reading}: NaN leaves the state of its gate"] = lost.implies(untouched(signal, left, counted))
    return said


def sums_shows(v: Case) -> Formulas:
    before, after = v.state.plausibility, v.after["state"].plausibility
    # Where the velocity is estimated, a lost reading of it does not matter. After a failed displacement the flows are
    # still compared.
    displacement, failed = v.input.displacement.is_nan(), before.distrusted[1].same(1)
    lost = v.input.force.is_nan() | v.input.spool.is_nan() | (displacement & ~failed)
    return {
        "a lost reading leaves them": lost.implies(
            all_of(untouched(*pair) for pair in zip(summed(before), summed(after), strict=True))
        ),
        "a lost displacement leaves those of the motion": displacement.implies(
            untouched(before.motion.travel, after.motion.travel)
            & untouched(before.motion.ratio, after.motion.ratio)
        ),
        "they stay bounded": sums(v, after),
    }


LEMMAS = [
    Lemma("plausibility watch, counts and latches", "channel", given, shows, Twin(without="counts"), refined=True),
    Lemma("plausibility watch, sums", "channel", given, sums_shows, Twin(without="sums"), refined=True),
]  # fmt: skip
