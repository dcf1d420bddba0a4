"""Quantities, their names in laboratories, and their units."""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass

from eft._native import quantity as si_value
from eft._table import TRACES

_SI = {
    "time": "s", "force": "N", "length": "m", "velocity": "m/s", "acceleration": "m/s2", "pressure": "Pa",
    "flow": "m3/s", "voltage": "V", "ratio": "1",
}  # fmt: skip
"""The SI unit of each quantity."""

_NAMES_OF = {
    "time": "s ms µs us min",
    "force": "N kN MN kgf tf lbf lb kip",
    "length": "m cm mm in inch ft",
    "velocity": "m/s cm/s mm/s in/s ft/s",
    "acceleration": "g m/s2 cm/s2 mm/s2 in/s2 ft/s2",
    "pressure": "Pa kPa MPa bar kgf/cm2 psi ksi",
    "flow": "m3/s L/s L/min lpm gpm in3/s",
    "voltage": "V mV",
    "ratio": "1 - %",
}
"""Names in headers of laboratories."""

_OTHER_NAMES = {
    "acceleration": "gal",
    "length": "inches",
    "time": "minute",
    "voltage": "volt",
    "ratio": "percent",
}
"""Further names, which messages leave out."""

_MEANT = {
    "lb": "lbf", "inch": "in", "inches": "in", "gal": "cm/s2", "-": "1", "minute": "min", "volt": "V",
    "percent": "%",
}  # fmt: skip
"""Names that the rig's table of units lacks, or has with another meaning, as `lb` for a mass."""

_SIGNS = str.maketrans({"²": "2", "³": "3", "¹": "1", "⁻": "-", "μ": "µ"} | dict.fromkeys("^*·. "))
_SPELLINGS = tuple(
    (re.compile(pattern, re.IGNORECASE), written)
    for pattern, written in (
        (r"sec(onds?|s)?$|sec(?=[/2\-])", "s"),
        (r"^milli(?=s)", "m"),
        (r"^micro(?=s)", "u"),
        (r"/s/s$", "/s2"),
        (r"^(m|cm|mm|in|ft)s-2$", r"\1/s2"),
        (r"^(m|cm|mm|in|ft)s-1$", r"\1/s"),
        (r"^(m3?|cm|mm|in|ft)ps(2?)$", r"\1/s\2"),
        (r"^(g)'s$", r"\1"),
    )
)
"""Other spellings of units, and the known ones."""


def _factors(dimension: str, names: str) -> dict[str, float]:
    """Factor of each name to SI, from the table of units for the keys of a rig."""
    si = _SI[dimension]
    return {name: si_value(name, f"1 {_MEANT.get(name, name)}", si) for name in names.split()}


_UNITS = {dimension: _factors(dimension, names) for dimension, names in _NAMES_OF.items()}
_KNOWN = {
    dimension: units | _factors(dimension, _OTHER_NAMES.get(dimension, ""))
    for dimension, units in _UNITS.items()
}


@dataclass(frozen=True)
class Quantity:
    """Quantities of a column."""

    dimension: str
    aliases: tuple[str, ...]


QUANTITIES = {
    "time": Quantity("time", ("t", "elapsed time", "x value")),
    "command": Quantity("force", ("force command", "command force", "reference", "reference force", "cmd")),
    "force": Quantity("force", ("load", "actuator force", "f")),
    "displacement": Quantity("length", ("disp", "stroke", "x")),
    "velocity": Quantity("velocity", ("vel", "v")),
    "acceleration": Quantity("acceleration", ("acc", "accel", "a")),
    "spool": Quantity("ratio", ("spool opening", "opening")),
    "load_pressure": Quantity("pressure", ("differential pressure", "delta p")),
    "supply_pressure": Quantity("pressure", ("supply",)),
    "flow": Quantity("flow", ("q",)),
    "valve_command": Quantity("voltage", ("valve", "servo command")),
    "compensation": Quantity("voltage", ()),
}
_DIMENSIONS = {unit.replace("1", ""): name for name, unit in _SI.items()}
# The other traces of a run, by their own names only.
QUANTITIES |= {
    name: Quantity(_DIMENSIONS[trace.unit.replace("²", "2")], ())
    for name, trace in TRACES.items()
    if name not in QUANTITIES
}

