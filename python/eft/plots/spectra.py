"""Spectra of force and command, and their ratio."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from eft._display import shown
from eft._signals import amplitude_spectrum, commands, labelled, sample_step
from eft.plots._style import COMMAND, LIMIT, axes_or_new, finish, lines_for

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from eft import DriveIteration, TestRun

Band = tuple[float, float]


def force_spectrum(
    runs: TestRun | Mapping[str, TestRun], *, band: Band = (0.0, 10.0), ax: Axes | None = None
) -> Axes:
    """Modulus of the Fourier transform of force and command over a band in Hz, as in Fig. 8.

    Parameters
    ----------
    runs : TestRun or mapping of str to TestRun
        One test, or several by their labels.
    band : tuple of float
        Lowest and highest frequency, Hz.
    ax : Axes, optional
        Where to draw; by default the axes of a new figure.

    Returns
    -------
    Axes
        The axes with the curves.

    Raises
    ------
    ValueError
        If there is no test.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 4.0, 4.0, 1024.0))
    >>> [float(edge) for edge in plots.force_spectrum(run, band=(0.5, 4.0)).get_xlim()]
    [0.5, 4.0]
    """
    ax = axes_or_new(ax)
    runs, unit = labelled(runs), shown("force")
    for label, run in commands(runs):
        frequency, command = amplitude_spectrum(run.command * unit.factor, sample_step(run), band)
        ax.plot(frequency, command, label=label, **COMMAND.keywords())
    for (label, each), line in zip(runs.items(), lines_for(runs), strict=True):
        frequency, force = amplitude_spectrum(each.force * unit.factor, sample_step(each), band)
        ax.plot(frequency, force, label=label, **line.keywords())
    ax.set_xlim(*band)
    ax.set_ylim(bottom=0)
    return finish(ax, xlabel="frequency (Hz)", ylabel=f"|FFT| of force ({unit.unit} s)")


def force_ratio(
    runs: TestRun | Mapping[str, TestRun], *, band: Band = (0.5, 3.0), ax: Axes | None = None
) -> Axes:
    """Fourier modulus of the force over that of the command, over a band in Hz; 1 is exact.

    Parameters
    ----------
    runs : TestRun or mapping of str to TestRun
        One test, or several by their labels.
    band : tuple of float
        Lowest and highest frequency, Hz.
    ax : Axes, optional
        Where to draw; by default the axes of a new figure.

    Returns
    -------
    Axes
        The axes with the curves.

    Raises
    ------
    ValueError
        If the band does not rise, or ends above half the sample rate.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 4.0, 4.0, 1024.0))
    >>> [line.get_label() for line in plots.force_ratio(run).get_lines()]
    ['exact', 'measured']
    """
    ax = axes_or_new(ax)
    runs = labelled(runs)
    ax.axhline(1.0, label="exact", **LIMIT.keywords())
    for (label, run), line in zip(runs.items(), lines_for(runs), strict=True):
        response = run.fft_ratio(*band)
        ax.plot(response.frequency, response.ratio, label=label, **line.keywords())
    ax.set_xlim(*band)
    ax.set_ylim(bottom=0)
    return finish(ax, xlabel="frequency (Hz)", ylabel="force / command")


def drive_response(found: DriveIteration, *, band: Band | None = None, ax: Axes | None = None) -> Axes:
    """Force over drive and their coherence from an iteration; 1 is exact.

    The default band ends at the highest corrected frequency. Each of several actuators has its own lines.

    Parameters
    ----------
    found : DriveIteration
        From `eft.iterate`.
    band : tuple of float, optional
        Lowest and highest frequency, Hz.
    ax : Axes, optional
        Where to draw; by default the axes of a new figure.

    Returns
    -------
    Axes
        The axes with the curves.

    Raises
    ------
    AttributeError
        If `found` is not an iteration.

    Examples
    --------
    >>> import eft
    >>> from eft import plots
    >>> sweep = eft.sine_sweep(8900.0, 0.0, 10.0, 4.0, 1024.0)
    >>> found = eft.iterate(eft.Rig.zhao2005(), sweep, repeats=1)
    >>> [line.get_label() for line in plots.drive_response(found).get_lines()]
    ['exact', 'force / drive', 'coherence']
    """
    ax = axes_or_new(ax)
    responses, coherences = np.atleast_2d(found.response), np.atleast_2d(found.coherence)
    if band is None:
        corrected = found.frequency[np.atleast_2d(found.corrected).any(axis=0)]
        band = (0.0, float(corrected.max()) if corrected.size else float(found.frequency[-1]))
    inside = (found.frequency >= band[0]) & (found.frequency <= band[1])
    frequency = found.frequency[inside]
    looks = lines_for(f"{one}" for one in range(2 * len(responses)))
    ax.axhline(1.0, label="exact", **LIMIT.keywords())
    for floor, (response, coherence) in enumerate(zip(responses, coherences, strict=True), 1):
        where = f", actuator {floor}" if len(responses) > 1 else ""
        ax.plot(frequency, abs(response[inside]), label=f"force / drive{where}", **next(looks).keywords())
        ax.plot(frequency, coherence[inside], label=f"coherence{where}", **next(looks).keywords())
    ax.set_xlim(*band)
    ax.set_ylim(bottom=0)
    return finish(ax, xlabel="frequency (Hz)", ylabel="ratio (1)")
