"""Keys of actuator and hydraulic supply from their data sheets."""

from __future__ import annotations

from typing import Any

from eft.data_sheets._values import Value, above_zero, at_least_zero, one_of

__all__ = ["actuator", "supply"]

ADIABATIC = 1.4
"""Polytropic exponent of nitrogen for compression within seconds."""

ATMOSPHERE = 101_325.0
"""Atmospheric pressure, Pa; the pressures of data sheets are relative to it."""


def actuator(
    force: Value | None = None,
    stroke: Value | None = None,
    area: Value | None = None,
    *,
    supply_pressure: Value = "3000 psi",
    oil_volume: Value | None = None,
    dead_volume: Value = 0.0,
    bulk_modulus: Value = "0.7 GPa",
    leakage: Value = 0.0,
    friction: Value = 0.0,
) -> dict[str, Any]:
    """Keys of a double-ended actuator from its data sheet.

    The area is ``force/supply_pressure`` unless it is given. The oil column's compressibility is
    ``V/(4β)``, with the oil of both chambers and their pipes ``V = area·stroke + dead_volume``.

    Parameters
    ----------
    force : float or str, optional
        Largest force at `supply_pressure`, N or such as ``"250 kN"``.
    stroke : float or str
        From end to end, m; the key has half of it.
    area : float or str, optional
        Effective piston area, m², instead of `force`.
    supply_pressure : float or str
        At which the force is given, Pa.
    oil_volume : float or str, optional
        Oil between valve and piston, both sides together, m³, instead of area times stroke.
    dead_volume : float or str
        Oil in manifold and pipes, in addition to area times stroke, m³.
    bulk_modulus : float or str
        Of the oil with its air and the hoses, Pa: 0.7 GPa with some air, 1.4 GPa without.
    leakage : float or str
        Over the piston, m³/(s·Pa) or such as ``"0.5 L/min/MPa"``. Leakage damps the oil column, so zero is
        the conservative choice.
    friction : float or str
        Of the seals, N.

    Returns
    -------
    dict
        Keys for `Rig.replace`.

    Raises
    ------
    ValueError
        If a value is not allowed; the message names it.

    Examples
    --------
    >>> import eft
    >>> keys = eft.actuator("250 kN", "250 mm")
    >>> f"{1e4 * keys['actuator.piston_area']:.1f} cm²"
    '120.9 cm²'
    """
    if one_of(force=force, area=area) == "area":
        piston = above_zero("area", area, "m²")
    else:
        pressure = above_zero("supply_pressure", supply_pressure, "Pa")
        piston = above_zero("force", force, "N") / pressure
    if stroke is None:
        raise ValueError("stroke = None: must be given, the length from end to end in m")
    length = above_zero("stroke", stroke, "m")
    if oil_volume is None:
        volume = piston * length + at_least_zero("dead_volume", dead_volume, "m³")
    else:
        volume = above_zero("oil_volume", oil_volume, "m³")
    return {
        "actuator.piston_area": piston,
        "actuator.stroke": length / 2.0,
        "actuator.compressibility": volume / (4.0 * above_zero("bulk_modulus", bulk_modulus, "Pa")),
        "actuator.leakage": at_least_zero("leakage", leakage, "m³/(s·Pa)"),
        "actuator.friction": at_least_zero("friction", friction, "N"),
    }


def supply(
    pressure: Value,
    pump_flow: Value | None = None,
    accumulator_volume: Value | None = None,
    precharge: Value | None = None,
    *,
    droop: Value = 0.03,
) -> dict[str, Any]:
    """Keys of pump and accumulator from their data sheets.

    The accumulator is filled slowly, so its gas volume is ``V_0·p_0/p`` in absolute pressures. During a test
    the gas exchanges no heat, so its capacity is ``V_0·p_0/(1.4·p²)``. Without a given flow of the pump the
    pressure is constant.

    Parameters
    ----------
    pressure : float or str
        At the valve, Pa or such as ``"3000 psi"``, above the atmosphere.
    pump_flow : float or str, optional
        Largest flow of the pump, m³/s or such as ``"20 gpm"``.
    accumulator_volume : float or str, optional
        Gas volume at precharge, m³ or such as ``"5 gal"``; needed with `pump_flow`.
    precharge : float or str, optional
        Pressure of the gas without oil, Pa above the atmosphere; half of `pressure` by default.
    droop : float
        Decrease of the pressure at the pump's largest flow, as a share of the pressure.

    Returns
    -------
    dict
        Keys for `Rig.replace`.

    Raises
    ------
    ValueError
        If a value is not allowed; the message names it.

    Examples
    --------
    >>> import eft
    >>> keys = eft.data_sheets.supply("207 bar", "20 gpm", "5 gal", "100 bar")
    >>> sorted(keys)
    ['supply.accumulator', 'supply.droop', 'supply.pressure', 'supply.pump_flow']
    """
    working = above_zero("pressure", pressure, "Pa")
    if pump_flow is None:
        for name, value in (("accumulator_volume", accumulator_volume), ("precharge", precharge)):
            if value is not None:
                raise ValueError(f"{name} = {value!r}: must come with pump_flow")
        return {"supply.pressure": working}
    flow = above_zero("pump_flow", pump_flow, "m³/s")
    if accumulator_volume is None:
        raise ValueError("accumulator_volume = None: must be given with pump_flow, in m³")
    gas = above_zero("accumulator_volume", accumulator_volume, "m³")
    charged = working / 2.0 if precharge is None else above_zero("precharge", precharge, "Pa")
    if charged >= working:
        raise ValueError(f"precharge = {precharge!r}: must be below the pressure, {working:g} Pa")
    absolute = working + ATMOSPHERE
    return {
        "supply.pressure": working,
        "supply.pump_flow": flow,
        "supply.droop": above_zero("droop", droop, "") * working / flow,
        "supply.accumulator": gas * (charged + ATMOSPHERE) / (ADIABATIC * absolute**2),
    }
