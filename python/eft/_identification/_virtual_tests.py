"""Identification tests of the paper, run on the virtual rig."""

from __future__ import annotations

from typing import NamedTuple

from eft import _native
from eft._identification._estimate import Array
from eft._native import Rig
from eft._read_only import read_only


class ValveTest(NamedTuple):
    """Signals of a response delay test, Fig. 4a."""

    valve_command: Array
    """In V."""
    spool: Array
    """Spool opening."""


class FlowTest(NamedTuple):
    """Signals of a flow test, Fig. 4b."""

    command: Array
    """Displacement command, m."""
    displacement: Array
    """In m."""
    spool: Array
    """Spool opening."""


def valve_test(rig: Rig, amplitude: float = 0.0254, sample_rate: float = 2048.0) -> ValveTest:
    """Run the response delay test of Fig. 4a on the virtual rig.

    The main stage is shut off; the command is a 0–10 Hz sweep in 32 s. It is held over each sample, which
    makes the spool half a sample later.

    Parameters
    ----------
    rig : Rig
        The rig.
    amplitude : float
        Amplitude of the displacement command in m; displacement control gives 10 V per full stroke.
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
    return ValveTest(*map(read_only, _native.valve_test(rig, amplitude, sample_rate)))


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
        Amplitude of the displacement command in m.
    frequency, duration : float
        Frequency and duration of the sine, in Hz and s.
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
    found = _native.flow_test(rig, amplitude, frequency, duration, piston_mass, sample_rate)
    return FlowTest(*map(read_only, found))


def free_vibration(
    rig: Rig, displacement: float, duration: float = 10.0, sample_rate: float = 512.0
) -> Array:
    """Simulate free vibration of the rig's structure, disconnected from the actuator.

    Parameters
    ----------
    rig : Rig
        The rig.
    displacement : float
        Initial displacement, in m.
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
