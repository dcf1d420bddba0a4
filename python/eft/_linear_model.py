"""The modes of a linear model."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eft._read_only import read_only


class Modes(NamedTuple):
    """The modes of a linear model, by natural frequency."""

    frequency: NDArray[np.float64]
    """Natural frequencies, Hz."""
    damping: NDArray[np.float64]
    """Damping ratios."""
    pole: NDArray[np.complex128]
    """Poles in continuous time, 1/s."""


def modes(self: Any) -> Modes:
    """Return the modes by natural frequency.

    The poles of a sampled model are converted to continuous time.

    Returns
    -------
    Modes
        Frequencies in Hz, damping ratios and poles in 1/s.

    Raises
    ------
    ValueError
        If the poles cannot be computed.

    Examples
    --------
    >>> import eft
    >>> found = eft.linearize(eft.Rig.zhao2005()).modes()
    >>> bool((found.damping > 0.0).all())
    True
    """
    return Modes(*map(read_only, self._modes()))
