"""Figures of measurements and analyses before a test: Figs. 4a, 4b and 6, and stability maps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

import eft
from eft import _display
from eft.plots._style import BLACK, BLUE, GREEN, VERMILION, axes_or_new, finish, lines_for

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike, NDArray

    from eft import FlowTable, ForceLoopTuning, Rig
    from eft.identification import DelayEstimate
    from eft.linear import StabilityMap


def response_delay(delay: DelayEstimate, *, ax: Axes | None = None) -> Axes:
    """Phase lag of the spool after its command against frequency, with the fitted line, as in Fig. 4a.

    Parameters
    ----------
    delay : DelayEstimate
        From `eft.identify_delay`.
    ax : Axes, optional
        Where to draw; by default the axes of a new figure.

    Returns
    -------
    Axes
        The axes with the curves.

    Raises
    ------
    AttributeError
        If `delay` is not such an estimate.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> test = eft.identification.valve_test(eft.Rig.zhao2005())
    >>> delay = eft.identify_delay(test.valve_command, test.spool, 2048.0)
    >>> plots.response_delay(delay).get_lines()[1].get_label()
    'delay 5.39 ms'
    """
    ax = axes_or_new(ax)
    frequency = delay.frequency
    ax.plot(frequency, delay.lag, ".", color="0.5", markersize=3, label="measured")
    line = 2 * np.pi * frequency * float(delay) - delay.intercept
    ax.plot(frequency, line, color=BLUE, label=f"delay {float(delay) * 1e3:.2f} ms")
    return finish(ax, xlabel="frequency (Hz)", ylabel="phase lag (rad)")


def flow_curve(
    table: FlowTable,
    *,
    spool: ArrayLike | None = None,
    displacement: ArrayLike | None = None,
    sample_rate: float | None = None,
    piston_area: float | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Flow against spool opening, as in Fig. 4b.

    With spool, displacement (m), sample rate (Hz) and piston area (m²) of one run, its flow by central
    differences is drawn behind the curve.

    Parameters
    ----------
    table : FlowTable
        The curve.
    spool : array_like, optional
        Spool opening of one run, as a fraction of its stroke.
    displacement : array_like, optional
        Displacement of that run, m.
    sample_rate : float, optional
        Its sample rate, Hz.
    piston_area : float, optional
        Area of the piston, m².
    ax : Axes, optional
        Where to draw; by default the axes of a new figure.

    Returns
    -------
    Axes
        The axes with the curves.

    Raises
    ------
    ValueError
        If spool and displacement have different lengths.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> table = eft.FlowTable([-1.0, 0.0, 1.0], [-2e-3, 0.0, 2e-3])
    >>> plots.flow_curve(table).get_ylabel()
    'flow (L/min)'
    """
    ax, unit = axes_or_new(ax), _display.shown("flow")
    if spool is not None and displacement is not None and sample_rate and piston_area:
        flow = piston_area * np.gradient(np.asarray(displacement), 1 / sample_rate) * unit.factor
        ax.plot(np.asarray(spool), flow, ".", color="0.6", markersize=5, label="measured")
    ax.plot(table.openings, table.flows * unit.factor, "o-", color=BLUE, markersize=3, label="control points")
    return finish(ax, xlabel="spool opening (1)", ylabel=f"flow ({unit.unit})")


