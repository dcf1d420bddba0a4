"""Overlap or underlap of the spool's lands."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from eft import _native
from eft._identification._estimate import Array, Estimate, make_estimate
from eft._identification._flow import runs_of


class OverlapEstimate(Estimate):
    """An overlap as a share of the stroke, negative for an underlap, with null bias and flow gains."""

    __slots__ = {
        "flow_gains": "Slopes beyond the overlap on the negative and on the positive side, m³/s.",
        "null_bias": "Spool opening at which the flow is zero.",
    }

    null_bias: Estimate
    flow_gains: tuple[Estimate, Estimate]

    def behind(self, spool: ArrayLike) -> Array:
        """Return the opening of the flow curve for each spool opening, without null bias and overlap.

        Parameters
        ----------
        spool : array_like
            Spool openings, as shares of the stroke.

        Returns
        -------
        numpy.ndarray
            Openings of the flow curve, as shares of the stroke.

        Raises
        ------
        ValueError
            If `spool` does not consist of numbers.

        Examples
        --------
        >>> import eft
        >>> rig = eft.Rig.zhao2005().replace({"truth.servovalve.overlap": 0.01})
        >>> test = eft.identification.flow_test(rig, amplitude=0.02, frequency=0.5, duration=8.0)
        >>> area = rig["actuator.piston_area"]
        >>> found = eft.identification.identify_overlap(test.spool, test.displacement, 2048.0, area)
        >>> found.behind([0.005, 0.11]).round(2).tolist()
        [0.0, 0.1]
        """
        opening = np.asarray(spool, dtype=np.float64) - float(self.null_bias)
        overlap = float(self)
        return np.asarray(opening - np.sign(overlap) * np.clip(opening, -abs(overlap), abs(overlap)))


def identify_overlap(
    spool: ArrayLike | Sequence[ArrayLike],
    displacement: ArrayLike | Sequence[ArrayLike],
    sample_rate: float,
    piston_area: float,
) -> OverlapEstimate:
    """Find overlap and null bias from slow strokes of the spool near null, of an actuator without load.

    The fit is ``A·x(t) = A·x(0) + ∫(s₊·max(spool - a, 0) + s₋·min(spool - c, 0)) dt``. The overlap is half
    the distance of the two knees, ``(a - c)/2``, and the null bias is their mean. The strokes must pass both
    knees, and must stay within the straight part of the flow curve. NaN are gaps, as of
    `eft.identify_flow_curve`.

    Parameters
    ----------
    spool : array_like or list of array_like
        Spool opening as a fraction of its stroke, one array for each run, within ±0.2.
    displacement : array_like or list of array_like
        Piston displacement in m, one array for each run.
    sample_rate : float
        In Hz.
    piston_area : float
        In m².

    Returns
    -------
    OverlapEstimate
        The overlap, negative for an underlap, with its ``uncertainty``; ``null_bias`` and ``flow_gains``
        (m³/s, on the negative and on the positive side) are estimates as well. The uncertainties are too
        small with fewer than two periods of the strokes. A drift of the displacement counts as null bias.

    Raises
    ------
    ValueError
        If the data do not determine the overlap; the message says why.

    Examples
    --------
    >>> import eft
    >>> rig = eft.Rig.zhao2005().replace({"servovalve.overlap": 0.001})
    >>> test = eft.identification.flow_test(rig, amplitude=0.02, frequency=0.5, duration=8.0)
    >>> area = rig["actuator.piston_area"]
    >>> found = eft.identification.identify_overlap(test.spool, test.displacement, 2048.0, area)
    >>> f"{found:.4f}"
    '0.0010'
    """
    runs = (runs_of(spool), runs_of(displacement))
    overlap, bias, back, forth = _native.identify_overlap(*runs, sample_rate, piston_area)
    found = {
        "uncertainty": overlap[1],
        "null_bias": Estimate(*bias),
        "flow_gains": (Estimate(*back), Estimate(*forth)),
    }
    answer = make_estimate(OverlapEstimate, overlap[0], found)
    assert isinstance(answer, OverlapEstimate)
    return answer
