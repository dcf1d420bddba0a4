"""Reads the signals of others: CSV, MAT, HDF5, Parquet, and saved runs."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eft._run import TestRun
from eft.traces._traces import Traces

Raw = Iterator[tuple[str, str | None, NDArray[np.float64]]]

LARGEST = 2 * 1024**3
"""Bytes of the largest file that is read: a slip of the finger must not fill the memory."""


def read_traces(
    path: str | PathLike[str],
    *,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    sample_rate: float | None = None,
    gaps: bool = False,
) -> Traces:
    """Read the signals of a test and bring them to SI units.

    The suffix tells the format: ``.csv``, ``.txt``, ``.tsv``; ``.mat`` (SciPy, from 7.3 on h5py);
    ``.h5``, ``.hdf5`` (h5py); ``.parquet`` (pandas and pyarrow); anything else must be a run that
    `TestRun.save` wrote. A column is known by its name and has its unit behind it, ``force (kip)`` or
    ``force_kip``, or in the attribute ``units`` of an HDF5 dataset.

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
        If the file cannot be read.
    ValueError
        If it is not what it should be; the message says where and what is allowed.
    """
    source = Path(path)
    size = source.stat().st_size
    if size > LARGEST:
        raise ValueError(f"{source}: {size / 1024**3:.1f} GiB, must be at most {LARGEST / 1024**3:g} GiB")
    reader = _READERS.get(source.suffix.lower())
    if reader is None:
        return Traces.from_run(TestRun.load(source), str(source))
    raw = _csv(source, gaps) if reader is _csv else reader(source)
    return Traces.from_columns(
        str(source), raw, columns=columns or {}, units=units or {}, sample_rate=sample_rate, gaps=gaps
    )


def _csv(source: Path, gaps: bool = False) -> Raw:
    try:
        text = source.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{source}: not a text file in UTF-8: byte {error.start + 1}") from None
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if len(lines) < 2:
        raise ValueError(f"{source}: {len(lines)} lines, must be a header and at least two samples")
    _, header = lines.pop(0)
    delimiter = max(",;\t", key=header.count)
    names = [_unquoted(name) for name in header.split(delimiter)]
    if all(_is_number(name) for name in names):
        raise ValueError(
            f"{source}, line 1: no header; it must name the columns, as in `time (s),force (kN)`"
        )
    units: list[str | None] = [None] * len(names)
    second = [_unquoted(cell) for cell in lines[0][1].split(delimiter)]
    if len(second) == len(names) and not any(_is_number(cell) for cell in second):
        # A line of units below the names.
        units = [cell.strip("()[]") for cell in second]
        lines.pop(0)
    if gaps:
        lines = [(number, _filled(line, delimiter)) for number, line in lines]
    try:
        values = np.loadtxt([line for _, line in lines], delimiter=delimiter, ndmin=2, comments=None)
    except ValueError:
        raise _csv_error(source, lines, delimiter, len(names)) from None
    if values.shape[1] != len(names):
        raise _csv_error(source, lines, delimiter, len(names))
    for name, unit, column in zip(names, units, values.T, strict=True):
        yield name, unit, np.ascontiguousarray(column)


def _filled(line: str, delimiter: str) -> str:
    """The line with NaN where a cell is empty."""
    return delimiter.join(cell if cell.strip() else "nan" for cell in line.split(delimiter))


def _csv_error(source: Path, lines: list[tuple[int, str]], delimiter: str, width: int) -> ValueError:
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


def _mat(source: Path) -> Raw:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    with source.open("rb") as file:
        start = file.read(128)
    if start.startswith(b"MATLAB 7.3"):
        yield from _hdf5(source)
        return
    try:
        stored = loadmat(source, squeeze_me=True, appendmat=False)
    except (MatReadError, ValueError, TypeError, NotImplementedError, OSError, EOFError) as error:
        raise ValueError(f"{source}: not a MAT file: {error}") from None
    except Exception as error:  # SciPy raises what its parser stumbles over, zlib errors among them
        raise ValueError(f"{source}: a damaged MAT file: {error}") from None
    yield from _vectors(source, {k: v for k, v in stored.items() if not k.startswith("__")}, {})


def _hdf5(source: Path) -> Raw:
    import h5py

    found: dict[str, Any] = {}
    units: dict[str, str] = {}

    def visit(path: str, item: object) -> None:
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "fiu" and not path.startswith("#"):
            name = path.rsplit("/", 1)[-1]
            if name in found:
                raise ValueError(f"{source}: two data sets are called `{name}`")
            if item.size * item.dtype.itemsize > LARGEST:
                raise ValueError(f"{source}: data set `{path}` declares {item.size} numbers, too many")
            found[name] = np.squeeze(item[()])
            unit = item.attrs.get("units", item.attrs.get("unit"))
            if unit is not None:
                units[name] = unit.decode() if isinstance(unit, bytes) else str(unit)

    try:
        with h5py.File(source, "r") as file:
            file.visititems(visit)
    except (OSError, RuntimeError, KeyError) as error:
        reason = re.sub(r"\s+", " ", str(error))
        raise ValueError(f"{source}: not an HDF5 file that can be read: {reason}") from None
    yield from _vectors(source, found, units)


def _vectors(source: Path, found: Mapping[str, Any], units: Mapping[str, str]) -> Raw:
    """The one-dimensional numeric arrays of the commonest length, for a file may hold other things."""
    vectors = {
        name: np.asarray(value, dtype=np.float64)
        for name, value in found.items()
        if isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind in "fiu"
    }
    if not vectors:
        raise ValueError(f"{source}: no one-dimensional arrays of numbers in it")
    sizes = [vector.size for vector in vectors.values()]
    size = max(set(sizes), key=sizes.count)
    for name, vector in vectors.items():
        if vector.size == size:
            yield name, units.get(name), vector


def _parquet(source: Path) -> Raw:
    import pandas as pd

    try:
        frame = pd.read_parquet(source)
    except (ValueError, OSError) as error:
        reason = re.sub(r"\s+", " ", str(error))
        raise ValueError(f"{source}: not a Parquet file that can be read: {reason}") from None
    numbers = frame.reset_index() if frame.index.name else frame
    for name in numbers.select_dtypes("number").columns:
        yield str(name), None, np.ascontiguousarray(numbers[name], dtype=np.float64)


_READERS = {
    ".csv": _csv,
    ".txt": _csv,
    ".tsv": _csv,
    ".mat": _mat,
    ".h5": _hdf5,
    ".hdf5": _hdf5,
    ".parquet": _parquet,
}
