"""The paper's test with SciPy's `solve_ivp`, called once per tick because of the sampled controller."""

import math

import numpy as np
from plant import FLOWS, OPENINGS, VALUES
from scipy.integrate import solve_ivp


def run(command, sample_rate, method="RK45", rtol=1e-4):
    """The force (N) at each tick."""
    p = dict(VALUES)
    A, Ps, Td, T = p["A"], p["Ps"], p["Td"], 1 / sample_rate
    lag = 2 * p["alpha"] * Td / (1 - p["alpha"])
    pole, gain = (lag - T) / (lag + T), 2 * Td / (lag + T)
    last = washout = 0.0
    state = np.zeros(5)
    # Absolute tolerances of the numbers of the state.
    atol = rtol * np.array([1e-5, 1e-1, 1e6, 1e-2, 1e-1])
    force = np.empty(command.size)
    for i, now in enumerate(command):
        force[i] = A * state[2]
        radicand = 1 - math.copysign(force[i] / (A * Ps), force[i] * state[1])
        required = np.interp(A * state[4] / math.sqrt(max(radicand, 0.05)), FLOWS, OPENINGS)
        washout = pole * washout + gain * (required - last)
        last = required
        vc = (required + washout) / (p["Gp"] * p["Ks"])
        rate = ((command[i + 1] if i + 1 < command.size else now) - now) * sample_rate

        def derivative(t, s, now=now, rate=rate, vc=vc):
            q, xv, P, x, v = s
            xv = min(max(xv, -1.0), 1.0)
            radicand = 1 - math.copysign(P / Ps, P * xv)
            flow = np.interp(xv, OPENINGS, FLOWS) * math.copysign(math.sqrt(abs(radicand)), radicand)
            dP = (flow - p["Cl"] * P - A * v) / p["Ka"]
            u = p["Gp"] * (p["CF"] * (now + rate * t - A * P) + vc) + p["Gd"] * p["CF"] * (rate - A * dP)
            inner = min(max(x, -p["kink"]), p["kink"])
            spring = p["k2"] * x + (p["k"] - p["k2"]) * inner
            return [
                (p["Kvp"] * (u - p["K3"] * p["xvmax"] * xv) - q) / p["tau"],
                q / (p["Av"] * p["xvmax"]),
                dP,
                v,
                (A * P - p["c"] * v - spring) / p["m"],
            ]

        state = solve_ivp(derivative, (0.0, T), state, method=method, rtol=rtol, atol=atol).y[:, -1]
    return force
