"""Findings against a test: one sentence for each exceeded limit of the rig's ``verdict`` section."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from eft import _native
from eft._display import shown
from eft._finding import GRADES, ROUNDED, Changes, Finding, Grade
from eft._findings_of_protection import of_protection
from eft._floors import floor_mass
from eft._force_loop import design_force_loop
from eft._native import Rig, stability_margin
from eft._status import Status

LARGEST_OF_STROKE = 0.95
"""Share of the stroke, and below of the stall force, that should not be exceeded."""
LARGEST_OF_STALL = 0.67

NO_FORCE = 1.0
"""Rms error over rms command of a force that stays zero."""

SAME_MASS = 1e-3
"""Relative difference up to which the masses of command and structure are the same."""

_FLOWS = ("velocity", "flow", "hydraulic power")
"""Demands of the same kind; only the largest of them is reported."""
_NAMED = 3
"""Largest number of names in the list of values that the controller does not have."""

SELF_CALIBRATION: Changes = (
    ("compensation.mode", "nonlinear"),
    ("compensation.adaptive", True),
    ("compensation.feedforward", True),
    ("compensation.look_ahead", True),
)


class Facts(NamedTuple):
    """The data for the verdict on a test, from a run or a row of a study."""

    rig: Rig
    sample_rate: float
    flags: Status
    metrics: Mapping[str, float]
    """Metrics of the actuator with the largest value; the lowest supply pressure; NaN if unknown."""
    peak_command: float
    """Largest force command, N."""
    peak_displacement: float
    """Largest displacement, m; NaN where unknown."""
    outside: bool = False
    """Whether an external structure replaced the rig's."""
    controlled: bool = False
    """Whether an external controller replaced the rig's; its margins are unknown."""
    mass: Any = None
    """Mass for which the command was made, kg; for a building one per floor."""
    floor: int | None = None
    """Number of the actuator of a building; None for all of them."""
    peak_force: float = np.nan
    """Largest force, N."""
    saturated: float = np.nan
    """Share of the samples in which the demand exceeds the valve's capacity."""
    stopped: float = np.nan
    """Share of the samples with the spool at its stop."""
    demands: tuple[Mapping[str, Any], ...] = ()
    """The demands of the command, if they were computed."""


def of_facts(facts: Facts) -> Iterator[Finding]:
    """Every finding on a test, causes before their effects."""
    yield from _mass(facts)
    yield from _reach(facts)
    yield from _supply(facts)
    if not facts.controlled:
        yield from of_loop(facts.rig, facts.sample_rate, facts.outside)
        yield from of_protection(facts.rig, facts.sample_rate, facts.outside, facts.floor)
    yield from _opening(facts)
    yield from _oscillation(facts)
    yield from _errors(facts)


def worst(grades: Iterable[Grade]) -> Grade:
    """The worst of some grades."""
    return max(grades, key=GRADES.index, default="go")


def above(rig: Rig, name: str, value: float) -> Grade | None:
    """The worse grade whose limit a value exceeds."""
    grades: tuple[Grade, ...] = ("no", "caution")
    return next((grade for grade in grades if value > rig[f"verdict.{grade}.{name}"]), None)


def below(rig: Rig, name: str, value: float) -> Grade | None:
    """The worse grade whose limit a value falls short of."""
    grades: tuple[Grade, ...] = ("no", "caution")
    return next((grade for grade in grades if value < rig[f"verdict.{grade}.{name}"]), None)


def of_demand(name: str, unit: str, required: float, available: float, advised: float) -> Finding | None:
    """The finding on one demand of a command, if it exceeds a limit."""
    form = shown(unit or "ratio")
    told = name[:1].upper() + name[1:]
    if required > available:
        sentence = f"{told} exceeds the rig's capacity: {form(required)} of {form(available)}."
        return Finding("no", sentence)
    if required > advised:
        sentence = f"{told} exceeds the advised limit: {form(required)} of {form(advised)}."
        return Finding("caution", sentence)
    return None


