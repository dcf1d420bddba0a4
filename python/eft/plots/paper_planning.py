"""Whole figures of the preparation of a test, like the paper's Figs. 4 and 6, and stability maps."""

from __future__ import annotations

from typing import TYPE_CHECKING

from eft.plots import planning
from eft.plots._style import page, printed

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike

    from eft import FlowTable, Rig
    from eft.identification import DelayEstimate
    from eft.linear import StabilityMap


def figure_4(
    delay: DelayEstimate,
    curve: FlowTable,
    *,
    spool: ArrayLike,
    displacement: ArrayLike,
    sample_rate: float,
    piston_area: float,
) -> tuple[Figure, Figure]:
    """The identification tests: phase lag with the delay's line (4a), flow curve over one run's flow (4b).

    `spool` and `displacement` (m) are signals of that run at `sample_rate` (Hz).

    Parameters
    ----------
    delay : DelayEstimate
        From `eft.identify_delay`.
    curve : FlowTable
        From `eft.identify_flow_curve`.
    spool : array_like
        Spool opening of one run, as a fraction of its stroke.
    displacement : array_like
        Displacement of that run, m.
    sample_rate : float
        Its sample rate, Hz.
    piston_area : float
        Area of the piston, m².

    Returns
    -------
    tuple of Figure
        Both pages, ready for ``savefig``.

    Raises
    ------
    ValueError
        If spool and displacement have different lengths.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> test = eft.identification.valve_test(eft.Rig.zhao2005())
    >>> delay = eft.identify_delay(test.valve_command, test.spool, 2048.0)
    >>> rig = eft.Rig.zhao2005()
    >>> flow, area = eft.identification.flow_test(rig, amplitude=0.1), rig["actuator.piston_area"]
    >>> curve = eft.identify_flow_curve(flow.spool, flow.displacement, 2048.0, area)
    >>> left, right = plots.figure_4(
    ...     delay,
    ...     curve,
    ...     spool=flow.spool,
    ...     displacement=flow.displacement,
    ...     sample_rate=2048.0,
    ...     piston_area=area,
    ... )
    >>> right.axes[0].get_xlabel()
    'spool opening (1)'
    """
    with printed():
        left, right = page(2.6), page(3.4)
        planning.response_delay(delay, ax=left.subplots())
        planning.flow_curve(
            curve,
            spool=spool,
            displacement=displacement,
            sample_rate=sample_rate,
            piston_area=piston_area,
            ax=right.subplots(),
        )
        return left, right


def figure_6(rig: Rig) -> Figure:
    """Valve, lead network and both in series: gain and phase.

    Parameters
    ----------
    rig : Rig
        The rig.

    Returns
    -------
    Figure
        The page, ready for ``savefig``.

    Raises
    ------
    TypeError
        If `rig` is not a rig.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> len(plots.figure_6(eft.Rig.zhao2005()).axes)
    2
    """
    with printed():
        figure = page(4.2)
        planning.inverse_dynamics(rig, axes=figure.subplots(2, 1, sharex=True))
        figure.align_ylabels()
        return figure


def figure_maps(*found: StabilityMap) -> Figure:
    """Stability maps one below the other.

    Parameters
    ----------
    found : StabilityMap
        The maps, from the top.

    Returns
    -------
    Figure
        The page, ready for ``savefig``.

    Raises
    ------
    ValueError
        If there is no map.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> levels, dampings = ("compensation.level", [0.9, 1.2]), ("structure.damping", [2e3, 4e3])
    >>> found = eft.linear.stability_map(eft.Rig.zhao2005(), levels, dampings)
    >>> plots.figure_maps(found).axes[0].get_xlabel()
    'compensation level'
    """
    with printed():
        figure = page(2.7 * len(found))
        for ax, each in zip(figure.subplots(len(found), 1, squeeze=False)[:, 0], found, strict=True):
            planning.stability_map(each, ax=ax)
        return figure
