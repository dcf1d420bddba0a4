"""The flow curve and the flow gain of a valve."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from eft import _native
from eft._identification._estimate import Estimate
from eft._native import FlowTable

FlowMethod = Literal["integral", "difference"]


def identify_flow_curve(
    spool: ArrayLike | Sequence[ArrayLike],
    displacement: ArrayLike | Sequence[ArrayLike],
    sample_rate: float,
    piston_area: float,
    knots: int = 21,
    *,
    method: FlowMethod = "integral",
) -> FlowTable:
    """Find the flow curve from spool opening and displacement of an actuator without load (Fig. 4b).

    The flow is the piston's motion, so a piecewise linear curve is fitted to
    ``A·x(t) = A·x(0) + ∫f(spool) dt``. The fit also finds offset and drift of every recording. NaN and masked
    samples are gaps. Up to three lost samples are bridged by straight lines. Longer gaps divide a recording.
    Control points that the spool never reached are extrapolated from the last two that it reached.

    `method` "difference" is the paper's: the mean of central differences near each control point. Both
    methods agree on data without noise. Differences amplify noise: 1 % of the stroke at 2 kHz becomes more
    flow than the rated flow of the valve.

    Parameters
    ----------
    spool : array_like or list of array_like
        Spool opening as a fraction of its stroke, one array for each run.
    displacement : array_like or list of array_like
        Piston displacement in m, one array for each run.
    sample_rate : float
        In Hz.
    piston_area : float
        In m².
    knots : int
        Number of evenly spaced control points from -1 to 1, odd.
    method : {"integral", "difference"}
        Fit of the displacement, or mean of its central differences.

    Returns
    -------
    FlowTable
        The curve with the ``uncertainty`` of each flow, and whether its point was ``measured``. The
        uncertainty has the scatter of the data and the error of straight pieces for a bent curve. For
        extrapolated points it includes the effect of a continued bend. A change of the flow within the
        recordings, as under a falling supply, adds to it. A supply that is low throughout does not show.

    Notes
    -----
    The displacement integrates the noise of the spool. The fit finds how much of the noise is integrated, and
    weights the samples accordingly. The uncertainty contains noise and resolution of both signals, offset and
    drift of the displacement, and the leakage of the piston. On 100 random curves of straight pieces between
    the same openings, with noise of the spool up to 0.2 %, 90 to 99.5 % of the flows must be within two
    uncertainties in the tests. On a smooth curve fewer are beyond them, because the uncertainty bounds what
    straight pieces miss. The uncertainty does not contain a wrong opening:
    an overlap, a null bias, or an offset or a wrong gain of the spool's sensor. On the paper's rig 1 % of
    overlap or bias puts flows off by 5 to 50 uncertainties. `eft.identification.identify_overlap` finds both.
    With ``opening = spool - bias``, the curve is that of
    ``opening - numpy.clip(opening, -overlap, overlap)``.

    Raises
    ------
    ValueError
        If the data do not determine the curve, if a measured flow is more uncertain than it is large, or if
        the flow changes by more than 10 % within a recording; the message says why.

    Examples
    --------
    >>> import eft
    >>> rig = eft.Rig.zhao2005()
    >>> test = eft.identification.flow_test(rig, amplitude=0.1)
    >>> area = rig["actuator.piston_area"]
    >>> table = eft.identify_flow_curve(test.spool, test.displacement, 2048.0, area)
    >>> len(table), table.measured.any().item()
    (21, True)
    """
    runs = (runs_of(spool), runs_of(displacement))
    return _with_shape(_native.identify_flow_curve(*runs, sample_rate, piston_area, knots, method))


_AT_A_KNOT, _AT_THE_EDGE = 1.0 / 12.0, 1.0 / 6.0
"""Error of a straight piece at its knot against a parabola, as a share of the second difference."""


def _with_shape(found: FlowTable) -> FlowTable:
    """The curve, with the error of its straight pieces in the uncertainty."""
    if found.measured is None or found.uncertainty is None or np.count_nonzero(found.measured) < 3:
        return found
    inside = np.flatnonzero(found.measured)
    first, last = int(inside[0]), int(inside[-1])
    shape = np.zeros(len(found))
    bends = np.abs(np.diff(found.flows[first : last + 1], 2))
    shape[first + 1 : last] = _AT_A_KNOT * bends
    for edge, bend, beyond in (
        (first, bends[0], range(first)),
        (last, bends[-1], range(last + 1, len(found))),
    ):
        shape[edge] = _AT_THE_EDGE * bend
        for knot in beyond:
            # Beyond the data the curve may continue to bend as at the edge.
            steps = abs(knot - edge)
            shape[knot] = bend * (0.5 * steps * (steps + 1) + _AT_THE_EDGE * (1 + 2 * steps))
    return FlowTable(found.openings, found.flows, np.hypot(found.uncertainty, shape), found.measured.tolist())


def identify_flow_gain(
    spool: ArrayLike | Sequence[ArrayLike],
    displacement: ArrayLike | Sequence[ArrayLike],
    sample_rate: float,
    piston_area: float,
    limit: float = 0.1,
) -> Estimate:
    """Find the flow gain `K_v` in m³/s, one slope for all openings within ±`limit`.

    Parameters
    ----------
    spool, displacement, sample_rate, piston_area
        As of `eft.identify_flow_curve`.
    limit : float
        Largest opening that is used.

    Returns
    -------
    Estimate
        In m³/s.

    Raises
    ------
    ValueError
        If the data do not determine the gain, if it is more uncertain than it is large, or if the flow
        changes by more than 10 % within a recording; the message says why.

    Examples
    --------
    >>> import eft
    >>> rig = eft.Rig.zhao2005()
    >>> test = eft.identification.flow_test(rig, amplitude=0.02)
    >>> gain = eft.identification.identify_flow_gain(
    ...     test.spool, test.displacement, 2048.0, rig["actuator.piston_area"]
    ... )
    >>> gain > 10 * gain.uncertainty > 0
    True
    """
    runs = (runs_of(spool), runs_of(displacement))
    return Estimate(*_native.identify_flow_gain(*runs, sample_rate, piston_area, limit))


def runs_of(given: ArrayLike | Sequence[ArrayLike]) -> list[ArrayLike]:
    """A list of recordings; a single array or a list of numbers becomes a list with one recording."""
    if isinstance(given, (list, tuple)):
        return list(given) if given and np.ndim(given[0]) else [given]
    array = np.asanyarray(given)  # a mask stays
    return list(array) if array.ndim == 2 else [array]
