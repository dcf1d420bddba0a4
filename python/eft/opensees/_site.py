"""The virtual rig in displacement control: the experimental site behind a finite-element model."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from eft._native import Plant, PlantState, Rig
from eft._status import Status

Array = NDArray[np.float64]

_RATE = 2048.0
"""Samples of the displacement control per second, Hz."""
_FULL_SCALE = 10.0
"""Valve command where the rig names no range of its converter, V."""
_SETTLED = 64
"""Samples in a row that must lie within the tolerance."""


class MoveError(ValueError):
    """A displacement that the rig did not reach; the message is one sentence."""


class Site:
    """A rig that moves its specimen to a displacement, waits until it rests there, and measures the force.

    The controller is proportional and integral in the displacement and proportional in the load pressure.
    Its gains are those of the fastest decay of the model linear about rest. The force is that of the
    specimen at rest, without inertia and damping: the model outside has those.

    Parameters
    ----------
    rig : Rig
        A rig of one actuator. Its plant is used, its controller and sensors are not.
    tolerance : float
        Distance from the displacement at which the specimen has arrived, m.
    longest : float
        Time of the rig that a move may take, s.

    Raises
    ------
    ValueError
        If the rig is a shear building, or an argument is not allowed.

    Examples
    --------
    >>> import eft
    >>> site = eft.opensees.Site(eft.Rig.zhao2005())
    >>> f"{1e-3 * site.move(0.01):.2f} kN"
    '6.94 kN'
    """

    def __init__(self, rig: Rig, *, tolerance: float = 1e-6, longest: float = 20.0) -> None:
        for name, value in (("tolerance", tolerance), ("longest", longest)):
            if not (np.isfinite(value) and value > 0.0):
                raise ValueError(f"{name} = {value!r}: must be positive and finite")
        if rig["structure.kind"] == "shear_building":
            raise ValueError('structure.kind = "shear_building": must be a structure with one actuator')
        self._plant = Plant(rig, _RATE)
        self._stroke = float(rig["actuator.stroke"])
        self._limit = float(rig["dac.range"] or _FULL_SCALE)
        self._tolerance, self._samples = tolerance, max(_SETTLED, int(longest * _RATE))
        self._gains, column = _gains(rig)
        # A motion at the oil column's frequency then has less inertia than stiffness times tolerance.
        self._slowest = tolerance * float(rig["structure.stiffness"]) / float(rig["structure.mass"]) / column
        self._wanted = self._integral = 0.0
        self.stiffness = float(rig["structure.stiffness"])
        """Initial stiffness of the specimen, N/m."""

    @property
    def state(self) -> PlantState:
        """What is true of the plant now."""
        return self._plant.state

    def reset(self) -> None:
        """Put the rig back to rest, the specimen as new."""
        self._plant.reset()
        self._wanted = self._integral = 0.0

    def move(self, displacement: float) -> float:
        """Move the specimen to a displacement; the force that holds it there.

        Parameters
        ----------
        displacement : float
            In m.

        Returns
        -------
        float
            In N, positive where it pulls.

        Raises
        ------
        ValueError
            If the displacement is not finite or beyond the stroke, or is not reached in the longest time.
        """
        if not np.isfinite(displacement):
            raise MoveError(f"displacement = {displacement!r}: must be finite")
        if abs(displacement) > self._stroke:
            raise MoveError(
                f"displacement = {displacement:g} m: must be within the stroke of ±{self._stroke:g} m"
            )
        proportional, integral, pressure, speed = self._gains
        start, rested = self._wanted, 0
        # A ramp that the valve can follow without running into its limit.
        ramp = max(abs(displacement - start) / speed, 1.0 / _RATE)
        for i in range(self._samples):
            now = self._plant.state
            if now.status & (Status.STROKE_EXCEEDED | Status.DIVERGED):
                raise MoveError(f"displacement = {displacement:g} m: the piston left its stroke on the way")
            wanted = start + (displacement - start) * min((i + 1) / (ramp * _RATE), 1.0)
            error = wanted - now.displacement
            at_rest = abs(now.velocity) < self._slowest
            rested = rested + 1 if at_rest and abs(displacement - now.displacement) < self._tolerance else 0
            if rested >= _SETTLED:
                self._wanted = displacement
                return float(now.force)
            command = proportional * error + self._integral - pressure * now.load_pressure
            if abs(command) < self._limit:
                self._integral += integral * error / _RATE
            self._plant.step(min(max(command, -self._limit), self._limit))
        self._wanted = float(self._plant.state.displacement)
        raise MoveError(
            f"displacement = {displacement:g} m: the rig came to {self._wanted:g} m "
            f"in {self._samples / _RATE:g} s, with {float(self._plant.state.force):g} N"
        )


def _gains(rig: Rig) -> tuple[tuple[float, float, float, float], float]:
    """Gains in V/m, V/(m·s), V/Pa and the speed of the ramp in m/s; the oil column's frequency in rad/s."""
    area, oil = float(rig["actuator.piston_area"]), float(rig["actuator.compressibility"])
    mass, stiffness = float(rig["structure.mass"]), float(rig["structure.stiffness"])
    flow = float(rig["compensation.flow_gain"]) * float(rig["compensation.valve_gain"])
    delay = 0.5 * float(rig["compensation.response_delay"]) + 0.5 / _RATE
    # States: two lags of the valve, load pressure, displacement, velocity, integral of the error.
    base = np.zeros((6, 6))
    base[0, 0] = base[1, 1] = -1.0 / delay
    base[1, 0] = 1.0 / delay
    base[2, [1, 2, 4]] = flow / oil, -float(rig["actuator.leakage"]) / oil, -area / oil
    base[3, 4] = 1.0
    base[4, 2:5] = area / mass, -stiffness / mass, -float(rig["structure.damping"]) / mass
    base[5, 3] = -1.0
    column = float(np.sqrt(area**2 / (oil * mass) + stiffness / mass))
    best, chosen = 0.0, None
    for share in np.geomspace(0.002, 0.5, 16):
        proportional = share * column * area / flow
        for damping in (0.0, *np.geomspace(0.02, 1.5, 12)):
            pressure = 2.0 * damping * column * oil / flow
            for corner in (0.1, 0.3):
                integral = corner * share * column * proportional
                closed = base.copy()
                closed[0, [2, 3, 5]] = np.array([-pressure, -proportional, integral]) / delay
                decay = -float(np.linalg.eigvals(closed).real.max())
                if decay > best:
                    best, chosen = decay, (proportional, integral, pressure)
    if chosen is None:
        raise ValueError("rig: no displacement control of this plant decays")
    full = float(np.abs(rig["servovalve.flow_table.flows"]).max())
    return (*chosen, 0.3 * full / area), column
