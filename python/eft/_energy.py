"""Where the energy of a test went."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class EnergyBalance:
    """Where the hydraulic work of a test went, all in J: ``supplied + swept = dissipated + stored``."""

    supplied: float
    """Work of the pump."""
    swept: float
    """Work of chambers that change their volume while under pressure, which Eq. (7) leaves out."""
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
    """Taken by the part of the structure that yields, most of it for good."""
    stored: float
    """What oil, accumulator, structure and stops hold more than at the start."""
    dissipated: float
    """The sum of all losses, from `droop` to `hysteresis`."""
    gap: float
    """What the books leave open, over the work supplied; zero but for the error of the integration."""
