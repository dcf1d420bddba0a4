"""Overview figures, which the methods ``plot()`` of the results draw."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

import eft
from eft import _display
from eft._signals import energy_edge, labelled
from eft.plots._style import (
    BLUE,
    GREEN,
    WIDTH,
    axes_or_new,
    finish,
    lines_for,
)
from eft.plots.histories import displacement_history, force_history, mark_ends, spool_history
from eft.plots.spectra import force_ratio

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    from eft import Command, Record, Study, TestRun

_LABEL = 20
"""Letters of a label."""
_WIDEST = 20_000
"""Largest number of points of a curve in a picture."""


def figure_or_new(figure: Figure | SubFigure | None, height: float) -> Figure | SubFigure:
    """The given figure, or a new one that spans a page."""
    if figure is not None:
        return figure
    # Imported here, so that a program with its own figure does not start pyplot.
    from matplotlib import pyplot

    return pyplot.figure(figsize=(WIDTH, height), layout="constrained")


def panel_letters(axes: Sequence[Axes]) -> None:
    """(a), (b), ... at the upper left of each panel."""
    for number, ax in enumerate(axes):
        ax.set_title(f"({chr(ord('a') + number)})", loc="left", fontweight="bold")


def natural_frequency(rig: eft.Rig) -> float | None:
    """Natural frequency at small motion, Hz; None for a building, which has several."""
    structure = rig.plant["structure"]
    if structure["kind"] == "shear_building" or structure["stiffness"] <= 0.0:
        return None
    return float(np.sqrt(structure["stiffness"] / structure["mass"]) / (2.0 * np.pi))


def run_page(run: TestRun, *, figure: Figure | SubFigure | None = None) -> Figure | SubFigure:
    """Force over its error, displacement over the ideal one, spool, and force over command by frequency.

    Parameters
    ----------
    run : TestRun
        The test.
    figure : Figure or SubFigure, optional
        Where to draw; by default a new figure.

    Returns
    -------
    Figure or SubFigure
        The figure with its panels.

    Raises
    ------
    AttributeError
        If `run` is not a test.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 4.0, 4.0, 1024.0))
    >>> len(plots.run_page(run).axes)
    5
    """
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
    """Frequency below which 99 % of the energy of a command lies, Hz."""
    power = (np.abs(np.fft.rfft(np.atleast_2d(command))) ** 2).sum(axis=0)
    return float((energy_edge(power) + 2) * sample_rate / np.atleast_2d(command).shape[1])


def record(motion: Record, *, ax: Axes | None = None) -> Axes:
    """Ground acceleration against time, with the peak.

    Parameters
    ----------
    motion : Record
        The ground motion.
    ax : Axes, optional
        Where to draw; by default the axes of a new figure.

    Returns
    -------
    Axes
        The axes with the curves.

    Raises
    ------
    TypeError
        If `motion` is not a record.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> import numpy as np
    >>> motion = eft.Record(np.sin(np.arange(400) / 20.0), dt=0.01, name="sine")
    >>> plots.record(motion).get_title(loc="left")
    'sine, 1 m/s²'
    """
    ax = axes_or_new(ax)
    every, unit = -(-len(motion) // _WIDEST), _display.shown("acceleration")
    ax.plot(motion.time[::every], motion.acceleration[::every] * unit.factor, color=BLUE, linewidth=0.8)
    ax.margins(x=0)
    ax.set_title(f"{motion.name}, {unit(motion.pga, '.3g')}".lstrip(", "), loc="left")
    return finish(ax, xlabel="time (s)", ylabel=f"acceleration ({unit.unit})", legend=False)


def command(force: Command, *, ax: Axes | None = None) -> Axes:
    """Force command against time, one curve for each actuator.

    Parameters
    ----------
    force : Command
        The command, of one or several actuators.
    ax : Axes, optional
        Where to draw; by default the axes of a new figure.

    Returns
    -------
    Axes
        The axes with the curves.

    Raises
    ------
    AttributeError
        If `force` is not a command.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> plots.command(eft.sine_sweep(2000.0, 0.5, 4.0, 4.0, 1024.0)).get_ylabel()
    'force command (kN)'
    """
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
    """One metric over each setting of a study, with one point per completed test.

    Parameters
    ----------
    found : Study
        The study.
    metric : str
        Name of the column to draw.
    figure : Figure or SubFigure, optional
        Where to draw; by default a new figure.

    Returns
    -------
    Figure or SubFigure
        The figure with its panels.

    Raises
    ------
    KeyError
        If the study has no column of that name.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> sweep = eft.sine_sweep(2000.0, 0.5, 4.0, 2.0, 512.0)
    >>> settings = {"compensation.level": [0.9, 1.0]}
    >>> found = eft.study(eft.Rig.zhao2005(), sweep, settings, progress=False)
    >>> plots.study(found).axes[0].get_ylabel()
    'nrmse (%)'
    """
    names = list(found.parameters) or ["index"]
    figure = figure_or_new(figure, 2.2 * len(names))
    axes = list(np.atleast_1d(figure.subplots(len(names), 1)))
    done = found["status"] == "completed"
    about = {column.name: column for column in found.columns}
    scale, unit = (100.0, " (%)") if metric in ("nrmse", "max_spool", "peak_error") else (1.0, "")
    for name, ax in zip(names, axes, strict=True):
        values = found[name][done]
        if about[name].type not in ("float", "int"):
            values = _words(values)
        ax.plot(values, scale * found[metric][done], "o", color=BLUE, markersize=3)
        label = f"{name} ({about[name].unit})" if about[name].unit else name
        finish(ax, xlabel=label, ylabel=f"{metric}{unit}", legend=False)
    panel_letters(axes)
    return figure


def _words(values: Iterable[object]) -> list[str]:
    """Values as labels of an axis; a long one, such as a list, is cut and has its number."""
    texts = list(map(str, values))
    numbers = {text: number for number, text in enumerate(dict.fromkeys(texts))}
    return [text if len(text) <= _LABEL else f"{numbers[text]}: {text[:_LABEL]}…" for text in texts]
