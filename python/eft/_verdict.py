"""One verdict on a test: whether it counts, why not, and what helps."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from eft._display import shown
from eft._native import Rig
from eft._planning import stability_margins
from eft._status import Status
from eft._table import Metrics

if TYPE_CHECKING:
    from eft._run import TestRun

__all__ = ["Remedy", "Verdict", "judge", "told_delay"]

Grade = Literal["go", "caution", "no"]
_GRADES: tuple[Grade, ...] = ("go", "caution", "no")

SPOOL_ADVICE = 0.6
"""The paper's advice for the largest spool opening."""

FORCE_ERROR = 0.1
"""Rms error over rms command above which a test of a study deserves a look."""

NO_FORCE = 1.0
"""Rms error over rms command of a force that stays zero: one no better is no answer to the command."""

LONGEST_DELAY = 1.0
"""The longest response delay (s) that a controller takes: a correlation at a longer lag is chance."""

LIMIT_CYCLE = 0.05
"""Rms of the force within `OIL_COLUMN` over the rms command, from where on it is called an oscillation."""

OIL_COLUMN = (30.0, 150.0)
"""Band (Hz) of the oil column's mode on rigs of the paper's size."""

SAME_MASS = 1e-3
"""Relative difference up to which the masses of command and structure are the same."""

SELF_CALIBRATION = (
    ("compensation.mode", "nonlinear"),
    ("compensation.adaptive", True),
    ("compensation.feedforward", True),
    ("compensation.look_ahead", True),
)


class Remedy(NamedTuple):
    """A change of the rig that may help."""

    key: str
    """Dotted key, as in `Rig.replace`."""
    value: Any
    """The value to set."""
    why: str
    """What it helps against."""


@dataclass(frozen=True)
class Verdict:
    """Whether a test counts; the same for `run.verdict`, `eft check`, `eft run`, reports and exit codes."""

    grade: Grade
    """``"go"``, ``"caution"`` where something deserves a look, ``"no"`` where the test does not count."""
    reasons: tuple[str, ...]
    """What keeps it from a "go", worst first, one sentence each."""
    remedies: tuple[Remedy, ...]
    """What may help, as keys with values for `Rig.replace`."""
    summary: str
    """Force error and spool opening in one sentence."""

    @property
    def ok(self) -> bool:
        """Whether the test counts, with or without a caution."""
        return self.grade != "no"

    @cached_property
    def changes(self) -> dict[str, Any]:
        """All remedies at once, for `Rig.replace`."""
        return {remedy.key: remedy.value for remedy in self.remedies}

    def _repr_html_(self) -> str:
        from eft import _notebook

        return _notebook.shown("Verdict", _notebook.verdict_rows(self))

    @property
    def text(self) -> str:
        """Every reason, then the summary."""
        return " ".join([*self.reasons, self.summary])


class _Finding(NamedTuple):
    grade: Grade
    sentence: str
    remedies: tuple[tuple[str, Any], ...] = ()


def judge(run: TestRun) -> Verdict:
    """Judge a test up to where it ended; the limits are the rig's ``verdict`` section."""
    if not run.success:
        return Verdict("no", ("The simulated state diverged: there is no result.",), (), "")
    part = run.to_its_end()
    metrics = part.metrics() if part.command.any() else None
    findings = sorted(_findings(run, part, metrics), key=lambda one: -_GRADES.index(one.grade))
    grade: Grade = findings[0].grade if findings else "go"
    remedies: dict[str, Remedy] = {}
    for finding in findings:
        for key, value in finding.remedies:
            if run.rig[key] != value:
                remedies.setdefault(key, Remedy(key, value, finding.sentence))
    opening = float(np.abs(part.spool).max())
    summary = f"The spool opens to {opening:.0%}."
    if metrics is not None:
        error = float(np.nanmax(metrics.nrmse))
        summary = f"The force misses the command by {error:.1%} (rms); the spool opens to {opening:.0%}."
    if len(part) < len(run):
        summary = f"In the {part.duration:.4g} s before, {summary[0].lower()}{summary[1:]}"
    return Verdict(grade, tuple(one.sentence for one in findings), tuple(remedies.values()), summary)


