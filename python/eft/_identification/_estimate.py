"""Estimates: numbers with their standard uncertainty."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eft._read_only import read_only

Array = NDArray[np.float64]


class Estimate(float):
    """A float with its standard uncertainty, in the same unit."""

    # A mapping, because `help` shows its texts.
    __slots__ = {"uncertainty": "One standard deviation."}

    uncertainty: float

    def __new__(cls, value: float, uncertainty: float) -> Estimate:
        """Make one from value and uncertainty."""
        self = super().__new__(cls, value)
        object.__setattr__(self, "uncertainty", uncertainty)
        return self

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"{name}: an estimate cannot be changed")

    def __reduce__(self) -> tuple[Any, ...]:
        return make_estimate, (type(self), float(self), {name: getattr(self, name) for name in self._found()})

    @classmethod
    def _found(cls) -> list[str]:
        """Names of the results that were estimated together with the value."""
        return [name for kind in reversed(cls.__mro__) for name in getattr(kind, "__slots__", ())]

    @property
    def details(self) -> Mapping[str, Any]:
        """Further results of the identification, by name."""
        return {name: getattr(self, name) for name in self._found() if name != "uncertainty"}

    def __repr__(self) -> str:
        return f"{float(self):.6g} ± {self.uncertainty:.2g}"


def make_estimate(kind: type[Estimate], value: float, found: Mapping[str, Any]) -> Estimate:
    """Make an estimate with its further results."""
    self = float.__new__(kind, value)
    for name, part in found.items():
        object.__setattr__(self, name, read_only(part))
    return self
