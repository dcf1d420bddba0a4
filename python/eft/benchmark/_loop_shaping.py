"""Loop shaping with normalised coprime factors: candidate (b) of the force loop, designed with SciPy.

McFarlane, Glover: *A loop shaping design procedure using H∞ synthesis*, IEEE Transactions on Automatic
Control 37(6), 1992. The plant is sampled exactly, with hold, computation delay and load cell. The bilinear
transform preserves normalised coprime factors. It converts the plant to continuous time, and the controller
back.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from eft._extras import need
from eft._native import Rig

Array = NDArray[np.float64]

_INTEGRAL = 0.05
"""Pole of the weight, 1/s: the integral part decays in 20 s."""
_ZERO = 2.0 * np.pi
"""Zero of the weight, 1/s."""
_LOW_PASS = 2.0 * np.pi * 300.0
"""Low-pass of the weight, 1/s."""
_SUBOPTIMAL = 1.1
"""Ratio of γ to its least value."""
E_MAX = 0.32
"""Margin for the choice of the weight's gain."""


class StateSpace(NamedTuple):
    """A linear system ``x' = A x + B u``, ``y = C x + D u`` of one input and output, or a sampled one."""

    a: Array
    b: Array
    c: Array
    d: float

    def before(self, second: StateSpace) -> StateSpace:
        """Both in series, this one first."""
        a = np.block(
            [[self.a, np.zeros((len(self.a), len(second.a)))], [np.outer(second.b, self.c), second.a]]
        )
        b = np.concatenate([self.b, second.b * self.d])
        return StateSpace(a, b, np.concatenate([second.d * self.c, second.c]), second.d * self.d)

    def held(self, period: float) -> StateSpace:
        """Sampled with a period (s) and a held input."""
        need("scipy")
        from scipy.linalg import expm

        size = len(self.a)
        system = np.zeros((size + 1, size + 1))
        system[:size, :size], system[:size, size] = self.a, self.b
        step = expm(system * period)
        return StateSpace(step[:size, :size], step[:size, size], self.c, self.d)

    def late(self) -> StateSpace:
        """With one sample of delay."""
        return StateSpace(np.zeros((1, 1)), np.ones(1), np.ones(1), 0.0).before(self)

    def continuous(self, period: float) -> StateSpace:
        """By the bilinear transform, from samples to continuous time."""
        half = np.linalg.inv(self.a + np.eye(len(self.a)))
        a = 2.0 / period * half @ (self.a - np.eye(len(self.a)))
        b, c = 2.0 / math.sqrt(period) * half @ self.b, 2.0 / math.sqrt(period) * self.c @ half
        return StateSpace(a, b, c, self.d - float(self.c @ half @ self.b))

    def sampled(self, period: float) -> StateSpace:
        """By the bilinear transform, from continuous time to samples."""
        half = np.linalg.inv(np.eye(len(self.a)) - 0.5 * period * self.a)
        a = half @ (np.eye(len(self.a)) + 0.5 * period * self.a)
        b, c = math.sqrt(period) * half @ self.b, math.sqrt(period) * self.c @ half
        return StateSpace(a, b, c, self.d + 0.5 * period * float(self.c @ half @ self.b))

    def dual(self) -> StateSpace:
        """The transposed system."""
        return StateSpace(self.a.T, self.c, self.b, self.d)


class Riccati(NamedTuple):
    """The two Riccati solutions of normalised coprime factors, and the largest margin."""

    x: Array
    """Solution of the control equation."""
    z: Array
    """Solution of the filter equation."""
    e_max: float
    """(1 + λ_max(X Z))^(−1/2)."""


class Margins(NamedTuple):
    """Margins of a shaped loop, with the piston at rest."""

    gain: float
    """Largest stable factor on the loop's gain."""
    e_max: float
    """Normalised coprime margin of shaped plant and controller."""


@dataclass(frozen=True, eq=False)
class ShapedLoop:
    """A force loop by loop shaping; made by `shape_loop`."""

    shaped: StateSpace
    """Plant and weight, in continuous time by the bilinear transform."""
    riccati: Riccati
    """Riccati solutions of the shaped plant."""
    margins: Margins
    """Margins with the controller."""
    plant: StateSpace
    """From valve command (V) to measured force (N), sampled."""
    controller: StateSpace
    """From force error (N) to valve command (V), sampled, including the weight."""
    sample_rate: float
    """Hz."""


def plant(rig: Rig) -> StateSpace:
    """Configured valve, oil and load cell, with the piston at rest."""
    area, stroke = rig["actuator.piston_area"], rig["servovalve.spool_stroke"]
    lag, pilot = rig["servovalve.pilot_time_constant"], rig["servovalve.pilot_flow_gain"]
    oil, leakage = rig["actuator.compressibility"], rig["actuator.leakage"]
    a, b, c = np.zeros((3, 3)), np.zeros(3), np.zeros(3)
    # Pilot flow, spool opening, load pressure.
    a[0, :2] = -1.0 / lag, -pilot * rig["servovalve.spool_sensitivity"] * stroke / lag
    b[0] = pilot / lag
    a[1, 0] = 1.0 / (rig["servovalve.spool_area"] * stroke)
    a[2, 1:] = rig["compensation.flow_gain"] / oil, -leakage / oil
    c[2] = area
    system = StateSpace(a, b, c, 0.0)
    if (bandwidth := rig.to_dict()["sensors"]["force"].get("bandwidth")) is not None:
        corner = 2.0 * np.pi * bandwidth
        system = system.before(StateSpace(np.array([[-corner]]), np.array([corner]), np.ones(1), 0.0))
    return system


