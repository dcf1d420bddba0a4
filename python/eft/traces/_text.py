"""Columns of text files: CSV, tabs, semicolons, decimal commas, preambles of MTS and LabVIEW."""

from __future__ import annotations

import re
import warnings
from array import array
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from eft._foreign import WrongFileError, opened
from eft.traces._traces import Column
from eft.traces._units import is_unit, parse_header

Wanted = Callable[[Sequence[str]], Sequence[int]]
"""Indices of the columns to be read, from their headers."""
Numbered = tuple[int, str]
"""A line and its number, counted from 1."""

_LONGEST = 1024**2
"""Length of the longest line, in characters."""
_PREAMBLE = 200
"""Number of lines in which the column names must be."""
_EARLIER_ROWS = 8
"""Smallest number of rows above the names that count as another measurement and not as a preamble."""
_PIECE = 1024**2
"""Characters that are parsed at a time."""


_DELIMITERS: tuple[str | None, ...] = ("\t", ";", ",", None)


class _Layout(NamedTuple):
    delimiter: str | None
    """None means blanks."""
    names: list[str]
    units: list[str | None]
    first: int
    """Place of the first row among the lines read so far."""


@contextmanager
def text(source: Path, wanted: Wanted, gaps: bool = False) -> Iterator[list[Column]]:
    """The columns of a text. Those in `wanted` must be numbers, or with `gaps` empty cells."""
    lines = _lines(source)
    begin: list[Numbered] = []
    size = 0
    for numbered in lines:
        begin.append(numbered)
        size += len(numbered[1])
        if len(begin) == _PREAMBLE or size > 2 * _LONGEST:
            break
    if len(begin) < 2:
        raise WrongFileError(f"{source}: {len(begin)} lines, must be a header and at least two samples")
    layout = _layout(source, begin, wanted, gaps)
    places = list(wanted(layout.names))
    values = [array("d") for _ in places]
    if places:
        for piece in _pieces(chain(begin[layout.first :], lines)):
            rows = _parsed(source, piece, layout, places, gaps)
            for kept, column in zip(values, rows.T, strict=True):
                kept.frombytes(np.ascontiguousarray(column).tobytes())
    kept_at = dict(zip(places, values, strict=True))
    yield [
        Column(name, unit, partial(_taken, kept_at, place))
        for place, (name, unit) in enumerate(zip(layout.names, layout.units, strict=True))
    ]


def _taken(values: dict[int, array[float]], place: int) -> NDArray[np.float64]:
    return np.frombuffer(values.pop(place), dtype=np.float64)


def _layout(source: Path, begin: Sequence[Numbered], wanted: Wanted, gaps: bool) -> _Layout:
    """Find the names of the columns: the line without numbers above the first row of numbers.

    A preamble may have such lines too, which lines of another width follow.
    """
    layouts = list(_layouts(begin, wanted, gaps))
    if not layouts:
        raise _without_layout(source, begin, gaps)

    def continues(layout: _Layout) -> bool:
        width, delimiter = len(layout.names), layout.delimiter
        return all(len(_cells(line, delimiter, width)) == width for _, line in begin[layout.first :])

    layout = next(filter(continues, layouts), layouts[0])
    _check_nothing_earlier(source, begin[: layout.first], layout)
    return layout


def _check_nothing_earlier(source: Path, earlier: Sequence[Numbered], layout: _Layout) -> None:
    """Refuse rows of numbers above the names. Of two measurements only the second would be read."""
    width = len(layout.names)
    rows = []
    for number, line in earlier:
        cells = _cells(line, layout.delimiter, width)
        if len(cells) == width and all(_is_number(cell.replace(",", ".")) for cell in cells):
            rows.append(number)
    if len(rows) >= _EARLIER_ROWS:
        raise ValueError(
            f"{source}, line {rows[-1]}: rows of numbers stand above the names of the columns; "
            "a file must hold one measurement"
        )


def _layouts(begin: Sequence[Numbered], wanted: Wanted, gaps: bool) -> Iterator[_Layout]:
    for at in range(1, len(begin)):
        header, row = begin[at - 1][1], begin[at][1]
        for delimiter in _DELIMITERS:
            if delimiter is not None and delimiter not in header:
                continue
            names = _names(header, delimiter, row)
            units: list[str | None] = [None] * len(names)
            if any(
                _is_number(name.replace(",", ".")) or all(map(_is_number, name.split(","))) for name in names
            ):
                continue
            if at > 1 and (above := _names(begin[at - 2][1], delimiter, row)) and _are_units(names, above):
                names, units = above, [name.strip("()[]") for name in names]
            cells = _cells(row, delimiter, len(names))
            places = wanted(names) or range(len(names))
            if max(places) < len(cells) < len(names):
                # LabVIEW names a column of comments that most rows leave out.
                names, units = names[: len(cells)], units[: len(cells)]
            if len(cells) == len(names) and all(_is_cell(cells[place], delimiter, gaps) for place in places):
                yield _Layout(delimiter, names, units, at)
                break


def _without_layout(source: Path, begin: Sequence[Numbered], gaps: bool) -> ValueError:
    """The error for a text without a row of numbers after a line of names."""
    (number, header), *rest = begin
    delimiter = max(",;\t", key=header.count)
    names = _names(header, delimiter, header)
    if all(_is_number(name) for name in names):
        return ValueError(
            f"{source}, line {number}: no header; it must name the columns, as in `time (s),force (kN)`"
        )
    if any(parse_header(name)[0] for name in names):
        layout = _Layout(delimiter, names, [], 1)
        return _row_error(source, rest, layout, list(range(len(names))), gaps)
    return ValueError(
        f"{source}: no line of column names above a row of numbers among the first {len(begin)} lines; "
        "it must name the columns, as in `time (s),force (kN)`"
    )