_NAMES = {alias: name for name, quantity in QUANTITIES.items() for alias in (name, *quantity.aliases)}
_LONGEST_NAME = 200
"""Largest length of a name with a quantity."""
_BY_DIMENSION = {quantity.dimension: name for name, quantity in QUANTITIES.items()}.values()
"""One quantity of each dimension."""
_CHANNEL = re.compile(
    r"^\s*(?:ch(?:annel)?\s?\d+\s)?\s*(?:axial\s)?\s*|\s+(?:feedback|fbk)\s*$", re.IGNORECASE
)
"""Words that testing machines add to the name of a quantity."""
_BRACKETS = re.compile(r"(?P<name>[^(\[]*+)[(\[](?P<unit>[^)\]]*+)[)\]]")


def si_unit(quantity: str) -> str:
    """The SI unit of a quantity."""
    return _SI[QUANTITIES[quantity].dimension]


def allowed_units(quantity: str) -> tuple[str, ...]:
    """The allowed units of a quantity."""
    return tuple(_UNITS[QUANTITIES[quantity].dimension])


def to_si(quantity: str, unit: str) -> float:
    """Factor from `unit` to SI; a ValueError names what is allowed."""
    dimension = QUANTITIES[quantity].dimension
    known = _KNOWN[dimension]
    plain = unit.strip().translate(_SIGNS)
    for spelling, written in _SPELLINGS:
        plain = spelling.sub(written, plain)
    for candidate in (plain, plain.removesuffix("s") if len(plain) > 2 else plain, plain.removesuffix("es")):
        if candidate in known:
            return known[candidate]
        folded = [name for name in known if name.lower() == candidate.lower()]
        # mN and MN differ by 10⁹, so the letter case is free only for units without such a pair.
        if len(folded) == 1 and candidate.lower() not in ("mn", "mpa", "mv"):
            return known[folded[0]]
    raise ValueError(f"unit `{unit}` of {quantity}: must be one of {', '.join(_UNITS[dimension])}")


def quantity_of(name: str) -> str | None:
    """The quantity a column name means, or None; a channel's number and axis may stand before it."""
    name = name.strip()
    if len(name) > _LONGEST_NAME:
        return None
    return _quantity_of(name) or _quantity_of(_CHANNEL.sub("", name))


def _quantity_of(name: str) -> str | None:
    return _NAMES.get(re.sub(r"[\s_]+", " ", name).strip().rstrip(".").lower()) or _NAMES.get(
        re.sub(r"[\s_]+", "_", name).strip("_ ").lower()
    )


def parse_header(header: str) -> tuple[str | None, str | None, str]:
    """Quantity, unit and bare name of `Force (kip)`, `force [kip]`, `force_kip`, `Force / kip` or `force`."""
    text = header.strip().strip('"').strip()
    for mark in (" / ", " in "):
        name, _, unit = text.rpartition(mark)
        if (quantity := quantity_of(name)) and is_unit_of(quantity, unit.strip("()")):
            return quantity, unit.strip("()"), name.strip()
    if match := _BRACKETS.fullmatch(text):
        return quantity_of(match["name"]), match["unit"].strip(), match["name"].strip()
    if quantity := quantity_of(text):
        return quantity, None, text
    if "," in text:
        name, _, unit = text.rpartition(",")
        if (quantity := quantity_of(name)) and is_unit_of(quantity, unit):
            return quantity, unit.strip(), name.strip()
    name, _, unit = re.sub(r"\s+", "_", text).rpartition("_")
    if name and (quantity := quantity_of(name)) and is_unit_of(quantity, unit):
        return quantity, unit, name
    return None, None, text


def is_unit(text: str) -> bool:
    """Whether a text is a unit of some quantity."""
    return any(is_unit_of(quantity, text) for quantity in _BY_DIMENSION)


def is_unit_of(quantity: str, unit: str) -> bool:
    """Whether a text is a unit of a quantity."""
    try:
        to_si(quantity, unit)
    except ValueError:
        return False
    return True


def checked_quantity(name: str) -> str:
    """`name` if it is a quantity; a ValueError names the nearest."""
    quantity = quantity_of(name)
    if quantity is None:
        near = difflib.get_close_matches(name, QUANTITIES, 1, 0.0)[0]
        raise ValueError(f"unknown quantity `{name}`; the nearest known one is `{near}`")
    return quantity