def inverse_dynamics(
    rig: Rig, *, band: tuple[float, float] = (0.1, 100.0), axes: Sequence[Axes]
) -> Sequence[Axes]:
    """Valve, lead network and both in series: gain over that at rest, and phase, as in Fig. 6.

    Parameters
    ----------
    rig : Rig
        The rig.
    band : tuple of float
        Lowest and highest frequency, Hz.
    axes : sequence of Axes
        Two axes: for the gain and for the phase.

    Returns
    -------
    sequence of Axes
        The same two axes.

    Raises
    ------
    ValueError
        If the band does not begin above 0, or there are not two axes.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> from matplotlib.figure import Figure
    >>> gain, phase = plots.inverse_dynamics(eft.Rig.zhao2005(), axes=Figure().subplots(2, 1))
    >>> gain.get_ylabel(), phase.get_ylabel()
    ('gain over that at rest', 'phase (°)')
    """
    upper, lower = axes
    frequency = np.geomspace(*band, 400)
    valve, lead = eft.linear.inverse_dynamics(rig, frequency)
    rest = [abs(response[0]) for response in eft.linear.inverse_dynamics(rig, [0.0])]
    parts = {
        "valve": (valve / rest[0], VERMILION, "--"),
        "lead network": (lead / rest[1], GREEN, ":"),
        "both": (valve * lead / (rest[0] * rest[1]), BLUE, "-"),
    }
    for label, (response, color, style) in parts.items():
        upper.semilogx(frequency, abs(response), color=color, linestyle=style, label=label)
        lower.semilogx(frequency, np.degrees(np.unwrap(np.angle(response))), color=color, linestyle=style)
    finish(upper, xlabel="", ylabel="gain over that at rest")
    finish(lower, xlabel="frequency (Hz)", ylabel="phase (°)", legend=False)
    return axes


def stability_map(found: StabilityMap, *, ax: Axes | None = None) -> Axes:
    """Stability: growth rates (1/s) in colour, with the line where they are zero, or levels as curves.

    The levels of a map such as `rate_realization_map` are drawn against the horizontal setting, one curve for
    each value of the vertical one.

    Parameters
    ----------
    found : StabilityMap
        From `eft.linear.stability_map`.
    ax : Axes, optional
        Where to draw; by default the axes of a new figure.

    Returns
    -------
    Axes
        The axes with the curves.

    Raises
    ------
    AttributeError
        If `found` is not a map.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> levels, dampings = ("compensation.level", [0.9, 1.2]), ("structure.damping", [2e3, 4e3])
    >>> found = eft.linear.stability_map(eft.Rig.zhao2005(), levels, dampings)
    >>> plots.stability_map(found).get_xlabel()
    'compensation level'
    """
    ax = axes_or_new(ax)
    across, up = map_axis(found.horizontal_key), map_axis(found.vertical_key)
    words = found.horizontal.dtype.kind not in "biuf"
    horizontal = np.arange(len(found.horizontal)) if words else found.horizontal * across.factor
    if words:
        ax.set_xticks(horizontal, found.horizontal)
    if found.quantity == "level" or found.vertical.dtype.kind not in "fiu":
        for label, row, line in zip(
            found.vertical, found.values, lines_for(map(str, found.vertical)), strict=True
        ):
            shown = np.where(np.isfinite(row), row, np.nan)
            ax.plot(horizontal, shown, label=str(label), **line.keywords())
        finish(ax, xlabel=_axis_label(found.horizontal_key), ylabel=_QUANTITIES[found.quantity])
        ax.ticklabel_format(axis="y", useOffset=False)
        finite = found.values[np.isfinite(found.values)]
        if finite.size and np.ptp(finite) < _ALIKE * finite.max():
            # Levels that hardly differ must not look as if they did.
            ax.set_ylim(finite.mean() * (1.0 - _ALIKE), finite.mean() * (1.0 + _ALIKE))
        _logarithmic(ax.set_xscale, horizontal)
        return ax
    vertical = found.vertical * up.factor
    # Beyond that, how fast it grows or decays no longer matters.
    shown = np.clip(found.values, -2.0, 2.0)
    mesh = ax.pcolormesh(
        horizontal, vertical, shown, cmap="RdBu_r", vmin=-2.0, vmax=2.0, shading="nearest", rasterized=True
    )
    if not words and min(found.values.shape) > 1 and found.values.min() < 0 < found.values.max():
        ax.contour(horizontal, vertical, found.values, levels=[0.0], colors=BLACK, linewidths=1.2)
    ax.figure.colorbar(mesh, ax=ax, label=_QUANTITIES[found.quantity], extend="both")
    finish(ax, xlabel=_axis_label(found.horizontal_key), ylabel=_axis_label(found.vertical_key), legend=False)
    _logarithmic(ax.set_xscale, horizontal)
    _logarithmic(ax.set_yscale, vertical)
    return ax


