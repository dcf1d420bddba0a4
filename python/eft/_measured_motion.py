"""A measured displacement beside that of another signal: sign, and the units of both and of the times."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_ALIKE = 0.5
"""Least correlation of two displacements of one motion. Below it noise or drift is larger than the motion."""


def motion_factor(
    time: Array, sample_rate: float, velocity: Array, displacement: Array, alike: float = _ALIKE
) -> float | None:
    """The displacement over the integral of the velocity, negative if they are opposed.

    None if the correlation of both is below `alike`.
    """
    whole = np.isfinite(velocity) & np.isfinite(displacement)
    time = time[whole]
    if time.size < 3:
        return None
    # An offset of the velocity is a drift of its integral.
    moved, shown = (
        values - np.polynomial.Polynomial.fit(time, values, 1)(time)
        for values in (np.cumsum(velocity[whole]) / sample_rate, displacement[whole])
    )
    by_velocity, by_sensor = float(np.linalg.norm(moved)), float(np.linalg.norm(shown))
    common = float(moved @ shown)
    if abs(common) <= alike * by_velocity * by_sensor:
        return None
    return by_sensor / by_velocity * float(np.sign(common))
