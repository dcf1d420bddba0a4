"""The paper's test in JAX: a scan over the ticks, `vmap` over the rigs, one Runge-Kutta step a tick."""

import jax
import jax.numpy as jnp
from plant import FLOWS, OPENINGS, VALUES

jax.config.update("jax_enable_x64", True)
X, Y = jnp.asarray(OPENINGS), jnp.asarray(FLOWS)


def _derivative(p, s, fc, rate, vc, t):
    q, xv, P, x, v = s
    opening = jnp.clip(xv, -1, 1)
    radicand = 1 - jnp.copysign(P / p["Ps"], P * opening)
    flow = jnp.interp(opening, X, Y) * jnp.copysign(jnp.sqrt(jnp.abs(radicand)), radicand)
    dP = (flow - p["Cl"] * P - p["A"] * v) / p["Ka"]
    force_rate = p["Gd"] * p["CF"] * (rate - p["A"] * dP)
    u = p["Gp"] * (p["CF"] * (fc + rate * t - p["A"] * P) + vc) + force_rate
    inner = jnp.clip(x, -p["kink"], p["kink"])
    stopped = ((xv >= 1) & (q > 0)) | ((xv <= -1) & (q < 0))
    return (
        (p["Kvp"] * (u - p["K3"] * p["xvmax"] * xv) - q) / p["tau"],
        jnp.where(stopped, 0.0, q / (p["Av"] * p["xvmax"])),
        dP,
        v,
        (p["A"] * P - p["c"] * v - p["k2"] * x - (p["k"] - p["k2"]) * inner) / p["m"],
    )


def _plus(s, d, h):
    return tuple(a + h * b for a, b in zip(s, d, strict=True))


def _one(p, command, sample_rate):
    h = 1 / sample_rate
    lag = 2 * p["alpha"] * p["Td"] / (1 - p["alpha"])
    pole, gain = (lag - h) / (lag + h), 2 * p["Td"] / (lag + h)

    def tick(carry, drive):
        s, last, washout = carry
        now, rate = drive
        force = p["A"] * s[2]
        radicand = 1 - jnp.copysign(force / (p["A"] * p["Ps"]), force * s[1])
        required = jnp.interp(p["A"] * s[4] / jnp.sqrt(jnp.maximum(radicand, 0.05)), Y, X)
        washout = pole * washout + gain * (required - last)
        vc = (required + washout) / (p["Gp"] * p["Ks"])
        k1 = _derivative(p, s, now, rate, vc, 0.0)
        k2 = _derivative(p, _plus(s, k1, h / 2), now, rate, vc, h / 2)
        k3 = _derivative(p, _plus(s, k2, h / 2), now, rate, vc, h / 2)
        k4 = _derivative(p, _plus(s, k3, h), now, rate, vc, h)
        s = _plus(_plus(_plus(_plus(s, k1, h / 6), k2, h / 3), k3, h / 3), k4, h / 6)
        s = (s[0], jnp.clip(s[1], -1, 1), *s[2:])
        return (s, required, washout), force

    rate = jnp.append(command[1:] - command[:-1], 0.0) * sample_rate
    zero = jnp.zeros(())
    return jax.lax.scan(tick, ((zero,) * 5, zero, zero), (command, rate))[1]


_many = jax.jit(jax.vmap(_one, in_axes=(dict.fromkeys(VALUES, 0), None, None)))


def run(rigs, command, sample_rate):
    """The forces (N), one row per rig; `rigs` are mappings like `VALUES`."""
    columns = {name: jnp.array([rig[name] for rig in rigs]) for name in VALUES}
    return _many(columns, jnp.asarray(command), sample_rate).block_until_ready()
