"""The floors of a rig: one, or those of a shear building, with an actuator on each."""

from __future__ import annotations

from typing import Any

import numpy as np

from eft._native import Rig

__all__ = ["actuators_of", "floor_frequencies", "floor_mass"]


def floor_mass(rig: Rig) -> Any:
    """Mass of the configured structure, kg; a list for a shear building, the ground floor first."""
    building = rig["structure.kind"] == "shear_building"
    return rig["structure.stories.masses" if building else "structure.mass"]


def floor_frequencies(rig: Rig) -> list[float]:
    """Natural frequency of each floor while the others are at rest, Hz.

    It is the root mean square of the modes' frequencies, by their shares in the floor's motion under a force.
    """
    if rig["structure.kind"] == "shear_building":
        below = rig["structure.stories.stiffnesses"]
        stiffnesses = np.add(below, [*below[1:], 0.0])
    else:
        stiffnesses = np.array([rig["structure.stiffness"]])
    frequencies = np.sqrt(stiffnesses / floor_mass(rig)) / (2 * np.pi)
    return [float(one) for one in frequencies]


def actuators_of(rig: Rig) -> int:
    """Number of actuators of a rig."""
    masses = floor_mass(rig)
    return len(masses) if isinstance(masses, list) else 1
