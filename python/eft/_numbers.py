"""Numbers among the arguments of Python functions, converted as by the functions of Rust."""

from __future__ import annotations

import operator
from typing import Any


def real_number(name: str, value: Any) -> float:
    """A real number, which a truth value or a text is not."""
    if not _is_text_or_truth(value):
        try:
            return float(value)
        except (TypeError, ValueError):
            pass
    raise TypeError(f"{name} = {value!r}: must be a real number")


def whole_number(name: str, value: Any) -> int:
    """A whole number, which a truth value is not."""
    if not _is_text_or_truth(value):
        try:
            return operator.index(value)
        except TypeError:
            pass
    raise TypeError(f"{name} = {value!r}: must be a whole number")


def _is_text_or_truth(value: Any) -> bool:
    kind = getattr(getattr(value, "dtype", None), "kind", None)
    return isinstance(value, bool | str | bytes) or kind == "b"
