"""Time histories of force, displacement, velocity and spool opening."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from eft._display import shown
from eft._signals import Array, Response, commands, endings, inside, labelled
from eft.plots._style import COMMAND, END, IDEAL, LIMIT, axes_or_new, finish, lines_for

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from eft import TestRun

SPOOL_ADVICE = 0.6
"""Largest spool opening that the paper recommends, as a fraction of the stroke."""

Window = tuple[float, float]


def force_history(
    runs: TestRun | Mapping[str, TestRun], *, window: Window | None = None, ax: Axes | None = None
) -> Axes:
    """Force command against force, as in Figs. 8 and 9; `window` in s. Units are those of `eft.use_units`.

    Parameters
    ----------
    runs : TestRun or mapping of str to TestRun
        One test, or several by their labels.
    window : tuple of float, optional
        First and last moment to draw, s; the whole test by default.
    ax : Axes, optional
        Where to draw; by default the axes of a new figure.

    Returns
    -------
    Axes
        The axes with the curves.

    Raises
    ------
    ValueError
        If there is no test, or the window holds fewer than two samples.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 4.0, 4.0, 1024.0))
    >>> plots.force_history(run, window=(1.0, 3.0)).get_ylabel()
    'force (kN)'
    """
    ax = axes_or_new(ax)
    runs, unit = labelled(runs), shown("force")
    for label, run in commands(runs):
        part = inside(run.time, window)
        ax.plot(run.time[part], run.command[part] * unit.factor, label=label, **COMMAND.keywords())
    for (label, each), line in zip(runs.items(), lines_for(runs), strict=True):
        part = inside(each.time, window)
        ax.plot(each.time[part], each.force[part] * unit.factor, label=label, **line.keywords())
    ax.margins(x=0)
    mark_ends(ax, runs, window)
    return finish(ax, xlabel="time (s)", ylabel=f"force ({unit.unit})")


def displacement_history(
    runs: TestRun | Mapping[str, TestRun],
    *,
    ideal: Response | None = None,
    window: Window | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Displacement, with that under the exact command (`ideal`), as in Fig. 10.

    Parameters
    ----------
    runs : TestRun or mapping of str to TestRun
        One test, or several by their labels.
    ideal : Response, optional
        Motion under the exact command, as of `eft.ideal_response`.
    window : tuple of float, optional
        First and last moment to draw, s; the whole test by default.
    ax : Axes, optional
        Where to draw; by default the axes of a new figure.

    Returns
    -------
    Axes
        The axes with the curves.

    Raises
    ------
    ValueError
        If the window ends before it starts, or holds fewer than two samples.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 4.0, 4.0, 1024.0))
    >>> ideal = eft.ideal_response(run.rig, eft.Command(run.command, run.sample_rate))
    >>> [line.get_label() for line in plots.displacement_history(run, ideal=ideal).get_lines()]
    ['ideal', 'measured']
    """
    unit = shown("length")
    ax = _responses(lambda each: each.displacement * unit.factor, runs, ideal, window, ax)
    return finish(ax, xlabel="time (s)", ylabel=f"displacement ({unit.unit})")


def velocity_history(
    runs: TestRun | Mapping[str, TestRun],
    *,
    ideal: Response | None = None,
    window: Window | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Velocity, with that under the exact command (`ideal`), as in Fig. 10.

    Parameters
    ----------
    runs : TestRun or mapping of str to TestRun
        One test, or several by their labels.
    ideal : Response, optional
        Motion under the exact command, as of `eft.ideal_response`.
    window : tuple of float, optional
        First and last moment to draw, s; the whole test by default.
    ax : Axes, optional
        Where to draw; by default the axes of a new figure.

    Returns
    -------
    Axes
        The axes with the curves.

    Raises
    ------
    ValueError
        If the window ends before it starts, or holds fewer than two samples.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 4.0, 4.0, 1024.0))
    >>> plots.velocity_history({"test": run}).get_lines()[0].get_label()
    'test'
    """
    unit = shown("velocity")
    ax = _responses(lambda each: each.velocity * unit.factor, runs, ideal, window, ax)
    return finish(ax, xlabel="time (s)", ylabel=f"velocity ({unit.unit})")


def spool_history(
    runs: TestRun | Mapping[str, TestRun],
    *,
    advice: float = SPOOL_ADVICE,
    window: Window | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Spool opening in percent of its stroke, with the largest opening that the paper advises.

    Parameters
    ----------
    runs : TestRun or mapping of str to TestRun
        One test, or several by their labels.
    advice : float
        Largest opening that is advised, as a fraction of the stroke.
    window : tuple of float, optional
        First and last moment to draw, s; the whole test by default.
    ax : Axes, optional
        Where to draw; by default the axes of a new figure.

    Returns
    -------
    Axes
        The axes with the curves.

    Raises
    ------
    ValueError
        If the window ends before it starts, or holds fewer than two samples.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 4.0, 4.0, 1024.0))
    >>> plots.spool_history(run, advice=0.5).get_lines()[1].get_label()
    '50% advised'
    """
    ax = axes_or_new(ax)
    runs = labelled(runs, alone="spool")
    highest = advice
    for (label, run), line in zip(runs.items(), lines_for(runs), strict=True):
        part = inside(run.time, window)
        ax.plot(run.time[part], run.spool[part] * 100, label=label, **line.keywords())
        highest = max(highest, float(abs(run.spool[part]).max()))
    ax.axhline(advice * 100, label=f"{advice:.0%} advised", **LIMIT.keywords())
    ax.axhline(-advice * 100, **LIMIT.keywords())
    ax.margins(x=0)
    mark_ends(ax, runs, window)
    ax.set_ylim(-110 * highest, 110 * highest)
    return finish(ax, xlabel="time (s)", ylabel="spool opening (% of stroke)")


def mark_ends(
    ax: Axes, runs: Mapping[str, TestRun], window: Window | None = None, *, named: bool = True
) -> None:
    """A line where a test tripped or left its stroke, with the cause in the legend."""
    for time, words in endings(runs):
        if window is None or window[0] <= time <= window[1]:
            ax.axvline(time, label=words if named else "_end", **END.keywords())


def _responses(
    quantity: Callable[[Response], Array],
    runs: TestRun | Mapping[str, TestRun],
    ideal: Response | None,
    window: Window | None,
    ax: Axes | None,
) -> Axes:
    ax = axes_or_new(ax)
    runs = labelled(runs)
    if ideal is not None:
        # Wide and behind the other curves, so that both are visible if they agree.
        part = inside(ideal.time, window)
        for row, values in enumerate(np.atleast_2d(quantity(ideal))):
            label = "_ideal" if row else "ideal"
            ax.plot(ideal.time[part], values[part], label=label, **IDEAL.keywords())
    for (label, run), line in zip(runs.items(), lines_for(runs), strict=True):
        part = inside(run.time, window)
        ax.plot(run.time[part], quantity(run)[part], label=label, **line.keywords())
    ax.margins(x=0)
    mark_ends(ax, runs, window)
    return ax
