"""Tests on the virtual rig, and what they would be without error or cost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Literal, NamedTuple, Protocol

from eft import _native
from eft._energy import EnergyBalance
from eft._native import Command, Rig
from eft._run import Array, Dtype, TestRun
from eft._watch import show

__all__ = ["IdealResponse", "StepController", "energy_balance", "ideal_response", "simulate"]

Structure = Callable[[Any, float], tuple[Any, Any]]
"""A structure from outside."""

Method = Literal["exponential", "runge-kutta"]

_TAKEN: dict[str, object] = {
    "controller.realization": "digital",
    "controller.force_loop": "pd",
    "controller.velocity_source": "sensor",
    "compensation.adaptive": False,
    "compensation.guard": False,
    "protection.enabled": False,
}
"""What a rig's own controller would do, and one from outside does itself."""

_CONVERGED_STEP = 1.0 / 65_536.0
"""Largest integration step of a converged run, s."""


class StepController(Protocol):
    """What `simulate` asks of a controller from outside; `eft.Controller` is one."""

    def step(
        self,
        command: float,
        velocity: float,
        force: float,
        spool: float,
        *,
        supply_pressure: float,
        displacement: float,
        acceleration: float,
        next_command: float,
    ) -> float:
        """Return the valve command (V).

        The force command is in N. The sensors report velocity (m/s), force (N), spool opening, supply
        pressure (Pa), displacement (m) and acceleration (m/s²). ``next_command`` is that of the next sample.
        A controller that needs only some of the named ones takes the others as ``**_``.
        """


class IdealResponse(NamedTuple):
    """What the structure does under the command applied without error."""

    time: Array
    """In s."""
    displacement: Array
    """In m."""
    velocity: Array
    """In m/s."""


def simulate(
    rig: Rig,
    command: Command,
    dtype: Dtype = "f64",
    *,
    method: Method | None = None,
    largest_step: float | None = None,
    converged: bool = False,
    controller: StepController | None = None,
    structure: Structure | None = None,
    progress: Callable[[int, int], object] | None = None,
    watch: bool = False,
) -> TestRun:
    """Run a test on the virtual rig; the digital side runs at the command's sample rate.

    Other threads go on meanwhile, and Ctrl-C stops the run.

    Parameters
    ----------
    rig : Rig
        The rig to be tested.
    command : Command
        The force to be applied; for a shear building (actuators, samples), the ground floor's first. There
        every floor has the rig's actuator and noise of its own, all share the supply, and when the
        protection of one trips, all others trip at the next sample.
    dtype : {"f64", "f32"}
        Precision of the controller; the plant is always computed in double precision.
    method : {"exponential", "runge-kutta"}, optional
        How the plant is carried through a step. "exponential", the default, takes its linear part exactly and
        evaluates the load flow once a step. "runge-kutta" is the classical method of fourth order: a half to
        a third of the error for four evaluations. A rig with effects beyond the paper's model takes
        Runge–Kutta steps whatever is asked for.
    largest_step : float, optional
        Largest integration step, s; a sample period is cut into equal steps no longer than this. The default
        of 1/4096 s keeps the force of the paper's tests within 1e-4 of its peak of the converged answer;
        halving it divides the error by three at least.
    converged : bool
        Whether to run with Runge–Kutta steps of 1/65536 s, against which the other choices are judged: about
        twenty times as long. It takes the place of the two above.
    controller : object with step, optional
        Replaces the rig's controller: called once a sample as ``step(command, velocity, force, spool,
        supply_pressure=..., displacement=..., acceleration=..., next_command=...)`` with what the sensors
        report, it gives the valve command in V. Sensors and converter are the rig's, the force loop is
        digital, and there is no protection but the controller's. What goes in and out has single precision.
        An exception of the controller ends the call.
    structure : callable, optional
        Replaces the rig's structure: called once a sample as ``structure(force, dt)`` with the mean force
        over the sample in N and its length in s, it gives displacement (m) and velocity (m/s) at its end;
        arrays for a shear building. See `eft.opensees.Structure`. The plant takes Runge–Kutta steps then. A
        structure that raises `StructureError`, or moves by what is not finite, ends the test: see
        `TestRun.stopped`.
    progress : callable, optional
        Called a few times a second with the samples done and their total; an exception from it ends the run.
    watch : bool
        Whether to step the test through `eft.watch` first and print force, error, spool and estimates as it
        runs. It needs what `eft.watch` needs; the run returned is the same with and without it.

    Returns
    -------
    TestRun
        With as many samples as the command, or fewer, and finite, if it diverged (see `success`) or the
        structure ended it.

    Raises
    ------
    ValueError
        If an argument is not allowed; the message names it.

    Examples
    --------
    >>> import eft
    >>> command = eft.sine_sweep(2000.0, 0.0, 5.0, duration=4.0, sample_rate=4096.0)
    >>> run = eft.simulate(eft.Rig.zhao2005(), command)
    >>> run.success, run.force.shape
    (True, (16384,))
    """
    if converged:
        for name, value in (("method", method), ("largest_step", largest_step)):
            if value is not None:
                raise ValueError(
                    f"{name} = {value!r}: must be left out of a converged run, which has its own"
                )
        method, largest_step = "runge-kutta", _CONVERGED_STEP
    if controller is not None:
        if watch:
            raise ValueError("watch = True: must be left out with a controller from outside")
        rig, dtype = rig.replace(_TAKEN), "f32"
    if watch:
        show(rig, command, dtype)
    options: dict[str, Any] = {"method": method or "exponential", "largest_step": largest_step}
    if structure is not None:
        options["structure"] = structure
    if controller is None:
        outcome = _native.simulate(rig, command, dtype, progress, **options)
    else:
        outcome = _native.simulate_controlled(rig, command, controller.step, progress, **options)
    run = TestRun._of(rig, command, dtype, outcome, structure is not None)
    return run if controller is None else replace(run, _controlled=True)


