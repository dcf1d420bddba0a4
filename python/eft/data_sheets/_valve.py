"""Keys of a servovalve from its data sheet."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from eft._native import quantity
from eft.data_sheets._values import Value, above_zero, one_of, opening_share

__all__ = ["servovalve"]

SPOOL_STROKE, SPOOL_AREA = 1e-3, 1e-4
"""Spool stroke (m) and area (m²) if the data sheet gives none; only the ratio of pilot flow to their product
matters."""


_FULL = 0.1
"""Largest difference of a curve's flow at full opening from the rated flow, over that flow."""

_ROUNDING = 1e-9
"""Largest difference of the full opening from 1 by rounding."""


def servovalve(
    rated_flow: Value,
    rated_drop: Value,
    phase_90_frequency: Value | None = None,
    *,
    damping_ratio: Value = 0.9,
    rise_time: Value | None = None,
    full_step_time: Value | None = None,
    rated_signal: Value = 10.0,
    supply_pressure: Value = "3000 psi",
    flow_curve: Sequence[tuple[float, float]] | None = None,
    overlap: Value = 0.0,
) -> dict[str, Any]:
    """Keys of a servovalve from its data sheet.

    The flow at full opening and no load is ``rated_flow·√(supply_pressure/rated_drop)``. Spool over command
    is of second order: its phase is -90° at the natural frequency, for any damping. The response delay is
    ``2ζ/ω_n``, the limit at low frequency. A three-stage valve is the same model with the figures of its main
    stage.

    Parameters
    ----------
    rated_flow : float or str
        Flow at full opening, m³/s or such as ``"90 gpm"``.
    rated_drop : float or str
        Pressure drop over both lands at that flow, Pa or such as ``"1000 psi"``. A sheet that gives the drop
        per land gives half of it.
    phase_90_frequency : float or str, optional
        Where the phase of a small signal is -90°, Hz.
    damping_ratio : float
        Of the spool; ``1/(2·amplitude)`` with the amplitude ratio at the frequency of -90°. 0.9 is an
        assumption for sheets that give no amplitude.
    rise_time : float or str, optional
        From 10 to 90 % of a small step, s; in the place of `phase_90_frequency`.
    full_step_time : float or str, optional
        Of a step from 0 to 100 %, s: limits the flow of the pilot stage.
    rated_signal : float or str
        Command of full opening, V.
    supply_pressure : float or str
        Pressure of the laboratory's supply, Pa.
    flow_curve : sequence of (float, float), optional
        Opening and share of the flow at full opening, from the curve on the sheet, up to (1, 1); a straight
        line of 21 points where absent.
    overlap : float or str
        Overlap of the lands, a share of the stroke.

    Returns
    -------
    dict
        Keys for `Rig.replace`, including those of the compensation and ``supply.pressure``.

    Raises
    ------
    ValueError
        If a value is not allowed or the dynamics are given twice or not at all; the message names it.

    Examples
    --------
    >>> import eft
    >>> keys = eft.servovalve("90 gpm", "1000 psi", "60 Hz")
    >>> rig = eft.Rig.zhao2005().replace(keys)
    >>> f"{rig['compensation.flow_gain'] * 60e3:.0f} L/min, {1e3 * rig['compensation.response_delay']:.2f} ms"
    '590 L/min, 4.77 ms'
    """
    flow = above_zero("rated_flow", rated_flow, "m³/s")
    drop = above_zero("rated_drop", rated_drop, "Pa")
    pressure = above_zero("supply_pressure", supply_pressure, "Pa")
    damping = above_zero("damping_ratio", damping_ratio, "")
    volts = above_zero("rated_signal", rated_signal, "V")
    given = one_of(phase_90_frequency=phase_90_frequency, rise_time=rise_time)
    if given == "rise_time":
        omega = _normalised_rise(damping) / above_zero("rise_time", rise_time, "s")
    else:
        omega = 2.0 * np.pi * above_zero("phase_90_frequency", phase_90_frequency, "Hz")
    full = flow * math.sqrt(pressure / drop)
    openings, shares = _curve(flow_curve)
    flows = [full * share for share in shares]
    zero = openings.index(0.0)
    slopes = [(flows[i + 1] - flows[i]) / (openings[i + 1] - openings[i]) for i in (zero - 1, zero)]
    keys = {
        "supply.pressure": pressure,
        "servovalve.flow_table.openings": openings,
        "servovalve.flow_table.flows": flows,
        "servovalve.overlap": opening_share("overlap", overlap),
        **second_order(omega, damping, volts),
        "compensation.flow_gain": sum(slopes) / 2.0,
    }
    if full_step_time is not None:
        step = above_zero("full_step_time", full_step_time, "s")
        keys["servovalve.pilot_flow_limit"] = SPOOL_AREA * SPOOL_STROKE / step
    return keys


