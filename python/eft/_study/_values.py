"""Values of settings: their types, and plain data that can be compared."""

from __future__ import annotations

import difflib
import hashlib
import json
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from eft._native import Rig, quantity, rig_keys

SCALE = "command.scale"
"""The only key that does not belong to the rig: a factor on the command."""

WITHOUT_EFFECT = "controller.sample_rate"
"""The key of the rig that no test of a study reads: each has the sample rate of its command."""

Value = bool | int | float | str | list[float] | None
Changes = dict[str, Value]


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


_TYPES: dict[str, tuple[Callable[[object], bool], str]] = {
    "float": (_number, "must be a number"),
    "int": (lambda value: isinstance(value, int) and not isinstance(value, bool), "must be a whole number"),
    "bool": (lambda value: isinstance(value, bool), "must be true or false"),
    "str": (lambda value: isinstance(value, str), "must be a string"),
    "list": (
        lambda value: isinstance(value, list) and all(map(_number, value)),
        "must be a list of numbers",
    ),
}


class Kind(NamedTuple):
    """What the values of a key are."""

    type: str
    """"float", "int", "bool", "str" or "list"."""
    unit: str
    """SI unit of numbers."""


def kind_of(key: str, rig: Rig) -> Kind:
    """The kind of a key's values.

    Raises
    ------
    ValueError
        If there is no such key (the message names the nearest one), or if it is a section.
    """
    if key == SCALE:
        return Kind("float", "")
    for entry in rig_keys():
        if entry["key"] == key:
            return Kind(entry["type"], entry["unit"])
    if difflib.get_close_matches(key, [SCALE], 1, 0.8):
        raise ValueError(f"unknown key `{key}`; the nearest known key is `{SCALE}`")
    own_value(rig, key)
    raise ValueError(f"`{key}` is a section: name one of its keys, such as `{_first_below(key)}`")


def own_value(rig: Rig, key: str) -> Any:
    """The rig's value of a key; the scale of an unchanged command is 1."""
    if key == SCALE:
        return 1.0
    try:
        return rig[key]
    except KeyError as error:
        raise ValueError(str(error.args[0])) from None


def value_in_effect(rig: Rig, key: str) -> Any:
    """The rig's value of a key; that of the plant for a key under ``truth``, which may be absent."""
    plain = key.removeprefix("truth.")
    return rig[key] if plain == key else rig.plant[plain]


def _first_below(section: str) -> str:
    return next(entry["key"] for entry in rig_keys() if entry["key"].startswith(f"{section}."))


def plain(name: str, value: Any, kind: Kind) -> Value:
    """A value without NumPy and without a unit, in SI; None removes an optional value.

    Raises
    ------
    ValueError
        If it is of another type, or has another unit.
    """
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, tuple):
        value = list(value)
    if value is None:
        return None
    if kind.type == "float" and isinstance(value, str):
        return quantity(name, value, kind.unit)
    if kind.type == "list" and isinstance(value, list):
        value = [quantity(name, item, kind.unit) if isinstance(item, str) else item for item in value]
    fits, allowed = _TYPES[kind.type]
    if not fits(value):
        raise ValueError(f"{name} = {value!r}: {allowed}")
    if isinstance(value, int) and not -(2**63) <= value < 2**63:
        raise ValueError(f"{name} = {value}: must fit 64 bits")
    if kind.type == "float":
        return float(value)
    return [float(item) for item in value] if kind.type == "list" else value


def digest(value: Any) -> str:
    """SHA-256 of plain data, independent of the order of its keys."""
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(text.encode()).hexdigest()
