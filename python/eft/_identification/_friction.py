"""Friction of the seals from a test of the whole rig."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import ArrayLike

from eft import _native
from eft._identification._estimate import Estimate
from eft._native import Rig


@dataclass(frozen=True)
class FrictionEstimate:
    """Friction of the seals, with the other numbers of the same flow balance."""

    friction: Estimate
    """Coulomb friction in N, whose flow is the measured one at the configured compressibility."""
    compressibility: Estimate
    """Compressibility of the oil, m³/Pa."""
    flow_factors: tuple[Estimate, Estimate]
    """Flow over that of the configured valve, in the negative and in the positive direction."""
    velocity_delay: Estimate
    """Delay of the velocity behind the spool by their sensors, s."""

    def apply(self, rig: Rig) -> Rig:
        """Return the rig with this friction, and with none if the estimate is negative.

        Parameters
        ----------
        rig : Rig
            The rig to be changed.

        Returns
        -------
        Rig

        Raises
        ------
        ValueError
            If the rig does not allow the value; the message names the key.

        Examples
        --------
        >>> import eft
        >>> rig = eft.Rig.zhao2005().replace({"truth.actuator.friction": 300.0})
        >>> run = eft.simulate(rig, eft.sine_sweep(4000.0, 0.5, 6.0, 16.0, 4096.0))
        >>> found = eft.identification.identify_friction(rig, run.spool, run.velocity, run.force, 4096.0)
        >>> round(found.apply(rig)["actuator.friction"], -2)
        300.0
        """
        return rig.replace({"actuator.friction": max(float(self.friction), 0.0)})


def identify_friction(
    rig: Rig, spool: ArrayLike, velocity: ArrayLike, force: ArrayLike, sample_rate: float
) -> FrictionEstimate:
    """Find the friction of the seals in the spool, velocity and force of a test, preferably a sweep.

    The load cell is behind the seals, so the oil carries the force and the friction. At each reversal the
    friction changes its sign, and the oil takes flow. Least squares fit this flow between 0.5 and 40 Hz,
    together with the flows in both directions, the compressibility, and delay, offset and drift of the
    velocity. A force that is excited from 15 to 40 Hz also shows its own delay, which is then fitted. Flow
    curve, overlap, null bias, supply pressure, area and leakage are those of `rig`. A drift of the spool's
    sensor changes the friction.

    Parameters
    ----------
    rig : Rig
        The rig as configured, with its overlap.
    spool : array_like
        Spool opening as a fraction of its stroke, one dimension, without gaps.
    velocity : array_like
        Piston velocity in m/s.
    force : array_like
        Measured force in N.
    sample_rate : float
        In Hz.

    Returns
    -------
    FrictionEstimate
        The uncertainties cover random errors only. Friction makes the compressibility too small, by more than
        its uncertainty: 800 N by 3.2 % in a sweep of 8.9 kN to 10 Hz and by 10.9 % in one of 2.2 kN on the
        paper's rig. Noise of 0.1 % of the ranges alone makes it too small by 0.0 % and 0.5 %. The page on
        laboratory rigs has the errors on random rigs with late and noisy sensors.

    Raises
    ------
    ValueError
        If a signal is short or has gaps, if the piston hardly moves, or if a unit or a sign is wrong: flows a
        third or three times those of the configured valve, or a compressibility below 1/30 or above 30 times
        the configured one.

    Examples
    --------
    >>> import eft
    >>> rig = eft.Rig.zhao2005()
    >>> sweep = eft.sine_sweep(2200.0, 0.0, 10.0, duration=16.0, sample_rate=2048.0)
    >>> run = eft.simulate(rig.replace({"truth.actuator.friction": 500.0}), sweep)
    >>> signals = run.measured_spool, run.measured_velocity, run.measured_force
    >>> found = eft.identification.identify_friction(rig, *signals, 2048.0)
    >>> 400.0 < found.friction < 600.0
    True
    """
    friction, compressibility, back, forth, delay = (
        Estimate(*one) for one in _native.identify_friction(rig, spool, velocity, force, sample_rate)
    )
    return FrictionEstimate(friction, compressibility, (back, forth), delay)
