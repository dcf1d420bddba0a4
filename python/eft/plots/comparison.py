"""Two compared tests and their difference."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from eft._display import UnitSystem, shown
from eft.plots._style import BLUE, COMMAND, VERMILION, WIDTH, Line, finish

if TYPE_CHECKING:
    from eft.traces import Comparison

_MEASURED, _VIRTUAL = COMMAND, Line(BLUE)
_DIFFERENCE = Line(VERMILION)
_ASKED_FOR = ("command", "valve_command")
"""Signals that are usually equal in both tests."""


def comparison(compared: Comparison, *quantities: str, units: UnitSystem | None = None) -> Figure:
    """Draw two compared tests, a panel for each signal with its difference below; see `Comparison.plot`."""
    for quantity in quantities:
        if quantity not in compared:
            raise ValueError(f"{quantity} was not compared; there are {', '.join(compared)}")
    names = quantities or [name for name in compared if name not in _ASKED_FOR] or list(compared)
    figure = Figure(figsize=(WIDTH, 0.4 + 2.6 * len(names)), dpi=200, layout="constrained")
    axes = figure.subplots(2 * len(names), 1, sharex=True, squeeze=False, height_ratios=[2, 1] * len(names))
    time = compared.reference.time
    paths = [traces.name for traces in (compared.reference, compared.other)]
    labels = [path.rpartition("/")[2] for path in paths]
    if labels[0] == labels[1]:
        labels = paths
    for place, name in enumerate(names):
        over, below = axes[2 * place, 0], axes[2 * place + 1, 0]
        unit = shown(compared[name].unit, units)
        one, two = (traces.columns[name] * unit.factor for traces in (compared.reference, compared.other))
        over.plot(time, one, label=labels[0], **_MEASURED.keywords())
        over.plot(time, two, label=labels[1], **_VIRTUAL.keywords())
        below.plot(time, two - one, label="_difference", **_DIFFERENCE.keywords())
        words = name.replace("_", " ")
        last = place == len(names) - 1
        finish(over, xlabel="", ylabel=f"{words} ({unit.unit})", legend=place == 0)
        finish(below, xlabel="time (s)" if last else "", ylabel=f"difference\n({unit.unit})", legend=False)
        over.margins(x=0)
    figure.align_ylabels()
    return figure
