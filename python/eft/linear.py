"""Linear models of a rig: poles, margins, stability maps, delays."""

from eft._linear_model import Modes
from eft._maps import STABILITY_MAPS, StabilityMap, stability_map
from eft._native import LinearModel, linearize, stability_margin
from eft._planning import (
    DelayBudget,
    InverseDynamics,
    ObserverGains,
    StabilityMargins,
    delay_budget,
    inverse_dynamics,
    observer_gains,
    stability_margins,
)

__all__ = [
    "STABILITY_MAPS",
    "DelayBudget",
    "InverseDynamics",
    "LinearModel",
    "Modes",
    "ObserverGains",
    "StabilityMap",
    "StabilityMargins",
    "delay_budget",
    "inverse_dynamics",
    "linearize",
    "observer_gains",
    "stability_map",
    "stability_margin",
    "stability_margins",
]
