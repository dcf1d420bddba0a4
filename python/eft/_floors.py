"""The floors of a rig: one, or those of a shear building, with an actuator on each."""

from __future__ import annotations

from typing import Any

from eft._native import Rig

__all__ = ["actuators_of", "floor_mass"]


def floor_mass(rig: Rig) -> Any:
    """Mass of the configured structure, kg; a list for a shear building, the ground floor first."""
    building = rig["structure.kind"] == "shear_building"
    return rig["structure.stories.masses" if building else "structure.mass"]


def actuators_of(rig: Rig) -> int:
    """Number of actuators of a rig."""
    masses = floor_mass(rig)
    return len(masses) if isinstance(masses, list) else 1