def weight(gain: float) -> StateSpace:
    """Gain (V/N) times (s + 2π)/(s + 0.05), with a low-pass of 300 Hz."""
    integral = StateSpace(np.array([[-_INTEGRAL]]), np.ones(1), np.array([gain * (_ZERO - _INTEGRAL)]), gain)
    low_pass = StateSpace(np.array([[-_LOW_PASS]]), np.array([_LOW_PASS]), np.ones(1), 0.0)
    return integral.before(low_pass)


def solve_riccati(shaped: StateSpace) -> Riccati:
    """Solve both Riccati equations of a system in continuous time, possibly with feedthrough."""
    need("scipy")
    from scipy.linalg import solve_continuous_are

    a, b, c, d = shaped.a, shaped.b[:, None], shaped.c[None, :], shaped.d
    scale = 1.0 + d * d
    a = a - b @ c * (d / scale)
    x = solve_continuous_are(a, b, c.T @ c / scale, np.array([[scale]]))
    z = solve_continuous_are(a.T, c.T, b @ b.T / scale, np.array([[scale]]))
    largest = float(np.linalg.eigvals(x @ z).real.max())
    return Riccati(x, z, float((1.0 + largest) ** -0.5))


def central_controller(shaped: StateSpace, riccati: Riccati) -> StateSpace:
    """The controller for γ = 1.1/e_max, with negative feedback."""
    a, b, c, d = shaped.a, shaped.b[:, None], shaped.c[None, :], shaped.d
    gamma2 = (_SUBOPTIMAL / riccati.e_max) ** 2
    f = -(d * c + b.T @ riccati.x) / (1.0 + d * d)
    left = (1.0 - gamma2) * np.eye(len(a)) + riccati.x @ riccati.z
    gain = gamma2 * np.asarray(np.linalg.solve(left.T, riccati.z @ c.T), dtype=np.float64)
    return StateSpace(a + b @ f + gain @ (c + d * f), gain[:, 0], -(b.T @ riccati.x)[0], d)


def shape_loop(rig: Rig, sample_rate: float, *, e_max: float = E_MAX, delay: int = 1) -> ShapedLoop:
    """Design a force loop for the configured rig, with the largest gain of the weight that keeps ``e_max``.

    ``delay`` is the computation delay in samples, without that of the converter.
    """
    period = 1.0 / sample_rate
    sampled = plant(rig).held(period)
    for _ in range(delay + rig["dac.delay"]):
        sampled = sampled.late()

    def shaped(gain: float) -> tuple[StateSpace, StateSpace, Riccati]:
        shaping = weight(gain).sampled(period)
        system = shaping.before(sampled).continuous(period)
        return shaping, system, solve_riccati(system)

    # Gain of the paper's loop; the margin decreases with the gain.
    low = high = rig["controller.force_sensitivity"] * rig["controller.proportional_gain"]
    while shaped(high)[2].e_max > e_max:
        high *= 2.0
    while shaped(low)[2].e_max < e_max:
        low /= 2.0
    while high / low > 1.0 + 1e-6:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if shaped(middle)[2].e_max >= e_max else (low, middle)
    shaping, system, riccati = shaped(low)
    central = central_controller(system, riccati)
    controller = central.sampled(period).before(shaping)
    margins = Margins(_gain_margin(controller.before(sampled)), _coprime_margin(system, central))
    return ShapedLoop(system, riccati, margins, sampled, controller, sample_rate)


def _gain_margin(opened: StateSpace) -> float:
    """The factor on the loop's gain that makes it unstable, by its poles."""

    def stable(factor: float) -> bool:
        closed = opened.a - factor * np.outer(opened.b, opened.c) / (1.0 + factor * opened.d)
        return bool(np.abs(np.linalg.eigvals(closed)).max() < 1.0)

    low, high = 1.0, 2.0
    while stable(high) and high < 1e6:
        low, high = high, 2.0 * high
    while high / low > 1.0 + 1e-9:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low


def _coprime_margin(shaped: StateSpace, central: StateSpace) -> float:
    """The least of |1 + G K| / sqrt((1 + |G|²)(1 + |K|²)) over the frequencies."""
    s = 1j * np.geomspace(1e-2, 1e6, 4000)

    def at(system: StateSpace) -> NDArray[np.complex128]:
        eye = np.eye(len(system.a))
        return np.array([system.c @ np.linalg.solve(one * eye - system.a, system.b) + system.d for one in s])

    g, k = at(shaped), at(central)
    return float((np.abs(1.0 + g * k) / np.sqrt((1.0 + np.abs(g) ** 2) * (1.0 + np.abs(k) ** 2))).min())
