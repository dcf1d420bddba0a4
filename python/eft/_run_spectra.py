"""Frequency response and coherence of a test."""

from __future__ import annotations

from collections.abc import Callable
from decimal import ROUND_DOWN, Context
from functools import reduce
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eft import _native
from eft._numbers import real_number
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
    """Divide the spectrum of the force by that of the command, over a band.

    The spectra have no window and cover the whole test. Bins that the command does not excite are
    omitted. For several actuators the ratio has a row for each, at the frequencies that all commands
    excite. The row of a zero command is NaN.

    Parameters
    ----------
    f_low, f_high : float
        Limits of the band, Hz.

    Returns
    -------
    FftRatio
        Frequencies in Hz and the ratio of the magnitudes.

    Raises
    ------
    ValueError
        If the band is not allowed, or the command is zero or does not excite it.

    Examples
    --------
    >>> import eft
    >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 5.0, 4.0, 1024.0))
    >>> f"{run.fft_ratio(1.0, 4.0).ratio.mean():.1f}"
    '1.0'
    """
    if run.command.ndim > 1:
        return FftRatio(*map(read_only, _rows(run, lambda one: one.fft_ratio(f_low, f_high))))
    return FftRatio(
        *map(read_only, _native.fft_ratio(run.command, run.force, run.sample_rate, f_low, f_high))
    )


def coherence(run: TestRun, segment: float = 4.0) -> Coherence:
    """Estimate the coherence of force and command from half overlapping segments.

    The windows are Hann windows, as in ``scipy.signal.coherence``. Frequencies at which a signal has no
    energy are left out. For several actuators the coherence has a row for each, at their common
    frequencies.

    Parameters
    ----------
    segment : float
        Length of a segment, s.

    Returns
    -------
    Coherence
        Frequencies in Hz and the coherence, from 0 to 1.

    Raises
    ------
    ValueError
        If the segment has less than two samples or two segments do not fit, or the command is zero.

    Examples
    --------
    >>> import eft
    >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 5.0, 4.0, 1024.0))
    >>> run.coherence(1.0).frequency[1].item()
    1.0
    """
    segment = real_number("segment", segment)
    if run.command.ndim > 1:
        return Coherence(*map(read_only, _rows(run, lambda one: one.coherence(segment))))
    length, rate = run.command.size, run.sample_rate
    samples = round(segment * rate) if abs(segment) <= length / rate else 0
    most = 2 * length // 3
    if not 2 <= samples <= most:
        longest = float(Context(prec=3, rounding=ROUND_DOWN).create_decimal(most / rate))
        allowed = f"at least {2.0 / rate:g} and at most two thirds of the test, {longest:g} s"
        raise ValueError(f"segment = {segment:g} s: must be {allowed}")
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
