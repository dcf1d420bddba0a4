"""The paper's test in numba: `peer.c`, line by line."""

import math

import numba
import numpy as np
from plant import FLOWS, KNOTS, OPENINGS, VALUES

CELLS = 64
TRACES = 8


def numbers(**changes):
    """The rig as one array, in the order of `VALUES`."""
    return np.array(list((VALUES | changes).values()))


@numba.njit(cache=False)
def _build(x, y):
    per_cell = (CELLS - 0.5) / (x[-1] - x[0])
    first = np.zeros(CELLS + 1, np.int64)
    slope = np.zeros(KNOTS)
    slope[:-1] = (y[1:] - y[:-1]) / (x[1:] - x[:-1])
    for cell in range(CELLS + 1):
        for i in range(1, KNOTS):
            if int((x[i] - x[0]) * per_cell) < cell:
                first[cell] = i
    return np.append(x, np.inf), y, slope, first, per_cell


@numba.njit(inline="always")
def _at(table, x):
    starts, values, slopes, first, per_cell = table
    x = min(max(x, starts[0]), starts[KNOTS - 1])
    i = first[int((x - starts[0]) * per_cell)]
    if x >= starts[i + 1]:
        i += 1
    return values[i] + (x - starts[i]) * slopes[i]


@numba.njit(inline="always")
def _derivative(rig, curve, state, drive, t):
    A, Av, c, Cl, CF, Gp, Gd, k, K3, Ka, _, _, Kvp, m, Ps, _, xvmax, _, tau, kink, k2, _, _ = rig
    q, xv, P, x, v = state
    fc, rate, vc = drive
    opening = min(max(xv, -1.0), 1.0)
    radicand = 1 - math.copysign(P / Ps, P * opening)
    flow = _at(curve, opening) * math.copysign(math.sqrt(abs(radicand)), radicand)
    dP = (flow - Cl * P - A * v) * (1 / Ka)
    command = Gp * (CF * (fc + rate * t - A * P) + vc) + Gd * CF * (rate - A * dP)
    inner = min(max(x, -kink), kink)
    stopped = (xv >= 1 and q > 0) or (xv <= -1 and q < 0)
    return (
        (Kvp * (command - K3 * xvmax * xv) - q) * (1 / tau),
        0.0 if stopped else q * (1 / (Av * xvmax)),
        dP,
        v,
        (A * P - c * v - k2 * x - (k - k2) * inner) * (1 / m),
    )


@numba.njit(inline="always")
def _plus(s, d, h):
    return (s[0] + h * d[0], s[1] + h * d[1], s[2] + h * d[2], s[3] + h * d[3], s[4] + h * d[4])


@numba.njit(fastmath={"contract"})
def _run(values, openings, flows, command, fs, steps, traces):
    rig = (
        values[0], values[1], values[2], values[3], values[4], values[5], values[6], values[7], values[8],
        values[9], values[10], values[11], values[12], values[13], values[14], values[15], values[16],
        values[17], values[18], values[19], values[20], values[21], values[22],
    )  # fmt: skip
    A, _, _, _, CF, Gp, Gd, _, _, _, Kv_per, Ks, _, _, Ps, Td, _, alpha, _, _, _, level, mode = rig
    curve, inverse = _build(openings, flows), _build(flows, openings)
    h, lag, T = 1 / (fs * steps), 2 * alpha * Td / (1 - alpha), 1 / fs
    pole, gain = (lag - T) / (lag + T), 2 * Td / (lag + T)
    last = washout = 0.0
    s = (0.0, 0.0, 0.0, 0.0, 0.0)
    n = command.size
    for i in range(n):
        force = A * s[2]
        demand = 0.0 if mode == 0 else A * s[4]
        if mode == 1:
            required = demand * Kv_per
        else:
            radicand = 1 - math.copysign(force * (1 / (A * Ps)), force * s[1])
            required = _at(inverse, demand / math.sqrt(max(radicand, 0.05)))
        required = min(max(required * level, -1.0), 1.0)
        washout = pole * washout + gain * (required - last)
        last = required
        following = command[i + 1] if i + 1 < n else command[i]
        drive = (command[i], (following - command[i]) * fs, (required + washout) / (Gp * Ks))
        k1 = _derivative(rig, curve, s, drive, 0.0)
        traces[0, i] = force
        traces[1, i] = s[3]
        traces[2, i] = s[4]
        traces[3, i] = s[1]
        traces[4, i] = s[2]
        traces[5, i] = Gp * (CF * (drive[0] - force) + drive[2]) + Gd * CF * (drive[1] - A * k1[2])
        traces[6, i] = drive[2]
        flags = 1 if abs(s[1]) >= 1 else 0
        flags += 2 if abs(s[3]) > 0.127 else 0
        traces[7, i] = flags + (4 if abs(required) > 0.6 else 0)
        for j in range(steps):
            t = j * h
            if j > 0:
                k1 = _derivative(rig, curve, s, drive, t)
            k2 = _derivative(rig, curve, _plus(s, k1, h / 2), drive, t + h / 2)
            k3 = _derivative(rig, curve, _plus(s, k2, h / 2), drive, t + h / 2)
            k4 = _derivative(rig, curve, _plus(s, k3, h), drive, t + h)
            s = _plus(_plus(_plus(_plus(s, k1, h / 6), k2, h / 3), k3, h / 3), k4, h / 6)
            s = (s[0], min(max(s[1], -1.0), 1.0), s[2], s[3], s[4])


def run(values, command, sample_rate, steps, traces):
    """One test, its traces in the order of `peer.c`."""
    _run(values, OPENINGS, FLOWS, command, sample_rate, steps, traces)
