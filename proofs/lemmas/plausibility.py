"""The plausibility watch, in the whole tick."""

from __future__ import annotations

from lemma import Case, Formulas, Lemma, Twin
from terms import Bool, Float, all_of

from lemmas.bounds import untouched

#: Upper limit of the counts.
MOST = 1 << 20
SIGNALS = range(4)
#: All but those of motion and ratio, whose limits increase with the motion.
SUMS = (0, 1, 3, 4, 6)
READINGS = ("force", "displacement", "velocity", "spool")


def counts(watch) -> Bool:
    signals = [watch.signals[n] for n in SIGNALS]
    return all_of((signal.lost <= MOST) & (signal.repeats <= MOST) for signal in signals)


def sums(v: Case, watch) -> Bool:
    """Between 0 and twice their limit."""
    limits = v.config.plausibility.Some.__0.limit
    most = {n: v.run.compute("fmul", limits[n], Float.of(2.0, v.size)) for n in SUMS}
    return all_of(
        sum_.within(0.0, most[n]) for n in SUMS for sum_ in (watch.sums[n].above, watch.sums[n].below)
    )


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
        "limits": all_of(c.plausibility.Some.__0.limit[n].within(0.0, 1e30) for n in SUMS),
    }


def shows(v: Case) -> Formulas:
    before, after = v.state.plausibility, v.after["state"].plausibility
    said = {
        "counts stay bounded": counts(after),
        "a distrusted sensor stays distrusted": all_of(
            before.distrusted[n].same(1).implies(after.distrusted[n].same(1)) for n in SIGNALS
        ),
        "the blame of a balance stays": before.by_balance.same(1).implies(after.by_balance.same(1)),
        "a failed pressure stays failed": before.load_pressure.failed.same(1).implies(
            after.load_pressure.failed.same(1)
        ),
    }
    for n, reading in enumerate(READINGS):
        lost = getattr(v.input, reading).is_nan()
        signal, left = before.signals[n], after.signals[n]
        counted = tuple(
            f"plausibility.signals.{n}.{name}" for name in ("lost", "jumps", "returned", "jumped")
        )
        said[f"{reading}: NaN leaves the state of its gate"] = lost.implies(untouched(signal, left, counted))
    return said


def sums_shows(v: Case) -> Formulas:
    before, after = v.state.plausibility, v.after["state"].plausibility
    # Where the velocity is estimated, a lost reading of it does not matter.
    lost = v.input.force.is_nan() | v.input.displacement.is_nan() | v.input.spool.is_nan()
    return {
        "a lost reading leaves them": lost.implies(untouched(before.sums, after.sums)),
        "they stay bounded": sums(v, after),
    }


LEMMAS = [
    Lemma("plausibility watch, counts and latches", "channel", given, shows, Twin(without="counts"), refined=True),
    Lemma("plausibility watch, sums", "channel", given, sums_shows, Twin(without="sums"), refined=True),
]  # fmt: skip
