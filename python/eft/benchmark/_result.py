"""The result of a benchmark: rows, a summary of each controller, and the file of both."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from eft._files import write_text
from eft._foreign import WrongFileError, read_text
from eft.benchmark._controllers import COMPETITORS
from eft.benchmark._judge import Row

_TEXTS = ("controller", "case", "test", "lost")
_LARGEST = 64 * 1024**2


@dataclass(frozen=True)
class Summary:
    """A controller over all its tests. A lost test counts as an infinite error, and is within no bound."""

    controller: str
    """Name of the controller."""
    tests: int
    """Number of tests."""
    lost: int
    """Number of tests that were lost."""
    nrmse: float
    """Median of the force error, rms over rms."""
    nrmse_90: float
    """The error that 90 % of the tests stay below; infinite if more than 10 % are lost."""
    slow_error: float
    """Median of the error below 20 Hz."""
    delay: float
    """Median of the magnitude of the delay, s."""
    peak_error: float
    """Median of the peak error."""
    within_band: float
    """Share of the sweeps whose ratio stays within 0.93 and 1.07; NaN without sweeps."""
    displacement_error: float
    """Median of the displacement error."""
    max_spool: float
    """Largest spool opening of the tests that were not lost."""
    energy: float
    """Median of the energy taken from the supply, J, without lost tests."""
    instructions: int | None
    """Budget of a tick on a Cortex-M4F; None if it was not measured."""


@dataclass(frozen=True)
class Benchmark:
    """The result of `run`: a row for each controller, rig and command."""

    rows: tuple[Row, ...]
    """In the order in which they were run."""

    def summary(self) -> tuple[Summary, ...]:
        """Return a summary of each controller, by the median of its force error.

        Returns
        -------
        tuple of Summary

        Examples
        --------
        >>> import eft
        >>> cases, sweep = eft.benchmark.named_cases()[:1], eft.benchmark.excitations()[:1]
        >>> found = eft.benchmark.run(["nonlinear"], on=cases, under=sweep)
        >>> [one.controller for one in found.summary()]
        ['nonlinear']
        """
        names = dict.fromkeys(row.controller for row in self.rows)
        found = (_summary(name, [row for row in self.rows if row.controller == name]) for name in names)
        return tuple(sorted(found, key=lambda one: (one.nrmse, one.lost)))

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the rows as CSV, under another name that is then renamed; returns the path.

        Parameters
        ----------
        path : path-like
            The file.

        Returns
        -------
        pathlib.Path

        Raises
        ------
        OSError
            If the file cannot be written.

        Examples
        --------
        >>> import eft
        >>> cases, sweep = eft.benchmark.named_cases()[:1], eft.benchmark.excitations()[:1]
        >>> found = eft.benchmark.run(["nonlinear"], on=cases, under=sweep)
        >>> found.save("benchmark.csv").name
        'benchmark.csv'
        """
        names = [field.name for field in fields(Row)]
        lines = [",".join(names)]
        lines += [",".join(_cell(value) for value in asdict(row).values()) for row in self.rows]
        target = Path(path)
        write_text(target, "\n".join(lines) + "\n")
        return target

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Benchmark:
        """Read rows that `save` wrote; ValueError for any other file.

        Parameters
        ----------
        path : path-like
            The file.

        Returns
        -------
        Benchmark

        Raises
        ------
        OSError
            If the file cannot be read.
        ValueError
            If it is not a file of `save`; the message names the line.

        Examples
        --------
        >>> import eft
        >>> cases, sweep = eft.benchmark.named_cases()[:1], eft.benchmark.excitations()[:1]
        >>> found = eft.benchmark.run(["nonlinear"], on=cases, under=sweep)
        >>> len(eft.benchmark.Benchmark.load(found.save("benchmark.csv")).rows)
        1
        """
        source = Path(path)
        lines = csv.DictReader(read_text(source, _LARGEST, "file of a benchmark").splitlines())
        names = [field.name for field in fields(Row)]
        if lines.fieldnames != names:
            raise WrongFileError(f"{source}: not a benchmark saved by eft: its columns must be {names}")
        return cls(tuple(_row(source, number, line) for number, line in enumerate(lines, 2)))


def _cell(value: str | float) -> str:
    if isinstance(value, float):
        return f"{value:.5g}"
    return '"' + value.replace('"', '""') + '"' if set(value) & set(',"\n') else value


def _row(source: Path, number: int, line: dict[str, str]) -> Row:
    try:
        values: dict[str, Any] = {
            name: text if name in _TEXTS else float(text) for name, text in line.items()
        }
        return Row(**values)
    except (TypeError, ValueError):
        raise WrongFileError(f"{source}: line {number} must have a number in each column of one") from None


def _summary(name: str, rows: list[Row]) -> Summary:
    sweeps = [row for row in rows if row.test.startswith("sweep")]
    inside = [row.lowest_ratio >= 0.93 and row.highest_ratio <= 1.07 for row in sweeps]
    kept = [row for row in rows if not row.lost]
    return Summary(
        name,
        tests=len(rows),
        lost=len(rows) - len(kept),
        nrmse=_share(rows, "nrmse", 0.5),
        nrmse_90=_share(rows, "nrmse", 0.9),
        slow_error=_share(rows, "slow_error", 0.5),
        delay=_share(rows, "delay", 0.5),
        peak_error=_share(rows, "peak_error", 0.5),
        within_band=float(np.mean(inside)) if inside else math.nan,
        displacement_error=_share(rows, "displacement_error", 0.5),
        max_spool=max((row.max_spool for row in kept), default=math.nan),
        energy=float(np.median([row.energy for row in kept])) if kept else math.nan,
        instructions=COMPETITORS[name].instructions if name in COMPETITORS else None,
    )


def _share(rows: Iterable[Row], name: str, share: float) -> float:
    """The value that a share of the tests do not exceed; a lost test counts as infinite."""
    values = [math.inf if row.lost else abs(getattr(row, name)) for row in rows]
    return float(np.quantile(np.where(np.isnan(values), math.inf, values), share, method="inverted_cdf"))
