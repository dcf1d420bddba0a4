"""Values of data sheets: numbers in SI units, or texts with a unit."""

from __future__ import annotations

from typing import Any

from eft._native import quantity

Value = float | str
"""A number in SI units, or a text with its unit such as ``"12 t"``."""


def above_zero(name: str, value: Any, unit: str) -> float:
    """A value in SI units; refused unless above zero."""
    number = quantity(name, value, unit)
    if number <= 0.0:
        raise ValueError(f"{name} = {value!r}: must be above zero{f' {unit}' if unit else ''}")
    return number


def at_least_zero(name: str, value: Any, unit: str) -> float:
    """A value in SI units; refused below zero."""
    number = quantity(name, value, unit)
    if number < 0.0:
        raise ValueError(f"{name} = {value!r}: must be at least zero{f' {unit}' if unit else ''}")
    return number


def damping_ratio_of(name: str, value: Any) -> float:
    """The damping ratio of a specimen that oscillates; a forgotten per cent sign is refused."""
    ratio = at_least_zero(name, value, "")
    if ratio >= 1.0:
        raise ValueError(f'{name} = {value!r}: must be below 1, such as 0.02 or "2 %"')
    return ratio


def opening_share(name: str, value: Any) -> float:
    """A share between 0 and 1."""
    share = at_least_zero(name, value, "")
    if share >= 1.0:
        raise ValueError(f"{name} = {value!r}: must be below 1")
    return share


def one_of(**given: Any) -> str:
    """The name of the only argument that is given."""
    names = [name for name, value in given.items() if value is not None]
    if len(names) != 1:
        raise ValueError(
            f"{' or '.join(given)} = {' and '.join(names) or 'None'}: must be exactly one of them"
        )
    return names[0]
