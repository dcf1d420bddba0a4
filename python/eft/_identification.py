"""Identification from measured arrays: estimates that are numbers and know their uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eft import _native
from eft._native import FlowTable

__all__ = [
    "Estimate",
    "FlowCurveEstimate",
    "flow_curve_estimate",
    "identify_damping",
    "identify_delay",
    "identify_flow_curve",
    "identify_flow_gain",
]

Array = NDArray[np.float64]


class Estimate(float):
    """A number with its standard uncertainty, in the same unit.

    It is used like any float; what else the identification found stands in `details`.
    """

    uncertainty: float
    """One standard deviation."""
    details: dict[str, Any]
    """What else was found, by name."""

    def __new__(cls, value: float, uncertainty: float, **details: Any) -> Estimate:
        """Make one from value, uncertainty and named details."""
        self = super().__new__(cls, value)
        self.uncertainty = uncertainty
        self.details = details
        return self

    def __getnewargs_ex__(self) -> tuple[tuple[float, float], dict[str, Any]]:
        return (float(self), self.uncertainty), self.details

    def __repr__(self) -> str:
        return f"{float(self):.6g} ± {self.uncertainty:.2g}"


class FlowCurveEstimate:
    """A flow curve with what is known of each control point."""

    def __init__(
        self, openings: Array, flows: Array, uncertainty: Array, measured: NDArray[np.bool_]
    ) -> None:
        """Keep the arrays and the table made of them."""
        self.table = FlowTable(openings, flows)
        self.uncertainty = uncertainty
        """Standard uncertainty of the flows, m³/s; extrapolated points carry that of the line."""
        self.measured = measured
        """Whether the spool reached the point; the others are extrapolated."""


def identify_delay(
    command: ArrayLike, response: ArrayLike, sample_rate: float, band: tuple[float, float] = (0.25, 10.0)
) -> Estimate:
    """Find how far a response lags its command, as the slope of phase against frequency (Fig. 4a).

    Samples that are NaN are gaps; offset and drift are taken out.

    Parameters
    ----------
    command, response : array_like
        Simultaneous samples, one dimension, of any unit.
    sample_rate : float
        In Hz.
    band : tuple of float
        Frequencies in Hz between which the line is fitted, with an intercept.

    Returns
    -------
    Estimate
        The delay in s, positive when the response lags. Its ``details``: ``intercept`` (rad), ``coherence``
        (1 where all phases lie on the line), ``frequency`` (Hz) and ``lag`` (rad) of every excited bin.

    Raises
    ------
    ValueError
        If the data cannot carry an answer; the message says why.
    """
    return Estimate(**_native.identify_delay(command, response, sample_rate, band))


def flow_curve_estimate(
    spool: ArrayLike | Sequence[ArrayLike],
    displacement: ArrayLike | Sequence[ArrayLike],
    sample_rate: float,
    piston_area: float,
    knots: int = 21,
) -> FlowCurveEstimate:
    """As `identify_flow_curve`, with the uncertainty of each control point and whether it was measured."""
    return FlowCurveEstimate(
        **_native.identify_flow_curve(_runs(spool), _runs(displacement), sample_rate, piston_area, knots)
    )


def identify_flow_curve(
    spool: ArrayLike | Sequence[ArrayLike],
    displacement: ArrayLike | Sequence[ArrayLike],
    sample_rate: float,
    piston_area: float,
    knots: int = 21,
) -> FlowTable:
    """Find the flow curve from spool opening and displacement of an actuator without load (Fig. 4b).

    The flow is the piston's motion, so a piecewise linear curve is fitted to
    ``A·x(t) = A·x(0) + ∫f(spool) dt``; offset and drift of every recording are found along with it. NaN are
    gaps. Control points that the spool never reached lie on the line through the last two that it did.

    Parameters
    ----------
    spool : array_like or list of array_like
        Spool opening as a fraction of its stroke, one array for each run.
    displacement : array_like or list of array_like
        Piston displacement in m, likewise.
    sample_rate : float
        In Hz.
    piston_area : float
        In m².
    knots : int
        Number of evenly spaced control points from -1 to 1, odd.

    Raises
    ------
    ValueError
        If the data cannot carry an answer; the message says why.
    """
    return flow_curve_estimate(spool, displacement, sample_rate, piston_area, knots).table


def identify_flow_gain(
    spool: ArrayLike | Sequence[ArrayLike],
    displacement: ArrayLike | Sequence[ArrayLike],
    sample_rate: float,
    piston_area: float,
    limit: float = 0.1,
) -> Estimate:
    """Find the flow gain `K_v` in m³/s: one slope for all openings within ±`limit`; otherwise as above."""
    return Estimate(
        *_native.identify_flow_gain(_runs(spool), _runs(displacement), sample_rate, piston_area, limit)
    )


def identify_damping(displacement: ArrayLike, sample_rate: float) -> Estimate:
    """Find the damping ratio from free vibration: give the part of a record after the release.

    Returns
    -------
    Estimate
        The damping ratio. Its ``details`` are ``frequency`` (Hz, undamped, an `Estimate`) and ``decrement``
        (logarithmic).

    Raises
    ------
    ValueError
        If the data is not one decaying oscillation of at least three cycles.
    """
    ratio, spread, frequency, frequency_spread, decrement = _native.identify_damping(
        displacement, sample_rate
    )
    return Estimate(ratio, spread, frequency=Estimate(frequency, frequency_spread), decrement=decrement)


def _runs(given: ArrayLike | Sequence[ArrayLike]) -> list[ArrayLike]:
    """One array is a list of one; a list of numbers is one array."""
    if isinstance(given, (list, tuple)):
        return list(given) if given and np.ndim(given[0]) else [given]
    array = np.asarray(given)
    return list(array) if array.ndim == 2 else [array]
