"""A stand-in for a run, so that figures are tested with known signals."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

import eft


class Ratio(NamedTuple):
    frequency: np.ndarray
    ratio: np.ndarray


@dataclass
class FakeRun:
    """Unit-mass signals in closed form: a sine command and a force that lags and is too small."""

    frequency: float = 2.0
    duration: float = 10.0
    sample_rate: float = 500.0
    amplitude: float = 5000.0
    share: float = 0.5

    def __post_init__(self):
        self.rig = eft.Rig.zhao2005().replace({"structure.kind": "linear"})
        self.time = np.arange(round(self.duration * self.sample_rate)) / self.sample_rate
        angle = 2 * np.pi * self.frequency * self.time
        omega = 2 * np.pi * self.frequency
        self.command = self.amplitude * np.sin(angle)
        self.force = self.share * self.command
        self.displacement = 0.05 * np.sin(angle)
        self.velocity = 0.05 * omega * np.cos(angle)
        self.spool = 0.8 * np.sin(angle)
        self.status = np.zeros(self.time.size, dtype=np.uint32)

    def fft_ratio(self, f_low, f_high):
        frequency = np.fft.rfftfreq(self.time.size, 1 / self.sample_rate)
        inside = (frequency >= f_low) & (frequency <= f_high)
        return Ratio(frequency[inside], np.full(inside.sum(), self.share))
