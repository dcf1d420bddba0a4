"""The simulated plant compared with SciPy's DOP853, which is restarted at every kink of the plant.

Plant and controller are written here from the paper's equations. Only the command comes from the library.
"""

import math
from bisect import bisect_right

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eft

AREA, SPOOL_AREA, DAMPING, LEAKAGE = 8.212e-3, 1.964e-4, 4330.0, 1.3e-11
FORCE_SENSITIVITY, G_P, G_D, STIFFNESS, K_3 = 5.6e-5, 0.8059, 2.0e-4, 693.8e3, 3579.13
K_A, K_S, K_VP, MASS, SUPPLY = 7.56e-13, 0.1, 1.06e-5, 7040.0, 1.9e7
T_D, STROKE, ALPHA, TAU = 5.0e-3, 2.79e-3, 0.1, 1.4e-3
SOFT_AT, SOFT_STIFFNESS = 0.025, 350.0e3

POSITIVE = [102.2, 187.2, 260.4, 321.1, 369.8, 411.2, 441.0, 468.3, 495.7, 523.0]
NEGATIVE = [-101.0, -188.2, -260.9, -324.2, -377.1, -419.9, -452.3, -480.2, -508.2, -536.2]
OPENINGS = np.linspace(-1.0, 1.0, 21).tolist()
FLOWS = [flow * 1.6387064e-5 for flow in (*NEGATIVE[::-1], 0.0, *POSITIVE)]

# The state (q, x_v, P_L, x, v) in units in which each is of order one, so that one tolerance serves all.
UNITS = np.array([1e-5, 1.0, 1e6, 1e-2, 1e-1])


HAIR = 1e-10


def compensation(velocity, force, spool, memory, dt):
    """Nonlinear compensation by the paper's Fig. 5; returns the signal and the state of the lead network."""
    root = np.sqrt(max(1.0 - np.sign(spool) * force / (AREA * SUPPLY), 0.05))
    required = np.clip(np.interp(AREA * velocity / root, FLOWS, OPENINGS), -1.0, 1.0)
    t_ld = T_D / (1.0 - ALPHA)
    last_in, last_out = memory
    a, b = 2.0 * t_ld / dt, 2.0 * ALPHA * t_ld / dt
    out = ((a + 1.0) * required + (1.0 - a) * last_in - (1.0 - b) * last_out) / (b + 1.0)
    return out / (G_P * K_S), (required, out)


def rates(t, y, segment, outside, stopped, f_0, f_rate, v_c):
    # Python's own numbers are several times as fast as NumPy's.
    q, x_v, p, x, v = (y * UNITS).tolist()
    slope = (FLOWS[segment + 1] - FLOWS[segment]) / (OPENINGS[segment + 1] - OPENINGS[segment])
    curve = FLOWS[segment] + slope * (x_v - OPENINGS[segment])
    direction = 1.0 if segment >= 10 else -1.0
    radicand = 1.0 - direction * p / SUPPLY
    flow = curve * math.copysign(math.sqrt(abs(radicand)), radicand)
    p_rate = (flow - LEAKAGE * p - AREA * v) / K_A
    error = FORCE_SENSITIVITY * (f_0 + f_rate * t - AREA * p)
    error_rate = FORCE_SENSITIVITY * (f_rate - AREA * p_rate)
    valve = G_P * (error + v_c) + G_D * error_rate
    if outside == 0:
        spring = STIFFNESS * x
    else:
        spring = outside * STIFFNESS * SOFT_AT + SOFT_STIFFNESS * (x - outside * SOFT_AT)
    spool_rate = 0.0 if stopped else q / (SPOOL_AREA * STROKE)
    return (
        np.array(
            [
                (K_VP * (valve - K_3 * STROKE * x_v) - q) / TAU,
                spool_rate,
                p_rate,
                v,
                (AREA * p - DAMPING * v - spring) / MASS,
            ]
        )
        / UNITS
    )


def terminal(function):
    function.terminal = True
    return function


def tick(y, dt, f_0, f_rate, v_c):
    """One sample period, divided at the plant's kinks."""
    t = 0.0
    for _ in range(50):
        stopped = abs(y[1]) >= 1.0 and y[0] * y[1] > 0.0
        segment = min(max(bisect_right(OPENINGS, y[1]) - 1, 0), 19)
        x = y[3] * UNITS[3]
        outside = int(np.sign(x)) if abs(x) > SOFT_AT else 0
        # Each piece ends slightly beyond its kink, so that the next one has a length.
        low, high = OPENINGS[segment] - HAIR, OPENINGS[segment + 1] + HAIR
        soft = SOFT_AT - HAIR if outside else SOFT_AT + HAIR
        if stopped:
            released = -HAIR * np.sign(y[1])
            events = [terminal(lambda t, y, *_, at=released: y[0] - at)]
        else:
            events = [
                terminal(lambda t, y, *_, at=low: y[1] - at),
                terminal(lambda t, y, *_, at=high: y[1] - at),
            ]
        events.append(terminal(lambda t, y, *_, at=soft: abs(y[3]) * UNITS[3] - at))
        piece = solve_ivp(
            rates,
            (t, dt),
            y,
            method="DOP853",
            rtol=1e-9,
            atol=1e-10,
            first_step=dt - t,
            events=events,
            args=(segment, outside, stopped, f_0, f_rate, v_c),
        )
        y = piece.y[:, -1].copy()
        y[1] = np.clip(y[1], -1.0, 1.0)
        t = piece.t[-1]
        if piece.status == 0:
            return y
    raise AssertionError("a sample period with fifty kinks")


def by_dop853(command):
    dt = 1.0 / command.sample_rate
    values = np.asarray(command.values)
    y, memory, force, spool = np.zeros(5), (0.0, 0.0), [], []
    for now, following in zip(values, np.append(values[1:], values[-1]), strict=True):
        force.append(AREA * y[2] * UNITS[2])
        spool.append(y[1])
        v_c, memory = compensation(y[4] * UNITS[4], force[-1], y[1], memory, dt)
        y = tick(y, dt, now, (following - now) / dt, v_c)
    return np.array(force), np.array(spool)


@pytest.mark.parametrize(
    ("amplitude", "f_end", "duration", "stops"),
    [
        pytest.param(8900.0, 3.0, 2.0, False, id="sweep through the natural frequency"),
        pytest.param(80000.0, 3.0, 1.2, True, id="spool against its stops"),
    ],
)
def test_force_and_spool(amplitude, f_end, duration, stops):
    command = eft.sine_sweep(amplitude, 0.0, f_end, duration, 1024.0)
    force, spool = by_dop853(command)
    assert (np.abs(spool).max() == 1.0) == stops
    run = eft.simulate(eft.Rig.zhao2005(), command)
    assert np.abs(run.force - force).max() < 1e-4 * np.abs(force).max()
    assert np.abs(run.spool - spool).max() < 1e-4
