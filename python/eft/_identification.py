"""Identification from measured arrays: estimates that are numbers and know their uncertainty."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eft import _native
from eft._native import FlowTable, Rig

__all__ = [
    "DampingEstimate",
    "DelayEstimate",
    "Estimate",
    "FineTuning",
    "FlowTest",
    "ValveTest",
    "fine_tune",
    "flow_test",
    "free_vibration",
    "identify_damping",
    "identify_delay",
    "identify_flow_curve",
    "identify_flow_gain",
    "valve_test",
]

Array = NDArray[np.float64]
FlowMethod = Literal["integral", "difference"]


class Estimate(float):
    """A number with its standard uncertainty, in the same unit.

    It is used like any float.
    """

    __slots__ = ("uncertainty",)

    uncertainty: float
    """One standard deviation."""

    def __new__(cls, value: float, uncertainty: float) -> Estimate:
        """Make one from value and uncertainty."""
        self = super().__new__(cls, value)
        object.__setattr__(self, "uncertainty", uncertainty)
        return self

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"{name}: an estimate cannot be changed")

    def __reduce__(self) -> tuple[Any, ...]:
        return _estimate, (type(self), float(self), {name: getattr(self, name) for name in self._found()})

    @classmethod
    def _found(cls) -> list[str]:
        """What else stands beside the value."""
        return [name for kind in reversed(cls.__mro__) for name in getattr(kind, "__slots__", ())]

    @property
    def details(self) -> Mapping[str, Any]:
        """What else the identification found, by name."""
        return {name: getattr(self, name) for name in self._found() if name != "uncertainty"}

    def __repr__(self) -> str:
        return f"{float(self):.6g} ± {self.uncertainty:.2g}"


def _estimate(kind: type[Estimate], value: float, found: Mapping[str, Any]) -> Estimate:
    """An estimate with what was found along with it."""
    self = float.__new__(kind, value)
    for name, part in found.items():
        object.__setattr__(self, name, part)
    return self


class DelayEstimate(Estimate):
    """A delay in s, and the line through the phases that it is the slope of."""

    __slots__ = ("coherence", "frequency", "intercept", "lag")

    intercept: float
    """Of the line, rad."""
    coherence: float
    """1 where all phases lie on the line."""
    frequency: Array
    """Of every excited bin, Hz."""
    lag: Array
    """Of the phase there, rad."""


class DampingEstimate(Estimate):
    """A damping ratio, and the oscillation that it was found in."""

    __slots__ = ("decrement", "frequency")

    frequency: Estimate
    """Undamped, Hz."""
    decrement: float
    """Logarithmic."""


class ValveTest(NamedTuple):
    """A response delay test, Fig. 4a."""

    valve_command: Array
    """In V."""
    spool: Array
    """Spool opening."""


class FlowTest(NamedTuple):
    """A flow test, Fig. 4b."""

    command: Array
    """Displacement command, m."""
    displacement: Array
    """In m."""
    spool: Array
    """Spool opening."""


def identify_delay(
    command: ArrayLike, response: ArrayLike, sample_rate: float, band: tuple[float, float] = (0.25, 10.0)
) -> DelayEstimate:
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
    DelayEstimate
        The delay in s, positive when the response lags, with its ``uncertainty``; ``intercept`` (rad) and
        ``coherence`` (1 where all phases lie on the line); ``frequency`` (Hz) and ``lag`` (rad) of every
        excited bin.

    Raises
    ------
    ValueError
        If the data cannot carry an answer; the message says why.

    Examples
    --------
    >>> import eft
    >>> test = eft.identification.valve_test(eft.Rig.zhao2005())
    >>> delay = eft.identify_delay(test.valve_command, test.spool, 2048.0)
    >>> f"{1e3 * delay:.1f} ms"
    '5.4 ms'
    """
    found = _native.identify_delay(command, response, sample_rate, band)
    answer = _estimate(DelayEstimate, found.pop("value"), found)
    assert isinstance(answer, DelayEstimate)
    return answer


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

    Returns
    -------
    FlowTable
        With the ``uncertainty`` of each flow, and whether its point was ``measured``.

    Raises
    ------
    ValueError
        If the data cannot carry an answer; the message says why.

    Examples
    --------
    >>> import eft
    >>> rig = eft.Rig.zhao2005()
    >>> test = eft.identification.flow_test(rig, amplitude=0.1)
    >>> area = rig["actuator.piston_area"]
    >>> table = eft.identify_flow_curve(test.spool, test.displacement, 2048.0, area)
    >>> len(table), table.measured.any().item()
    (21, True)
    """
    runs = (_runs(spool), _runs(displacement))
    return _native.identify_flow_curve(*runs, sample_rate, piston_area, knots, method)


def identify_flow_gain(
    spool: ArrayLike | Sequence[ArrayLike],
    displacement: ArrayLike | Sequence[ArrayLike],
    sample_rate: float,
    piston_area: float,
    limit: float = 0.1,
) -> Estimate:
    """Find the flow gain `K_v` in m³/s: one slope for all openings within ±`limit`.

    Parameters
    ----------
    spool, displacement, sample_rate, piston_area
        As of `eft.identify_flow_curve`.
    limit : float
        Largest opening that counts.

    Returns
    -------
    Estimate
        In m³/s.

    Raises
    ------
    ValueError
        If the data cannot carry an answer; the message says why.

    Examples
    --------
    >>> import eft
    >>> rig = eft.Rig.zhao2005()
    >>> test = eft.identification.flow_test(rig, amplitude=0.02)
    >>> gain = eft.identification.identify_flow_gain(
    ...     test.spool, test.displacement, 2048.0, rig["actuator.piston_area"]
    ... )
    >>> gain > 10 * gain.uncertainty > 0
    True
    """
    runs = (_runs(spool), _runs(displacement))
    return Estimate(*_native.identify_flow_gain(*runs, sample_rate, piston_area, limit))


def identify_damping(displacement: ArrayLike, sample_rate: float) -> DampingEstimate:
    """Find the damping ratio from free vibration.

    Parameters
    ----------
    displacement : array_like
        Of any unit: the part of a record after the release.
    sample_rate : float
        In Hz.

    Returns
    -------
    DampingEstimate
        The damping ratio, with ``frequency`` (Hz, undamped, an `Estimate`) and ``decrement`` (logarithmic).

    Raises
    ------
    ValueError
        If the data is not one decaying oscillation of at least three cycles.

    Examples
    --------
    >>> import eft
    >>> rig = eft.Rig.zhao2005()
    >>> motion = eft.identification.free_vibration(rig, displacement=0.02)
    >>> f"{eft.identification.identify_damping(motion, 512.0):.3f}"
    '0.031'
    """
    ratio, spread, frequency, frequency_spread, decrement = _native.identify_damping(
        displacement, sample_rate
    )
    found = {
        "uncertainty": spread,
        "frequency": Estimate(frequency, frequency_spread),
        "decrement": decrement,
    }
    answer = _estimate(DampingEstimate, ratio, found)
    assert isinstance(answer, DampingEstimate)
    return answer


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

    Examples
    --------
    >>> import eft
    >>> rig = eft.Rig.zhao2005().replace({"compensation.level": 0.9})
    >>> run = eft.simulate(rig, eft.sine_sweep(8900.0, 0.0, 10.0, duration=32.0, sample_rate=1024.0))
    >>> found = eft.identification.fine_tune(rig, run.command, run.force, run.velocity, 1024.0)
    >>> f"{found.level:.2f}"
    '1.00'
    """
    found = _native.fine_tune(rig, command, force, velocity, sample_rate, band)
    return FineTuning(
        level=Estimate(*found.pop("level")),
        response_delay=Estimate(*found.pop("response_delay")),
        **found,
    )


