"""Two tests side by side, signal by signal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from eft import _native
from eft.traces._traces import Traces
from eft.traces._units import si_unit

_COMPARED = ("command", "force", "displacement", "velocity", "spool", "load_pressure", "valve_command")


@dataclass(frozen=True)
class Comparison:
    """How far a signal of one test is from the same signal of a reference."""

    quantity: str
    unit: str
    reference_peak: float
    """Largest absolute value in the reference."""
    peak: float
    """Largest absolute value in the other test."""
    nrmse: float
    """Rms difference over the rms of the reference."""
    peak_error: float
    """Largest difference over the largest value of the reference."""
    delay: float
    """By cross-correlation, s; positive when the other test lags; NaN where there is no answer."""


def compare(reference: Traces, other: Traces) -> list[Comparison]:
    """Compare every signal that both have, over the time that both cover, at the reference's sample rate.

    Raises
    ------
    ValueError
        If the two have no signal or no time in common.
    """
    shared = [name for name in _COMPARED if name in reference.columns and name in other.columns]
    if not shared:
        raise ValueError(
            f"no signal in common: {reference.name} has {', '.join(reference.columns)}, "
            f"{other.name} has {', '.join(other.columns)}"
        )
    time, other_time = reference.time, other.time
    # A millionth of a step: two clocks that mean the same time may differ by rounding.
    margin = 1e-6 / reference.sample_rate
    inside = (time >= other_time[0] - margin) & (time <= other_time[-1] + margin)
    if np.count_nonzero(inside) < 2:
        raise ValueError(
            f"no time in common: {reference.name} covers {time[0]:g} to {time[-1]:g} s, "
            f"{other.name} {other_time[0]:g} to {other_time[-1]:g} s"
        )
    answer = []
    for name in shared:
        wanted = np.ascontiguousarray(reference.columns[name][inside])
        values = np.interp(time[inside], other_time, other.columns[name])
        answer.append(_compare(name, wanted, values, reference.sample_rate))
    return answer


def _compare(name: str, wanted: np.ndarray, values: np.ndarray, sample_rate: float) -> Comparison:
    peaks = float(np.abs(wanted).max()), float(np.abs(values).max())
    if peaks[0] == 0.0:
        # A reference of zero has no relative difference, except to another zero.
        error = 0.0 if peaks[1] == 0.0 else float("nan")
        return Comparison(name, si_unit(name), *peaks, error, error, error)
    judged = _native.metrics(wanted, values, sample_rate)
    return Comparison(name, si_unit(name), *peaks, judged["nrmse"], judged["peak_error"], judged["delay"])
