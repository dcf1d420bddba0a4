"""Arrays of results, which are read-only: a changed sample would contradict what was computed from it."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np

Anything = TypeVar("Anything")


def read_only(value: Anything) -> Anything:
    """A read-only view of an array; any other value itself. The given array stays as it was."""
    if not isinstance(value, np.ndarray) or not value.flags.writeable:
        return value
    view = value.view()
    view.setflags(write=False)
    return view


class ReadOnly:
    """Base of frozen dataclasses with arrays, which become read-only."""

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        self._lock()

    def __setstate__(self, state: dict[str, Any]) -> None:
        # Arrays from a pickle are writable.
        self.__dict__.update(state)
        self._lock()

    def _lock(self) -> None:
        self.__dict__.update({name: read_only(value) for name, value in self.__dict__.items()})
