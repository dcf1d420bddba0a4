"""Tests on the virtual rig, their ideal response, and their energy balance."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal, NamedTuple, Protocol

from eft import _native
from eft._energy import EnergyBalance
from eft._memory import memory_of_samples, warn_of_memory
from eft._native import Command, Rig
from eft._read_only import read_only
from eft._run import Array, Dtype, TestRun
from eft._sections import Calibration
from eft._watch import show

__all__ = ["IdealResponse", "StepController", "energy_balance", "ideal_response", "simulate"]

Structure = Callable[[Any, float], tuple[Any, Any]]
"""An external structure."""

Method = Literal["exponential", "runge-kutta"]

_TAKEN: dict[str, object] = {
    "controller.realization": "digital",
    "controller.force_loop": "pd",
    "controller.velocity_source": "sensor",
    "compensation.adaptive": False,
    "compensation.guard": False,
    "protection.enabled": False,
}
"""Settings of the rig's own controller that an external controller replaces."""

_CONVERGED_STEP = 1.0 / 65_536.0
"""Largest integration step of a converged run, s."""


class StepController(Protocol):
    """The interface of an external controller for `simulate`; `eft.Controller` is one."""

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
        """Return the valve command of one sample.

        A controller may accept unused named arguments as ``**_``.

        Parameters
        ----------
        command, next_command : float
            Force command of this sample and of the next one, N.
        velocity, force, spool, supply_pressure, displacement, acceleration : float
            Readings of the sensors, in m/s, N, 1, Pa, m and m/s².

        Returns
        -------
        float
            In V.

        Examples
        --------
        >>> import eft
        >>> class Proportional:
        ...     def step(self, command, velocity, force, spool, **_):
        ...         return 2e-5 * (command - force)
        >>> sweep = eft.sine_sweep(2000.0, 0.5, 5.0, 4.0, 1024.0)
        >>> eft.simulate(eft.Rig.zhao2005(), sweep, controller=Proportional()).success
        True
        """


_READ = ("command", "velocity", "force", "spool")
_NAMED = ("supply_pressure", "displacement", "acceleration", "next_command")


def _step_of(controller: StepController) -> Callable[..., Any]:
    """The method of an external controller; refuses an object without one, or with one for other signals."""
    step: Callable[..., Any] | None = getattr(controller, "step", None)
    if isinstance(controller, type) or not callable(step):
        kind = controller if isinstance(controller, type) else type(controller)
        found = f"the class {kind.__name__}" if kind is controller else f"an object of type {kind.__name__}"
        raise ValueError(f"controller = {found}: must be an object with a method step: eft.StepController")
    try:
        signature = inspect.signature(step)
    except (TypeError, ValueError):
        return step  # of an extension module that does not tell its arguments
    try:
        # Each signal stands for its own name.
        bound = signature.bind(*_READ, **{name: name for name in _NAMED}).arguments
        taken = {name: value for name, value in bound.items() if isinstance(value, str)}
    except TypeError:
        taken = None
    if taken is None or any(taken.get(name, name) != name for name in (*_READ, *_NAMED)):
        allowed = f"must accept {', '.join(_READ)} in this order, and by name {', '.join(_NAMED)}"
        raise ValueError(f"controller.step = {signature}: {allowed}; **_ accepts unused names")
    return step


def _of_all_floors(calibration: Any) -> Any:
    """The calibrations with one for each floor: without excitation a controller starts anew."""
    if not isinstance(calibration, list | tuple) or None not in calibration:
        return calibration
    known = [one for one in calibration if one is not None]
    return [known[0] | {"excitation": 0.0} if one is None else one for one in calibration] if known else None


_LESS = "shorten it or sample less often, or keep fewer traces: `eft.study` keeps none of them by default"