def _names(line: str, delimiter: str | None, row: str) -> list[str]:
    if delimiter is None:
        # Two blanks separate names, which may contain single blanks.
        names = re.split(r"\s{2,}", line.strip())
        return names if len(names) == len(row.split()) else line.split()
    names = [_unquoted(name) for name in line.split(delimiter)]
    while len(names) > 1 and not names[-1]:
        names.pop()
    return names


def _are_units(line: Sequence[str], above: Sequence[str]) -> bool:
    """Whether a line has the units of the names above it."""
    if len(line) != len(above) or any(_is_number(name) for name in above):
        return False
    known = sum(parse_header(name)[0] is not None for name in above)
    # A unit may look like a short name: `V` is also a velocity.
    named = sum(len(name) > 2 and parse_header(name)[0] is not None for name in line)
    units = [cell.strip("()[]") for cell in line]
    return known > named or all(not cell or cell == "-" or is_unit(cell) for cell in units)


def _cells(line: str, delimiter: str | None, width: int) -> list[str]:
    cells = line.split(delimiter)
    while len(cells) > width and not cells[-1].strip():
        cells.pop()
    return [_unquoted(cell) for cell in cells]


def _is_cell(cell: str, delimiter: str | None, gaps: bool) -> bool:
    return (gaps and not cell) or _is_number(cell if delimiter == "," else cell.replace(",", "."))


def _pieces(lines: Iterable[Numbered]) -> Iterator[list[Numbered]]:
    piece: list[Numbered] = []
    size = 0
    for numbered in lines:
        piece.append(numbered)
        size += len(numbered[1]) + 64
        if size > _PIECE:
            yield piece
            piece, size = [], 0
    if piece:
        yield piece


def _parsed(
    source: Path, piece: list[Numbered], layout: _Layout, places: list[int], gaps: bool
) -> NDArray[np.float64]:
    width, delimiter = len(layout.names), layout.delimiter
    try:
        rows = [_plain(line, delimiter, width, gaps) for _, line in piece]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of no rows
            values: NDArray[np.float64] = np.loadtxt(
                rows, delimiter=delimiter, ndmin=2, comments=None, usecols=places
            )
        return values
    except ValueError:
        raise _row_error(source, piece, layout, places, gaps) from None


def _plain(line: str, delimiter: str | None, width: int, gaps: bool) -> str:
    """A row for NumPy; raises ValueError if it has another number of cells."""
    if '"' in line:
        line = line.replace('"', "")
    if delimiter != "," and "," in line:
        if _has_both_marks(line, delimiter):
            raise ValueError
        line = line.replace(",", ".")
    if delimiter is None:
        if len(line.split()) != width:
            raise ValueError
        return line
    for _ in range(line.count(delimiter) + 1 - width):
        line, _, last = line.rpartition(delimiter)
        if last.strip():
            raise ValueError
    if line.count(delimiter) + 1 != width:
        raise ValueError
    if gaps:
        return delimiter.join(cell if cell.strip() else "nan" for cell in line.split(delimiter))
    return line


def _has_both_marks(line: str, delimiter: str | None) -> bool:
    """Whether a row has points and commas in its numbers. A date also contains points, and is no number."""
    if "," not in line or "." not in line:
        return False
    cells = [cell for cell in line.split(delimiter) if "." in cell]
    return any(_is_number(cell.replace(".", "").replace(",", ".") if "," in cell else cell) for cell in cells)


def _row_error(
    source: Path, lines: Iterable[Numbered], layout: _Layout, places: Sequence[int], gaps: bool
) -> ValueError:
    width, delimiter = len(layout.names), layout.delimiter
    for number, line in lines:
        cells = _cells(line, delimiter, width)
        if len(cells) != width:
            return ValueError(
                f"{source}, line {number}: {len(cells)} columns, must be {width} as in the header"
            )
        if delimiter != "," and _has_both_marks(line, delimiter):
            return ValueError(
                f"{source}, line {number}: both `.` and `,` in it; one must be the decimal mark"
            )
        for place in places:
            if not _is_cell(cells[place], delimiter, gaps):
                shown = cells[place][:40]
                return ValueError(f"{source}, line {number}, column {place + 1}: `{shown}` is not a number")
    return ValueError(f"{source}: the numbers cannot be read")


def _lines(source: Path) -> Iterator[Numbered]:
    """The numbered lines that are neither empty nor a comment."""
    with opened(source) as file:
        number = 0
        while line := file.readline(_LONGEST + 1):
            number += 1
            if len(line) > _LONGEST:
                raise WrongFileError(f"{source}, line {number}: longer than {_LONGEST} characters")
            if number == 1:
                if line.startswith((b"\xff\xfe", b"\xfe\xff")):
                    raise WrongFileError(f"{source}: a text in UTF-16; save it as UTF-8")
                line = line.removeprefix(b"\xef\xbb\xbf")
            if b"\0" in line:
                raise WrongFileError(f"{source}, line {number}: not a text: it has zero bytes")
            try:
                words = line.decode()
            except UnicodeDecodeError:
                # The encoding of Windows programs, with `²` in one byte.
                try:
                    words = line.decode("cp1252")
                except UnicodeDecodeError:
                    raise WrongFileError(f"{source}, line {number}: not a text in UTF-8") from None
            if words.strip() and not words.lstrip().startswith("#"):
                yield number, words.rstrip("\r\n")


def _unquoted(cell: str) -> str:
    return cell.strip().strip('"').strip()


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    # As in `1_000`, which NumPy does not read.
    return "_" not in cell
