"""Gain of the load cell from a test of the whole rig, against the specimen's inertia."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import ArrayLike

from eft import _native
from eft._identification._estimate import Estimate
from eft._native import Rig


@dataclass(frozen=True)
class LoadCellEstimate:
    """The gain of the load cell, and the ratios of the sensors' gains."""

    gain: Estimate
    """Reading of the load cell over the force; divide the calibration of the load cell by it."""
    force_over_velocity: Estimate
    """Gain of the load cell over that of the velocity sensor, for the configured mass."""
    velocity_over_displacement: Estimate
    """Gain of the velocity sensor over that of the displacement sensor."""


def identify_load_cell(
    rig: Rig,
    displacement: ArrayLike,
    velocity: ArrayLike,
    force: ArrayLike,
    sample_rate: float,
    *,
    gain_uncertainty: float = 0.01,
    mass_uncertainty: float = 0.0,
) -> LoadCellEstimate:
    """Find the gain of the load cell in a test, preferably a sweep from 0 to 40 Hz.

    From four times the natural frequency to 35 Hz the inertia takes nearly the whole force, so a known mass
    compares force and velocity. Displacement and velocity are compared from 0.5 to 10 Hz. The gains of all
    three sensors have the same tolerance, with a rectangular distribution of softened limits. The gain of the
    load cell is the mean of those that leave all three within it. The further the three gains lie apart
    within the tolerance, the more certain it is. Latencies of the sensors have no effect. Configured
    bandwidths and attachment are allowed for. An unknown bandwidth below some hundred Hz changes the gain,
    and so does a specimen that is not elastic above four times its natural frequency.

    Parameters
    ----------
    rig : Rig
        The rig as configured, with mass, damping and stiffness of the specimen.
    displacement : array_like
        Displacement in m, one dimension, without gaps.
    velocity : array_like
        Velocity in m/s.
    force : array_like
        Measured force in N.
    sample_rate : float
        In Hz.
    gain_uncertainty : float
        Standard deviation of each sensor's gain before the test, as a share: its tolerance over √3.
    mass_uncertainty : float
        Standard deviation of `structure.mass`, as a share.

    Returns
    -------
    LoadCellEstimate
        The uncertainties of the ratios cover random errors, that of the gain also the two given ones.

    Raises
    ------
    ValueError
        If a signal is short or has gaps, an uncertainty is out of range, the sample rate is below 80 Hz, the
        structure is a building, has a power damper or a natural frequency above 8.75 Hz, the piston has play,
        the test lacks these frequencies, a unit or a sign is wrong, or two gains lie further apart than 4
        times `gain_uncertainty`, by more than three standard deviations of their ratio.

    Examples
    --------
    >>> import eft
    >>> rig = eft.Rig.zhao2005().replace({"controller.force_loop": "robust"})
    >>> sweep = eft.sine_sweep(8900.0, 0.0, 40.0, duration=16.0, sample_rate=4096.0)
    >>> run = eft.simulate(rig.replace({"truth.sensors.force.gain": 1.03}), sweep)
    >>> signals = run.measured_displacement, run.measured_velocity, run.measured_force
    >>> found = eft.identification.identify_load_cell(rig, *signals, 4096.0)
    >>> round(found.force_over_velocity, 2), round(found.gain, 2)
    (1.03, 1.02)
    """
    signals = displacement, velocity, force
    found = _native.identify_load_cell(rig, signals, sample_rate, gain_uncertainty, mass_uncertainty)
    return LoadCellEstimate(*(Estimate(*one) for one in found))
