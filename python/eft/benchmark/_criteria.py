"""Criteria of the benchmark in addition to the metrics of a run."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def slow_error(command: Array, force: Array, sample_rate: float, highest: float = 20.0) -> float:
    """Rms force error over rms command, both below a frequency (Hz); by Parseval's theorem."""
    last = 1 + int(highest * command.size / sample_rate)
    wanted = np.fft.rfft(command)[:last]
    missed = np.fft.rfft(force - command)[:last]
    return float(np.linalg.norm(missed) / np.linalg.norm(wanted))
