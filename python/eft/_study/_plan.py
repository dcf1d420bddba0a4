"""The plan of a study: every test by number, and the description that identifies the study."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from eft._native import Command, Rig, __version__
from eft._run import Dtype
from eft._simulate import Structure
from eft._study._combinations import MOST, Combinations
from eft._study._values import SCALE, Changes, digest

StructureMaker = Callable[[Rig], Structure]
"""Makes the external structure for the rig of a test."""

FORMAT = 1
"""Format of the folder of a study."""


@dataclass(frozen=True)
class Test:
    """One test: its command, and the changes of the rig and of the command."""

    __test__ = False  # pytest would collect classes with this name

    index: int
    command: str
    changes: Changes


@dataclass(frozen=True)
class Batch:
    """Some tests of a study with all their data, to be sent to a worker."""

    version: str
    rig: Rig
    commands: Mapping[str, Command]
    tests: tuple[Test, ...]
    dtype: Dtype
    traces: bool
    fft: bool
    structure: StructureMaker | None

    def alone(self) -> list[Batch]:
        """Each test as a batch of its own."""
        return [replace(self, tests=(test,)) for test in self.tests]


@dataclass(frozen=True)
class Plan:
    """Commands times combinations, in chunks; the commands change slowest."""

    rig: Rig
    commands: Mapping[str, Command]
    combinations: Combinations
    dtype: Dtype
    traces: bool
    fft: bool
    chunk: int
    structure: StructureMaker | None = None

    def __post_init__(self) -> None:
        if len(self) > MOST:
            raise ValueError(f"{len(self)} tests: must be at most {MOST}")

    def __len__(self) -> int:
        return len(self.commands) * len(self.combinations)

    @property
    def chunks(self) -> int:
        """Number of chunks; the last may be shorter."""
        return -(-len(self) // self.chunk)

    def size(self, number: int) -> int:
        """Tests in a chunk."""
        return min(self.chunk, len(self) - number * self.chunk)

    def batch(self, number: int) -> Batch:
        """The tests of a chunk."""
        start = number * self.chunk
        tests = tuple(self._test(index) for index in range(start, start + self.size(number)))
        needed = {test.command: self.commands[test.command] for test in tests}
        return Batch(__version__, self.rig, needed, tests, self.dtype, self.traces, self.fft, self.structure)

    def _test(self, index: int) -> Test:
        which, place = divmod(index, len(self.combinations))
        return Test(index, tuple(self.commands)[which], self.combinations[place])

    def describe(self) -> dict[str, Any]:
        """The data that identifies a study, as plain data."""
        return {
            "version": __version__,
            "rig": self.rig.to_dict(),
            "commands": {name: _about(command) for name, command in self.commands.items()},
            "parameters": self.combinations.describe(),
            "dtype": self.dtype,
            "traces": self.traces,
            "fft": self.fft,
            "tests": len(self),
        } | ({"structure": _named(self.structure)} if self.structure else {})


def _named(maker: StructureMaker) -> str:
    return f"{getattr(maker, '__module__', '')}.{getattr(maker, '__qualname__', type(maker).__qualname__)}"


def _about(command: Command) -> dict[str, Any]:
    return {
        "samples": len(command),
        "sample_rate": command.sample_rate,
        "sha256": hashlib.sha256(command.values.astype("<f8").tobytes()).hexdigest(),
    }


def configuration_hash(description: Mapping[str, Any]) -> str:
    """SHA-256 of a study's description."""
    return digest(description)


def scaled(command: Command, changes: Changes) -> Command:
    """The command of a test: scaled if the test says so."""
    factor = changes.get(SCALE)
    if not isinstance(factor, float) or factor == 1.0:
        return command
    if not math.isfinite(factor):
        raise ValueError(f"{SCALE} = {factor}: must be finite")
    return command * factor
