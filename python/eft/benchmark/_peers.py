"""Controllers from publications, some with the compensation of the core."""

from __future__ import annotations

import tomllib
from collections import deque
from functools import cache

import numpy as np
from numpy.typing import NDArray

from eft._native import Compensator, Controller, Rig
from eft.benchmark._loop_shaping import StateSpace, shape_loop

_VOLTS = 10.0
"""Range of the converter on each side, V."""
_FEEDFORWARD: dict[str, object] = {"compensation.feedforward": True, "compensation.look_ahead": True}
_ADAPTIVE: dict[str, object] = {"compensation.adaptive": True, "compensation.curve_correction": True}


@cache
def _designed(rig: str, sample_rate: float) -> StateSpace:
    """The cached design for the text of a rig; the tests of a benchmark have few different rigs."""
    return shape_loop(Rig.from_dict(tomllib.loads(rig)), sample_rate).controller


class LoopShaping:
    """Loop shaping only, without velocity, designed for the plant with the piston at rest."""

    def __init__(self, rig: Rig, sample_rate: float) -> None:
        """Design the loop for the configured rig."""
        a, b, c, d = _designed(rig.to_toml(), sample_rate)
        # One matrix product per sample gives next states and output from states and error.
        self._system = np.block([[a, b[:, None]], [c[None, :], np.array([[d]])]])
        self._values = np.zeros(len(b) + 1)
        self._last = 0.0

    def step(self, command: float, velocity: float, force: float, spool: float, **further: float) -> float:
        """Return the valve command, V."""
        self._values[-1] = command - force
        values = self._system @ self._values
        wanted = float(values[-1]) + self.compensation(
            command, velocity, force, spool, further["next_command"]
        )
        self._last = min(max(wanted, -_VOLTS), _VOLTS)
        if self._last == wanted:
            # The integral part is held while the converter is at its limit.
            self._values = values
        return self._last

    def compensation(
        self, command: float, velocity: float, force: float, spool: float, next_command: float
    ) -> float:
        """Return the signal that is added to the loop, V."""
        return 0.0


class CompensatedLoopShaping(LoopShaping):
    """Candidate (b): the same loop with the core's compensation and feedforward."""

    changes = _FEEDFORWARD

    def __init__(self, rig: Rig, sample_rate: float) -> None:
        """Design the loop and configure the compensation."""
        super().__init__(rig, sample_rate)
        # The compensation only, as with an analog loop; it receives the valve command.
        analog = rig.replace({"controller.realization": "analog"} | self.changes)
        self._compensator = Compensator(analog, sample_rate=sample_rate)
        self._gain: float = rig["controller.proportional_gain"]

    def compensation(
        self, command: float, velocity: float, force: float, spool: float, next_command: float
    ) -> float:
        """Return the compensation signal of Eq. (1) after its gain, V."""
        signal = self._compensator.step(
            velocity, force, spool, command, valve_command=self._last, next_command=next_command
        )
        return self._gain * signal


class AdaptiveLoopShaping(CompensatedLoopShaping):
    """Candidate (b) with self-calibration and curve."""

    changes = _FEEDFORWARD | _ADAPTIVE


class AdaptiveTimeSeries:
    """The paper's controller inside an adaptive time series compensator, 2nd order.

    Chae, Kazemibidokhti, Ricles: *Adaptive time series compensator for delay compensation of servo-hydraulic
    actuator systems for real-time hybrid simulation*, Earthquake Engineering & Structural Dynamics 42(11),
    2013. The command becomes ``a0 F_c + a1 dF_c/dt + a2 d²F_c/dt²``. The coefficients fit the sent command to
    the measured force over the last second, by least squares.
    """

    _EVERY = 8
    """Distance of the samples in the window."""
    _CORNER = 30.0
    """Corner of the two low-passes of both signals, Hz."""
    _BOUNDS = (np.array([0.7, -5e-3, -1e-4]), np.array([1.3, 2e-2, 2e-4]))
    """Bounds of the coefficients: 1, s and s²."""
    _LEAST = 50.0
    """Least rms force of the window for an estimate, N."""

    def __init__(self, rig: Rig, sample_rate: float) -> None:
        """Configure the inner loop."""
        self._inner = Controller(rig, sample_rate=sample_rate)
        self._rate, self._count = sample_rate, 0
        self._coefficients = np.array([1.0, 0.0, 0.0])
        self._before = 0.0
        # Sent command and measured force after one low-pass and after both.
        self._sent = self._force = (0.0, 0.0)
        self._share = 1.0 - float(np.exp(-2.0 * np.pi * self._CORNER / sample_rate))
        # Filtered measured force, the two before, and the filtered sent command, at the window's rate.
        self._recent: deque[tuple[float, float]] = deque(maxlen=3)
        self._window: deque[tuple[NDArray[np.float64], float]] = deque()
        self._normal, self._right = np.zeros((3, 3)), np.zeros(3)

    def step(self, command: float, velocity: float, force: float, spool: float, **further: float) -> float:
        """Return the valve command, V."""
        following = further["next_command"]
        first = 0.5 * (following - self._before) * self._rate
        second = (following - 2.0 * command + self._before) * self._rate**2
        self._before = command
        a0, a1, a2 = self._coefficients
        sent = float(a0 * command + a1 * first + a2 * second)
        self._learn(sent, force)
        return self._inner.step(sent, velocity, force, spool, next_command=sent)

    def _learn(self, sent: float, force: float) -> None:
        self._sent = self._smooth(self._sent, sent)
        self._force = self._smooth(self._force, force)
        self._count += 1
        if self._count % self._EVERY:
            return
        self._recent.append((self._sent[1], self._force[1]))
        if len(self._recent) < 3:
            return
        rate = self._rate / self._EVERY
        (_, old), (told, now), (_, new) = self._recent
        regressor = np.array([now, 0.5 * (new - old) * rate, (new - 2.0 * now + old) * rate**2])
        self._add(regressor, told, 1.0)
        self._window.append((regressor, told))
        if len(self._window) > rate:
            self._add(*self._window.popleft(), -1.0)
        if self._normal[0, 0] < len(self._window) * self._LEAST**2:
            return
        found = np.linalg.lstsq(self._normal, self._right, rcond=1e-12)[0]
        self._coefficients = np.clip(found, *self._BOUNDS)

    def _smooth(self, before: tuple[float, float], value: float) -> tuple[float, float]:
        first = before[0] + self._share * (value - before[0])
        return first, before[1] + self._share * (first - before[1])

    def _add(self, regressor: NDArray[np.float64], told: float, sign: float) -> None:
        self._normal += sign * np.outer(regressor, regressor)
        self._right += sign * told * regressor