def _findings(run: TestRun, part: TestRun, metrics: Metrics | None) -> Iterator[_Finding]:
    if run.flags & Status.STROKE_EXCEEDED:
        yield _Finding("no", "The piston left its stroke: no result of a real rig.", SELF_CALIBRATION)
    if run.stopped:
        yield _Finding("no", f"The structure ended the test: {run.stopped.rstrip('.')}.")
    elif run.flags & (Status.TRIPPED | Status.SHUT_DOWN):
        yield _Finding("no", f"The protection tripped ({_cause(run)}) and ended the test.")
    yield from _mass(run)
    yield from _margin(run.rig, run.sample_rate)
    if metrics is not None:
        yield from _errors(part, metrics)
        yield from _supply(run.rig, metrics)
        yield from _oscillation(part)
    yield from _opening(part, metrics)


def _mass(run: TestRun) -> Iterator[_Finding]:
    """A command that was made for another mass than the structure's is another test."""
    if run.mass is None:
        return
    building = run.rig["structure.kind"] == "shear_building"
    own = np.asarray(run.rig["structure.stories.masses" if building else "structure.mass"])
    if building and run._building is not None:
        own = own[run._building[1]]
    made_for = np.asarray(run.mass)
    if made_for.shape == own.shape and np.allclose(made_for, own, rtol=SAME_MASS, atol=0.0):
        return
    masses = f"{_masses(made_for)}, and the rig's structure has {_masses(own)}"
    yield _Finding("caution", f"The command is the effective force of {masses}.")


def _masses(values: Any) -> str:
    unit = shown("mass")
    return " and ".join(f"{mass * unit.factor:.6g}" for mass in np.atleast_1d(values)) + f" {unit.unit}"


def _margin(rig: Rig, rate: float) -> Iterator[_Finding]:
    """The gain margin of the force loop; of a controller that learns, with a sound calibration."""
    if rig["compensation.adaptive"]:
        rig = rig.plant.replace({"servovalve.flow_gain_scale": 1.0})
    try:
        margin = stability_margins(rig, sampled=True, sample_rate=rate).loop_gain
    except ValueError:
        margin = None
    if margin is None:
        return
    least = {grade: rig[f"verdict.{grade}.gain_margin"] for grade in _GRADES[1:]}
    if margin < least["caution"]:
        yield _Finding(
            "no" if margin < least["no"] else "caution",
            f"The gain margin of the force loop is {margin:.2f} ({20 * np.log10(margin):.1f} dB), advised at "
            f"least {least['caution']:.2f}.",
            (("controller.force_loop", "robust"),),
        )


def _errors(part: TestRun, metrics: Metrics) -> Iterator[_Finding]:
    rig = part.rig
    error = float(np.nanmax(metrics.nrmse))
    if error >= NO_FORCE:
        yield _Finding("no", f"No test of this command: {_astray(part, error)}.", SELF_CALIBRATION)
    elif grade := _beyond(rig, "force_error", error):
        allowed = rig[f"verdict.{grade}.force_error"]
        sentence = f"The force misses the command by {error:.1%} (rms), more than {allowed:.0%}."
        yield _Finding(grade, sentence, SELF_CALIBRATION)
    # Of a structure from outside the ideal motion is not known.
    motion = 0.0 if part._outside else float(np.nanmax(metrics.displacement_error))
    if error < NO_FORCE and (grade := _beyond(rig, "displacement_error", motion)):
        allowed = rig[f"verdict.{grade}.displacement_error"]
        sentence = f"The displacement misses the ideal one by {motion:.1%} (rms), more than {allowed:.0%}."
        yield _Finding(grade, sentence, SELF_CALIBRATION)


