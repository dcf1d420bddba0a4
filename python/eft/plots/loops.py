"""Hysteresis loops of the structure."""

from __future__ import annotations

from typing import TYPE_CHECKING

from eft._display import shown
from eft._signals import inside, restoring_force
from eft.plots._style import BLUE, axes_or_new, finish

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from eft import TestRun


def hysteresis(run: TestRun, *, window: tuple[float, float] | None = None, ax: Axes | None = None) -> Axes:
    """Restoring force `r(x) = F − m·ẍ − c·ẋ` against displacement; `window` in s.

    Mass and damping are the true ones of the rig that was tested.

    Parameters
    ----------
    run : TestRun
        A test of a structure of one mass.
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
        If the structure is a building, or the window holds fewer than two samples.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 4.0, 4.0, 1024.0))
    >>> plots.hysteresis(run).get_xlabel()
    'displacement (mm)'
    """
    if run.rig["structure.kind"] == "shear_building":
        raise ValueError(
            'structure.kind = "shear_building": must be of one mass, whose restoring force this is'
        )
    ax = axes_or_new(ax)
    part = inside(run.time, window)
    structure = run.rig.plant["structure"]
    force = restoring_force(run, structure["mass"], structure["damping"])
    across, up = shown("length"), shown("force")
    ax.plot(run.displacement[part] * across.factor, force[part] * up.factor, color=BLUE, linewidth=0.9)
    ax.axhline(0, color="0.7", linewidth=0.6)
    ax.axvline(0, color="0.7", linewidth=0.6)
    labels = (f"displacement ({across.unit})", f"restoring force ({up.unit})")
    return finish(ax, xlabel=labels[0], ylabel=labels[1], legend=False)
