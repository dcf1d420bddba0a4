"""What to think of a test, in one sentence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from eft._run import TestRun
from eft._status import Status

SPOOL_ADVICE = 0.6
"""The paper's advice for the largest spool opening."""


FORCE_ERROR = 0.1
"""Rms error over rms command beyond which a test deserves a look; ours, the paper names no number."""


@dataclass(frozen=True)
class Verdict:
    """Whether a test may count, and why."""

    usable: bool
    """False when there is no whole test: diverged, out of the stroke, or tripped."""
    concern: bool
    """The test ran, but something deserves a look."""
    text: str


def judge(run: TestRun) -> Verdict:
    """Judge a test by its flags, the spool opening and the force error."""
    if not run.success:
        return Verdict(False, True, "The simulated state diverged: no result.")
    opening = float(np.abs(run.spool).max())
    spool = f"the spool opens to {opening:.0%} (advised: at most {SPOOL_ADVICE:.0%})"
    follows, far = "", False
    if run.command.any():
        error = float(np.nanmax(run.metrics()["nrmse"]))
        far = error > FORCE_ERROR
        follows = f"The force misses the command by {error:.1%} (rms); "
    if run.flags & Status.STROKE_EXCEEDED:
        return Verdict(False, True, f"The piston left its stroke: no result of a real rig. {follows}{spool}.")
    if run.flags & (Status.TRIPPED | Status.SHUT_DOWN):
        return Verdict(False, True, f"The protection tripped and ended the test. {follows}{spool}.")
    if run.flags & (Status.SPOOL_STOP | Status.DEMAND_SATURATED):
        text = f"The valve was asked for more than it has. {follows}{spool}."
        return Verdict(True, True, text)
    text = f"{follows}{spool}."
    return Verdict(True, far or opening > SPOOL_ADVICE, text[0].upper() + text[1:])
