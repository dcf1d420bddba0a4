"""The units of tables, plots and reports: one for each quantity, of the system that the user chooses."""

from __future__ import annotations

from types import TracebackType
from typing import Literal, NamedTuple

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


_INCH, _POUND, _GALLON = 0.0254, 4.4482216152605, 231 * 0.0254**3

_SYSTEMS: dict[UnitSystem, dict[str, Shown]] = {
    "si": {
        "force": Shown("kN", 1e-3),
        "length": Shown("mm", 1e3),
        "velocity": Shown("m/s", 1.0),
        "acceleration": Shown("m/s²", 1.0),
        "pressure": Shown("MPa", 1e-6),
        "flow": Shown("L/min", 6e4),
        "mass": Shown("kg", 1.0),
        "power": Shown("kW", 1e-3),
    },
    "us": {
        "force": Shown("kip", 1e-3 / _POUND),
        "length": Shown("in", 1 / _INCH),
        "velocity": Shown("in/s", 1 / _INCH),
        "acceleration": Shown("g", 1 / 9.80665),
        "pressure": Shown("psi", _INCH**2 / _POUND),
        "flow": Shown("gpm", 60 / _GALLON),
        "mass": Shown("lb", 9.80665 / _POUND),
        "power": Shown("hp", 1 / (550 * 12 * _INCH * _POUND)),
    },
}
_COMMON = {
    "time": Shown("s", 1.0),
    "voltage": Shown("V", 1.0),
    "ratio": Shown("%", 1e2),
}
_DIMENSIONS = {
    "N": "force", "m": "length", "m/s": "velocity", "m/s²": "acceleration", "m/s2": "acceleration",
    "Pa": "pressure", "m³/s": "flow", "m3/s": "flow", "kg": "mass", "W": "power", "s": "time", "V": "voltage",
    "1": "ratio",
}  # fmt: skip
"""What is measured in an SI unit."""

_current: UnitSystem = "si"


class _Restore:
    """Gives the former units back at the end of a ``with``."""

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

    Values in Python, and those that files and ``--json`` hold, stay in SI units.

    Parameters
    ----------
    system : {"si", "us"}
        "si": kN, mm, m/s, m/s², MPa, L/min, kg, kW. "us": kip, in, in/s, g, psi, gpm, lb, hp.

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
