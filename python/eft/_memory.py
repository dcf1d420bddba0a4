"""The memory of tests, before they allocate it."""

from __future__ import annotations

import math
import os

from eft._native import Rig

_BYTES = 200
"""Memory per sample and actuator of a test, for its traces and the computation of its metrics."""


def memory_of_samples(rig: Rig, samples: int) -> float:
    """Memory that so many samples of a rig take, GiB."""
    building = rig["structure.kind"] == "shear_building"
    actuators = len(rig["structure.stories.masses"]) if building else 1
    return actuators * samples * _BYTES / 1024**3


def _memory_of_this_machine() -> float:
    """Memory of this machine, GiB; unlimited if the system does not tell."""
    try:
        there = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 1024**3
    except (AttributeError, OSError, ValueError):
        return math.inf
    return there if there > 0 else math.inf


def check_memory(what: str, needed: float, allowed: float = math.inf) -> None:
    """Refuse what needs more memory (GiB) than this machine has, or than ``--memory`` allows."""
    there = _memory_of_this_machine()
    said = f"{what} {needed:.1f} GiB of memory, must be at most the "
    if needed > there:
        raise ValueError(f"{said}{there:.1f} GiB of this machine; shorten it or sample less often")
    if needed > allowed:
        raise ValueError(f"{said}{allowed:g} GiB of --memory; --memory {math.ceil(needed)} lets it run")
