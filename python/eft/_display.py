"""The units of tables, plots and reports: one for each quantity, of the system that the user chooses."""

from __future__ import annotations

from types import TracebackType
from typing import Literal, NamedTuple

from eft._native import quantity

__all__ = ["Shown", "UnitSystem", "shown", "use_units"]

UnitSystem = Literal["si", "us"]


class Shown(NamedTuple):
    """A unit in which a quantity is shown."""

    unit: str
    factor: float
    """Factor from the SI unit."""

    def __call__(self, value: float, form: str = ".4g") -> str:
        """Return a value in SI as text with its unit."""
        return f"{value * self.factor:{form}} {self.unit}".rstrip()


_UNITS: dict[UnitSystem, dict[str, tuple[str, str]]] = {
    "si": {
        "force": ("kN", "N"), "length": ("mm", "m"), "velocity": ("m/s", "m/s"), "mass": ("kg", "kg"),
        "acceleration": ("m/s²", "m/s²"), "pressure": ("MPa", "Pa"), "flow": ("L/min", "m³/s"),
        "power": ("kW", "W"), "stiffness": ("N/m", "N/m"), "damping": ("N·s/m", "N·s/m"),
    },
    "us": {
        "force": ("kip", "N"), "length": ("in", "m"), "velocity": ("in/s", "m/s"), "mass": ("lb", "kg"),
        "acceleration": ("g", "m/s²"), "pressure": ("psi", "Pa"), "flow": ("gpm", "m³/s"),
        "power": ("hp", "W"), "stiffness": ("kip/in", "N/m"), "damping": ("kip·s/in", "N·s/m"),
    },
}  # fmt: skip
"""The unit in which each quantity is shown, and its SI unit."""

_HORSEPOWER = "550 ft·lbf/s"
_SYSTEMS = {
    system: {
        name: Shown(unit, 1.0 / quantity(name, _HORSEPOWER if unit == "hp" else f"1 {unit}", si))
        for name, (unit, si) in units.items()
    }
    for system, units in _UNITS.items()
}
_COMMON = {
    "time": Shown("s", 1.0),
    "voltage": Shown("V", 1.0),
    "ratio": Shown("%", 1e2),
}
_DIMENSIONS = {
    "N": "force", "m": "length", "m/s": "velocity", "m/s²": "acceleration", "m/s2": "acceleration",
    "Pa": "pressure", "m³/s": "flow", "m3/s": "flow", "kg": "mass", "W": "power", "s": "time", "V": "voltage",
    "1": "ratio", "N/m": "stiffness", "N·s/m": "damping",
}  # fmt: skip
"""The quantity with an SI unit."""

_current: UnitSystem = "si"


class _Restore:
    """Restores the previous units at the end of a ``with``."""

    def __init__(self, former: UnitSystem) -> None:
        self._former = former

    def __enter__(self) -> None:
        return None

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        _set(self._former)


def use_units(system: UnitSystem) -> _Restore:
    """Choose the units of tables, plots and reports.

    Values in Python, in files and in the output of ``--json`` stay in SI units.

    Parameters
    ----------
    system : {"si", "us"}
        "si": kN, mm, m/s, m/s², MPa, L/min, kg, kW, N/m, N·s/m. "us": kip, in, in/s, g, psi, gpm, lb, hp,
        kip/in, kip·s/in.

    Returns
    -------
    context manager
        As ``with eft.use_units("us"):`` the choice ends with the block.

    Raises
    ------
    ValueError
        If there is no such system.

    Examples
    --------
    >>> import eft
    >>> with eft.use_units("us"):
    ...     print(eft._display.shown("force")(8896.4))
    2 kip
    """
    if system not in _SYSTEMS:
        allowed = ", ".join(f'"{name}"' for name in _SYSTEMS)
        raise ValueError(f"system = {system!r}: must be one of {allowed}")
    former = _current
    _set(system)
    return _Restore(former)


def _set(system: UnitSystem) -> None:
    global _current
    _current = system


def current_units() -> UnitSystem:
    """The system in use."""
    return _current


def shown(quantity: str, system: UnitSystem | None = None) -> Shown:
    """The unit of a quantity such as ``force``, or of an SI unit such as ``N``."""
    name = _DIMENSIONS.get(quantity, quantity)
    if name in _COMMON:
        return _COMMON[name]
    return _SYSTEMS[system or _current].get(name, Shown(quantity, 1.0))
