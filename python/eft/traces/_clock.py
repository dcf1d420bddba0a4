"""The clock of a measurement: evenly spaced, or even within the rounding of its digits."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SLOWEST, FASTEST = 1e-6, 1e9
"""Lowest and highest sample rate of a measurement, Hz."""

_UNEVEN = 0.01
"""Allowed relative difference of a time step from the mean step, for times with few digits."""

_JITTER = 0.05
"""Allowed difference of a sample from its time in addition to rounding, as a fraction of a step."""

_OUTLIERS = 0.1
"""Share of uneven steps above which they count as rounding of the times."""

_ROUNDED, _SPREAD = 8, 1.001
"""Number of uneven steps from which they may be rounding, and their largest spread in last digits."""

_PIECE = 2**18
"""Samples that are checked together, to limit the memory of a check."""


@np.errstate(over="ignore", invalid="ignore")
def clock(name: str, time: Array) -> tuple[float, float]:
    """First time (s) and sample rate (Hz) of an evenly spaced clock; `name` is that of the file."""
    if time.size < 2:
        raise ValueError(f"{name}: {time.size} sample, must be at least 2")
    step = float(time[-1] - time[0]) / (time.size - 1)
    if step <= 0.0:
        raise ValueError(f"{name}: time must increase, and goes from {time[0]:g} s to {time[-1]:g} s")
    if not SLOWEST <= 1.0 / step <= FASTEST:
        raise ValueError(
            f"{name}: a step of {step:g} s: must lie within {1 / FASTEST:g} and {1 / SLOWEST:g} s"
        )
    middle = float(np.median(np.diff(time[:_PIECE])))
    odd = sum(np.count_nonzero(np.abs(steps - middle) > _UNEVEN * step) for steps in _steps(time))
    if not odd:
        return float(time[0]), 1.0 / step
    if odd >= _ROUNDED and (rate := _exactly_rounded(time, round(1.0 / step))) is not None:
        return float(time[0]), rate
    if odd >= _ROUNDED and odd > _OUTLIERS * (time.size - 1):
        # Many uneven steps may be the rounding of times with few digits.
        if (rate := _rounded(time)) is not None:
            return float(time[0]), rate
        middle = step
    largest = [float(np.abs(steps - middle).max()) for steps in _steps(time)]
    begin = int(np.argmax(largest)) * _PIECE
    where = begin + int(np.abs(np.diff(time[begin : begin + _PIECE + 1]) - middle).argmax())
    raise ValueError(
        f"{name}: time is not evenly spaced: sample {where + 2} comes {time[where + 1] - time[where]:.6g} s "
        f"after the one before, the mean step is {step:.6g} s; correct it or give the sample rate"
    )


def _steps(time: Array) -> Iterator[Array]:
    for start in range(0, time.size - 1, _PIECE):
        yield np.diff(time[start : start + _PIECE + 1])


def _pieces(time: Array) -> Iterator[tuple[int, Array]]:
    for start in range(0, time.size, _PIECE):
        yield start, time[start : start + _PIECE]


def _exactly_rounded(time: Array, rate: int) -> float | None:
    """An integer rate (Hz) whose times, rounded, are the written ones. Lost samples move later times."""
    decimal = _decimal(time)
    if rate < 1 or decimal == 0.0:
        return None
    least, most = np.inf, -np.inf
    for first, piece in _pieces(time):
        off = piece - (first + np.arange(piece.size)) / rate
        least, most = min(least, float(off.min())), max(most, float(off.max()))
    return float(rate) if most - least <= _SPREAD * decimal else None


def _rounded(time: Array) -> float | None:
    """The rate of a clock that is even within the rounding of its digits, or None."""
    digits = _digits(time)
    if digits is None or any(steps.min() < 0.0 for steps in _steps(time)):
        return None
    every = -(-time.size // _PIECE)
    count = np.arange(0, time.size, every)
    fitted = float(1.0 / np.polyfit(count, time[::every], 1)[0])
    # An integer rate, if the rounding allows one.
    for rate in (float(round(fitted)), fitted):
        if rate > 0.0:
            start = float(np.median(time[::every] - count / rate))
            if all(_is_even(piece, start + first / rate, rate, digits) for first, piece in _pieces(time)):
                return rate
    return None


def _is_even(time: Array, start: float, rate: float, digits: tuple[float, int | None]) -> bool:
    off = np.abs(time - start - np.arange(time.size) / rate)
    return bool((off <= 0.6 * _unit(time, *digits) + _JITTER / rate).all())


def _digits(time: Array) -> tuple[float, int | None] | None:
    """The last decimal of the written times, s (0 if there are many), and their significant digits."""

    def significant(digits: int) -> bool:
        for _, piece in _pieces(time):
            unit = _unit(piece, 0.0, digits)
            if not np.allclose(np.round(piece / unit) * unit, piece, rtol=1e-13, atol=0.0):
                return False
        return True

    decimal = _decimal(time)
    digits = next((digits for digits in range(4, 11) if significant(digits)), None)
    return None if not decimal and digits is None else (decimal, digits)


def _decimal(time: Array) -> float:
    """The last decimal of the written times, s, or 0 if there are many."""

    def fit(places: int) -> bool:
        return all(np.array_equal(np.round(piece, places), piece) for _, piece in _pieces(time))

    return next((10.0**-places for places in range(10) if fit(places)), 0.0)


def _unit(time: Array, decimal: float, digits: int | None) -> Array:
    """One unit of the last digit of each written time, s."""
    if digits is None:
        return np.full(time.shape, decimal)
    with np.errstate(divide="ignore"):
        size = np.floor(np.log10(np.abs(time)))
    size[~np.isfinite(size)] = -9.0
    return np.maximum(10.0 ** (size - digits + 1), decimal)
