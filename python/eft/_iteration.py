"""Drive files: commands, found by repeated tests, that give the desired force."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from eft._measured_force import check_force
from eft._native import Command, Rig
from eft._numbers import real_number, whole_number
from eft._read_only import ReadOnly
from eft._run import TestRun
from eft._signals import energy_edge
from eft._simulate import simulate

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from eft.traces import Traces

__all__ = ["DriveIteration", "iterate"]

Array = NDArray[np.float64]

_SMOOTHING = 0.15
"""Hz on either side over which spectra are averaged: half of a resonance at 5 Hz with 3 % of damping."""

_ENERGY = 0.9999
"""Share of the command's energy up to the highest frequency that is corrected."""

_RESIDUAL = 0.05
"""Residual displacement over peak displacement above which a measured specimen counts as yielded."""

_LARGEST_FORCE = 3.0
"""Largest rms of a measured force over that of its command."""


@dataclass(frozen=True, eq=False)
class DriveIteration(ReadOnly):
    """A command for the next repeat, and the results of the previous ones."""

    drive: Command
    """The drive for the next test; for a rig the drive of the best repeat."""
    errors: tuple[float, ...]
    """Rms force error over rms command, of the worst actuator; the first is without iteration."""
    frequency: Array
    """Frequencies of the spectra, Hz."""
    response: NDArray[np.complex128]
    """Force over drive, of the last repeat; with a leading axis for several actuators, as in the next two
    fields."""
    coherence: Array
    """Of force and drive, of the last repeat, from 0 to 1."""
    corrected: NDArray[np.bool_]
    """Whether each frequency is corrected, within the band and with enough coherence."""
    stopped: str
    """Reason for the end of the iteration."""
    runs: tuple[TestRun, ...] = field(default=(), repr=False)
    """The repeats on the virtual rig; empty for measured data."""

    def _repr_html_(self) -> str:
        from eft import _notebook, plots

        rows = [(f"error of repeat {number}", f"{error:.2%}") for number, error in enumerate(self.errors)]
        draw = _notebook.on_axes(plots.drive_response, self)
        return _notebook.shown("Drive", [*rows, ("stopped", self.stopped)], draw)

    def plot(self, *, ax: Axes | None = None) -> Axes:
        """Draw force over drive and the coherence; uncorrected frequencies are shaded.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Axes to draw into; by default those of a new figure.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> import eft
        >>> sweep = eft.sine_sweep(2000.0, 0.5, 5.0, 4.0, 1024.0)
        >>> axes = eft.iterate(eft.Rig.zhao2005(), sweep, repeats=1).plot()
        """
        from eft import plots

        return plots.drive_response(self, ax=ax)


def iterate(
    rig_or_measured: Rig | TestRun | Traces,
    command: Command,
    *,
    repeats: int = 5,
    relaxation: float = 0.8,
    band: tuple[float, float] | None = None,
    least_coherence: float = 0.8,
    target: float = 0.0,
) -> DriveIteration:
    """Find the drive with which the force follows a command, like a drive file of a shaking table.

    Each repeat gives an estimate of force over drive, ``H = S_uy/S_uu``, with spectra averaged over
    neighbouring frequencies. The next drive is ``U + r·(Y_wanted - Y)/H``. Frequencies outside the band, or
    with a low coherence, are not corrected. For a rig the repeats run on the virtual rig, until the error no
    longer decreases. For measured data, one step gives the drive for the next test. Each of several actuators
    is corrected by its own response. The next repeat corrects the effect of the others on its force.  A
    specimen that yields is refused, because each repeat would change it.

    Parameters
    ----------
    rig_or_measured : Rig, TestRun or Traces
        The rig, or a test with ``command`` (the previous drive) and ``force``, and ``displacement`` if
        measured.
    command : Command
        The desired force.
    repeats : int
        Repeats on the virtual rig after the first test.
    relaxation : float
        Applied share of the correction, above 0 and up to 1.
    band : tuple of float, optional
        Lowest and highest corrected frequency, Hz; by default from 0 to the frequency below which 99.99 % of
        the command's energy lies.
    least_coherence : float
        Coherence below which a frequency is not corrected.
    target : float
        Error (rms over rms) at which to stop.

    Returns
    -------
    DriveIteration
        The drive, the errors and the estimated response.

    Raises
    ------
    TypeError
        If the first argument is another object, such as a path.
    ValueError
        If an argument is not allowed, the data do not fit the command or have another sign or unit, or the
        specimen yields.

    Examples
    --------
    >>> import eft
    >>> sweep = eft.sine_sweep(8900.0, 0.0, 10.0, 16.0, 2048.0)
    >>> found = eft.iterate(eft.Rig.zhao2005(), sweep, repeats=3)
    >>> found.errors[-1] < 0.3 * found.errors[0]
    True
    """
    if not isinstance(rig_or_measured, Rig) and not hasattr(rig_or_measured, "sample_rate"):
        raise TypeError(
            f"rig_or_measured = an object of type {type(rig_or_measured).__name__}: must be an eft.Rig, a "
            "TestRun or eft.traces.Traces; eft.traces.read_traces reads a file"
        )
    relaxation, target = real_number("relaxation", relaxation), real_number("target", target)
    least_coherence = real_number("least_coherence", least_coherence)
    repeats = whole_number("repeats", repeats)
    if not 0.0 < relaxation <= 1.0:
        raise ValueError(f"relaxation = {relaxation}: must be above 0 and at most 1")
    if not 0.0 <= least_coherence <= 1.0:
        raise ValueError(f"least_coherence = {least_coherence}: must be from 0 to 1")
    if not target >= 0.0:
        raise ValueError(f"target = {target}: must be at least 0")
    if repeats < 1:
        raise ValueError(f"repeats = {repeats}: must be at least 1")
    if not command.values.any():
        raise ValueError("command = 0: must have a force")
    step = _Step(command, _band(command, band), relaxation, least_coherence)
    if isinstance(rig_or_measured, Rig):
        return _on_the_rig(rig_or_measured, step, repeats, target)
    return _from_measured(rig_or_measured, step)


