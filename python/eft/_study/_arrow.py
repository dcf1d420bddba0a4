"""Columns of Arrow from lists."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Sequence
from itertools import accumulate
from typing import Any

import numpy as np

from eft._extras import need


def arrow_array(values: Sequence[Any], kind: Any) -> Any:
    """An Arrow array of a type of a study's columns; None is null, and NaN is a number.

    `pyarrow.array` imports pandas where it is installed, which takes longer than a short study.
    """
    need("pyarrow", "study")
    import pyarrow as pa

    known = [value for value in values if value is not None]
    nulls = len(values) - len(known)
    valid = _bits(value is not None for value in values) if nulls else None
    children = None
    buffers: list[Any]
    if pa.types.is_list(kind):
        buffers = [_ends(0 if value is None else len(value) for value in values)]
        children = [arrow_array([number for value in known for number in value], kind.value_type)]
    elif kind == pa.string():
        texts = [b"" if value is None else value.encode() for value in values]
        buffers = [_ends(map(len, texts)), b"".join(texts)]
    elif kind == pa.bool_():
        buffers = [_bits(values)]
    else:
        code = {pa.int64(): "q", pa.uint32(): "I", pa.float64(): "d"}[kind]
        buffers = [array(code, (0 if value is None else value for value in values))]
    held = [None if buffer is None else pa.py_buffer(buffer) for buffer in (valid, *buffers)]
    return pa.Array.from_buffers(kind, len(values), held, nulls, children=children)


def _bits(flags: Iterable[Any]) -> bytes:
    return np.packbits(np.fromiter(flags, bool), bitorder="little").tobytes()


def _ends(lengths: Iterable[int]) -> array[int]:
    """Where each value begins among those of all, and where the last one ends."""
    return array("i", accumulate(lengths, initial=0))