def of_size(rig: Rig, peak: float) -> Iterator[Finding]:
    """A caution about a command, with a peak in N, whose force is lost in friction and errors of sensors."""
    least = _native.smallest_force(rig)
    if 0.0 < peak < ROUNDED * least:
        form = shown("force")
        yield Finding(
            "caution",
            f"The command reaches {form(peak)}, advised at least {form(least)}: friction, and noise and "
            "accuracy of the load cell, hide a smaller force. Check the unit of the record, the mass and the "
            "scale.",
        )


def of_demands(demands: Iterable[Mapping[str, Any]]) -> Iterator[Finding]:
    """The findings on demands; only the largest of velocity, flow and power counts."""
    demands = list(demands)
    flows = [one for one in demands if one["name"] in _FLOWS]
    most = max(flows, key=lambda one: one["required"] / one["available"], default=None)
    for one in demands:
        if (one not in flows or one is most) and (found := of_demand(**one)):
            yield found


def _mass(facts: Facts) -> Iterator[Finding]:
    """A caution about a command for a mass other than that of the structure."""
    if facts.mass is None:
        return
    own = np.asarray(floor_mass(facts.rig))
    if own.ndim and facts.floor is not None:
        own = own[facts.floor]
    made_for = np.asarray(facts.mass)
    if made_for.shape == own.shape and np.allclose(made_for, own, rtol=SAME_MASS, atol=0.0):
        return
    masses = f"{_masses(made_for)}, and the rig's structure has {_masses(own)}"
    yield Finding("caution", f"The command is the effective force of {masses}.")


def _masses(values: Any) -> str:
    unit = shown("mass")
    return " and ".join(f"{mass * unit.factor:.6g}" for mass in np.atleast_1d(values)) + f" {unit.unit}"


def _reach(facts: Facts) -> Iterator[Finding]:
    # A floor alone may have a small command, which is part of a larger one.
    if facts.floor is None:
        yield from of_size(facts.rig, facts.peak_command)
    actuator = facts.rig.plant
    stall = actuator["actuator.piston_area"] * actuator["supply.pressure"]
    stroke = actuator["actuator.stroke"]
    for name, unit, value, most, share in (
        ("force", "N", facts.peak_command, stall, LARGEST_OF_STALL),
        ("displacement", "m", facts.peak_displacement, stroke, LARGEST_OF_STROKE),
    ):
        left = facts.flags & Status.STROKE_EXCEEDED and name == "displacement"
        if not left and (found := of_demand(name, unit, value, most, share * most)):
            yield found


def of_loop(rig: Rig, rate: float, outside: bool = False) -> Iterator[Finding]:
    """Stability and margins about rest, after the calibration or after a guard on an unstable loop."""
    learns = rig["compensation.adaptive"]
    guards = rig["compensation.guard"] and not learns
    names = ("level_margin", "dead_time", "gain_margin")
    level, dead_time, gain = (
        max(rig[f"verdict.{grade}.{name}"] for grade in ("caution", "no")) for name in names
    )
    try:
        judged = _native.learned(rig, rate) if learns else rig
        growth, within = _native.margins_within(judged, rate, level, dead_time, gain, "steeper")
        first = _native.margins_within(rig, rate, 1.0, -1.0, 1.0, "steeper") if learns else (growth, within)
        if guards and within is None:
            reduced = _native.guarded(rig, rate)
            guards = reduced is not None
            if reduced is not None:
                growth, within = _native.margins_within(reduced, rate, level, dead_time, gain, "steeper")
    except ValueError:
        return  # there is no linear model: too many delays, or no slope at rest
    if not outside and None in (first[1], within):
        yield _unstable(rig, rate, first[0], growth if learns or guards else None)
    if within is None:
        return
    level, dead_time, gain = within
    if (grade := below(rig, "gain_margin", gain)) is not None:
        yield Finding(
            grade,
            f"The gain margin of the force loop is {gain:.2f} ({20 * np.log10(gain):.1f} dB), advised at "
            f"least {rig['verdict.caution.gain_margin']:.2f}.",
            better_loop(rig, gain),
        )
    if (grade := below(rig, "dead_time", dead_time)) is not None:
        yield Finding(
            grade,
            f"The loop is unstable with {1e3 * dead_time:.2g} ms more of dead time, advised at least "
            f"{1e3 * rig['verdict.caution.dead_time']:.2g} ms.",
            better_loop(rig, gain),
        )
    guarded = guards and first[1] is None
    if not (learns or guarded or outside) and (grade := below(rig, "level_margin", level)) is not None:
        yield Finding(
            grade,
            f"The largest stable level is {level * rig['compensation.level']:.4f}: the flow gain must be "
            "known this accurately.",
            SELF_CALIBRATION,
        )


