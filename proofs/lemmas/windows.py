"""The sums of a window, the learner's input, in the whole tick."""

from __future__ import annotations

from lemma import Case, Formulas, Lemma, Twin
from terms import Bool, Float, Word, all_of

from lemmas.bounds import LARGEST, is_set
from lemmas.tick import channel_given

#: No signal is larger: the least power of two above `LARGEST`.
SIGNAL = 2.0**40
#: As validated (N).
LARGEST_FRICTION = 1e9
#: Ticks of the longest window.
TICKS = 1024
SUMS = ("force", "spool", "command", "valve_command", "spool_without_command")


def bounded(v: Case, state, names: tuple[str, ...] = SUMS) -> Formulas:
    """Each sum is at most its number of ticks times the largest signal; that product is exact."""
    ticks: Word = v.config.window_ticks - state.ticks_left
    most = ticks.as_number(v.size) * Float.of(SIGNAL, v.size)
    return {f"sum of {name}": abs(getattr(state.window.sums, name)) <= most for name in names}


def given(v: Case) -> Formulas:
    c = v.config
    ranges = c.controller.compensation
    return {
        **channel_given(v),
        "ticks of a window": (c.window_ticks >= 1) & (c.window_ticks <= TICKS),
        "ticks left": v.state.ticks_left <= c.window_ticks,
        "ranges": (ranges.force_range <= LARGEST) & (ranges.spool_range <= LARGEST),
        "friction": c.controller.friction.force.within(0.0, LARGEST_FRICTION),
        "largest valve command": c.controller.limiter.amplitude <= LARGEST,
        "sums": all_of(bounded(v, v.state).values()),
    }


def shows(v: Case) -> Formulas:
    after = v.after["state"]
    return {
        "ticks left": after.ticks_left <= v.config.window_ticks,
        **bounded(v, after),
    }


def tripped(state) -> Bool:
    """Whether a distrusted sensor has tripped the protection."""
    distrusted = state.plausibility.distrusted
    return all_of(distrusted[n].same(1).implies(is_set(state.protection.tripped)) for n in range(4))


def velocity_given(v: Case) -> Formulas:
    c = v.config
    return {
        **given(v),
        "sums": all_of(bounded(v, v.state, ("velocity",)).values()),
        "velocity range": c.controller.compensation.velocity_range <= LARGEST,
        # `Channel::new` makes the watch of a protection only.
        "watch": (c.plausibility.variant <= 1).implies(c.protection.variant <= 1),
        "distrust": tripped(v.state),
    }


def velocity_shows(v: Case) -> Formulas:
    after = v.after["state"]
    return {
        "a distrusted sensor has tripped": (v.config.plausibility.variant <= 1).implies(tripped(after)),
        **bounded(v, after, ("velocity",)),
    }


LEMMAS = [
    Lemma("window, sums", "channel", given, shows, Twin(without="ranges"), refined=True),
    Lemma("window, sum of velocities", "channel", velocity_given, velocity_shows, Twin(without="distrust"), refined=True,
          hard=True),
]  # fmt: skip
