"""The energy balance of a test."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class EnergyBalance:
    """The energy balance of a test, all in J: ``supplied + swept = dissipated + stored``."""

    supplied: float
    """Work of the pump."""
    swept: float
    """Work of chambers that change their volume under pressure, which Eq. (7) does not contain."""
    droop: float
    """Lost by the droop of the supply."""
    valve: float
    """Throttled in the main stage."""
    leakage: float
    """Lost by leakage, in the valve and across the piston."""
    friction: float
    """Lost in the seals."""
    stops: float
    """Lost in the end stops."""
    damping: float
    """Lost in the structure's dampers."""
    hysteresis: float
    """Energy in the yielding part of the structure, most of it dissipated."""
    stored: float
    """Increase of the energy in oil, accumulator, structure and stops."""
    dissipated: float
    """The sum of all losses, from `droop` to `hysteresis`."""
    gap: float
    """Imbalance over the supplied work, by the error of the integration."""