def ideal_response(rig: Rig, command: Command) -> IdealResponse:
    """Compute what the rig's structure would do if the command were applied without error.

    The structure starts at rest; the command is linear between samples.

    Parameters
    ----------
    rig : Rig
        The rig.
    command : Command
        The force.

    Returns
    -------
    IdealResponse
        Time, displacement and velocity; of a shear building the last two are (actuators, samples).

    Raises
    ------
    ValueError
        If the command does not fit the rig, or the structure is too stiff to be integrated.

    Examples
    --------
    >>> import eft
    >>> command = eft.Command.step(1000.0, duration=10.0, sample_rate=512.0)
    >>> f"{1e3 * eft.ideal_response(eft.Rig.zhao2005(), command).displacement.max():.1f} mm"
    '2.7 mm'
    """
    return IdealResponse(command.time, *_native.ideal_response(rig, command))


def energy_balance(rig: Rig, command: Command, *, largest_step: float | None = None) -> EnergyBalance:
    """Run a test with the books of its energy.

    Parameters
    ----------
    rig : Rig
        The rig.
    command : Command
        The force to be applied.
    largest_step : float, optional
        Of the Runge–Kutta integration, s; the default is that of `simulate`, 1/4096 s. The gap shrinks with
        it and tells how far the integration can be trusted.

    Returns
    -------
    EnergyBalance
        In J; the actuators of a shear building share one.

    Raises
    ------
    ValueError
        If an argument is not allowed; the message names it.

    Examples
    --------
    >>> import eft
    >>> command = eft.sine_sweep(2000.0, 0.5, 5.0, duration=4.0, sample_rate=4096.0)
    >>> balance = eft.energy_balance(eft.Rig.zhao2005(), command)
    >>> balance.valve / balance.dissipated > 0.9
    True
    """
    return EnergyBalance(**_native.energy_balance(rig, command, largest_step))