def _unstable(rig: Rig, rate: float, growth: float, sound: float | None) -> Finding:
    """The finding on an unstable loop; `sound` is its growth after calibration or guard."""
    at = f"at {rate:g} Hz"
    learns = rig["compensation.adaptive"]
    if sound is not None and sound > 0.0:
        after = "after self-calibration" if learns else "at the level to which the guard reduces it"
        sentence = f"The loop is unstable {at} even {after}: it grows at {sound:.3g} 1/s."
        return Finding("no", sentence, better_loop(rig, None))
    if sound is not None:
        before = "self-calibration" if learns else "the guard acts"
        sentence = f"Before {before} the loop is unstable {at}: it grows at {growth:.3g} 1/s."
        return Finding("caution", sentence, () if learns else SELF_CALIBRATION)
    try:
        stability_margin(rig, sampled=True, sample_rate=rate, flow_gain="steeper")
    except ValueError:
        return Finding(
            "no",
            f"The loop is unstable {at}: it grows at {growth:.3g} 1/s, and no compensation level from 0 to "
            "10 makes the loop stable.",
            better_loop(rig, None),
        )
    return Finding("no", f"The loop is unstable {at}: it grows at {growth:.3g} 1/s.", SELF_CALIBRATION)


def better_loop(rig: Rig, gain: float | None) -> Changes:
    """A force loop with more margin: the designed one, or lower gains if there is no design."""
    if rig["controller.force_loop"] == "robust":
        return ()
    try:
        design_force_loop(rig)
    except ValueError:
        if gain is None or not np.isfinite(gain):
            return ()
        factor = float(f"{0.95 * gain / rig['verdict.caution.gain_margin']:.2g}")
        if factor >= 1.0:
            return ()
        keys = ("controller.proportional_gain", "controller.derivative_gain")
        return tuple((key, float(f"{factor * rig[key]:.6g}")) for key in keys)
    return (("controller.force_loop", "robust"),)


def _supply(facts: Facts) -> Iterator[Finding]:
    yield from of_supply(facts.rig, facts.metrics["min_supply_pressure"], facts.demands)


def of_supply(rig: Rig, lowest: float, demands: Iterable[Mapping[str, Any]]) -> Iterator[Finding]:
    """The finding on a supply whose pressure falls to a lowest one, Pa."""
    share = lowest / rig["supply.pressure"]
    if (grade := below(rig, "supply_pressure", share)) is not None:
        mean = [one for one in demands if one["name"] == "mean flow of the pump"]
        part, needed = "pump or accumulator is", ""
        if mean:
            short = mean[0]["required"] > mean[0]["available"]
            part = "the pump is" if short else "the accumulator is"
            needed = (
                f" The pump must deliver {shown('flow')(mean[0]['required'])} on average." if short else ""
            )
        sentence = (
            f"The supply pressure falls to {share:.0%} of the configured one: {part} too small.{needed}"
        )
        yield Finding(grade, sentence, (("compensation.supply_correction", True),))


