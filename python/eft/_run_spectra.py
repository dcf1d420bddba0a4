"""Frequency response and coherence of a test."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eft import _native
from eft._read_only import read_only

if TYPE_CHECKING:
    from eft._run import TestRun

Array = NDArray[np.float64]


class FftRatio(NamedTuple):
    """Frequency response over a band."""

    frequency: Array
    """Frequency of each bin, Hz."""
    ratio: Array
    """abs(FFT(force)) / abs(FFT(command)), dimensionless."""


class Coherence(NamedTuple):
    """Part of the force that is linear in the command, over frequency."""

    frequency: Array
    """Frequency of each bin, Hz."""
    coherence: Array
    """Magnitude squared, from 0 to 1."""


def fft_ratio(run: TestRun, f_low: float, f_high: float) -> FftRatio:
    """Divide the spectrum of the force by that of the command; see `TestRun.fft_ratio`."""
    if run.command.ndim > 1:
        return FftRatio(*map(read_only, _rows(run, lambda one: one.fft_ratio(f_low, f_high))))
    return FftRatio(
        *map(read_only, _native.fft_ratio(run.command, run.force, run.sample_rate, f_low, f_high))
    )


def coherence(run: TestRun, segment: float) -> Coherence:
    """Estimate the coherence of force and command; see `TestRun.coherence`."""
    if run.command.ndim > 1:
        return Coherence(*map(read_only, _rows(run, lambda one: one.coherence(segment))))
    if not segment > 0.0:
        raise ValueError(f"segment = {segment}: must be positive, in s")
    samples = round(min(segment * run.sample_rate, 2.0**40))
    return Coherence(*map(read_only, _native.coherence(run.command, run.force, run.sample_rate, samples)))


def check_command(run: TestRun) -> None:
    """Refuse a test whose command is zero."""
    if not run.command.any():
        raise ValueError("command is zero at every sample of every actuator: nothing to judge by")


def _rows(run: TestRun, judge: Callable[[TestRun], tuple[Array, Array]]) -> tuple[Array, Array]:
    """One row for each actuator at their common frequencies; NaN for an actuator without a command."""
    check_command(run)
    actuators = [run.actuator(index) for index in range(run.command.shape[0])]
    each = [judge(one) if one.command.any() else None for one in actuators]
    shared = reduce(np.intersect1d, (found[0] for found in each if found))
    nothing = np.full(shared.size, np.nan)
    rows = [found[1][np.isin(found[0], shared)] if found else nothing for found in each]
    return shared, np.array(rows)