_MARGINS = (1.1, 1.2, 1.5, 2.0, 3.0, 5.0, 10.0)
"""Gain margins with a contour of their own; the first two are the verdict's limits."""


def force_loop_gains(tuning: ForceLoopTuning, *, ax: Axes | None = None) -> Axes:
    """Gain margin of the force loop over both gains, with the rig's own gains and the advised ones.

    Parameters
    ----------
    tuning : ForceLoopTuning
        From `eft.tune_force_loop`.
    ax : Axes, optional
        Where to draw; by default the axes of a new figure.

    Returns
    -------
    Axes
        The axes with the curves.

    Raises
    ------
    AttributeError
        If `tuning` is not such advice.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> rig = eft.Rig.zhao2005().replace({"controller.realization": "digital"})
    >>> plots.force_loop_gains(eft.tune_force_loop(rig)).get_xlabel()
    'proportional gain G_p'
    """
    ax = axes_or_new(ax)
    advised = tuning.coefficients
    shown: list[tuple[float, float, str, str, str]] = [
        (*advised.values(), "advised", "D", GREEN),  # type: ignore[list-item]
        (tuning.proportional_gain, tuning.derivative_gain, "this rig", "o", BLACK),
    ]
    highest = 1.6 * max(gain for gain, *_ in shown)
    gain = np.linspace(highest / 100.0, highest, 160)
    derivative = np.linspace(0.0, max(1.6 * max(point[1] for point in shown), 1e-6), 160)
    # Beyond the computed ratios the margin is unknown.
    ratio = derivative[:, None] / gain
    margin = tuning.margin_at(
        np.broadcast_to(gain, ratio.shape), np.broadcast_to(derivative[:, None], ratio.shape)
    )
    margin = np.where(ratio <= tuning.ratios[-1], np.minimum(margin, 1e3), np.nan)
    ax.contourf(gain, 1e3 * derivative, margin, levels=[0.0, 1.0], colors=["#f3c9b5"])
    lines = ax.contour(gain, 1e3 * derivative, margin, levels=_MARGINS, colors="0.45", linewidths=0.8)
    ax.clabel(lines, fmt="%g", fontsize=7)
    ax.contour(gain, 1e3 * derivative, margin, levels=[1.0], colors=VERMILION, linewidths=1.4)
    for x, y, label, marker, color in shown:
        ax.plot(x, 1e3 * y, marker, color=color, label=f"{label} ({float(tuning.margin_at(x, y)):.3g})")
    finish(ax, xlabel="proportional gain G_p", ylabel="derivative gain G_d (ms)")
    ax.set_title("gain margin", loc="left")
    return ax


_ALIKE = 0.02
"""Levels within this relative difference count as equal."""

_QUANTITIES = {"growth_rate": "growth rate (1/s)", "level": "largest stable level"}


def map_axis(key: str) -> _display.Shown:
    """The unit of a key of the rig in figures."""
    return _display.shown(next((row.unit for row in eft.rig_keys() if row.key == key), ""))


def _axis_label(key: str) -> str:
    """A dotted key in words, with its unit."""
    unit, words = map_axis(key).unit, key.replace("truth.", "true ").replace(".", " ").replace("_", " ")
    return f"{words} ({unit})" if unit else words


def _logarithmic(set_scale: Callable[[str], object], values: NDArray[Any]) -> None:
    """A logarithmic axis for positive values in even ratios over at least a decade."""
    if values.size < 3 or values.dtype.kind not in "fiu" or values.min() <= 0.0:
        return
    steps = np.diff(np.log(values))
    if values.max() > 10.0 * values.min() and np.ptp(steps) < 0.5 * abs(steps.mean()):
        set_scale("log")
