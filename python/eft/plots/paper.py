"""Whole figures in the manner of the paper's Figs. 4, 6 and 8 to 11, laid out for a printed page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from eft._signals import Response
from eft.plots import histories, loops, planning, spectra
from eft.plots._style import page, printed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike

    from eft import FlowTable, Rig, TestRun
    from eft.identification import DelayEstimate
    from eft.linear import StabilityMap

Runs = Mapping[str, "TestRun"]


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

    `spool` and `displacement` (m) are that run's, sampled at `sample_rate` (Hz).
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
    """Valve, lead network and both in series: gain and phase."""
    with printed():
        figure = page(4.2)
        planning.inverse_dynamics(rig, axes=figure.subplots(2, 1, sharex=True))
        figure.align_ylabels()
        return figure


def figure_maps(*found: StabilityMap) -> Figure:
    """Stability maps one below the other."""
    with printed():
        figure = page(2.7 * len(found))
        for ax, each in zip(figure.subplots(len(found), 1, squeeze=False)[:, 0], found, strict=True):
            planning.stability_map(each, ax=ax)
        return figure


def figure_8(runs: Runs, *, window: tuple[float, float] = (4.0, 8.0)) -> Figure:
    """A sine sweep under each scheme: force against command in a time window in s, and all spectra."""
    return _forces(runs, window, band=(0.0, 10.0), spectrum="the whole sweep")


def figure_8_ratio(runs: Runs) -> Figure:
    """The same sweeps: force over command around the resonance, and the spool opening."""
    with printed():
        figure = page(4.6)
        top, bottom = figure.subplots(2, 1)
        spectra.force_ratio(runs, ax=top)
        histories.spool_history(runs, ax=bottom)
        figure.align_ylabels()
        return figure


def figure_9(runs: Runs, *, window: tuple[float, float] | None = None) -> Figure:
    """An earthquake test under each scheme: force against command in a time window in s, and all spectra."""
    return _forces(runs, window, band=(0.5, 3.0), spectrum="the whole test, around the natural frequency")


def figure_10(runs: Runs, ideal: Response, *, window: tuple[float, float] | None = None) -> Figure:
    """An earthquake test under each scheme: displacement and velocity beside the ideal response."""
    with printed():
        figure = page(1.4 * 2 * len(runs))
        grid = figure.subplots(2 * len(runs), 1)
        for row, (label, run) in enumerate(runs.items()):
            one = {label: run}
            upper, lower = grid[row], grid[row + len(runs)]
            histories.displacement_history(one, ideal=ideal, window=window, ax=upper)
            histories.velocity_history(one, ideal=ideal, window=window, ax=lower)
            upper.set_title(f"displacement, compensation {label}")
            lower.set_title(f"velocity, compensation {label}")
        _same_scale(grid[: len(runs)])
        _same_scale(grid[len(runs) :])
        _only_last_has_xlabel(grid)
        figure.align_ylabels()
        return figure


def figure_11(runs: Runs, *, band: tuple[float, float] = (0.75, 2.5)) -> Figure:
    """Sweeps with one setting varied: spectra of the force, and its ratio to the command, in a band in Hz."""
    with printed():
        figure = page(4.6)
        top, bottom = figure.subplots(2, 1)
        spectra.force_spectrum(runs, band=band, ax=top)
        spectra.force_ratio(runs, band=band, ax=bottom)
        _only_last_has_xlabel((top, bottom))
        figure.align_ylabels()
        return figure


def figure_structure(run: TestRun, *, window: tuple[float, float] | None = None) -> Figure:
    """What the test asked of valve and structure: spool opening in time, and the restoring force r(x)."""
    with printed():
        figure = page(2.7)
        left, right = figure.subplots(1, 2, width_ratios=[1.5, 1.0])
        histories.spool_history(run, window=window, ax=left)
        loops.hysteresis(run, window=window, ax=right)
        figure.align_ylabels()
        return figure


def _forces(
    runs: Runs, window: tuple[float, float] | None, *, band: tuple[float, float], spectrum: str
) -> Figure:
    with printed():
        figure = page(1.6 * len(runs) + 2.3)
        grid = figure.subplots(len(runs) + 1, 1, height_ratios=[1.0] * len(runs) + [1.5])
        for ax, (label, run) in zip(grid, runs.items(), strict=False):
            histories.force_history({label: run}, window=window, ax=ax)
            ax.set_title(f"compensation {label}")
        _same_scale(grid[:-1])
        _only_last_has_xlabel(grid[:-1])
        spectra.force_spectrum(runs, band=band, ax=grid[-1])
        grid[-1].set_title(spectrum)
        figure.align_ylabels()
        return figure


def _only_last_has_xlabel(column: Iterable[Axes]) -> None:
    *upper, _ = column
    for ax in upper:
        ax.set_xlabel("")
        ax.tick_params(labelbottom=False)


def _same_scale(column: Iterable[Axes]) -> None:
    axes = list(column)
    highest = max(max(abs(limit) for limit in ax.get_ylim()) for ax in axes)
    for ax in axes:
        ax.set_ylim(-highest, highest)
