"""Figures of a rig's linear model, force loop and identification."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from eft.plots._style import BLACK, BLUE, LIMIT, VERMILION, axes_or_new, finish
from eft.plots.overview import figure_or_new, panel_letters
from eft.plots.planning import flow_curve, response_delay

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    from eft import ForceLoop
    from eft.identification import Identification
    from eft.linear import LinearModel


def linear_model(
    model: LinearModel,
    *,
    band: tuple[float, float] = (0.1, 200.0),
    output: str = "force",
    source: str | None = None,
    figure: Figure | SubFigure | None = None,
) -> Figure | SubFigure:
    """Bode diagram from an input, the first by default, to an output of a linear model.

    Parameters
    ----------
    model : LinearModel
        From `eft.linearize`, or the open loop of a force loop.
    band : tuple of float
        Lowest and highest frequency, Hz.
    output : str
        Name of the output; one that the model does not have gives its first output.
    source : str, optional
        Name of the input; the first by default.
    figure : Figure or SubFigure, optional
        Where to draw; by default a new figure.

    Returns
    -------
    Figure or SubFigure
        The figure with its panels.

    Raises
    ------
    ValueError
        If the model has no such input, or the band does not begin above 0.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> model = eft.linearize(eft.Rig.zhao2005())
    >>> plots.linear_model(model, band=(0.5, 50.0)).axes[0].get_ylabel()
    '|force / command|'
    """
    figure = figure_or_new(figure, 4.2)
    upper, lower = figure.subplots(2, 1, sharex=True)
    high = min(band[1], 0.5 / model.sample_time) if model.sample_time else band[1]
    frequency = np.geomspace(band[0], high, 600)
    output = output if output in model.outputs else model.outputs[0]
    source = source or model.inputs[0]
    response = model.response(frequency, output, source)
    upper.loglog(frequency, np.abs(response), color=BLUE)
    lower.semilogx(frequency, np.degrees(np.unwrap(np.angle(response))), color=BLUE)
    finish(upper, xlabel="", ylabel=f"|{output} / {source}|", legend=False)
    finish(lower, xlabel="frequency (Hz)", ylabel="phase (°)", legend=False)
    panel_letters((upper, lower))
    return figure


def force_loop(loop: ForceLoop, *, ax: Axes | None = None) -> Axes:
    """Nyquist diagram of a designed force loop, with a circle around -1 whose radius is the least distance.

    Parameters
    ----------
    loop : ForceLoop
        From `eft.design_force_loop`.
    ax : Axes, optional
        Where to draw; by default the axes of a new figure.

    Returns
    -------
    Axes
        The axes with the curves.

    Raises
    ------
    AttributeError
        If `loop` is not a designed force loop.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> plots.force_loop(eft.design_force_loop(eft.Rig.zhao2005())).get_xlabel()
    'real part'
    """
    ax = axes_or_new(ax)
    model = loop.open_loop
    rate = 1.0 / model.sample_time if model.sample_time else 1e4
    frequency = np.geomspace(0.5, 0.5 * rate, 4000)
    gain = model.response(frequency, model.outputs[0], model.inputs[0])
    distance = float(np.abs(1.0 + gain).min())
    ax.plot(gain.real, gain.imag, color=BLUE, label="force loop")
    ax.plot(-1.0, 0.0, "+", color=VERMILION, markersize=9)
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    label = f"distance {distance:.2f} to -1"
    ax.plot(-1.0 + distance * np.cos(angle), distance * np.sin(angle), label=label, **LIMIT.keywords())
    ax.plot(
        -1.0 / loop.margins.gain,
        0.0,
        "o",
        color=BLACK,
        markersize=4,
        label=f"gain margin {loop.margins.gain:.3g}",
    )
    ax.set_xlim(-2.2, 1.2)
    ax.set_ylim(-1.8, 1.2)
    ax.set_aspect("equal", adjustable="box")
    return finish(ax, xlabel="real part", ylabel="imaginary part")


def identification(found: Identification, *, figure: Figure | SubFigure | None = None) -> Figure | SubFigure:
    """The phase of the valve and the flow curve, if identified.

    Parameters
    ----------
    found : Identification
        From `eft.identify`.
    figure : Figure or SubFigure, optional
        Where to draw; by default a new figure.

    Returns
    -------
    Figure or SubFigure
        The figure with its panels.

    Raises
    ------
    AttributeError
        If `found` is not an identification.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> from eft.traces import Traces
    >>> rig = eft.Rig.zhao2005()
    >>> test = eft.identification.valve_test(rig)
    >>> signals = {"valve_command": test.valve_command, "spool": test.spool}
    >>> found = eft.identify(rig, valve=Traces("valve", 2048.0, signals))
    >>> plots.identification(found).axes[0].get_ylabel()
    'phase lag (rad)'
    """
    parts: list[tuple[Any, Any]] = []
    if found.response_delay is not None:
        parts.append((response_delay, found.response_delay))
    if found.flow_curve is not None:
        parts.append((flow_curve, found.flow_curve))
    figure = figure_or_new(figure, 2.6 * max(len(parts), 1))
    if not parts:
        figure.suptitle("neither delay nor flow curve was identified", fontsize=9)
        return figure
    axes = list(np.atleast_1d(figure.subplots(len(parts), 1)))
    for (draw, what), ax in zip(parts, axes, strict=True):
        draw(what, ax=ax)
    panel_letters(axes)
    return figure
