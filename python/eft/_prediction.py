"""Findings on the errors of a test that the linear model predicts before it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from eft import _native
from eft._display import shown
from eft._finding import Finding, Grade
from eft._findings import above, worst
from eft._native import Command, Rig

NOTICED = 5e-4
"""Difference of two delays, s, that is worth a remark."""

_LARGEST_ERROR = 10.0
"""Largest error, rms over rms, that a sentence states."""
_LEAST_PRESSURE = 0.01
"""Share of the supply pressure that a prediction needs at least."""


class PredictedError(NamedTuple):
    """One error and its parts, rms over rms."""

    whole: float
    """All parts together."""
    noise: float
    """The part by noise of the sensors and resolution of the converters."""
    constant: float
    """The part by constant causes: biases, and a null that the controller does not know."""


class Prediction(NamedTuple):
    """Errors of force and displacement at small motion, of the actuator with the largest."""

    force: PredictedError
    """Of the force, against the command."""
    displacement: PredictedError
    """Of the displacement, against the ideal one."""
    oscillation: PredictedError
    """Of the force above 30 Hz, where the oil column oscillates."""
    constants: dict[str, float]
    """Keys of constant causes, with the rms of the force in N."""
    null_learned: bool
    """Whether the controller learns the null, and a bias of the velocity with it, during the test."""
    overlap: float
    """An overlap for which the controller compensates, over the rms opening."""
    play: tuple[float, float]
    """Force error by the play of the attachment, about, rms over rms, and the amplitude in N of the
    oscillation that it sustains where the command is small."""
    unreached: tuple[tuple[str, float, float], ...]
    """What self-calibration needs, and the nearest that it reaches; delays in s. Flow and valve gain over the
    configured ones, where it rejects them or noise may make it reject them."""
    left_out: tuple[str, ...]
    """What is not contained: keys of the rig, and the command above 20 or 100 Hz."""


def predicted(rig: Rig, command: Command) -> Prediction | None:
    """The errors of a test, with its self-calibration; None where the linear model has none."""
    found = _native.predicted_errors(rig, command)
    if found is None:
        return None
    return Prediction(
        PredictedError(**found["force"]),
        PredictedError(**found["displacement"]),
        PredictedError(**found["oscillation"]),
        dict(found["constants"]),
        found["null_learned"],
        found["overlap"],
        found["play"],
        tuple(found["unreached"]),
        tuple(found["left_out"]),
    )


def of_prediction(rig: Rig, rate: float, found: Prediction) -> Iterator[Finding]:
    """A finding for each predicted error beyond a limit, and their cause."""
    grades: list[Grade] = []
    constant = False
    for error, name, told in (
        (found.displacement, "displacement_error", "The displacement will miss the ideal one"),
        (found.force, "force_error", "The force will miss the command"),
    ):
        if (grade := above(rig, name, error.whole)) is not None:
            grades.append(grade)
            constant |= 2.0 * error.constant**2 > error.whole**2
            allowed = rig[f"verdict.{grade}.{name}"]
            by = _by_noise(error)
            sentence = (
                f"{told} by {_size(error.whole, 1)} (rms) at small motion{by}, more than {allowed:.0%}."
            )
            yield Finding(grade, sentence)
    if (grade := above(rig, "oscillation", found.oscillation.whole)) is not None:
        size = _size(found.oscillation.whole, 0)
        sentence = (
            f"The force will miss the command by {size} (rms) above 30 Hz, where the oil column oscillates"
            f"{_by_noise(found.oscillation)}."
        )
        yield Finding(grade, sentence)
    if constant:
        yield Finding(worst(grades), _of_constant(rig, found))
    if above(rig, "force_error", found.overlap) is not None:
        sentence = (
            f"The overlap is {found.overlap:.0%} of the rms opening. The spool crosses it late, although the "
            "controller knows it, which makes a force error of half to two and a half times this size."
        )
        yield Finding("caution", sentence)
    crossed, oscillation = found.play
    if above(rig, "force_error", crossed) or above(rig, "oscillation", crossed):
        size = f"{1e3 * rig.plant['actuator.attachment_play']:.2g} mm"
        lasts = f", and an oscillation of about {shown('force')(oscillation)} where the command is small"
        sentence = (
            f"The play of {size} between piston and structure makes a force error of about {crossed:.0%}"
            f"{lasts if oscillation else ''}."
        )
        yield Finding("caution", sentence)
    path = _native.delay_budget(rig, rate)["path"]
    lead = rig["compensation.response_delay"] + rig["compensation.velocity_delay"]
    late = rig["compensation.mode"] != "off" and path > lead + NOTICED
    if grades and late and not rig["compensation.adaptive"]:
        sentence = (
            f"Velocity, controller and valve are late by {1e3 * path:.2g} ms, and the lead network "
            f"compensates for {1e3 * lead:.2g} ms."
        )
        yield Finding(worst(grades), sentence)
    if grades:
        unreached = (one for one in found.unreached if one[0] != "doubtful")
        yield from (Finding(worst(grades), _of_unreached(rig, rate, *one)) for one in unreached)


def _size(error: float, digits: int) -> str:
    """An error in per cent, with so many digits after the point."""
    return f"{error:.{digits}%}" if error <= _LARGEST_ERROR else f"more than {_LARGEST_ERROR:.0%}"


def _by_noise(error: PredictedError) -> str:
    """The main cause of an error, if it is noise."""
    return ", mostly by noise and resolution of its sensors" if 2.0 * error.noise**2 > error.whole**2 else ""


def _of_unreached(rig: Rig, rate: float, what: str, needed: float, nearest: float) -> str:
    """What self-calibration would need and does not reach."""
    if what == "rejected":
        return (
            f"The flow gain is {needed:.2f} and the valve gain {nearest:.2f} times the configured one. "
            "Self-calibration takes such a difference for the fault of a sensor, and learns nothing."
        )
    if what == "delay":
        bound = "longest" if needed > nearest else "shortest"
        samples = nearest * rate < 2.0 + 1e-6
        at = "two samples" if samples else f"compensation.learning.{bound}_delay"
        return (
            f"Self-calibration needs a response delay of {1e3 * needed:.2g} ms, and the {bound} that it "
            f"learns is {1e3 * nearest:.2g} ms ({at})."
        )
    key = f"compensation.learning.lowest_{what.replace(' ', '_')}"
    return (
        f"Self-calibration needs a {what} of {needed:.2f} times the configured one, and the lowest that it "
        f"learns is {nearest:.2f} ({key})."
    )


def of_distrust(rig: Rig, command: Command, found: Prediction) -> Iterator[Finding]:
    """A caution about gains that noise may make the learner reject, so that only its guard acts."""
    for _, flow, valve in (one for one in found.unreached if one[0] == "doubtful"):
        guarded = rig.replace({"compensation.adaptive": False, "compensation.guard": True})
        rejected = predicted(guarded, command)
        error = float("inf") if rejected is None else rejected.displacement.whole
        if error > found.displacement.whole and above(rig, "displacement_error", error) is not None:
            sentence = (
                f"The flow gain is {flow:.2f} and the valve gain {valve:.2f} times the configured one. With "
                "noise of its sensors self-calibration may take this for the fault of a sensor, and learn "
                f"nothing: the displacement then misses the ideal one by {_size(error, 0)} (rms). Configure "
                "the true gains."
            )
            yield Finding("caution", sentence)


def of_droop(rig: Rig, command: Command, lowest: float, found: Prediction) -> Iterator[Finding]:
    """A caution about a droop to this lowest pressure, Pa, that the controller does not know.

    A linear model has one pressure. At the lowest one the flow gain is that of the root of the pressure.
    """
    plant = rig.plant
    if plant["supply.droop"] is None or rig["compensation.supply_correction"]:
        return
    share = lowest / plant["supply.pressure"]
    flow_gain = max(share, _LEAST_PRESSURE) ** 0.5 * plant["servovalve.flow_gain_scale"]
    drooped = predicted(rig.replace({"truth.servovalve.flow_gain_scale": flow_gain}), command)
    if drooped is None:
        return
    error = drooped.displacement.whole
    if error > found.displacement.whole and above(rig, "displacement_error", error) is not None:
        sentence = (
            f"The supply droops to {share:.0%} of its pressure, and the controller does not know it: the "
            f"displacement may miss the ideal one by about {_size(error, 0)} (rms). "
            "compensation.supply_correction measures the pressure."
        )
        yield Finding("caution", sentence, (("compensation.supply_correction", True),))


def _of_constant(rig: Rig, found: Prediction) -> str:
    """The largest constant cause and its remedy."""
    key, force = max(found.constants.items(), key=lambda one: one[1])
    size = f"force of {1e-3 * force:.2g} kN"
    makes = f"makes a constant {size}"
    if found.null_learned and key != "sensors.force.bias":
        makes = f"makes a {size} (rms), most of it in the first second, until it is learned as the null"
    if key == "servovalve.null_bias":
        valve = rig.plant["servovalve"]
        true = valve["null_bias"] * valve["spool_sensitivity"] * valve["spool_stroke"]
        known = rig[key] / rig["compensation.valve_gain"]
        missed = f"The valve is at its true null with a command of {true:.2g} V, and the controller gives "
        own = rig["controller.realization"] == "digital" and rig["controller.integral_gain"] > 0.0
        if own or rig["controller.force_loop"] == "robust":
            return (
                f"{missed}{known:.2g} V: this makes a {size} (rms) until the integral part of the force loop "
                "has found the null. servovalve.null_bias tells it to the controller."
            )
        return (
            f"{missed}{known:.2g} V: this {makes}. An integral part (controller.integral_gain) of a digital "
            "force loop removes it."
        )
    sensor = key.split(".")[1]
    remedy = "" if sensor == "force" else ", or an integral part (controller.integral_gain) of a digital loop"
    return f"The bias of the {sensor} sensor {makes}. Setting it to zero before the test removes it{remedy}."
