"""The errors of a test, predicted with the linear model before it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from eft import _native
from eft._findings import Finding, Grade, above, worst
from eft._learned import learned
from eft._native import Command, Rig

HIGHEST = 20.0
"""Highest frequency, Hz, of the prediction."""
NOTICED = 5e-4
"""Difference of two delays, s, that is worth a remark."""


class Prediction(NamedTuple):
    """Errors at small motion, rms over rms, of the actuator with the largest."""

    force: float
    """Of the force against the command."""
    displacement: float
    """Of the displacement against the ideal one."""


def predicted(rig: Rig, command: Command) -> Prediction | None:
    """The errors of a test.

    With self-calibration they are those after it. None without a stable linear model, without a command below
    `HIGHEST`, or with a guard alone, which changes the loop.
    """
    rate, learns = command.sample_rate, rig["compensation.adaptive"]
    if rig["compensation.guard"] and not learns:
        return None
    try:
        judged = learned(rig, rate) if learns else rig
        model = _native.linearize(judged, sampled=True, sample_rate=rate)
    except ValueError:
        return None  # there is no linear model: too many delays, or no slope at rest
    if not model.stable:
        return None
    values = np.atleast_2d(command.values)
    frequency = np.fft.rfftfreq(values.shape[1], 1.0 / rate)
    # At rest there is no motion, and the force of every loop is nearly the command.
    band = (frequency > 0.0) & (frequency <= HIGHEST)
    asked = np.fft.rfft(values)[:, band].T
    if not np.any(asked):
        return None

    def of(quantity: str) -> np.ndarray:
        outputs = [name for name in model.outputs if name.split("_")[0] == quantity]
        responses = [
            [model.response(frequency[band], output, command) for command in model.inputs]
            for output in outputs
        ]
        return np.moveaxis(np.array(responses), -1, 0)

    per_command, moved = of("force"), of("displacement")
    applied = np.einsum("fij,fj->fi", per_command, asked)
    # The forces that are asked for move the structure as a command that makes them.
    ideal = np.einsum("fij,fj->fi", moved, np.linalg.solve(per_command, asked[..., None])[..., 0])
    motion = np.einsum("fij,fj->fi", moved, asked)
    return Prediction(_relative(applied, asked), _relative(motion, ideal))


def _relative(found: np.ndarray, ideal: np.ndarray) -> float:
    """The largest error over the ideal values, rms over rms, of the columns that are not zero."""
    sizes = np.sum(np.abs(ideal) ** 2, axis=0)
    errors = np.sum(np.abs(found - ideal) ** 2, axis=0)
    return float(np.sqrt(np.max(errors[sizes > 0.0] / sizes[sizes > 0.0])))


def of_prediction(rig: Rig, rate: float, errors: Prediction) -> Iterator[Finding]:
    """A finding for each predicted error beyond a limit, and their cause."""
    grades: list[Grade] = []
    for name, told, error in (
        ("displacement_error", "The displacement will miss the ideal one", errors.displacement),
        ("force_error", "The force will miss the command", errors.force),
    ):
        if (grade := above(rig, name, error)) is not None:
            grades.append(grade)
            allowed = rig[f"verdict.{grade}.{name}"]
            yield Finding(grade, f"{told} by {error:.1%} (rms) at small motion, more than {allowed:.0%}.")
    path = _native.delay_budget(rig, rate)["path"]
    lead = rig["compensation.response_delay"] + rig["compensation.velocity_delay"]
    late = rig["compensation.mode"] != "off" and path > lead + NOTICED
    if grades and late and not rig["compensation.adaptive"]:
        sentence = (
            f"Velocity, controller and valve are late by {1e3 * path:.2g} ms, and the lead network "
            f"compensates for {1e3 * lead:.2g} ms."
        )
        yield Finding(worst(grades), sentence)
