"""The settings of a study: a grid, a list, or the points of a sampler."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Protocol

from eft._native import Rig
from eft._study._samplers import Sampler
from eft._study._values import WITHOUT_EFFECT, Changes, Kind, digest, kind_of, own_value, plain

MOST = 100_000_000
"""Largest number of tests of a study: a hundred million of 1 ms take a day on one core."""


class Combinations(Protocol):
    """Settings by number, and the data that must be unchanged when a study resumes."""

    keys: tuple[str, ...]

    def __len__(self) -> int: ...

    def __getitem__(self, index: int, /) -> Changes: ...

    def describe(self) -> dict[str, Any]:
        """As plain data, which is equal only for equal combinations."""


class Grid:
    """Every value of one key with every value of the others; the last key changes fastest."""

    def __init__(self, axes: Mapping[str, Iterable[Any]], rig: Rig) -> None:
        self._axes = {key: _axis(key, values, kind_of(_word(key), rig)) for key, values in axes.items()}
        self.keys = tuple(self._axes)
        if (size := math.prod(map(len, self._axes.values()))) > MOST:
            raise ValueError(f"parameters make {size} combinations: must be at most {MOST}")
        self._size = size

    def __len__(self) -> int:
        return self._size

    def __getitem__(self, index: int) -> Changes:
        chosen: Changes = {}
        for key in reversed(self.keys):
            index, place = divmod(index, len(self._axes[key]))
            chosen[key] = self._axes[key][place]
        return {key: chosen[key] for key in self.keys}

    def describe(self) -> dict[str, Any]:
        """The axes, in their order."""
        return {"kind": "grid", "values": self._axes, "order": list(self.keys)}


class Listed:
    """A list of combinations; a key that a combination does not name has the rig's value."""

    def __init__(self, combinations: Sequence[Mapping[str, Any]], rig: Rig) -> None:
        for number, changes in enumerate(combinations):
            if not isinstance(changes, Mapping):
                raise ValueError(
                    f"parameters[{number}] = {changes!r}: must be a mapping of dotted keys to values"
                )
        self.keys = tuple(dict.fromkeys(_word(key) for changes in combinations for key in changes))
        kinds = {key: kind_of(key, rig) for key in self.keys}
        own = {key: own_value(rig, key) for key in self.keys}
        self._rows = [
            {
                key: plain(f"parameters[{i}][{key!r}]", changes.get(key, own[key]), kinds[key])
                for key in self.keys
            }
            for i, changes in enumerate(combinations)
        ]
        if not self._rows:
            raise ValueError("parameters is empty: must hold at least one combination")

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, index: int) -> Changes:
        return dict(self._rows[index])

    def describe(self) -> dict[str, Any]:
        """Number of combinations, and a digest of all of them."""
        return {"kind": "list", "order": list(self.keys), "n": len(self), "sha256": digest(self._rows)}


def combinations_of(
    parameters: Mapping[str, Iterable[Any]] | Iterable[Mapping[str, Any]] | Sampler, rig: Rig
) -> Combinations:
    """Make combinations from the argument of `eft.study`.

    Raises
    ------
    ValueError
        If a key is unknown or has no effect, a value is of a wrong type, or there are too many; the message
        says which.
    """
    found = _combinations(parameters, rig)
    if WITHOUT_EFFECT in found.keys:
        raise ValueError(
            f"parameters[{WITHOUT_EFFECT!r}]: has no effect, because each test has the sample rate of its "
            "command: give a command for each rate"
        )
    return found


def _combinations(
    parameters: Mapping[str, Iterable[Any]] | Iterable[Mapping[str, Any]] | Sampler, rig: Rig
) -> Combinations:
    if isinstance(parameters, Sampler):
        return parameters.combinations(rig)
    if isinstance(parameters, Mapping):
        return Grid(parameters, rig)
    if isinstance(parameters, str) or not isinstance(parameters, Iterable):
        raise ValueError(
            f"parameters = {parameters!r}: must be a mapping of keys to lists, "
            "a list of mappings, or a sampler"
        )
    return Listed(list(parameters), rig)


def _word(key: object) -> str:
    if not isinstance(key, str):
        raise ValueError(f"parameters: key {key!r} must be a string")
    return key


def _axis(key: str, values: Iterable[Any], kind: Kind) -> list[Any]:
    if isinstance(values, str | Mapping) or not isinstance(values, Iterable):
        raise ValueError(f"parameters[{key!r}] = {values!r}: must be a list of values")
    axis = [plain(f"parameters[{key!r}][{i}]", value, kind) for i, value in enumerate(values)]
    if not axis:
        raise ValueError(f"parameters[{key!r}] is empty: must hold at least one value")
    return axis
