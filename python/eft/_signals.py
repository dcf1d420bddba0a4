"""Signals for the figures that are derived from a run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from eft._status import ENDED, Status

if TYPE_CHECKING:
    from eft import TestRun

Array = NDArray[np.float64]


class Response(Protocol):
    """The motion of a structure: a run, or its ideal response."""

    @property
    def time(self) -> Array:
        """In s."""

    @property
    def displacement(self) -> Array:
        """In m."""

    @property
    def velocity(self) -> Array:
        """In m/s."""


def labelled(runs: TestRun | Mapping[str, TestRun], alone: str = "measured") -> Mapping[str, TestRun]:
    """Runs by label; a run of several actuators becomes one run for each."""
    answer: dict[str, TestRun] = {}
    named = runs if isinstance(runs, Mapping) else {alone: runs}
    for label, run in named.items():
        if not hasattr(run, "command"):
            found = f"runs = an object of type {type(run).__name__}"
            raise TypeError(f"{found}: must be a TestRun, or a mapping of names to TestRuns")
        if run.command.ndim == 1:
            answer[label] = run
            continue
        prefix = f"{label}, " if len(named) > 1 else ""
        for index in range(run.command.shape[0]):
            answer[f"{prefix}actuator {index + 1}"] = run.actuator(index)
    return answer


def commands(runs: Mapping[str, TestRun]) -> list[tuple[str, TestRun]]:
    """The runs with different commands; only the first has a label for the legend."""
    found: list[TestRun] = []
    for run in runs.values():
        # A run that diverged has only the first part of its command.
        if not any(_begin_alike(run.command, other.command) for other in found):
            found.append(run)
    if not found:
        raise ValueError("runs is empty: at least one run is needed for a figure")
    first = "command" if len(found) == 1 else "commands"
    return [(first if run is found[0] else "_command", run) for run in found]


def _begin_alike(one: Array, other: Array) -> bool:
    shared = min(one.size, other.size)
    return np.array_equal(one[:shared], other[:shared])


def endings(runs: Mapping[str, TestRun]) -> list[tuple[float, str]]:
    """Times (s) at which tests ended early, with the causes; for equal causes the first time."""
    found: dict[str, float] = {}
    for label, run in runs.items():
        ended = (run.status & np.uint32(ENDED)) != 0
        if not ended.any():
            continue
        at = int(ended.argmax())
        if run.status[at] & np.uint32(Status.STROKE_EXCEEDED):
            words = "left its stroke"
        else:
            words = f"tripped: {run.stopped or run.cause.name.lower().replace('_', ' ')}"
        # The actuators of a building trip by one cause; other tests have separate causes.
        if len(runs) > 1 and run._building is None:
            words = f"{label} {words}"
        found[words] = min(found.get(words, np.inf), float(run.time[at]))
    return [(time, words) for words, time in found.items()]


def inside(time: Array, window: tuple[float, float] | None) -> slice:
    """The samples of a time window in s; all samples without a window."""
    if window is None:
        return slice(None)
    low, high = window
    if not low < high:
        raise ValueError(f"window is ({low}, {high}) s: its start must lie before its end")
    part = slice(int(np.searchsorted(time, low)), int(np.searchsorted(time, high, side="right")))
    if part.stop - part.start < 2:
        raise ValueError(
            f"window ({low}, {high}) s holds fewer than two samples of a run of {time[-1]:.3g} s"
        )
    return part


def amplitude_spectrum(signal: Array, step: float, band: tuple[float, float]) -> tuple[Array, Array]:
    """Frequency in Hz and |Fourier transform| in the signal's unit times s, within a band in Hz."""
    frequency = np.fft.rfftfreq(signal.size, step)
    part = slice(
        int(np.searchsorted(frequency, band[0])), int(np.searchsorted(frequency, band[1], side="right"))
    )
    amplitude: Array = np.abs(np.fft.rfft(signal))[part] * step
    return np.asarray(frequency[part], dtype=np.float64), amplitude


def energy_edge(power: Array, share: float = 0.99) -> int:
    """Place of the frequency up to which a share of the energy lies, from the power at each frequency."""
    below = np.cumsum(power)
    return min(int(np.searchsorted(below, share * below[-1])), len(below) - 1)


def restoring_force(run: TestRun, mass: float, damping: float) -> Array:
    """Restoring force of the structure's spring, in N: `A·P_L − m·ẍ − c·ẋ`."""
    acceleration = np.gradient(run.velocity, run.time, edge_order=2)
    return np.asarray(run.force - mass * acceleration - damping * run.velocity)


def sample_step(run: Response) -> float:
    """Time between two samples of a run, s."""
    return float(run.time[-1] - run.time[0]) / (run.time.size - 1)
