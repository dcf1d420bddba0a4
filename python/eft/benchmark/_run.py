"""The benchmark itself: every controller on every rig under every command."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from os import PathLike
from pathlib import Path

import numpy as np

from eft._native import Command, Rig
from eft._simulate import ideal_response
from eft.benchmark._controllers import Competitor, Maker, field_of
from eft.benchmark._excitations import Excitation, excitations
from eft.benchmark._judge import Row, judge
from eft.benchmark._result import Benchmark
from eft.benchmark._rigs import Case, drawn_cases, named_cases
from eft.traces._write import check_folder

_SHORT = (
    "nominal",
    "oil 1.5 times as stiff",
    "pilot 1.7 times as slow",
    "flow gain 1.07",
    "velocity 1.5 ms late",
)
_SHORT_TESTS = ("sweep 8.9 kN", "El Centro")
RANDOM = 8
"""Number of random rigs after the named ones."""


def cases(*, short: bool = False, random: int | None = None, seed: int = 1) -> list[Case]:
    """Return the rigs of a benchmark: named ones and random ones; five named ones in the short form."""
    if short:
        named = [case for case in named_cases() if case.name in _SHORT]
        return named + drawn_cases(random or 0, seed)
    return named_cases() + drawn_cases(RANDOM if random is None else random, seed)


def commands_of(short: bool) -> tuple[Excitation, ...]:
    """Return the commands of a benchmark: all four, or in the short form two of them."""
    return tuple(one for one in excitations() if not short or one.name in _SHORT_TESTS)


def run(
    controllers: Iterable[str | Competitor | Maker] | None = None,
    *,
    short: bool = False,
    random: int | None = None,
    seed: int = 1,
    on: Sequence[Case] | None = None,
    under: Sequence[Excitation] | None = None,
    progress: Callable[[int, int], object] | None = None,
    output: str | PathLike[str] | None = None,
) -> Benchmark:
    """Run controllers on the rigs of the benchmark.

    A controller loses a test if it raises an exception, returns no finite number, becomes unstable or leaves
    the stroke. The other tests continue. The same arguments give the same numbers.

    Parameters
    ----------
    controllers : iterable, optional
        Names (see `COMPETITORS`), entry points of the group ``eft.controllers``, texts like
        ``"package:Class"``, or classes; all that ship by default. A class is made for each test as
        ``Class(rig, sample_rate=...)`` with the rig as a controller knows it, and has the method ``step`` of
        `eft.StepController`.
    short : bool
        Whether to run five rigs under two commands instead of all.
    random : int, optional
        Number of random rigs; 8 by default, and none in the short form.
    seed : int
        Of the random rigs.
    on : sequence of Case, optional
        Rigs to take instead.
    under : sequence of Excitation, optional
        Commands to take instead.
    progress : callable, optional
        Called with the tests done and their total; an exception from it ends the run.
    output : path-like, optional
        File for the rows, as `Benchmark.save` writes it. An interrupt or another exception leaves the rows of
        the tests that are done there.

    Returns
    -------
    Benchmark
        A row for each test.

    Raises
    ------
    OSError
        If `output` cannot be written.
    ValueError
        If a controller cannot be found, none is given, or two different ones have the same name. If `on` or
        `under` holds something else, or nothing.

    Examples
    --------
    >>> import eft
    >>> class Mine:
    ...     def __init__(self, rig, sample_rate):
    ...         self.gain = 2e-5
    ...     def step(self, command, velocity, force, spool, **_):
    ...         return self.gain * (command - force)
    >>> found = eft.benchmark.run([Mine, "nonlinear"], on=eft.benchmark.named_cases()[:1], short=True)
    >>> [one.controller for one in found.summary()]
    ['nonlinear', 'Mine']
    """
    competitors = field_of(controllers)
    rigs = cases(short=short, random=random, seed=seed) if on is None else on
    commands = commands_of(short) if under is None else under
    _check("on", rigs, Case)
    _check("under", commands, Excitation)
    if output is not None:
        check_folder(Path(output))
    total, rows = len(competitors) * len(rigs) * len(commands), list[Row]()
    try:
        for test in _tests(competitors, rigs, commands):
            if progress is not None:
                progress(len(rows), total)
            rows.append(judge(*test))
        if progress is not None:
            progress(total, total)
    finally:
        if output is not None and rows:
            Benchmark(tuple(rows)).save(output)
    return Benchmark(tuple(rows))


def _tests(
    competitors: Iterable[Competitor], rigs: Sequence[Case], commands: Sequence[Excitation]
) -> Iterator[tuple[Competitor, Rig, tuple[str, str], Command, float]]:
    """The tests in their order, as `judge` takes them."""
    for case in rigs:
        known = case.rig.replace({"truth": None})
        for excitation in commands:
            command = excitation.command(known)
            peak = float(np.abs(ideal_response(case.rig, command).displacement).max())
            for competitor in competitors:
                yield competitor, case.rig, (case.name, excitation.name), command, peak


def _check(name: str, given: Sequence[object], kind: type) -> None:
    """Refuse an empty list, and one of other objects."""
    if isinstance(given, str) or not given or not all(isinstance(one, kind) for one in given):
        raise ValueError(f"{name} = {given!r}: must be a list of at least one eft.benchmark.{kind.__name__}")
