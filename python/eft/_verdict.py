"""What to think of a test, in one sentence."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from eft._run import TestRun
from eft._status import Status
from eft._table import Metrics

SPOOL_ADVICE = 0.6
"""The paper's advice for the largest spool opening."""


FORCE_ERROR = 0.1
"""Rms error over rms command beyond which a test deserves a look; ours, the paper names no number."""

NO_FORCE = 1.0
"""Rms error over rms command of a force that stays zero: one no better is no answer to the command."""

LONGEST_DELAY = 1.0
"""The longest response delay (s) that a controller takes: a correlation at a longer lag is chance."""


@dataclass(frozen=True)
class Verdict:
    """Whether a test may count, and why."""

    usable: bool
    """False when there is no test: diverged, out of the stroke, tripped, or no answer to the command."""
    concern: bool
    """The test ran, but something deserves a look."""
    text: str


def judge(run: TestRun) -> Verdict:
    """Judge a test by its flags, the spool opening and the force error, up to where it ended."""
    if not run.success:
        return Verdict(False, True, "The simulated state diverged: no result.")
    whole, run = run, run.to_its_end()
    opening = float(np.abs(run.spool).max())
    spool = f"the spool opens to {opening:.0%} (advised: at most {SPOOL_ADVICE:.0%})"
    follows, error = "", 0.0
    if run.command.any():
        error = float(np.nanmax(run.metrics(fft=False)["nrmse"]))
        follows = f"The force misses the command by {error:.1%} (rms); "
    until = f"In the {run.duration:.4g} s before, {follows[:1].lower()}{follows[1:]}{spool}."
    if whole.flags & Status.STROKE_EXCEEDED:
        return Verdict(False, True, f"The piston left its stroke: no result of a real rig. {until}")
    if whole.flags & (Status.TRIPPED | Status.SHUT_DOWN):
        return Verdict(False, True, f"The protection tripped ({_cause(whole)}) and ended the test. {until}")
    if error >= NO_FORCE:
        return Verdict(False, True, f"No test of this command: {_astray(run, error)}; {spool}.")
    if run.flags & (Status.SPOOL_STOP | Status.DEMAND_SATURATED):
        text = f"The valve was asked for more than it has. {follows}{spool}."
        return Verdict(True, True, text)
    text = f"{follows}{spool}."
    return Verdict(True, error > FORCE_ERROR or opening > SPOOL_ADVICE, text[0].upper() + text[1:])


def _cause(run: TestRun) -> str:
    """Why the protection tripped, in words."""
    return run.cause.name.lower().replace("_", " ")


def _astray(run: TestRun, error: float) -> str:
    """What a force does that is no answer to its command."""
    force, command = (float(np.abs(trace).max()) / 1e3 for trace in (run.force, run.command))
    stopped = float(((run.status & Status.SPOOL_STOP) != 0).mean())
    stops = f", with the spool at its stop in {stopped:.0%} of the samples" if stopped else ""
    return (
        f"the force misses it by {error:.0%} (rms), more than no force at all would, and reaches "
        f"{force:.4g} kN against {command:.4g} kN{stops}"
    )


def told_delay(metrics: Metrics) -> Any:
    """The delay (s), NaN where a shift by it explains nothing or no controller makes up for so much."""
    delay, left = np.asarray(metrics["delay"]), np.asarray(metrics["nrmse_delay_removed"])
    return np.where((np.abs(delay) > LONGEST_DELAY) | (left >= NO_FORCE), np.nan, delay)
