"""Functions of universal files, dataset 58: signals over time."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from eft._foreign import WrongFileError, opened, understood
from eft.traces._traces import Column
from eft.traces._units import quantity_of

LARGEST_UFF = 8 * 1024**2
"""Bytes of the largest file, because pyuff needs several times the memory of the file."""

_WRONG = "not a universal file that can be read"
_FUNCTION, _OVER_TIME, _REAL = 58, (0, 1), (2, 4)
"""The dataset, its function types that are signals, and its types of real numbers."""


@contextmanager
def uff(source: Path) -> Iterator[list[Column]]:
    """The signals of a universal file, named by the label of the ordinate or the first line of text."""
    import pyuff

    _check(source)
    with understood(source, _WRONG):
        file = pyuff.UFF(str(source))
        places = [place for place, kind in enumerate(file.get_set_types()) if kind == _FUNCTION]
        sets = [file.read_sets(place) for place in places]
        signals = [one for one in sets if one["func_type"] in _OVER_TIME and one["ord_data_type"] in _REAL]
        if not signals:
            raise WrongFileError(f"{source}: no signals over time, dataset 58, in it")
        columns = [Column("time", "s", lambda: np.array(signals[0]["x"], dtype=np.float64))]
        for one in signals:
            if len(one["data"]) != one["num_pts"] or not np.array_equal(one["x"], signals[0]["x"]):
                raise ValueError("the signals differ in length or in time, or end too early")
            columns.append(_column(one))
    yield columns


def _column(one: dict[str, Any]) -> Column:
    labels = [str(one[key]).strip() for key in ("ordinate_axis_lab", "id1", "id2")]
    name = next((label for label in labels if quantity_of(label)), labels[1])
    unit = str(one["ordinate_axis_units_lab"]).strip()
    known = unit if unit and unit.upper() != "NONE" else None
    return Column(name, known, lambda: np.array(one["data"], dtype=np.float64))


def _check(source: Path) -> None:
    """Refuse a file for which pyuff would need much memory: a large one, or one with short lines."""
    with opened(source) as file:
        data = file.read(LARGEST_UFF + 1)
    if len(data) > LARGEST_UFF:
        raise WrongFileError(f"{source}: larger than {LARGEST_UFF >> 20} MiB, the limit for universal files")
    ends = data.count(b"\n") + data.count(b"\r")
    if ends > 1000 + len(data) // 20:
        raise WrongFileError(f"{source}: {_WRONG}: {ends} lines in {len(data)} bytes")
