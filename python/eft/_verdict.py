"""The verdict on a test, with reasons and remedies."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from eft import _native
from eft._finding import GRADES, Finding, Grade
from eft._findings import NO_FORCE, SELF_CALIBRATION, Facts, of_demands, of_facts, worst
from eft._native import Command, Rig
from eft._status import Status
from eft._table import METRICS, Metrics

if TYPE_CHECKING:
    from eft._run import TestRun

__all__ = ["Grade", "Remedy", "Verdict", "judge", "told_delay", "worst"]

SPOOL_ADVICE = 0.6
"""The paper's advice for the largest spool opening."""

FORCE_ERROR = 0.1
"""Rms error over rms command above which the verdict on a test of a study is a caution."""

LONGEST_DELAY = 1.0
"""The longest response delay (s) that a controller takes: a correlation at a longer lag is accidental."""

_NOISES = tuple(f"sensors.{name}.noise" for name in ("force", "velocity", "displacement", "spool"))


class Remedy(NamedTuple):
    """A suggested change of the rig."""

    key: str
    """Dotted key, as in `Rig.replace`."""
    value: Any
    """The value to set."""
    why: str
    """The problem that it may solve."""


@dataclass(frozen=True)
class Verdict:
    """The verdict on a test, the same in `run.verdict`, `eft run`, reports and exit codes.

    `eft check` gives the worse of this one and that of `eft.check_feasibility`.
    """

    grade: Grade
    """``"go"``; ``"caution"`` if a result needs attention; ``"no"`` if the test is not usable."""
    reasons: tuple[str, ...]
    """Reasons against a "go", worst first, one sentence each."""
    remedies: tuple[Remedy, ...]
    """Suggested changes, as keys with values for `Rig.replace`."""
    summary: str
    """Force error and spool opening in one sentence."""

    @property
    def ok(self) -> bool:
        """Whether the test is usable, with the grade "go" or "caution"."""
        return self.grade != "no"

    @cached_property
    def changes(self) -> dict[str, Any]:
        """All remedies together, for `Rig.replace`."""
        return {remedy.key: remedy.value for remedy in self.remedies}

    def _repr_html_(self) -> str:
        from eft import _notebook

        return _notebook.shown("Verdict", _notebook.verdict_rows(self))

    @property
    def text(self) -> str:
        """Every reason, then the summary."""
        return " ".join([*self.reasons, self.summary])


def judge(run: TestRun) -> Verdict:
    """Judge a test up to its end by the limits of the rig's ``verdict`` section."""
    if not run.success:
        return _verdict(run.rig, [Finding("no", "The simulated state diverged: there is no result.")], "")
    part = run.to_its_end()
    metrics = part.metrics() if part.command.any() else None
    facts = _facts(run, part, metrics)
    findings = [*_events(run), *of_facts(facts)]
    least = run.rig["supply.pressure"] * run.rig["verdict.caution.supply_pressure"]
    sags = facts.metrics["min_supply_pressure"] < least
    if sags or any(one.grade == "no" for one in findings):
        facts = facts._replace(demands=_demands(run))
        asked = [one for one in of_demands(facts.demands) if one.grade == "no"]
        findings = [*_events(run), *asked, *_noise(run, facts), *of_facts(facts)]
        if asked:
            # No setting of the controller can exceed the capacity of the rig.
            findings = [one._replace(remedies=()) for one in findings]
    if run._controlled:
        # Remedies are settings of the rig's own controller only.
        findings = [one._replace(remedies=()) for one in findings]
    opening = facts.metrics["max_spool"]
    summary = f"The spool opens to {opening:.0%}."
    if metrics is not None:
        error = facts.metrics["nrmse"]
        summary = f"The force misses the command by {error:.1%} (rms); the spool opens to {opening:.0%}."
    if len(part) < len(run):
        summary = f"In the {part.duration:.4g} s before, {summary[0].lower()}{summary[1:]}"
    return _verdict(run.rig, findings, summary)


