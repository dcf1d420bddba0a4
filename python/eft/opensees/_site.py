"""The virtual rig in displacement control, as experimental site of a finite-element model."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eft._native import Plant, PlantState, Rig
from eft._numbers import real_number
from eft._status import Status
from eft.opensees._displacement_control import RATE, Specimen, design

Array = NDArray[np.float64]

_FULL_SCALE = 10.0
"""Limit of the valve command if the rig has no range of its converter, V."""
_SETTLED = 64
"""Number of consecutive samples that must be within the tolerance."""


class MoveError(ValueError):
    """The rig did not reach a displacement; the message is one sentence."""


class Site:
    """A rig that moves its specimen to a displacement, waits until it rests there, and measures the force.

    Each actuator has a controller, proportional and integral in its displacement and proportional in its load
    pressure. The gains are those of the fastest decay of the model linear about rest. The forces are those of
    the specimen at rest, without inertia and damping: the external model has those.

    Parameters
    ----------
    rig : Rig
        The rig. Its plant is used, its controller and sensors are not. A shear building has an actuator at
        each floor.
    tolerance : float
        Distance from the displacement at which the specimen has arrived, m.
    longest : float
        Time of the rig that a move may take, s.

    Raises
    ------
    ValueError
        If an argument is not allowed.

    Examples
    --------
    >>> import eft
    >>> site = eft.opensees.Site(eft.Rig.zhao2005())
    >>> f"{1e-3 * site.move(0.01):.2f} kN"
    '6.94 kN'
    """

    def __init__(self, rig: Rig, *, tolerance: float = 1e-6, longest: float = 20.0) -> None:
        tolerance, longest = real_number("tolerance", tolerance), real_number("longest", longest)
        for name, value in (("tolerance", tolerance), ("longest", longest)):
            if not (np.isfinite(value) and value > 0.0):
                raise ValueError(f"{name} = {value!r}: must be positive and finite")
        self._plant = Plant(rig, RATE)
        self._stroke = float(rig["actuator.stroke"])
        self._limit = float(rig["dac.range"] or _FULL_SCALE)
        self._tolerance, self._samples = tolerance, max(_SETTLED, int(longest * RATE))
        specimen = Specimen.of(rig)
        self._gains = design(rig, specimen)
        # The inertia of a motion at the oil column's frequency is then less than stiffness times tolerance.
        own = np.diag(specimen.stiffness) / specimen.masses / specimen.columns(rig)
        self._slowest = tolerance * float(own.min())
        self.actuators = len(specimen.masses)
        """Number of actuators."""
        self._several = rig["structure.kind"] == "shear_building"
        self.stiffness: Any = specimen.stiffness if self._several else float(specimen.stiffness[0, 0])
        """Initial stiffness of the specimen, N/m; a matrix for a building."""
        self._wanted = self._integral = np.zeros(self.actuators)

    @property
    def state(self) -> PlantState:
        """The true state of the plant."""
        return self._plant.state

    def reset(self) -> None:
        """Return the rig to rest, with a new specimen.

        Examples
        --------
        >>> import eft
        >>> site = eft.opensees.Site(eft.Rig.zhao2005())
        >>> site.reset()
        >>> site.state.displacement
        0.0
        """
        self._plant.reset()
        self._wanted = self._integral = np.zeros(self.actuators)

    def move(self, displacement: ArrayLike) -> Any:
        """Move the specimen to a displacement and return the force that holds it there.

        Parameters
        ----------
        displacement : float or array_like
            In m; one for each floor of a building, the ground floor's first.

        Returns
        -------
        float or numpy.ndarray
            In N, positive where it pulls; one for each floor of a building.

        Raises
        ------
        ValueError
            If a displacement is not finite or beyond the stroke, or is not reached in the longest time.

        Examples
        --------
        >>> import eft
        >>> site = eft.opensees.Site(eft.Rig.zhao2005())
        >>> site.move(0.005) < site.move(0.01)
        True
        """
        target = np.atleast_1d(np.asarray(displacement, dtype=np.float64))
        told = _listed(target)
        if target.shape != (self.actuators,):
            raise MoveError(f"displacement = {told}: must be one for each of {self.actuators} actuators")
        if not np.isfinite(target).all():
            raise MoveError(f"displacement = {told}: must be finite")
        if (np.abs(target) > self._stroke).any():
            raise MoveError(f"displacement = {told} m: must be within the stroke of ±{self._stroke:g} m")
        proportional, integral, pressure, speed = self._gains
        start, rested = self._wanted, 0
        # A ramp that the valves can follow without reaching their limit.
        ramp = max(float(np.abs(target - start).max()) / speed, 1.0 / RATE)
        for i in range(self._samples):
            now = self._plant.state
            if (np.bitwise_or.reduce(now.status, axis=None)) & (Status.STROKE_EXCEEDED | Status.DIVERGED):
                raise MoveError(f"displacement = {told} m: the piston left its stroke on the way")
            error = start + (target - start) * min((i + 1) / (ramp * RATE), 1.0) - now.displacement
            at_rest = np.max(np.abs(now.velocity)) < self._slowest
            arrived = np.max(np.abs(target - now.displacement)) < self._tolerance
            rested = rested + 1 if at_rest and arrived else 0
            if rested >= _SETTLED:
                self._wanted = target
                return np.asarray(now.force) if self._several else float(now.force)
            command = proportional * error + self._integral - pressure * now.load_pressure
            within = np.abs(command) < self._limit
            self._integral = self._integral + np.where(within, integral / RATE * error, 0.0)
            limited = np.clip(command, -self._limit, self._limit)
            self._plant.step(limited if self._several else float(limited[0]))
        self._wanted = np.atleast_1d(np.asarray(self._plant.state.displacement, dtype=np.float64))
        raise MoveError(
            f"displacement = {told} m: the rig came to {_listed(self._wanted)} m "
            f"in {self._samples / RATE:g} s, with {_listed(np.atleast_1d(self._plant.state.force))} N"
        )


def _listed(values: Array) -> str:
    """One number, or several in brackets."""
    texts = [f"{value:g}" for value in values]
    return texts[0] if len(texts) == 1 else f"[{', '.join(texts)}]"
