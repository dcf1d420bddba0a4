"""The damping ratio of a structure in free vibration."""

from __future__ import annotations

from numpy.typing import ArrayLike

from eft import _native
from eft._identification._estimate import Estimate, make_estimate


class DampingEstimate(Estimate):
    """A damping ratio, with the natural frequency and the logarithmic decrement."""

    __slots__ = {"decrement": "Logarithmic decrement.", "frequency": "Undamped natural frequency, Hz."}

    frequency: Estimate
    decrement: float


def identify_damping(displacement: ArrayLike, sample_rate: float) -> DampingEstimate:
    """Estimate the damping ratio from free vibration.

    Parameters
    ----------
    displacement : array_like
        Displacement after the release, in any unit.
    sample_rate : float
        In Hz.

    Returns
    -------
    DampingEstimate
        The damping ratio, with ``frequency`` (Hz, undamped, an `Estimate`) and ``decrement`` (logarithmic).
        The uncertainties are larger with few cycles, where the fit takes noise near it for vibration. A
        damping that changes from the beginning to the end of at least six cycles, as with friction, has the
        change in its uncertainty.

    Raises
    ------
    ValueError
        If the data is not one decaying oscillation of at least three cycles.

    Examples
    --------
    >>> import eft
    >>> rig = eft.Rig.zhao2005()
    >>> motion = eft.identification.free_vibration(rig, displacement=0.02)
    >>> f"{eft.identification.identify_damping(motion, 512.0):.3f}"
    '0.031'
    """
    ratio, spread, frequency, frequency_spread, decrement = _native.identify_damping(
        displacement, sample_rate
    )
    found = {
        "uncertainty": spread,
        "frequency": Estimate(frequency, frequency_spread),
        "decrement": decrement,
    }
    answer = make_estimate(DampingEstimate, ratio, found)
    assert isinstance(answer, DampingEstimate)
    return answer