@dataclass(frozen=True)
class _Step:
    """One correction of the drive."""

    wanted: Command
    band: tuple[float, float]
    relaxation: float
    least_coherence: float

    def error(self, force: Array) -> float:
        """Rms of the force error over that of the command, of the actuator where it is largest."""
        missed = np.mean((force - self.wanted.values) ** 2, axis=-1)
        asked = np.mean(self.wanted.values**2, axis=-1)
        return float(np.sqrt(np.max(missed[asked > 0.0] / asked[asked > 0.0])))

    def estimate(self, drive: Array, force: Array) -> tuple[Array, NDArray[np.complex128], Array]:
        """Frequency, force over drive, coherence."""
        count = self._length
        u, y = np.fft.rfft(drive, count), np.fft.rfft(force, count)
        frequency = np.arange(count // 2 + 1, dtype=np.float64) * (self.wanted.sample_rate / count)
        half = max(round(float(_SMOOTHING / frequency[1])), 2)
        kernel = np.hanning(2 * half + 3)
        uu, yy, uy = (
            np.apply_along_axis(np.convolve, -1, part, kernel, "same")
            for part in (abs(u) ** 2, abs(y) ** 2, u.conj() * y)
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            response = np.nan_to_num(uy / uu)
            coherence = np.nan_to_num(abs(uy) ** 2 / (uu * yy))
        found: NDArray[np.complex128] = response
        bounded: Array = np.minimum(coherence, 1.0)
        return frequency, found, bounded

    def corrected(self, frequency: Array, coherence: Array) -> NDArray[np.bool_]:
        """The corrected frequencies."""
        inside = (frequency >= self.band[0]) & (frequency <= self.band[1])
        good: NDArray[np.bool_] = inside & (coherence >= self.least_coherence)
        return good

    def next(
        self, drive: Array, force: Array
    ) -> tuple[Command, Array, NDArray[np.complex128], Array, NDArray[np.bool_]]:
        """The next drive, and the data of its correction."""
        frequency, response, coherence = self.estimate(drive, force)
        chosen = self.corrected(frequency, coherence) & (abs(response) > 0.0)
        left = np.fft.rfft(self.wanted.values - force, self._length)
        change = np.zeros_like(left)
        change[chosen] = left[chosen] / response[chosen]
        correction = np.fft.irfft(change, self._length)[..., : drive.shape[-1]]
        following = Command(drive + self.relaxation * correction, self.wanted.sample_rate)
        return following, frequency, response, coherence, chosen

    @property
    def _length(self) -> int:
        """Samples padded with zeros, so that the end does not affect the beginning."""
        return 1 << math.ceil(math.log2(1.25 * len(self.wanted)))


def _on_the_rig(rig: Rig, step: _Step, repeats: int, target: float) -> DriveIteration:
    drives, runs, errors = [step.wanted], [_run(rig, step.wanted)], []
    errors.append(step.error(runs[0].force))
    stopped = f"{repeats} repeats are done"
    for _ in range(repeats):
        following, *found = step.next(drives[-1].values, runs[-1].force)
        if errors[-1] <= target:
            stopped = f"the error is below the target of {target:.2%}"
            break
        if not found[-1].any():
            stopped = f"no frequency of the band has a coherence of {step.least_coherence:g}"
            break
        drives.append(following)
        runs.append(_run(rig, following))
        errors.append(step.error(runs[-1].force))
        if errors[-1] >= errors[-2]:
            stopped = "the error no longer falls"
            break
    best = int(np.argmin(errors))
    frequency, response, coherence = step.estimate(drives[-1].values, runs[-1].force)
    chosen = step.corrected(frequency, coherence)
    return DriveIteration(
        drives[best], tuple(errors), frequency, response, coherence, chosen, stopped, tuple(runs)
    )


def _run(rig: Rig, drive: Command) -> TestRun:
    run = simulate(rig, drive)
    if not run.success or len(run) < len(drive):
        raise ValueError("rig: the simulated state diverged, there is nothing to iterate from")
    if rig.plant["structure.kind"] == "bouc_wen":
        limit = rig.plant["structure.bouc_wen.yield_displacement"]
        moved = float(np.abs(run.displacement).max())
        if moved > limit:
            raise ValueError(
                f"structure.bouc_wen.yield_displacement = {limit:g}: the specimen yields at {moved:.3g} m, "
                "and must not be iterated, for each repeat would test another one"
            )
    return run


def _from_measured(measured: TestRun | Traces, step: _Step) -> DriveIteration:
    wanted = step.wanted
    if isinstance(measured, TestRun):
        drive, force, rate = measured.command, measured.force, measured.sample_rate
        # For a structure of the rig it is known whether it can yield.
        yields = measured._outside or measured.rig.plant["structure.kind"] == "bouc_wen"
        moved: Array | None = measured.displacement if yields else None
    else:
        drive, force, rate = measured["command"], measured["force"], measured.sample_rate
        moved = measured["displacement"] if "displacement" in measured.columns else None
    if drive.shape != wanted.values.shape or abs(rate / wanted.sample_rate - 1.0) > 1e-6:
        raise ValueError(
            f"command = {len(wanted)} samples at {wanted.sample_rate:g} Hz: must fit the measured test of "
            f"{drive.shape[-1]} samples at {rate:g} Hz"
        )
    if not (np.isfinite(drive).all() and np.isfinite(force).all()):
        raise ValueError("measured = NaN in it: must have no gaps")
    for sent, measured_force in zip(np.atleast_2d(drive), np.atleast_2d(force), strict=True):
        check_force(sent, measured_force, _LARGEST_FORCE)
    if moved is not None and (left := max(map(_left_over, np.atleast_2d(moved)))) > _RESIDUAL:
        raise ValueError(
            f"displacement = {left:.0%} of its peak at the end: the specimen has yielded, and must not be "
            "iterated, for each repeat would test another one"
        )
    following, frequency, response, coherence, chosen = step.next(drive, force)
    stopped = "one step of measured data" if chosen.any() else "no frequency has the coherence"
    return DriveIteration(following, (step.error(force),), frequency, response, coherence, chosen, stopped)


def _left_over(displacement: Array) -> float:
    """Mean of the last twentieth minus that before the test, over the peak."""
    part = max(len(displacement) // 20, 1)
    start = float(displacement[: max(part // 20, 1)].mean())
    peak = float(np.abs(displacement - start).max())
    return abs(float(displacement[-part:].mean()) - start) / peak if peak > 0.0 else 0.0


def _band(command: Command, given: tuple[float, float] | None) -> tuple[float, float]:
    if given is not None:
        low, high = (real_number("band", edge) for edge in given)
        if not 0.0 <= low < high <= command.sample_rate / 2.0:
            raise ValueError(f"band = {given}: must rise within 0 and {command.sample_rate / 2.0:g} Hz")
        return low, high
    power = (np.abs(np.atleast_2d(np.fft.rfft(command.values))) ** 2).sum(axis=0)
    frequency = np.fft.rfftfreq(len(command), 1.0 / command.sample_rate)
    return 0.0, float(frequency[energy_edge(power, _ENERGY)])
