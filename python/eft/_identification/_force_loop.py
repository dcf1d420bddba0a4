"""Valve, oil and latencies of a force loop from a test of the whole rig."""

from __future__ import annotations

from dataclasses import dataclass, fields

from numpy.typing import ArrayLike

from eft import _native
from eft._identification._estimate import Estimate
from eft._native import Rig


@dataclass(frozen=True)
class ForceLoopEstimate:
    """Valve, oil and sensor latencies of a force loop."""

    force_delay: Estimate
    """Latency of the load cell, s."""
    spool_delay: Estimate
    """Latency of the spool's sensor, s."""
    response_delay: Estimate
    """Delay of the spool itself behind the valve command at low frequency, s."""
    pilot_time_constant: Estimate
    """Pilot time constant, s."""
    compressibility: Estimate
    """Compressibility of the oil, m³/Pa."""

    def apply(self, rig: Rig) -> Rig:
        """Return the rig with valve, oil and latency of the load cell as found.

        A negative latency becomes none. `controller.identified_plant` becomes true if two standard deviations
        of compressibility and pilot time constant are within 20 %, so that a designed loop allows for smaller
        errors of both. A configured friction keeps its flow, which the compressibility scales.
        `compensation.response_delay` stays, because self-calibration and fine tuning find it with the latency
        of the velocity. A plant's value that is not under `truth` is that of the configuration, so it changes
        as well.

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
        >>> rig = eft.Rig.zhao2005().replace({"controller.force_loop": "robust"})
        >>> sweep = eft.sine_sweep(2200.0, 0.0, 40.0, duration=16.0, sample_rate=4096.0)
        >>> run = eft.simulate(rig.replace({"truth.sensors.force.delay": 4}), sweep)
        >>> signals = run.valve_command, run.measured_spool, run.measured_velocity, run.measured_force
        >>> found = eft.identification.identify_force_loop(rig, *signals, 4096.0)
        >>> f"{1e3 * found.apply(rig)['controller.force_delay']:.1f} ms"
        '1.0 ms'
        """
        return rig.replace(self.keys(rig))

    def keys(self, rig: Rig) -> dict[str, float | bool]:
        """Return the keys that `apply` changes, with their values.

        Parameters
        ----------
        rig : Rig
            The rig to be changed.

        Returns
        -------
        dict

        Examples
        --------
        >>> import eft
        >>> rig = eft.Rig.zhao2005().replace({"controller.force_loop": "robust"})
        >>> sweep = eft.sine_sweep(2200.0, 0.0, 40.0, duration=16.0, sample_rate=4096.0)
        >>> run = eft.simulate(rig, sweep)
        >>> signals = run.valve_command, run.measured_spool, run.measured_velocity, run.measured_force
        >>> found = eft.identification.identify_force_loop(rig, *signals, 4096.0)
        >>> found.keys(rig)["controller.identified_plant"]
        True
        """
        found = [getattr(self, one.name) for one in fields(self)]
        return _native.force_loop_keys(rig, [(float(one), one.uncertainty) for one in found])


def identify_force_loop(
    rig: Rig,
    valve_command: ArrayLike,
    spool: ArrayLike,
    velocity: ArrayLike,
    force: ArrayLike,
    sample_rate: float,
) -> ForceLoopEstimate:
    """Find valve, oil and sensor latencies of a force loop in a test, preferably a sweep from 0 to 40 Hz.

    Only the valve command has no latency. The spool follows it with the response of the paper's valve,
    Eqs. (2) and (3), and with the latency of its sensor, fitted from 1 to 200 Hz. Between 15 and 40 Hz the
    compression of the oil takes much of the flow. Least squares of the flow balance find the compressibility
    and the delay of the force behind the spool there. Flow curve, overlap, supply pressure, area and leakage
    are those of `rig`.

    Parameters
    ----------
    rig : Rig
        The rig as configured, with its overlap, and with its torque motor if it has one.
    valve_command : array_like
        Valve command in V, one dimension, without gaps, as the controller samples it.
    spool : array_like
        Spool opening as a fraction of its stroke.
    velocity : array_like
        Piston velocity in m/s.
    force : array_like
        Measured force in N.
    sample_rate : float
        In Hz.

    Returns
    -------
    ForceLoopEstimate
        The uncertainties cover random errors only. A further lag of the valve counts to the sensors. Noise
        makes the compressibility too small, by more than its uncertainty: noise of 0.1 % of the ranges by
        0.3 % in a sweep of 8.9 kN and by 4.8 % in one of 2.2 kN on the paper's rig. With a friction of 800 N
        that is not configured it is 1.4 % and 8.1 %. The page on laboratory rigs has the errors on random
        rigs.

    Raises
    ------
    ValueError
        If a signal is short or has gaps, if the spool does not follow the valve command, if a unit or a sign
        is wrong, or if the test lacks these frequencies.

    Examples
    --------
    >>> import eft
    >>> rig = eft.Rig.zhao2005().replace({"controller.force_loop": "robust"})
    >>> sweep = eft.sine_sweep(2200.0, 0.0, 40.0, duration=16.0, sample_rate=4096.0)
    >>> run = eft.simulate(rig.replace({"truth.sensors.force.delay": 4}), sweep)
    >>> signals = run.measured_spool, run.measured_velocity, run.measured_force
    >>> found = eft.identification.identify_force_loop(rig, run.valve_command, *signals, 4096.0)
    >>> abs(found.force_delay - 4 / 4096.0) < 1e-4
    True
    """
    found = _native.identify_force_loop(rig, valve_command, spool, velocity, force, sample_rate)
    return ForceLoopEstimate(*(Estimate(*one) for one in found))
