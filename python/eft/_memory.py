"""The memory of tests, before they allocate it."""

from __future__ import annotations

import math
import os
import warnings
from dataclasses import dataclass

from eft._floors import actuators_of
from eft._native import Rig, recorded_traces

_GIB = 1024**3
_BYTES = 200
"""Memory per sample and actuator of a test, for its traces and the computation of its metrics."""
_SIDE_BY_SIDE = 2
"""Memory of a thread that runs eight tests of a study side by side, over that of one test."""
_SHORTER = "shorten it or sample less often"
_UNASKED = 2.0
"""Memory that tests take without a warning, GiB; the default of ``--memory``."""


class MemoryUseWarning(UserWarning):
    """A test or a study that takes more than 2 GiB of memory, about as much as a laptop has free.

    The command line asks for ``--memory`` instead.
    """


def memory_of_samples(rig: Rig, samples: int) -> float:
    """Memory that so many samples of a rig take, GiB."""
    return actuators_of(rig) * samples * _BYTES / _GIB


@dataclass(frozen=True)
class StudyMemory:
    """The tests of a study that are in this machine's memory at once."""

    running: int
    """Tests at a time; tests side by side count as the number whose memory they take."""
    kept: int
    """Finished tests whose traces are kept, in memory or until their chunk is in the folder."""
    samples: int
    """Samples of the longest command."""

    @classmethod
    def of(
        cls,
        tests: int,
        samples: int,
        chunk: int,
        *,
        traces: bool,
        folder: bool,
        workers: int | None,
        wide: bool = True,
    ) -> StudyMemory:
        """Those of a study, by its options.

        `workers` are those of an executor on this machine. Without one a chunk runs on all cores. `wide`
        says whether tests run side by side, which those with an external structure do not.
        """
        threads = workers if workers is not None else (os.cpu_count() or 1) if wide else 1
        running = threads * (_SIDE_BY_SIDE if wide else 1)
        kept = 0 if not traces else (workers or 1) * chunk if folder else tests
        return cls(min(running, tests), min(kept, tests), samples)

    def needed(self, rig: Rig) -> float:
        """Memory for a rig, GiB."""
        # A status of four bytes besides the traces.
        kept = self.kept * actuators_of(rig) * self.samples * (8 * recorded_traces(rig) + 4) / _GIB
        return memory_of_samples(rig, self.running * self.samples) + kept

    def __str__(self) -> str:
        kept = f" and the traces of {self.kept}" if self.kept else ""
        tests = "1 test" if self.running == 1 else f"{self.running} tests"
        return f"{self.samples} samples in {tests} at a time{kept} need"


def _memory_of_this_machine() -> float:
    """Memory of this machine, GiB; unlimited if the system does not tell."""
    try:
        there = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / _GIB
    except (AttributeError, OSError, ValueError):
        return math.inf
    return there if there > 0 else math.inf


def check_memory(what: str, needed: float, allowed: float = math.inf, less: str = _SHORTER) -> None:
    """Refuse what needs more memory (GiB) than this machine has, or than ``--memory`` allows."""
    there = _memory_of_this_machine()
    said = f"{what} {needed:.1f} GiB of memory, must be at most the "
    if needed > there:
        raise ValueError(f"{said}{there:.1f} GiB of this machine; {less}")
    if needed > allowed:
        raise ValueError(f"{said}{allowed:g} GiB of --memory; --memory {math.ceil(needed)} lets it run")


def warn_of_memory(what: str, needed: float, less: str) -> None:
    """Refuse what needs more memory (GiB) than this machine has, and warn of more than 2 GiB."""
    check_memory(what, needed, less=less)
    if needed > _UNASKED:
        # The caller of `simulate` or `study`.
        warnings.warn(f"{what} about {needed:.1f} GiB of memory; {less}", MemoryUseWarning, stacklevel=3)