def _verdict(rig: Rig, found: Iterable[Finding], summary: str) -> Verdict:
    findings = sorted(found, key=lambda one: -GRADES.index(one.grade))
    remedies: dict[str, Remedy] = {}
    for finding in findings:
        for key, value in finding.remedies:
            if rig[key] != value:
                remedies.setdefault(key, Remedy(key, value, finding.sentence))
    reasons = tuple(dict.fromkeys(one.sentence for one in findings))
    return Verdict(worst(one.grade for one in findings), reasons, tuple(remedies.values()), summary)


def _facts(run: TestRun, part: TestRun, metrics: Metrics | None) -> Facts:
    told = {} if metrics is None else {name: float(np.nanmax(value)) for name, value in _known(metrics)}
    told |= {
        "max_spool": float(np.abs(part.spool).max()),
        "min_supply_pressure": float(part.supply_pressure.min()),
    }
    status = part.status.reshape(-1, len(part))
    saturated, stopped = (
        float(((status & flags) != 0).any(axis=0).mean())
        for flags in (Status.SPOOL_STOP | Status.DEMAND_SATURATED, Status.SPOOL_STOP)
    )
    return Facts(
        rig=run.rig,
        sample_rate=run.sample_rate,
        flags=part.flags | (run.flags & Status.STROKE_EXCEEDED),
        metrics={name: told.get(name, np.nan) for name in METRICS},
        peak_command=float(np.abs(run.command).max()),
        peak_displacement=float(np.abs(part.displacement).max()),
        outside=run._outside,
        controlled=run._controlled,
        mass=run.mass,
        floor=run._floor,
        peak_force=float(np.abs(part.force).max()),
        saturated=saturated,
        stopped=stopped,
    )


def _known(metrics: Metrics) -> Iterator[tuple[str, Any]]:
    return ((name, value) for name, value in metrics.items() if np.isfinite(value).any())


def _demands(run: TestRun) -> tuple[dict[str, Any], ...]:
    """The demands of the command; none if the rig's structure or other actuators are not in the test."""
    if run._outside or run._building is not None or not run._whole:
        return ()
    return tuple(_native.demands(run.rig, Command(run.command, run.sample_rate)))


def _events(run: TestRun) -> Iterator[Finding]:
    """Findings on an early end."""
    if run.flags & Status.STROKE_EXCEEDED:
        yield Finding("no", "The piston left its stroke: no result of a real rig.", SELF_CALIBRATION)
    if run.stopped:
        yield Finding("no", f"The structure ended the test: {run.stopped.rstrip('.')}.")
    elif run.flags & (Status.TRIPPED | Status.SHUT_DOWN):
        cause = run.cause.name.lower().replace("_", " ")
        yield Finding("no", f"The protection tripped ({cause}) and ended the test.")


def _noise(run: TestRun, facts: Facts) -> Iterator[Finding]:
    """The finding that sensor noise causes most of an error, by the same test without noise."""
    error = facts.metrics["nrmse"]
    quiet = {key: 0.0 for key in _NOISES if run.rig.plant[key]}
    if not quiet or not run._whole or run._building or run._outside or run._controlled:
        return
    if not error > run.rig["verdict.caution.force_error"]:
        return
    rig = run.rig.replace(quiet | {f"truth.{key}": 0.0 for key in quiet})
    command = Command(run.command, run.sample_rate)
    other = type(run)._of(rig, command, run.dtype, _native.simulate(rig, command, run.dtype)).to_its_end()
    without = float(np.nanmax(other.metrics(fft=False).nrmse)) if other.success else np.nan
    if without < 0.5 * error:
        yield Finding(
            "no" if error > run.rig["verdict.no.force_error"] else "caution",
            "Noise of the sensors makes most of the error: without it the force misses the command by "
            f"{without:.1%} (rms).",
        )


def told_delay(metrics: Metrics) -> Any:
    """The delay (s); NaN if a shift does not reduce the error, or if it is too long for any controller."""
    delay, left = np.asarray(metrics["delay"]), np.asarray(metrics["nrmse_delay_removed"])
    return np.where((np.abs(delay) > LONGEST_DELAY) | (left >= NO_FORCE), np.nan, delay)
