"""The units of tables, plots and reports: one for each quantity, of the system that the user chooses."""

from __future__ import annotations

from types import TracebackType
from typing import Literal, NamedTuple, get_args

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


_UNITS = {
    "force": ("N", "kN", "kip"), "length": ("m", "mm", "in"), "velocity": ("m/s", "m/s", "in/s"),
    "mass": ("kg", "kg", "lb"), "acceleration": ("m/s²", "m/s²", "g"), "pressure": ("Pa", "MPa", "psi"),
    "flow": ("m³/s", "L/min", "gpm"), "power": ("W", "kW", "hp"), "stiffness": ("N/m", "N/m", "kip/in"),
    "damping": ("N·s/m", "N·s/m", "kip·s/in"), "time": ("s", "s", "s"), "voltage": ("V", "V", "V"),
    "ratio": ("1", "%", "%"),
}  # fmt: skip
"""The SI unit of each quantity, and its unit in each system."""

_SYSTEMS: dict[UnitSystem, dict[str, Shown]] = {
    system: {
        name: Shown(units[at], 1.0 / quantity(name, f"1 {units[at]}", units[0]))
        for name, units in _UNITS.items()
    }
    for at, system in enumerate(get_args(UnitSystem), 1)
}
_NAMES = {
    spelling: name for name, (si, *_) in _UNITS.items()
    for spelling in (si, si.replace("²", "2").replace("³", "3"))
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
    return _SYSTEMS[system or _current].get(_NAMES.get(quantity, quantity), Shown(quantity, 1.0))
