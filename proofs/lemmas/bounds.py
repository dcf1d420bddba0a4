"""Bounds that several lemmas are given: those that the constructors validate (`error.rs`: LARGEST, SMALLEST, `positive`,
`within`, `range`), and for a state those that its own lemma shows to be kept."""

from __future__ import annotations

from lemma import Formulas
from terms import Bool, Word

LARGEST = 1e12
#: Largest gain of a lead network that a learner publishes; a configured one is at most `LARGEST`.
LEAD_GAIN = 2.0**84
#: The largest `f32`, which bounds a reading in either precision.
MOST = 3.4028234663852886e38
#: The end of a ramp.
FULL = 1 << 62

EVERYTHING = frozenset({"fmul", "fdiv", "fadd", "fsub", "sqrt", "fptosi"})


def nothing(v) -> Formulas:
    return {}


def lead_bounds(lead) -> Formulas:
    """As `LeadNetwork::new` leaves them, by the lemma on it."""
    return {
        "pole": lead.pole.within(-1.0, 1.0),
        "decay": lead.pole < 1.0,
        "rate": lead.rate.within(0.0, 1024.0),
        "gain": lead.gain.within(0.0, LEAD_GAIN),
    }


def washout_bound(size: int) -> float:
    """The size at which pole·washout loses more by rounding than the rate can add."""
    return 2.0**36 if size == 4 else 2.0**65


def limiter_bounds(limiter) -> Formulas:
    """As `Limiter::new` leaves them."""
    return {
        "amplitude": limiter.amplitude.within(0.0, MOST / 2.0),
        "change": limiter.change.within(0.0, MOST / 2.0),
    }


def level_order(limits) -> Bool:
    """As `Limit::new` leaves the levels of a signal."""
    return (limits.warning >= 0.0) & (limits.warning <= limits.trip) & (limits.trip <= LARGEST * 1.0001)


def protection_bounds(c) -> Formulas:
    return {
        "ramps": (c.rise.__0 <= FULL)
        & (c.fall.__0 <= FULL)
        & (c.shutdown_ramp.__0 <= FULL)
        & (c.settle_ramp.Some.__0.__0 <= FULL),
        "force levels": level_order(c.force),
        "lost_samples": c.lost_samples <= 100_000,
        "other levels": level_order(c.displacement) & level_order(c.velocity) & level_order(c.spool),
    }


def protection_state(s) -> Formulas:
    """The property that every step keeps."""
    return {
        "positions": (s.command_ramp.__0 <= FULL) & (s.valve_ramp.__0 <= FULL) & (s.settling.__0 <= FULL),
        "last command": abs(s.command) <= LARGEST,
    }


def is_set(latch) -> Bool:
    return ~(latch.set.same(0) & latch.unset.same(0xFFFFFFFF))


def untouched(before, after, but: tuple[str, ...] = ()) -> Bool:
    """Every bit of a struct except the named fields."""
    result = Bool(True)
    for path, value in before.all().items():
        if not path.startswith(but or ("\0",)):
            result = result & value.same(after.all()[path])
    return result


def raised(flags: Word, bit: int) -> Bool:
    return (flags & bit).same(bit)
