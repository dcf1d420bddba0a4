"""Quantities, their names in laboratories, and their units."""

from __future__ import annotations

import difflib
import re
from typing import NamedTuple

from eft._native import unit_factor, units_of
from eft._table import TRACES


class Quantity(NamedTuple):
    """Quantities of a column."""

    unit: str
    """SI unit."""
    aliases: tuple[str, ...] = ()


QUANTITIES = {
    "time": Quantity("s", ("t", "elapsed time", "x value")),
    "command": Quantity("N", ("force command", "command force", "reference", "reference force", "cmd")),
    "force": Quantity("N", ("load", "actuator force", "f")),
    "displacement": Quantity("m", ("disp", "stroke", "x")),
    "velocity": Quantity("m/s", ("vel", "v")),
    "acceleration": Quantity("m/s2", ("acc", "accel", "a")),
    "spool": Quantity("1", ("spool opening", "opening")),
    "load_pressure": Quantity("Pa", ("differential pressure", "delta p")),
    "supply_pressure": Quantity("Pa", ("supply",)),
    "flow": Quantity("m3/s", ("q",)),
    "valve_command": Quantity("V", ("valve", "servo command")),
    "compensation": Quantity("V"),
}
# The other traces of a run, by their own names only.
QUANTITIES |= {
    name: Quantity(trace.unit.replace("²", "2") or "1")
    for name, trace in TRACES.items()
    if name not in QUANTITIES
}

_NAMES = {alias: name for name, quantity in QUANTITIES.items() for alias in (name, *quantity.aliases)}
_LONGEST_NAME = 200
"""Largest length of a name with a quantity."""
_UNITS = {quantity.unit for quantity in QUANTITIES.values()}
_CHANNEL = re.compile(
    r"^\s*(?:ch(?:annel)?\s?\d+\s)?\s*(?:axial\s)?\s*|\s+(?:feedback|fbk)\s*$", re.IGNORECASE
)
"""Words that testing machines add to the name of a quantity."""
_BRACKETS = re.compile(r"(?P<name>[^(\[]*+)[(\[](?P<unit>[^)\]]*+)[)\]]")


def si_unit(quantity: str) -> str:
    """The SI unit of a quantity."""
    return QUANTITIES[quantity].unit


def to_si(quantity: str, unit: str) -> float:
    """Factor from `unit` to SI; a ValueError names what is allowed."""
    si = si_unit(quantity)
    factor = unit_factor(unit, si)
    if factor is None:
        raise ValueError(f"unit `{unit}` of {quantity}: must be one of {units_of(si)}")
    return factor


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
    return any(unit_factor(text, si) is not None for si in _UNITS)


def is_unit_of(quantity: str, unit: str) -> bool:
    """Whether a text is a unit of a quantity."""
    return unit_factor(unit, si_unit(quantity)) is not None


def checked_quantity(name: str) -> str:
    """`name` if it is a quantity; a ValueError names the nearest."""
    quantity = quantity_of(name)
    if quantity is None:
        near = difflib.get_close_matches(name, QUANTITIES, 1, 0.0)[0]
        raise ValueError(f"unknown quantity `{name}`; the nearest known one is `{near}`")
    return quantity
