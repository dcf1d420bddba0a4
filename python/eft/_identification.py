"""Identification from measured arrays: estimates that are numbers and know their uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eft import _native
from eft._native import FlowTable, Rig

__all__ = [
    "Estimate",
    "FineTuning",
    "FlowCurveEstimate",
    "fine_tune",
    "flow_curve_estimate",
    "identify_damping",
    "identify_delay",
    "identify_flow_curve",
    "identify_flow_gain",
]

Array = NDArray[np.float64]
FlowMethod = Literal["integral", "difference"]


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
    *,
    method: FlowMethod = "integral",
) -> FlowCurveEstimate:
    """As `identify_flow_curve`, with the uncertainty of each control point and whether it was measured."""
    return FlowCurveEstimate(
        **_native.identify_flow_curve(
            _runs(spool), _runs(displacement), sample_rate, piston_area, knots, method
        )
    )


def identify_flow_curve(
    spool: ArrayLike | Sequence[ArrayLike],
    displacement: ArrayLike | Sequence[ArrayLike],
    sample_rate: float,
    piston_area: float,
    knots: int = 21,
    *,
    method: FlowMethod = "integral",
) -> FlowTable:
    """Find the flow curve from spool opening and displacement of an actuator without load (Fig. 4b).

    The flow is the piston's motion, so a piecewise linear curve is fitted to
    ``A·x(t) = A·x(0) + ∫f(spool) dt``; offset and drift of every recording are found along with it. NaN are
    gaps. Control points that the spool never reached lie on the line through the last two that it did.

    The paper's own way, the mean of central differences near each control point, is `method` "difference". It
    gives the same on clean data and is at the mercy of noise: a displacement that scatters by 1 % of the
    stroke at 2 kHz scatters as flow by more than the valve has.

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
    method : {"integral", "difference"}
        Fit of the displacement, or mean of its central differences.

    Raises
    ------
    ValueError
        If the data cannot carry an answer; the message says why.
    """
    return flow_curve_estimate(spool, displacement, sample_rate, piston_area, knots, method=method).table


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


@dataclass(frozen=True)
class FineTuning:
    """Compensation level and response delay that a test asks for, and what one sees in it (Fig. 11)."""

    level: Estimate
    """The level with which the motion would have been compensated exactly."""
    response_delay: Estimate
    """The response delay that leaves none, s."""
    natural_frequency: float
    """Where the structure moved most, Hz."""
    force_ratio: float
    """``abs(FFT(force)) / abs(FFT(command))`` there; below 1 the test was undercompensated."""
    peak: float
    """Frequency of the largest ratio about it, Hz."""
    valley: float
    """Frequency of the smallest ratio about it, Hz."""

    @property
    def peak_before_valley(self) -> bool:
        """Whether the delay was compensated too little, as the paper tells it by eye."""
        return self.peak < self.valley

    def apply(self, rig: Rig) -> Rig:
        """Return the rig with this level and response delay."""
        return rig.replace(
            {
                "compensation.level": float(self.level),
                "compensation.response_delay": float(self.response_delay),
            }
        )


def fine_tune(
    rig: Rig,
    command: ArrayLike,
    force: ArrayLike,
    velocity: ArrayLike,
    sample_rate: float,
    band: tuple[float, float] = (0.25, 10.0),
) -> FineTuning:
    """Find level and response delay from a test with the present ones (Fig. 11): a sweep is best.

    The opening that the measured velocity calls for is set against the one that the compensation gave, which
    is what the flow balance asks for less what the force error opened. Their ratio about the natural
    frequency has the level in its size and the delay in its phase. The rig's flow curve, gains and valve are
    taken for granted, so a wrong flow gain shows as a level.

    Parameters
    ----------
    rig : Rig
        The rig as it was set in the test.
    command, force : array_like
        In N, simultaneous samples, one dimension, without gaps.
    velocity : array_like
        In m/s.
    sample_rate : float
        In Hz.
    band : tuple of float
        Frequencies in Hz between which the structure's motion counts.

    Returns
    -------
    FineTuning
        The uncertainties are those of scatter. On the virtual rig the level comes out within 0.005 and the
        delay within 0.15 ms of the exact ones whatever the settings of Fig. 11.

    Raises
    ------
    ValueError
        If compensation is off, the structure hardly moves, moves too much for the linear scheme, or units or
        signs cannot be right; the message says which.
    """
    found = _native.fine_tune(rig, command, force, velocity, sample_rate, band)
    return FineTuning(
        level=Estimate(*found.pop("level")),
        response_delay=Estimate(*found.pop("response_delay")),
        **found,
    )


def _runs(given: ArrayLike | Sequence[ArrayLike]) -> list[ArrayLike]:
    """One array is a list of one; a list of numbers is one array."""
    if isinstance(given, (list, tuple)):
        return list(given) if given and np.ndim(given[0]) else [given]
    array = np.asarray(given)
    return list(array) if array.ndim == 2 else [array]
