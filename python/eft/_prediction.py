"""The errors of a test, predicted with the linear model before it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eft import _native
from eft._findings import Finding, Grade, above, worst
from eft._learned import learned
from eft._native import Command, LinearModel, Rig

Array = NDArray[Any]
HIGHEST = 20.0
"""Highest frequency, Hz, of the prediction."""
MOST = 2000
"""Largest number of frequencies."""
FADED = 30.0
"""Factor by which the signals fade over a test."""
NOTICED = 5e-4
"""Difference of two delays, s, that is worth a remark."""


class Prediction(NamedTuple):
    """Errors of force and displacement at small motion, rms over rms, of the actuator with the largest."""

    whole: tuple[float, float]
    """Of the force against the command, and of the displacement against the ideal one."""
    noise: tuple[float, float]
    """The part of each that noise of the sensors and resolution of the converters cause."""
    null: tuple[float, float]
    """The part of each that a null of the valve causes where the controller does not expect it."""
    constant: float
    """Constant force, N, of that null."""
    left_out: tuple[str, ...]
    """Keys of the rig whose effect is not contained."""


def predicted(rig: Rig, command: Command) -> Prediction | None:
    """The errors of a test.

    With self-calibration they are those after it. None without a stable linear model, without a command below
    `HIGHEST`, with a guard alone, which changes the loop, or with self-calibration in a building, whose
    channels find different delays.
    """
    rate, learns = command.sample_rate, rig["compensation.adaptive"]
    if np.ndim(command.values) > 1 if learns else rig["compensation.guard"]:
        return None
    try:
        judged = learned(rig, rate) if learns else rig
        model = _native.linearize(judged, sampled=True, sample_rate=rate, flow_gain="mean")
        if not model.stable:
            return None
        deviations = _native.noise_deviations(judged, rate)
    except ValueError:
        return None  # there is no linear model: too many delays, or no slope at rest
    values = np.atleast_2d(command.values)
    samples = values.shape[1]
    # The signals fade in the transform, so that the motion at the end of a test does not return at its start.
    growth = FADED ** (np.arange(samples) / samples)
    band = 1 + min(int(HIGHEST * samples / rate), MOST, samples // 2)
    asked = np.fft.rfft(values / growth)[:, :band].T
    if not np.any(asked):
        return None
    angle = 2.0 * np.pi * np.arange(band) / samples
    per_command, moved = _responses(model, FADED ** (1.0 / samples) * np.exp(1j * angle))
    applied = np.einsum("fij,fj->fi", per_command, asked)
    # The forces that are asked for move the structure as a command that makes them.
    ideal = np.einsum("fij,fj->fi", moved, np.linalg.solve(per_command, asked[..., None])[..., 0])
    motion = np.einsum("fij,fj->fi", moved, asked)

    # The constant force of an unknown null adds to both. It acts as a command without feedforward.
    rests = judged.replace({"compensation.feedforward": False})
    model = _native.linearize(rests, sampled=True, sample_rate=rate, flow_gain="mean")
    known, true = null_commands(rig)
    per_volt = 1.0 / (rig["controller.proportional_gain"] * rig["controller.force_sensitivity"])
    unknown = np.full(len(values), (known - true) * per_volt)
    offset, away = (np.real(at_rest[0] @ unknown) for at_rest in _responses(model, np.ones(1)))

    def size(spectrum: Array, constant: Array | float = 0.0) -> Array:
        signal = growth * np.fft.irfft(spectrum.T, samples)
        return np.asarray(np.linalg.norm(signal + np.reshape(constant, (-1, 1)), axis=1))

    wanted = np.array([size(asked), size(ideal)])
    wanted[wanted == 0.0] = np.nan  # an actuator without a command
    missed = np.array([size(applied - asked, offset), size(motion - ideal, away)]) / wanted
    noise = np.sqrt(samples) * np.transpose(deviations) / wanted
    null = np.sqrt(samples) * np.abs([offset, away]) / wanted

    def largest(error: Array) -> tuple[float, float]:
        force, displacement = np.nanmax(error, axis=1)
        return float(force), float(displacement)

    whole = largest(np.hypot(missed, noise))
    left_out = [key for key in model.left_out if key != "servovalve.null_bias"]
    overlap = rig.plant["servovalve.overlap"]
    if overlap < 0.0 and overlap != rig["servovalve.overlap"]:
        # The model is that of a motion within an underlap, which the controller does not know.
        left_out.append("servovalve.overlap")
    return Prediction(whole, largest(noise), largest(null), float(abs(offset).max()), tuple(left_out))


def null_commands(rig: Rig) -> tuple[float, float]:
    """Valve commands, V, for the null that the controller knows and for the true one.

    Both are zero if the difference makes no constant force: an integral part removes it, and so does a
    learned null offset.
    """
    learns = rig["compensation.adaptive"] and rig["compensation.curve_correction"]
    integrates = rig["controller.realization"] == "digital" and rig["controller.integral_gain"] > 0.0
    if learns or integrates or rig["controller.force_loop"] == "robust":
        return 0.0, 0.0
    valve = rig.plant["servovalve"]
    per_opening = valve["spool_sensitivity"] * valve["spool_stroke"]
    return rig["servovalve.null_bias"] / rig["compensation.valve_gain"], valve["null_bias"] * per_opening


def _responses(model: LinearModel, shifts: Array) -> tuple[Array, Array]:
    """Force and displacement per command at each shift by a sample: shift, actuator, command."""
    rows = [
        [row for row, name in enumerate(model.outputs) if name.split("_")[0] == quantity]
        for quantity in ("force", "displacement")
    ]
    chosen = np.concatenate(rows)
    outputs, direct = model.C[chosen], model.D[chosen]
    a, b, unit = model.A, model.B, np.eye(len(model.A))
    found = [outputs @ np.linalg.solve(shift * unit - a, b) + direct for shift in shifts]
    force, displacement = np.split(np.array(found), 2, axis=1)
    return force, displacement


def of_prediction(rig: Rig, rate: float, errors: Prediction) -> Iterator[Finding]:
    """A finding for each predicted error beyond a limit, and their cause."""
    grades: list[Grade] = []
    off_null = False
    for which, name, told in (
        (1, "displacement_error", "The displacement will miss the ideal one"),
        (0, "force_error", "The force will miss the command"),
    ):
        error, noise, null = errors.whole[which], errors.noise[which], errors.null[which]
        if (grade := above(rig, name, error)) is not None:
            grades.append(grade)
            off_null |= 2.0 * null**2 > error**2
            allowed = rig[f"verdict.{grade}.{name}"]
            cause = ", mostly by noise and resolution of its sensors" if 2.0 * noise**2 > error**2 else ""
            sentence = f"{told} by {error:.1%} (rms) at small motion{cause}, more than {allowed:.0%}."
            yield Finding(grade, sentence)
    if off_null:
        known, true = null_commands(rig)
        sentence = (
            f"The valve is at its true null with a command of {true:.2g} V, and the controller gives "
            f"{known:.2g} V: this makes a constant force of {1e-3 * errors.constant:.2g} kN. An integral "
            f"part (controller.integral_gain) of a digital force loop removes it."
        )
        yield Finding(worst(grades), sentence)
    path = _native.delay_budget(rig, rate)["path"]
    lead = rig["compensation.response_delay"] + rig["compensation.velocity_delay"]
    late = rig["compensation.mode"] != "off" and path > lead + NOTICED
    if grades and late and not rig["compensation.adaptive"]:
        sentence = (
            f"Velocity, controller and valve are late by {1e3 * path:.2g} ms, and the lead network "
            f"compensates for {1e3 * lead:.2g} ms."
        )
        yield Finding(worst(grades), sentence)