def second_order(omega: float, damping: float, rated_signal: float) -> dict[str, Any]:
    """Keys of a spool that follows its command with this natural frequency (rad/s) and damping ratio."""
    sensitivity = rated_signal / SPOOL_STROKE
    return {
        "servovalve.spool_stroke": SPOOL_STROKE,
        "servovalve.spool_area": SPOOL_AREA,
        "servovalve.spool_sensitivity": sensitivity,
        "servovalve.pilot_time_constant": 1.0 / (2.0 * damping * omega),
        "servovalve.pilot_flow_gain": omega * SPOOL_AREA / (2.0 * damping * sensitivity),
        "servovalve.pilot_flow_limit": None,
        "compensation.valve_gain": 1.0 / rated_signal,
        "compensation.response_delay": 2.0 * damping / omega,
    }


def _normalised_rise(damping: float) -> float:
    """``ω_n`` times the time from 10 to 90 % of the step response of a second-order system."""
    time = np.linspace(0.0, 20.0 * max(damping, 1.0), 200_001)
    root = np.sqrt(complex(damping**2 - 1.0)) if damping != 1.0 else 1e-6
    first, second = -damping + root, -damping - root
    response = 1.0 + np.real(
        (second * np.exp(first * time) - first * np.exp(second * time)) / (first - second)
    )
    low, high = (int(np.argmax(response >= level)) for level in (0.1, 0.9))
    return float(time[high] - time[low])


def _is_no_pair(point: Any) -> bool:
    return isinstance(point, str) or not isinstance(point, Sequence | np.ndarray) or len(point) != 2


def _curve(given: Sequence[tuple[float, float]] | None) -> tuple[list[float], list[float]]:
    """Openings and shares of the full flow; a curve of one side is used for both."""
    # A learned curve has the points of the table, so the straight line has as many as a measured curve.
    points = [(n / 10, n / 10) for n in range(-10, 11)] if given is None else given
    if (
        isinstance(points, str)
        or not isinstance(points, Sequence | np.ndarray)
        or any(map(_is_no_pair, points))
    ):
        raise ValueError(
            f"flow_curve = {given!r}: must be pairs of opening and share, such as [[0, 0], [1, 1]]"
        )
    pairs = sorted({(quantity("flow_curve", x, ""), quantity("flow_curve", q, "")) for x, q in points})
    if all(x >= 0.0 for x, _ in pairs):
        pairs = sorted({*pairs, (0.0, 0.0), *((-x, -q) for x, q in pairs if x > 0.0)})
    if (0.0, 0.0) not in pairs or pairs[0][0] >= 0.0:
        raise ValueError(f"flow_curve = {given!r}: must pass through (0, 0), with points above it")
    if abs(pairs[-1][0] - 1.0) > _ROUNDING or abs(pairs[-1][1] - 1.0) > _FULL:
        raise ValueError(
            f"flow_curve = {given!r}: must end at the opening 1 with a share of 1, within {_FULL:g}: "
            "shares of the stroke and of rated_flow"
        )
    # An unequal spool has less flow on its other side.
    if pairs[0][0] < -1.0 - _ROUNDING or pairs[0][1] < -1.0 - _FULL:
        raise ValueError(
            f"flow_curve = {given!r}: must begin at the opening -1 or above, with a share from "
            f"{-1.0 - _FULL:g}: shares of the stroke and of rated_flow"
        )
    return [x for x, _ in pairs], [q for _, q in pairs]
