"""Whole figures of tests like the paper's Figs. 8 to 11, laid out for a printed page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from eft._signals import Response
from eft.plots import histories, loops, spectra
from eft.plots._style import page, printed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from eft import TestRun

Runs = Mapping[str, "TestRun"]


def figure_8(runs: Runs, *, window: tuple[float, float] = (4.0, 8.0)) -> Figure:
    """A sine sweep under each scheme: force against command in a time window in s, and all spectra.

    Parameters
    ----------
    runs : mapping of str to TestRun
        Tests by their labels.
    window : tuple of float
        First and last moment to draw, s.

    Returns
    -------
    Figure
        The page, ready for ``savefig``.

    Raises
    ------
    ValueError
        If the window ends before it starts, or holds fewer than two samples.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> rig, sweep = eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 4.0, 4.0, 1024.0)
    >>> runs = {
    ...     mode: eft.simulate(rig.replace({"compensation.mode": mode}), sweep)
    ...     for mode in ("off", "nonlinear")
    ... }
    >>> len(plots.figure_8(runs, window=(1.0, 3.0)).axes)
    3
    """
    return _forces(runs, window, band=(0.0, 10.0), spectrum="the whole sweep")


def figure_8_ratio(runs: Runs) -> Figure:
    """The same sweeps: force over command around the resonance, and the spool opening.

    Parameters
    ----------
    runs : mapping of str to TestRun
        Tests by their labels.

    Returns
    -------
    Figure
        The page, ready for ``savefig``.

    Raises
    ------
    ValueError
        If half the sample rate is below the band of 0.5 to 3 Hz.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> rig, sweep = eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 4.0, 4.0, 1024.0)
    >>> runs = {
    ...     mode: eft.simulate(rig.replace({"compensation.mode": mode}), sweep)
    ...     for mode in ("off", "nonlinear")
    ... }
    >>> [ax.get_ylabel() for ax in plots.figure_8_ratio(runs).axes]
    ['force / command', 'spool opening (% of stroke)']
    """
    with printed():
        figure = page(4.6)
        top, bottom = figure.subplots(2, 1)
        spectra.force_ratio(runs, ax=top)
        histories.spool_history(runs, ax=bottom)
        figure.align_ylabels()
        return figure


def figure_9(runs: Runs, *, window: tuple[float, float] | None = None) -> Figure:
    """An earthquake test under each scheme: force against command in a time window in s, and all spectra.

    Parameters
    ----------
    runs : mapping of str to TestRun
        Tests by their labels.
    window : tuple of float, optional
        First and last moment to draw, s; the whole test by default.

    Returns
    -------
    Figure
        The page, ready for ``savefig``.

    Raises
    ------
    ValueError
        If the window ends before it starts, or holds fewer than two samples.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> rig, sweep = eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 4.0, 4.0, 1024.0)
    >>> runs = {
    ...     mode: eft.simulate(rig.replace({"compensation.mode": mode}), sweep)
    ...     for mode in ("off", "nonlinear")
    ... }
    >>> len(plots.figure_9(runs).axes)
    3
    """
    return _forces(runs, window, band=(0.5, 3.0), spectrum="the whole test, around the natural frequency")


def figure_10(runs: Runs, ideal: Response, *, window: tuple[float, float] | None = None) -> Figure:
    """An earthquake test under each scheme: displacement and velocity with the ideal response.

    Parameters
    ----------
    runs : mapping of str to TestRun
        Tests by their labels.
    ideal : Response
        Motion under the exact command, as of `eft.ideal_response`.
    window : tuple of float, optional
        First and last moment to draw, s; the whole test by default.

    Returns
    -------
    Figure
        The page, ready for ``savefig``.

    Raises
    ------
    ValueError
        If there is no test, or the window holds fewer than two samples.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> rig, sweep = eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 4.0, 4.0, 1024.0)
    >>> runs = {
    ...     mode: eft.simulate(rig.replace({"compensation.mode": mode}), sweep)
    ...     for mode in ("off", "nonlinear")
    ... }
    >>> ideal = eft.ideal_response(rig, sweep)
    >>> len(plots.figure_10(runs, ideal).axes)
    4
    """
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
    """Sweeps with one setting varied: spectra of the force, and its ratio to the command, in a band in Hz.

    Parameters
    ----------
    runs : mapping of str to TestRun
        Tests by their labels.
    band : tuple of float
        Lowest and highest frequency, Hz.

    Returns
    -------
    Figure
        The page, ready for ``savefig``.

    Raises
    ------
    ValueError
        If there is no test, or the band does not rise.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> rig, sweep = eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 4.0, 4.0, 1024.0)
    >>> runs = {
    ...     mode: eft.simulate(rig.replace({"compensation.mode": mode}), sweep)
    ...     for mode in ("off", "nonlinear")
    ... }
    >>> [ax.get_ylabel() for ax in plots.figure_11(runs).axes]
    ['|FFT| of force (kN s)', 'force / command']
    """
    with printed():
        figure = page(4.6)
        top, bottom = figure.subplots(2, 1)
        spectra.force_spectrum(runs, band=band, ax=top)
        spectra.force_ratio(runs, band=band, ax=bottom)
        _only_last_has_xlabel((top, bottom))
        figure.align_ylabels()
        return figure


def figure_structure(run: TestRun, *, window: tuple[float, float] | None = None) -> Figure:
    """The load of valve and structure in a test: spool opening over time, and the restoring force r(x).

    Parameters
    ----------
    run : TestRun
        A test of a structure of one mass.
    window : tuple of float, optional
        First and last moment to draw, s; the whole test by default.

    Returns
    -------
    Figure
        The page, ready for ``savefig``.

    Raises
    ------
    ValueError
        If the structure is a building, or the window holds fewer than two samples.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 4.0, 4.0, 1024.0))
    >>> [ax.get_xlabel() for ax in plots.figure_structure(run).axes]
    ['time (s)', 'displacement (mm)']
    """
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
