"""Against time: force, displacement, velocity, spool opening."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from eft._signals import Array, Response, commands, inside, labelled
from eft.plots._style import COMMAND, IDEAL, LIMIT, axes_or_new, finish, lines_for

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from eft import TestRun

SPOOL_ADVICE = 0.6
"""Largest spool opening that the paper recommends, as a fraction of the stroke."""

Window = tuple[float, float]


def force_history(
    runs: TestRun | Mapping[str, TestRun], *, window: Window | None = None, ax: Axes | None = None
) -> Axes:
    """Force command against force, in kN, as in Figs. 8 and 9; `window` in s."""
    ax = axes_or_new(ax)
    runs = labelled(runs)
    for label, run in commands(runs):
        part = inside(run.time, window)
        ax.plot(run.time[part], run.command[part] / 1e3, label=label, **COMMAND.keywords())
    for (label, each), line in zip(runs.items(), lines_for(runs), strict=True):
        part = inside(each.time, window)
        ax.plot(each.time[part], each.force[part] / 1e3, label=label, **line.keywords())
    ax.margins(x=0)
    return finish(ax, xlabel="time (s)", ylabel="force (kN)")


def displacement_history(
    runs: TestRun | Mapping[str, TestRun],
    *,
    ideal: Response | None = None,
    window: Window | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Displacement in mm, with that under the exact command (`ideal`), as in Fig. 10."""
    ax = _responses(lambda each: each.displacement * 1e3, runs, ideal, window, ax)
    return finish(ax, xlabel="time (s)", ylabel="displacement (mm)")


def velocity_history(
    runs: TestRun | Mapping[str, TestRun],
    *,
    ideal: Response | None = None,
    window: Window | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Velocity in m/s, with that under the exact command (`ideal`), as in Fig. 10."""
    ax = _responses(lambda each: each.velocity, runs, ideal, window, ax)
    return finish(ax, xlabel="time (s)", ylabel="velocity (m/s)")


def spool_history(
    runs: TestRun | Mapping[str, TestRun],
    *,
    advice: float = SPOOL_ADVICE,
    window: Window | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Spool opening in percent of its stroke, with the largest opening that the paper advises."""
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
    ax.set_ylim(-110 * highest, 110 * highest)
    return finish(ax, xlabel="time (s)", ylabel="spool opening (% of stroke)")


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
        # Beneath and wide: where a test follows the ideal response, both can still be seen.
        part = inside(ideal.time, window)
        for row, values in enumerate(np.atleast_2d(quantity(ideal))):
            label = "_ideal" if row else "ideal"
            ax.plot(ideal.time[part], values[part], label=label, **IDEAL.keywords())
    for (label, run), line in zip(runs.items(), lines_for(runs), strict=True):
        part = inside(run.time, window)
        ax.plot(run.time[part], quantity(run)[part], label=label, **line.keywords())
    ax.margins(x=0)
    return ax