class IdealResponse(NamedTuple):
    """The motion of the structure under the command, applied without error."""

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
    calibration: Calibration
    | Mapping[str, Any]
    | Sequence[Calibration | Mapping[str, Any] | None]
    | None = None,
    progress: Callable[[int, int], object] | None = None,
    watch: bool = False,
) -> TestRun:
    """Run a test on the virtual rig at the command's sample rate.

    Other threads continue during the call, and Ctrl-C stops the run.

    Parameters
    ----------
    rig : Rig
        The rig to be tested.
    command : Command
        The force to be applied. A shear building needs the shape (actuators, samples), with the ground floor
        first. Every floor has the rig's actuator and its own noise. All floors share the supply. If the
        protection of one floor trips, the others trip at the next sample.
    dtype : {"f64", "f32"}
        Precision of the controller; the plant is always computed in double precision.
    method : {"exponential", "runge-kutta"}, optional
        The integration method. "exponential", the default, integrates the linear part exactly and evaluates
        the load flow once per step. "runge-kutta" is the classical method of fourth order. It has a half to a
        third of the error and needs four evaluations. A rig with effects beyond the paper's model always
        takes Runge–Kutta steps.
    largest_step : float, optional
        Largest integration step, s. A sample period is divided into equal steps that are not longer. With the
        default of 1/4096 s, the force of the paper's tests differs from the converged one by less than 1e-4
        of its peak. Half the step divides the error by at least three.
    converged : bool
        Whether to run with Runge–Kutta steps of 1/65536 s, the reference for the other choices. This takes
        about twenty times as long, and overrides `method` and `largest_step`.
    controller : object with step, optional
        Replaces the rig's controller. Its method ``step`` is called once a sample with command, velocity,
        force and spool. Further readings are named: ``supply_pressure``, ``displacement``, ``acceleration``
        and ``next_command``. It returns the valve command in V. Sensors and converter are the rig's. The
        force loop is digital, and the rig's protection is off. Arguments and result have single precision. An
        exception of the controller ends the call. A shear building is refused.
    structure : callable, optional
        Replaces the rig's structure. It is called once a sample as ``structure(force, dt)`` with the mean
        force over the sample in N and its length in s. It returns displacement (m) and velocity (m/s) at the
        end of the sample, as arrays for a shear building. See `eft.opensees.Structure`. The plant then takes
        Runge–Kutta steps. A structure that raises `StructureError`, or whose motion is not finite, ends the
        test. `TestRun.stopped` has the reason.
    calibration : mapping or sequence of mappings, optional
        The `TestRun.calibration` of an earlier test, from which an adaptive controller starts. For a shear
        building it is that of all controllers, or the `TestRun.calibrations` with one for each, where a
        controller with None starts anew. It replaces the section ``calibration`` of the rig. It must be of
        the same flow table, and within the bounds of ``compensation.learning``.
    progress : callable, optional
        Called a few times a second with the samples done and their total; an exception from it ends the run.
    watch : bool
        Whether to run the test first with `eft.watch`, which prints force, error, spool and estimates. It has
        the requirements of `eft.watch`. The returned run is the same with and without it.

    Returns
    -------
    TestRun
        The run has as many samples as the command. It has fewer if it diverged (see `success`) or if the
        structure ended it. All samples are finite, except lost measurements, which are NaN.

    Raises
    ------
    ValueError
        If an argument is not allowed; the message names it. If the test needs more memory than this machine
        has.

    Warns
    -----
    MemoryUseWarning
        If the test needs more than 2 GiB.

    Examples
    --------
    >>> import eft
    >>> command = eft.sine_sweep(2000.0, 0.0, 5.0, duration=4.0, sample_rate=4096.0)
    >>> run = eft.simulate(eft.Rig.zhao2005(), command)
    >>> run.success, run.force.shape
    (True, (16384,))
    """
    _native.check_rig(rig)
    if converged:
        for name, value in (("method", method), ("largest_step", largest_step)):
            if value is not None:
                raise ValueError(
                    f"{name} = {value!r}: must be left out of a converged run, which sets its own"
                )
        method, largest_step = "runge-kutta", _CONVERGED_STEP
    if calibration is not None:
        rig = rig.replace({"calibration": _of_all_floors(calibration)})
    if controller is not None:
        if watch:
            raise ValueError("watch = True: must be left out with an external controller")
        if rig["calibration"] is not None:
            raise ValueError(
                "calibration: must be left out with an external controller, which starts from its own"
            )
        if rig["structure.kind"] == "shear_building":
            raise ValueError(
                'structure.kind = "shear_building": must be of one actuator with an external controller'
            )
        step, rig, dtype = _step_of(controller), rig.replace(_TAKEN), "f32"
    warn_of_memory(f"command: {len(command)} samples need", memory_of_samples(rig, len(command)), _LESS)
    if watch:
        show(rig, command, dtype)
    options: dict[str, Any] = {"method": method or "exponential", "largest_step": largest_step}
    if structure is not None:
        if not callable(structure):
            kind = type(structure).__name__
            raise ValueError(
                f"structure = an object of type {kind}: must be callable as structure(force, dt)"
            )
        options["structure"] = structure
    if controller is None:
        outcome = _native.simulate(rig, command, dtype, progress, **options)
    else:
        outcome = _native.simulate_controlled(rig, command, step, progress, **options)
    run = TestRun._of(rig, command, dtype, outcome, structure is not None)
    return run if controller is None else replace(run, _controlled=True)


def ideal_response(rig: Rig, command: Command) -> IdealResponse:
    """Compute what the rig's structure would do if the command were applied without error.

    The structure starts at rest; the command is linear between samples. The steps of a linear structure are
    exact. A structure with softening, hysteresis or a power damper takes Runge-Kutta steps wherever its
    motion is not linear.

    Parameters
    ----------
    rig : Rig
        The rig.
    command : Command
        The force.

    Returns
    -------
    IdealResponse
        Time, displacement and velocity; for a shear building the last two have the shape (actuators,
        samples).

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
    return IdealResponse(*map(read_only, (command.time, *_native.ideal_response(rig, command))))


def energy_balance(rig: Rig, command: Command, *, largest_step: float | None = None) -> EnergyBalance:
    """Run a test and compute its energy balance.

    Parameters
    ----------
    rig : Rig
        The rig.
    command : Command
        The force to be applied.
    largest_step : float, optional
        Largest step of the Runge–Kutta integration, s; the default is that of `simulate`, 1/4096 s. The gap
        decreases with the step and shows the error of the integration.

    Returns
    -------
    EnergyBalance
        The energies in J; for a shear building of all actuators together.

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
