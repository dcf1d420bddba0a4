"""A measured force beside its command: sign and unit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_LEAST = 0.05
"""Smallest rms of a measured force over that of its command. Without compensation little force may remain."""


def check_force(command: Array, force: Array, most: float) -> None:
    """Refuse a force of another sign or unit: above `most` times the command (rms), or hardly any."""
    whole = np.isfinite(command) & np.isfinite(force)
    command, force = command[whole], force[whole]
    sent, answered = float(np.linalg.norm(command)), float(np.linalg.norm(force))
    if sent == 0.0:
        return
    factor = answered / sent
    if not _LEAST <= factor <= most:
        raise ValueError(
            f"force = {factor:.2g} times the command (rms): must be {_LEAST:g} to {most:g} times: "
            "check the units of both"
        )
    if command @ force < -0.5 * sent * answered:
        raise ValueError("force = against the command: must follow it: one of the two has the wrong sign")