def valve_test(rig: Rig, amplitude: float = 0.0254, sample_rate: float = 2048.0) -> ValveTest:
    """Run the response delay test of Fig. 4a on the virtual rig.

    The main stage is shut off; the command is a 0–10 Hz sweep in 32 s.

    Parameters
    ----------
    rig : Rig
        The rig.
    amplitude : float
        Of the displacement command in m; displacement control gives 10 V per full stroke.
    sample_rate : float
        In Hz.

    Returns
    -------
    ValveTest
        Valve command (V) and spool opening.

    Raises
    ------
    ValueError
        If an argument is not allowed; the message names it.

    Examples
    --------
    >>> import eft
    >>> len(eft.identification.valve_test(eft.Rig.zhao2005()).spool)
    65536
    """
    return ValveTest(*_native.valve_test(rig, amplitude, sample_rate))


def flow_test(
    rig: Rig,
    amplitude: float,
    frequency: float = 3.0,
    duration: float = 4.0,
    piston_mass: float = 20.0,
    sample_rate: float = 2048.0,
) -> FlowTest:
    """Run one flow test of Fig. 4b on the virtual rig: no structure, displacement control, a sine.

    Parameters
    ----------
    rig : Rig
        The rig.
    amplitude : float
        Of the displacement command in m.
    frequency, duration : float
        Of the sine, in Hz and s.
    piston_mass : float
        In kg.
    sample_rate : float
        In Hz.

    Returns
    -------
    FlowTest
        Command (m), displacement (m) and spool opening.

    Raises
    ------
    ValueError
        If an argument is not allowed; the message names it.

    Examples
    --------
    >>> import eft
    >>> command, displacement, spool = eft.identification.flow_test(eft.Rig.zhao2005(), 0.05)
    >>> round(command.max().item(), 3)
    0.05
    """
    return FlowTest(*_native.flow_test(rig, amplitude, frequency, duration, piston_mass, sample_rate))


def free_vibration(
    rig: Rig, displacement: float, duration: float = 10.0, sample_rate: float = 512.0
) -> Array:
    """Release the rig's structure, disconnected from the actuator.

    Parameters
    ----------
    rig : Rig
        The rig.
    displacement : float
        From which it is released, in m.
    duration : float
        In s.
    sample_rate : float
        In Hz.

    Returns
    -------
    numpy.ndarray
        Displacement in m.

    Raises
    ------
    ValueError
        If an argument is not allowed, or the rig has a building.

    Examples
    --------
    >>> import eft
    >>> eft.identification.free_vibration(eft.Rig.zhao2005(), 0.02)[0].item()
    0.02
    """
    return _native.free_vibration(rig, displacement, duration, sample_rate)


def _runs(given: ArrayLike | Sequence[ArrayLike]) -> list[ArrayLike]:
    """One array is a list of one; a list of numbers is one array."""
    if isinstance(given, (list, tuple)):
        return list(given) if given and np.ndim(given[0]) else [given]
    array = np.asarray(given)
    return list(array) if array.ndim == 2 else [array]
