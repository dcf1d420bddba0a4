"""Margins, delays and gains of a rig's loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eft import _native
from eft._native import Rig
from eft._read_only import read_only
from eft._results import Result

__all__ = [
    "DelayBudget",
    "InverseDynamics",
    "ObserverGains",
    "StabilityMargins",
    "delay_budget",
    "inverse_dynamics",
    "observer_gains",
    "stability_margins",
]

FlowGain = Literal["nominal", "steeper", "shallower", "mean"]


@dataclass(frozen=True)
class StabilityMargins(Result):
    """The stable range of each setting, changed alone; None if the unchanged rig is unstable."""

    growth_rate: float
    """Growth rate of the least damped mode of the unchanged rig, 1/s."""
    level: float
    """The largest stable compensation level."""
    response_delay: tuple[float, float] | None = None
    """Lowest and highest stable value, s."""
    dead_time: float | None = None
    """The shortest additional delay of the compensation or of the whole valve command that makes the loop
    unstable, s; infinite if there is none."""
    loop_gain: float | None = None
    """The largest stable factor on the force loop."""
    flow_gain: tuple[float, float] | None = None
    """Lowest and highest stable ratio of the true flow gain to the configured one."""


@dataclass(frozen=True)
class DelayBudget(Result):
    """The parts of the delay that the lead network must compensate for, all in s."""

    valve: float
    """Delay of the servovalve."""
    hold: float
    """Half a sample for the hold, and ``dac.delay``."""
    computation: float
    """Delay of the computation."""
    sensor: float
    """Delay of the velocity sensor; negative for an estimated velocity that leads."""
    derivative: float
    """Delay of the force controller's derivative action; it is negative, because it leads."""
    path: float
    """Delay of the compensation's path, which has all parts except `derivative` (force error only)."""
    total: float
    """The sum of all parts, as in the paper."""


class InverseDynamics(NamedTuple):
    """The frequency responses of Fig. 6."""

    valve: NDArray[np.complex128]
    """Of the servovalve, Eq. (4)."""
    lead: NDArray[np.complex128]
    """Of the lead network that inverts it, Eq. (8)."""


class ObserverGains(NamedTuple):
    """The steady-state gains of a velocity observer."""

    displacement: float
    """On displacement, 1."""
    velocity: float
    """On velocity, 1/s."""
    drift: float
    """On drift, 1/s²."""


def stability_margins(
    rig: Rig,
    *,
    sampled: bool = False,
    sample_rate: float | None = None,
    flow_gain: FlowGain = "nominal",
) -> StabilityMargins:
    """Find every stability margin of the linear model, each setting changed alone.

    Parameters
    ----------
    rig, sampled, sample_rate, flow_gain
        As of `eft.linearize`.

    Returns
    -------
    StabilityMargins
        Growth rate, level, response delay, dead time, loop gain and flow gain. Dead time is counted in whole
        samples, up to 64 of them, or as many as a building's model can hold.

    Raises
    ------
    ValueError
        If an argument is not allowed; the message names it.

    Examples
    --------
    >>> import eft
    >>> margins = eft.linear.stability_margins(eft.Rig.zhao2005())
    >>> margins.growth_rate < 0.0 < margins.level
    True
    """
    found = _native.stability_margins(rig, sampled=sampled, sample_rate=sample_rate, flow_gain=flow_gain)
    return StabilityMargins(**found)


def delay_budget(
    rig: Rig, sample_rate: float | None = None, band: tuple[float, float] = (0.25, 10.0)
) -> DelayBudget:
    """Find the parts of the delay that the lead network must compensate for.

    The function does not change ``compensation.response_delay``.

    Parameters
    ----------
    rig : Rig
        The rig.
    sample_rate : float, optional
        In Hz; that of the rig's controller if not given.
    band : tuple of float
        Band in Hz over which phases are converted to delays.

    Returns
    -------
    DelayBudget
        In s.

    Raises
    ------
    ValueError
        If an argument is not allowed; the message names it.

    Examples
    --------
    >>> import eft
    >>> budget = eft.linear.delay_budget(eft.Rig.zhao2005())
    >>> round(budget.hold, 6)
    0.000122
    """
    return DelayBudget(**_native.delay_budget(rig, sample_rate, band))


def observer_gains(rig: Rig, sample_rate: float | None = None) -> ObserverGains:
    """Find the steady-state gains of a rig's velocity observer.

    They solve the discrete Riccati equation for the noises in ``controller.observer_...``.

    Parameters
    ----------
    rig : Rig
        The rig.
    sample_rate : float, optional
        In Hz; that of the rig's controller if not given.

    Returns
    -------
    ObserverGains
        On displacement (1), velocity (1/s) and drift (1/s²).

    Raises
    ------
    ValueError
        If an argument is not allowed; the message names it.

    Examples
    --------
    >>> import eft
    >>> observer = {"controller.velocity_source": "observer", "controller.observer_mass": 7040.0}
    >>> rig = eft.Rig.zhao2005().replace(observer)
    >>> 0.0 < eft.linear.observer_gains(rig).displacement < 1.0
    True
    """
    return ObserverGains(*_native.observer_gains(rig, sample_rate))


def inverse_dynamics(rig: Rig, frequency: ArrayLike) -> InverseDynamics:
    """Compute the frequency responses of Fig. 6: the servovalve and the lead network that inverts it.

    Parameters
    ----------
    rig : Rig
        The rig.
    frequency : array_like
        In Hz, one dimension.

    Returns
    -------
    InverseDynamics
        Two complex arrays.

    Raises
    ------
    ValueError
        If a frequency is not allowed.

    Examples
    --------
    >>> import eft
    >>> valve, lead = eft.linear.inverse_dynamics(eft.Rig.zhao2005(), [0.0])
    >>> f"{abs(valve * lead)[0]:.2f}"
    '1.00'
    """
    return InverseDynamics(*map(read_only, _native.inverse_dynamics(rig, frequency)))
