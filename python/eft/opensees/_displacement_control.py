"""Gains of the displacement control: decentralized, with the same gains at every actuator."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from eft._native import Rig

Array = NDArray[np.float64]

RATE = 2048.0
"""Sample rate of the displacement control, Hz."""


class Gains(NamedTuple):
    """Gains on the displacement (proportional and integral) and on the load pressure."""

    proportional: float
    """V/m."""
    integral: float
    """V/(m·s)."""
    pressure: float
    """V/Pa."""
    speed: float
    """Velocity of a ramp that the valve can follow, m/s."""


class Specimen(NamedTuple):
    """The floors of a rig's structure, linear about rest, with the ground floor's first."""

    masses: Array
    """kg."""
    damping: Array
    """N·s/m, a matrix."""
    stiffness: Array
    """N/m, a matrix."""

    @classmethod
    def of(cls, rig: Rig) -> Specimen:
        """The structure of a rig; one floor if it is not a building."""
        if rig["structure.kind"] != "shear_building":
            mass, damping, stiffness = (rig[f"structure.{name}"] for name in ("mass", "damping", "stiffness"))
            return cls(np.array([mass]), np.array([[damping]]), np.array([[stiffness]]))
        stories = (rig[f"structure.stories.{name}"] for name in ("masses", "dampings", "stiffnesses"))
        masses, dampings, stiffnesses = (np.array(values, dtype=np.float64) for values in stories)
        return cls(masses, _between_floors(dampings), _between_floors(stiffnesses))

    def columns(self, rig: Rig) -> Array:
        """Natural frequencies of the floors on the oil and their own stiffness, rad/s."""
        oil = float(rig["actuator.piston_area"]) ** 2 / float(rig["actuator.compressibility"])
        return np.asarray(np.sqrt((oil + np.diag(self.stiffness)) / self.masses))


def _between_floors(stories: Array) -> Array:
    """The matrix of elements between each floor and the one below it."""
    above = np.append(stories[1:], 0.0)
    off_diagonal = np.diag(-stories[1:], 1)
    return np.asarray(np.diag(stories + above) + off_diagonal + off_diagonal.T)


def design(rig: Rig, specimen: Specimen) -> Gains:
    """Return the gains with the fastest decay of the model linearised about rest.

    Raises
    ------
    ValueError
        If no gains on the grid let the model decay.
    """
    area, oil = float(rig["actuator.piston_area"]), float(rig["actuator.compressibility"])
    flow = float(rig["compensation.flow_gain"]) * float(rig["compensation.valve_gain"])
    delay = 0.5 * float(rig["compensation.response_delay"]) + 0.5 / RATE
    floors, inverse = len(specimen.masses), 1.0 / specimen.masses[:, None]
    unit = np.eye(floors)
    # States, each of all floors: two lags of the valve, load pressure, displacement, velocity, the error's
    # integral.
    base = np.zeros((6, 6, floors, floors))
    base[0, 0] = base[1, 1] = -unit / delay
    base[1, 0] = unit / delay
    base[2, 1], base[2, 2], base[2, 4] = (
        size * unit for size in (flow / oil, -float(rig["actuator.leakage"]) / oil, -area / oil)
    )
    base[3, 4] = unit
    base[4, 2], base[4, 3], base[4, 4] = (
        area * inverse * unit,
        -specimen.stiffness * inverse,
        -specimen.damping * inverse,
    )
    base[5, 3] = -unit
    column = float(specimen.columns(rig).max())
    best, chosen = 0.0, None
    for share in np.geomspace(0.002, 0.5, 16):
        proportional = share * column * area / flow
        for damping in (0.0, *np.geomspace(0.02, 1.5, 12)):
            pressure = 2.0 * damping * column * oil / flow
            for corner in (0.1, 0.3):
                integral = corner * share * column * proportional
                closed = base.copy()
                for state, gain in ((2, -pressure), (3, -proportional), (5, integral)):
                    closed[0, state] = gain / delay * unit
                whole = closed.transpose(0, 2, 1, 3).reshape(6 * floors, 6 * floors)
                decay = -float(np.linalg.eigvals(whole).real.max())
                if decay > best:
                    best, chosen = decay, (proportional, integral, pressure)
    if chosen is None:
        raise ValueError("rig: no displacement control of this plant decays")
    full = float(np.abs(rig["servovalve.flow_table.flows"]).max())
    return Gains(*chosen, 0.3 * full / area)
