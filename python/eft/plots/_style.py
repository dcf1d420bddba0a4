"""The style of the figures: colours, lines, axes. It does not change matplotlib's global state."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
from matplotlib.figure import Figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# The eight colours of Okabe and Ito, which differ under every common colour vision; line styles differ too,
# for grey prints.
BLACK, ORANGE, SKY, GREEN, YELLOW, BLUE, VERMILION, PURPLE = (
    "#000000", "#E69F00", "#56B4E9", "#009E73", "#F0E442", "#0072B2", "#D55E00", "#CC79A7",
)  # fmt: skip

WIDTH = 6.7
"""Width in inches of a figure that spans the text of a printed page (170 mm)."""


@dataclass(frozen=True)
class Line:
    """The style of one curve."""

    color: str
    linestyle: str | tuple[int, tuple[float, ...]] = "-"
    linewidth: float = 1.1

    def keywords(self) -> dict[str, Any]:
        """As keyword arguments of ``Axes.plot``."""
        return {"color": self.color, "linestyle": self.linestyle, "linewidth": self.linewidth}


COMMAND = Line("0.62", "-", 2.2)
IDEAL = Line("0.62", "-", 2.2)
LIMIT = Line("0.35", (0, (5, 3)), 0.9)
END = Line(PURPLE, (0, (1, 1)), 1.4)

_SCHEMES = {
    "off": Line(GREEN, (0, (1, 1.2)), 1.3),
    "linear": Line(VERMILION, (0, (4, 1.6)), 1.1),
    "nonlinear": Line(BLUE, "-", 1.1),
}
_OTHERS = (
    Line(BLUE, "-"),
    Line(VERMILION, (0, (4, 1.6))),
    Line(GREEN, (0, (1, 1.2)), 1.3),
    Line(PURPLE, (0, (6, 1.5, 1, 1.5))),
    Line(ORANGE, "-"),
    Line(SKY, (0, (4, 1.6))),
)


def lines_for(labels: Iterable[str]) -> Iterator[Line]:
    """One style for each label: the schemes have fixed styles, other labels get the next unused one."""
    others = 0
    for label in labels:
        scheme = _SCHEMES.get(label)
        if scheme is None:
            yield _OTHERS[others % len(_OTHERS)]
            others += 1
        else:
            yield scheme


def axes_or_new(ax: Axes | None) -> Axes:
    """The caller's axes, or those of a new figure that spans a page."""
    if ax is not None:
        return ax
    # Imported here, so that a program with its own axes does not start pyplot.
    from matplotlib import pyplot

    _, new = pyplot.subplots(figsize=(WIDTH, 2.4), layout="constrained")
    return new


@contextmanager
def printed() -> Iterator[None]:
    """A context in which figures have the fonts of a printed report."""
    with mpl.rc_context(
        {
            "font.size": 8.5,
            "axes.titlesize": 8.5,
            "axes.titlelocation": "left",
            "axes.titlepad": 3.0,
            "axes.labelsize": 8.5,
            "legend.fontsize": 7.5,
            "xtick.labelsize": 7.5,
            "ytick.labelsize": 7.5,
            "axes.linewidth": 0.7,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "lines.linewidth": 1.1,
            "figure.constrained_layout.use": True,
        }
    ):
        yield


def page(height: float) -> Figure:
    """A figure as wide as a printed page, `height` in inches, which opens no window."""
    return Figure(figsize=(WIDTH, height), dpi=200, layout="constrained")


_COLUMNS = 5
"""Largest number of entries in a row of a legend."""


def finish(ax: Axes, *, xlabel: str, ylabel: str, legend: bool = True) -> Axes:
    """Labels with units, a light grid, and a legend if there are several curves."""
    ax.set_xlabel(xlabel)
    ax.set_ylabel(ylabel)
    ax.grid(visible=True, color="0.9", linewidth=0.5)
    ax.set_axisbelow(True)
    if legend:
        # Above the axes, because a legend inside could hide data.
        entries = len(ax.get_legend_handles_labels()[1])
        ax.legend(
            loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=min(entries, _COLUMNS), frameon=False,
            borderpad=0.1, borderaxespad=0.1, handlelength=2.2, columnspacing=1.4,
        )  # fmt: skip
    return ax
