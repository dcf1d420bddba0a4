"""Reads signals from CSV, MAT, HDF5 and Parquet files, and from saved runs."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from itertools import chain, islice
from os import PathLike
from pathlib import Path

import numpy as np

from eft._foreign import LARGEST, WrongFileError, opened, ordinary_size
from eft._run import TestRun
from eft.traces import _binary
from eft.traces._traces import Column, Traces

_LONGEST = 1024**2
"""Characters of the longest line of a text."""


def read_traces(
    path: str | PathLike[str],
    *,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    sample_rate: float | None = None,
    gaps: bool = False,
) -> Traces:
    """Read the signals of a test and convert them to SI units.

    The suffix tells the format: ``.csv``, ``.txt``, ``.tsv``; ``.mat`` (SciPy, from 7.3 on h5py);
    ``.h5``, ``.hdf5`` (h5py); ``.parquet`` (pyarrow); anything else must be a run that
    `TestRun.save` wrote. The name of a column says what it is, and its unit follows the name, as in
    ``force (kip)`` or ``force_kip``. An HDF5 dataset may have the unit in the attribute ``units``.

    Parameters
    ----------
    path : path-like
        The file.
    columns : mapping, optional
        Header of the column that holds a quantity, where its name does not say so.
    units : mapping, optional
        Unit of a quantity, where the file does not say it.
    sample_rate : float, optional
        In Hz, for a file without a time column.
    gaps : bool
        Whether samples may be missing, as NaN or, in a CSV, an empty cell; they become NaN.

    Raises
    ------
    OSError
        If the file cannot be read, or is a pipe or a device.
    ValueError
        If it is not what it should be; the message says where and what is allowed.
    """
    source = Path(path)
    size = ordinary_size(source)
    if size > LARGEST:
        raise ValueError(f"{source}: {size / 1024**3:.1f} GiB, must be at most {LARGEST / 1024**3:g} GiB")
    reader = _READERS.get(source.suffix.lower())
    if reader is None:
        return Traces.from_run(TestRun.load(source), str(source))
    with _csv(source, gaps) if reader is _csv else reader(source) as raw:
        return Traces.from_columns(
            str(source), raw, columns=columns or {}, units=units or {}, sample_rate=sample_rate, gaps=gaps
        )


@contextmanager
def _csv(source: Path, gaps: bool = False) -> Iterator[list[Column]]:
    lines = _lines(source)
    begin = list(islice(lines, 2))
    if len(begin) < 2:
        raise ValueError(f"{source}: {len(begin)} lines, must be a header and at least two samples")
    (_, header), first = begin
    delimiter = max(",;\t", key=header.count)
    names = [_unquoted(name) for name in header.split(delimiter)]
    if all(_is_number(name) for name in names):
        raise ValueError(
            f"{source}, line 1: no header; it must name the columns, as in `time (s),force (kN)`"
        )
    units: list[str | None] = [None] * len(names)
    second = [_unquoted(cell) for cell in first[1].split(delimiter)]
    has_units = len(second) == len(names) and not any(_is_number(cell) for cell in second)
    if has_units:
        # A line of units below the names.
        units = [cell.strip("()[]") for cell in second]

    def filled(lines: Iterable[tuple[int, str]]) -> Iterator[tuple[int, str]]:
        for number, line in lines:
            yield number, _filled(line, delimiter) if gaps else line

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of no rows
            rows = (line for _, line in filled(lines if has_units else chain([first], lines)))
            values = np.loadtxt(rows, delimiter=delimiter, ndmin=2, comments=None)
    except WrongFileError:
        raise
    except ValueError:
        values = np.empty((0, 0))
    if values.shape[1] != len(names):
        rest = islice(_lines(source), 2 if has_units else 1, None)
        raise _csv_error(source, filled(rest), delimiter, len(names))
    yield [Column(name, unit, column.copy) for name, unit, column in zip(names, units, values.T, strict=True)]


def _lines(source: Path) -> Iterator[tuple[int, str]]:
    """The numbered lines of a text that say something; a comment does not."""
    with opened(source) as file, io.TextIOWrapper(file, "utf-8-sig", errors="replace") as text:
        number = 0
        while line := text.readline(_LONGEST + 1):
            number += 1
            if len(line) > _LONGEST:
                raise WrongFileError(f"{source}, line {number}: longer than {_LONGEST} characters")
            if "\ufffd" in line:
                raise WrongFileError(f"{source}, line {number}: not a text in UTF-8")
            if line.strip() and not line.lstrip().startswith("#"):
                yield number, line.rstrip("\r\n")


def _filled(line: str, delimiter: str) -> str:
    """The line with NaN where a cell is empty."""
    return delimiter.join(cell if cell.strip() else "nan" for cell in line.split(delimiter))


def _csv_error(source: Path, lines: Iterable[tuple[int, str]], delimiter: str, width: int) -> ValueError:
    for number, line in lines:
        cells = line.split(delimiter)
        if len(cells) != width:
            return ValueError(
                f"{source}, line {number}: {len(cells)} columns, must be {width} as in the header"
            )
        for position, cell in enumerate(cells, start=1):
            if not _is_number(_unquoted(cell)) or cell.strip().startswith('"'):
                return ValueError(
                    f"{source}, line {number}, column {position}: `{cell.strip()[:40]}` is not a number"
                )
    return ValueError(f"{source}: the numbers cannot be read")


def _unquoted(cell: str) -> str:
    return cell.strip().strip('"').strip()


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


_READERS = {
    ".csv": _csv,
    ".txt": _csv,
    ".tsv": _csv,
    ".mat": _binary.mat,
    ".h5": _binary.hdf5,
    ".hdf5": _binary.hdf5,
    ".parquet": _binary.parquet,
}