def _beyond(rig: Rig, name: str, value: float) -> Grade | None:
    grades: tuple[Grade, ...] = ("no", "caution")
    return next((grade for grade in grades if value > rig[f"verdict.{grade}.{name}"]), None)


def _supply(rig: Rig, metrics: Metrics) -> Iterator[_Finding]:
    share = float(np.nanmin(metrics.min_supply_pressure)) / rig["supply.pressure"]
    below = [grade for grade in ("no", "caution") if share < rig[f"verdict.{grade}.supply_pressure"]]
    if below:
        sentence = (
            f"The supply pressure falls to {share:.0%} of the configured one: "
            "pump or accumulator is too small."
        )
        yield _Finding(
            "no" if below[0] == "no" else "caution", sentence, (("compensation.supply_correction", True),)
        )


def _oscillation(part: TestRun) -> Iterator[_Finding]:
    """A limit cycle of the oil column."""
    if part.sample_rate <= 2 * OIL_COLUMN[1]:
        return
    frequency = np.fft.rfftfreq(len(part), 1.0 / part.sample_rate)
    band = (frequency > OIL_COLUMN[0]) & (frequency < OIL_COLUMN[1])
    surplus = np.fft.rfft(np.atleast_2d(part.force - part.command))[:, band]
    rms = np.sqrt(2.0 * (np.abs(surplus) ** 2).sum(axis=-1)) / len(part)
    command = np.sqrt(np.mean(np.atleast_2d(part.command) ** 2, axis=-1))
    moved = command > 0.0
    share = float((rms[moved] / command[moved]).max())
    if share > LIMIT_CYCLE:
        sentence = (
            f"The force oscillates between {OIL_COLUMN[0]:.0f} and {OIL_COLUMN[1]:.0f} Hz by {share:.0%} "
            "of the command (rms): the oil column."
        )
        yield _Finding("caution", sentence, (("controller.force_loop", "robust"),))


def _opening(part: TestRun, metrics: Metrics | None) -> Iterator[_Finding]:
    opening = float(np.abs(part.spool).max())
    advised = part.rig["limits.spool_warning"]
    stops = (part.status & (Status.SPOOL_STOP | Status.DEMAND_SATURATED)) != 0
    if stops.any():
        error = 0.0 if metrics is None else float(np.nanmax(metrics.nrmse))
        useless = error > part.rig["verdict.caution.force_error"]
        sentence = (
            f"The valve is asked for more than it has in {stops.mean():.1%} of the samples: "
            "it is too small for this command, or the command too large."
        )
        yield _Finding("no" if useless else "caution", sentence)
    elif opening > advised:
        yield _Finding("caution", f"The spool opens to {opening:.0%}, advised at most {advised:.0%}.")


def _cause(run: TestRun) -> str:
    """Why the protection tripped, in words."""
    return run.cause.name.lower().replace("_", " ")


def _astray(run: TestRun, error: float) -> str:
    """What a force does that is no answer to its command."""
    unit = shown("force")
    force, command = (unit(float(np.abs(trace).max())) for trace in (run.force, run.command))
    stopped = float(((run.status & Status.SPOOL_STOP) != 0).mean())
    stops = f", with the spool at its stop in {stopped:.0%} of the samples" if stopped else ""
    return (
        f"the force misses it by {error:.0%} (rms), more than no force at all would, and reaches "
        f"{force} against {command}{stops}"
    )


def worst(grades: Iterable[Grade]) -> Grade:
    """The worst of some grades."""
    return max(grades, key=_GRADES.index, default="go")


def told_delay(metrics: Metrics) -> Any:
    """The delay (s), NaN where a shift by it explains nothing or no controller makes up for so much."""
    delay, left = np.asarray(metrics["delay"]), np.asarray(metrics["nrmse_delay_removed"])
    return np.where((np.abs(delay) > LONGEST_DELAY) | (left >= NO_FORCE), np.nan, delay)
