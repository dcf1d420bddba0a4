"""One look at a result: what its ``plot()`` draws."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

import eft
from eft import _display
from eft._signals import labelled
from eft.plots._style import (
    BLACK,
    BLUE,
    GREEN,
    LIMIT,
    VERMILION,
    WIDTH,
    axes_or_new,
    finish,
    lines_for,
)
from eft.plots.histories import displacement_history, force_history, mark_ends, spool_history
from eft.plots.planning import flow_curve, response_delay
from eft.plots.spectra import force_ratio

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    from eft import Command, ForceLoop, Record, Study, TestRun
    from eft.identification import Identification
    from eft.linear import LinearModel

_WIDEST = 20_000
"""Points of one curve of a picture; more are not seen."""


def figure_or_new(figure: Figure | SubFigure | None, height: float) -> Figure | SubFigure:
    """The caller's figure, or a new one that spans a page."""
    if figure is not None:
        return figure
    # Only here, so that a program which passes its own figure never starts pyplot.
    from matplotlib import pyplot

    return pyplot.figure(figsize=(WIDTH, height), layout="constrained")


def panel_letters(axes: Sequence[Axes]) -> None:
    """(a), (b), ... at the upper left of each panel."""
    for number, ax in enumerate(axes):
        ax.set_title(f"({chr(ord('a') + number)})", loc="left", fontweight="bold")


def natural_frequency(rig: eft.Rig) -> float | None:
    """Of the structure at small motion, Hz; None of a building, which has several."""
    structure = rig.plant["structure"]
    if structure["kind"] == "shear_building" or structure["stiffness"] <= 0.0:
        return None
    return float(np.sqrt(structure["stiffness"] / structure["mass"]) / (2.0 * np.pi))


def run_page(run: TestRun, *, figure: Figure | SubFigure | None = None) -> Figure | SubFigure:
    """Force over its error, displacement over the ideal one, spool, and force over command by frequency."""
    figure = figure_or_new(figure, 8.5)
    axes = list(figure.subplots(5, 1, gridspec_kw={"height_ratios": [1.4, 0.8, 1.2, 1.0, 1.2]}))
    force_history(run, ax=axes[0])
    several, unit = np.atleast_2d(run.force - run.command), _display.shown("force")
    for row, line in zip(several, lines_for(map(str, range(len(several)))), strict=True):
        axes[1].plot(run.time, row * unit.factor, **line.keywords())
    axes[1].margins(x=0)
    mark_ends(axes[1], labelled(run), named=False)
    finish(axes[1], xlabel="time (s)", ylabel=f"force error ({unit.unit})", legend=False)
    ideal = eft.ideal_response(run.rig, eft.Command(run.command, run.sample_rate)) if len(run) > 1 else None
    displacement_history(run, ideal=ideal, ax=axes[2])
    spool_history(run, ax=axes[3])
    highest = min(_highest(run.command, run.sample_rate), run.sample_rate / 2.0)
    if run.command.any() and highest * run.duration > 4.0:
        force_ratio(run, band=(1.0 / run.duration, highest), ax=axes[4])
        if (natural := natural_frequency(run.rig)) is not None and natural < highest:
            label = f"natural frequency {natural:.2f} Hz"
            axes[4].axvline(natural, color=GREEN, linestyle=":", linewidth=1.1, label=label)
            finish(axes[4], xlabel="frequency (Hz)", ylabel="force / command")
    panel_letters(axes)
    return figure


def _highest(command: Any, sample_rate: float) -> float:
    """Where 99 % of the energy of a command lies below, Hz."""
    power = (np.abs(np.fft.rfft(np.atleast_2d(command))) ** 2).sum(axis=0)
    edge = int(np.searchsorted(np.cumsum(power), 0.99 * power.sum()))
    return float((edge + 2) * sample_rate / np.atleast_2d(command).shape[1])


def record(motion: Record, *, ax: Axes | None = None) -> Axes:
    """Ground acceleration against time, with the peak."""
    ax = axes_or_new(ax)
    every, unit = -(-len(motion) // _WIDEST), _display.shown("acceleration")
    ax.plot(motion.time[::every], motion.acceleration[::every] * unit.factor, color=BLUE, linewidth=0.8)
    ax.margins(x=0)
    ax.set_title(f"{motion.name}, {unit(motion.pga, '.3g')}".lstrip(", "), loc="left")
    return finish(ax, xlabel="time (s)", ylabel=f"acceleration ({unit.unit})", legend=False)


def command(force: Command, *, ax: Axes | None = None) -> Axes:
    """Force command against time, one curve for each actuator."""
    ax = axes_or_new(ax)
    rows, unit = np.atleast_2d(force.values), _display.shown("force")
    every = -(-rows.shape[1] // _WIDEST)
    labels = [f"actuator {number + 1}" for number in range(len(rows))]
    for row, label, line in zip(rows, labels, lines_for(labels), strict=True):
        ax.plot(force.time[::every], row[::every] * unit.factor, label=label, **line.keywords())
    ax.margins(x=0)
    return finish(ax, xlabel="time (s)", ylabel=f"force command ({unit.unit})", legend=len(rows) > 1)


def study(
    found: Study, *, metric: str = "nrmse", figure: Figure | SubFigure | None = None
) -> Figure | SubFigure:
    """One metric over each setting of a study, a point a completed test."""
    names = list(found.parameters) or ["index"]
    figure = figure_or_new(figure, 2.2 * len(names))
    axes = list(np.atleast_1d(figure.subplots(len(names), 1)))
    done = found["status"] == "completed"
    about = {column.name: column for column in found.columns}
    scale, unit = (100.0, " (%)") if metric in ("nrmse", "max_spool", "peak_error") else (1.0, "")
    for name, ax in zip(names, axes, strict=True):
        values = found[name][done]
        if about[name].type not in ("float", "int"):
            values = np.array([str(value) for value in values])
        ax.plot(values, scale * found[metric][done], "o", color=BLUE, markersize=3)
        label = f"{name} ({about[name].unit})" if about[name].unit else name
        finish(ax, xlabel=label, ylabel=f"{metric}{unit}", legend=False)
    panel_letters(axes)
    return figure


def linear_model(
    model: LinearModel,
    *,
    band: tuple[float, float] = (0.1, 200.0),
    output: str = "force",
    source: str | None = None,
    figure: Figure | SubFigure | None = None,
) -> Figure | SubFigure:
    """Bode diagram from an input, the first by default, to an output of a linear model."""
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
    """Nyquist diagram of a designed force loop, with the circle that its least distance to -1 leaves free."""
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
    """The phase of the valve and the flow curve, as far as they were found."""
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