def _opening(facts: Facts) -> Iterator[Finding]:
    opening, advised = facts.metrics["max_spool"], facts.rig["limits.spool_warning"]
    if facts.flags & (Status.SPOOL_STOP | Status.DEMAND_SATURATED):
        useless = facts.metrics["nrmse"] > facts.rig["verdict.caution.force_error"]
        share = "" if np.isnan(facts.saturated) else f" in {facts.saturated:.1%} of the samples"
        sentence = f"The demand exceeds the valve's capacity{share}. {_larger_valve(facts)}."
        yield Finding("no" if useless else "caution", sentence)
    elif opening > advised:
        yield Finding("caution", f"The spool opens to {opening:.0%}, advised at most {advised:.0%}.")


def _larger_valve(facts: Facts) -> str:
    """The reason for a valve at its stops, and a remedy."""
    opening = next((one["required"] for one in facts.demands if one["name"] == "spool opening"), np.nan)
    if opening <= 1.0:
        return f"The command needs an opening of {opening:.0%}, and the controller demands the rest"
    # Beyond full opening the demand is proportional to the flow.
    flow = f"{max(opening, 1.01):.3g} times its flow" if opening > 1.0 else "more flow"
    return f"The valve is too small for this command. A valve with {flow} helps, or a smaller command"


def _oscillation(facts: Facts) -> Iterator[Finding]:
    """A limit cycle of the oil column."""
    share = facts.metrics["oscillation"]
    if (grade := above(facts.rig, "oscillation", share)) is not None:
        sentence = (
            f"The force oscillates between 30 and 150 Hz by {share:.0%} of the command (rms): the oil column."
        )
        yield Finding(grade, sentence, better_loop(facts.rig, None))


def _errors(facts: Facts) -> Iterator[Finding]:
    rig, error = facts.rig, facts.metrics["nrmse"]
    unknown = _unknown(rig)
    if error >= NO_FORCE:
        form = shown("force")
        stops = (
            f", with the spool at its stop in {facts.stopped:.0%} of the samples" if facts.stopped > 0 else ""
        )
        sentence = (
            f"The force error is {error:.0%} (rms), larger than without any force. The force reaches "
            f"{form(facts.peak_force)} under a command of {form(facts.peak_command)}{stops}.{unknown}"
        )
        yield Finding("no", sentence, SELF_CALIBRATION)
        return
    if grade := above(rig, "force_error", error):
        allowed = rig[f"verdict.{grade}.force_error"]
        sentence = f"The force misses the command by {error:.1%} (rms), more than {allowed:.0%}.{unknown}"
        yield Finding(grade, sentence, SELF_CALIBRATION)
        unknown = ""
    # For an external structure the ideal motion is unknown.
    motion = facts.metrics["displacement_error"]
    if not facts.outside and (grade := above(rig, "displacement_error", motion)):
        allowed = rig[f"verdict.{grade}.displacement_error"]
        sentence = (
            f"The displacement misses the ideal one by {motion:.1%} (rms), more than {allowed:.0%}.{unknown}"
        )
        yield Finding(grade, sentence, SELF_CALIBRATION)


def _unknown(rig: Rig) -> str:
    """True values of the plant that the controller does not have."""
    tree = rig.to_dict()
    found = dict(_leaves(tree.get("truth", {})))
    if rig["servovalve.flow_gain_scale"] != 1.0:
        found.setdefault("servovalve.flow_gain_scale", rig["servovalve.flow_gain_scale"])
    if rig["servovalve.true_flow_table"] is not None:
        found.setdefault("servovalve.true_flow_table", "…")
    if not found:
        return ""
    named = [f"{key} = {value}" for key, value in list(found.items())[:_NAMED]]
    return f" Unknown to the controller: {', '.join(named)}{', …' if len(found) > _NAMED else ''}."


def _leaves(tree: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in tree.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{above}{name}.")
        else:
            yield f"{above}{name}", "…" if isinstance(value, list) else value
