"""One finding against a test, and its grades."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

Grade = Literal["go", "caution", "no"]
GRADES: tuple[Grade, ...] = ("go", "caution", "no")
Changes = tuple[tuple[str, Any], ...]

ROUNDED = 0.995
"""Share of an advised value that passes, because sentences round it."""


class Finding(NamedTuple):
    """One finding against a test."""

    grade: Grade
    sentence: str
    remedies: Changes = ()
