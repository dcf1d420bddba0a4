"""Columns of MAT, HDF5 and Parquet files. The memory budget allows all columns before one is read."""

from __future__ import annotations

import math
import mmap
import os
import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from eft._extras import need
from eft._foreign import FREE, Budget, WrongFileError, check_unpacked, opened, ordinary_size, understood
from eft.traces._traces import Column

Array = NDArray[np.float64]

_CHUNK = FREE // 2
"""Bytes of the largest HDF5 chunk; the library holds a chunk both compressed and decompressed."""
_DEFLATE = 1032
"""Largest ratio of decompression of deflate."""
_MATRIX, _COMPRESSED, _NUMERIC = 14, 15, range(6, 16)
"""Types of elements and classes of numeric arrays in MAT files."""
_DATA_TYPES = {1, 2, 3, 4, 5, 6, 7, 9, 12, 13}
"""Types of numbers in MAT files. SciPy does not check them and ends the process at others."""
_COMPLEX = 0x0800
"""Flag of a complex array, whose second element of numbers is not checked."""
_PIECE, _PIECES = 16384, 8
"""Bytes decompressed at a time here, and the multiple of it that SciPy decompresses at once."""
_HEAP, _HEADER = b"GCOL\1\0\0\0", 16
"""Beginning of a heap of texts in HDF5 files, and bytes of its header and of each object's."""
_SEARCHED = 1 << 20
"""Bytes searched for heaps at a time."""
_NUMBERS = {
    "double",
    "single",
    "logical",
    *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)),
}


@contextmanager
def mat(source: Path) -> Iterator[list[Column]]:
    """The vectors of a MAT file."""
    need("scipy")
    from scipy.io import loadmat, whosmat

    wrong = "not a MAT file that can be read"
    with opened(source) as file:
        if file.read(10) == b"MATLAB 7.3":
            with hdf5(source) as columns:
                yield columns
            return
        budget = Budget(source)
        with understood(source, wrong):
            # A read of a mapped file needs no more memory than the file has bytes.
            mapped = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        with mapped:
            with understood(source, wrong):
                unpacked, complexes = _scanned(mapped, budget)
                found = [
                    (name, math.prod(shape))
                    for name, shape, kind in whosmat(mapped, appendmat=False)
                    if kind in _NUMBERS and _is_vector(shape) and name not in complexes
                ]
                largest = max((size for _, size in found), default=0)
                if unpacked > FREE + 16 * largest:
                    raise ValueError(f"an array of at most {largest} numbers unpacks to {unpacked} bytes")

            def read(name: str) -> Array:
                with understood(source, wrong):
                    mapped.seek(0)
                    stored = loadmat(mapped, appendmat=False, squeeze_me=True, variable_names=[name])[name]
                    if stored.dtype.kind not in "fiub":
                        raise ValueError(f"`{name}` is of {stored.dtype}, must be real numbers")
                    return np.asarray(stored, dtype=np.float64)

            yield [
                Column(name, None, partial(read, name), partial(budget.take, 8 * size))
                for name, size in _commonest(source, found)
            ]


def _scanned(mapped: mmap.mmap, budget: Budget) -> tuple[int, set[str | None]]:
    """Bytes of the largest compressed numeric array, and the names of complex ones.

    Refuses arrays that need much memory in SciPy, or at which it ends the process.
    """
    complexes: set[str | None] = set()
    order = "<" if mapped[126:128] == b"IM" else ">"
    at, largest = 128, 0
    while at + 8 <= len(mapped):
        kind, length = struct.unpack_from(f"{order}LL", mapped, at)
        begin, at = at + 8, at + 8 + length
        if kind == _MATRIX:
            complexes.add(_complex_name(mapped[begin : min(begin + _PIECE, at)], order))
        if kind != _COMPRESSED:
            continue
        inflate, size, block, numeric = zlib.decompressobj(), 0, 0, True
        for number, start in enumerate(range(begin, min(at, len(mapped)), _PIECE)):
            piece = inflate.decompress(mapped[start : min(start + _PIECE, at)])
            if number == 0:
                flags = piece[16:20].ljust(4)
                numeric = struct.unpack(f"{order}L", flags)[0] & 0xFF in _NUMERIC
                complexes.add(_complex_name(piece[8:], order))
            size, block = size + len(piece), len(piece) + (block if number % _PIECES else 0)
            if block > FREE // 2 or size > budget.whole:
                raise ValueError(f"an array unpacks from {start + _PIECE - begin} bytes to {size}")
            if not numeric and number == _PIECES:
                break  # the rest is not decompressed
        largest = max(largest, size if numeric else 0)
    return largest, complexes


def _complex_name(matrix: bytes, order: str) -> str | None:
    """The name of a complex array; refuses a numeric array whose numbers are of no known type."""

    def word(at: int) -> int:
        # Lengths of a damaged file can lie far behind its end.
        return int(struct.unpack(f"{order}L", matrix[at : at + 4].ljust(4, b"\0"))[0])

    flags = word(8)
    if flags & 0xFF not in _NUMERIC:
        return None
    at, name = 16, b""
    for _ in ("size", "name"):
        kind, length = word(at), word(at + 4)
        # An element of at most four bytes has its length in the upper half of its type.
        begin, length = (at + 4, kind >> 16) if kind >> 16 else (at + 8, length)
        name, at = matrix[begin : begin + length], at + 8 + (0 if kind >> 16 else (length + 7) // 8 * 8)
    kind = word(at) & 0xFFFF
    if kind not in _DATA_TYPES:
        raise ValueError(f"an array has numbers of type {kind}")
    return name.decode("latin-1") if flags & _COMPLEX else None


@contextmanager
def hdf5(source: Path) -> Iterator[list[Column]]:
    """The vectors of all groups of an HDF5 file, with the attribute ``units``."""
    need("h5py")
    import h5py

    wrong = "not an HDF5 file that can be read"
    budget = Budget(source)
    found: dict[str, Any] = {}

    def visit(path: str, item: object) -> None:
        numeric = isinstance(item, h5py.Dataset) and item.dtype.kind in "fiu" and _is_vector(item.shape)
        if numeric and not path.startswith("#"):
            name = path.rsplit("/", 1)[-1]
            if name in found:
                raise WrongFileError(f"{source}: two data sets are called `{name}`")
            found[name] = item

    def read(item: Any) -> Array:
        with understood(source, wrong):
            _check_storage(item)
            values = np.empty(item.shape)
            item.read_direct(values)
            return values.reshape(-1)

    def unit(item: Any) -> str | None:
        for name in ("units", "unit"):
            if name in item.attrs and item.attrs.get_id(name).get_storage_size() <= 1024:
                value = item.attrs[name]
                return value.decode() if isinstance(value, bytes) else str(value)
        return None

    with understood(source, wrong):
        file = h5py.File(source, "r")
    with file:
        with understood(source, wrong):
            _check_heaps(source, file.id.get_create_plist().get_sizes()[1])
            file.visititems(visit)
            chosen = _commonest(source, [(name, item.size) for name, item in found.items()])
            columns = [
                Column(name, unit(found[name]), partial(read, found[name]), partial(budget.take, 8 * size))
                for name, size in chosen
            ]
        yield columns


def _check_heaps(source: Path, length: int) -> None:
    """Refuse a heap of texts with an object that takes no space, because the library would not end there.

    `length` is the number of bytes of a size in this file.
    """
    with opened(source) as file:
        whole = os.fstat(file.fileno()).st_size
        for heap in _heaps(file):
            at, end = heap + _HEADER, min(heap + _size(file, heap, length), whole)
            while at + _HEADER <= end:
                # Object 0 is the free space, whose size includes the header.
                size, free = _size(file, at, length), _word(file, at, 2) == 0
                taken = (size if free else _HEADER + (size + 7) // 8 * 8) % 256**length
                if taken < _HEADER:
                    raise ValueError(f"an object of a heap takes {taken} bytes")
                at += taken


def _heaps(file: BinaryIO) -> Iterator[int]:
    """Where heaps begin. The file is read in pieces, because a mapped file counts as memory."""
    at = 0
    while len(piece := os.pread(file.fileno(), _SEARCHED, at)) >= len(_HEAP):
        found = piece.find(_HEAP)
        while found >= 0:
            yield at + found
            found = piece.find(_HEAP, found + 1)
        at += len(piece) - len(_HEAP) + 1


def _size(file: BinaryIO, at: int, length: int) -> int:
    return _word(file, at + 8, length)


def _word(file: BinaryIO, at: int, length: int) -> int:
    return int.from_bytes(os.pread(file.fileno(), length, at), "little")


def _check_storage(item: Any) -> None:
    """Refuse a data set in other files, and chunks that are large before or after decompression."""
    settings = item.id.get_create_plist()
    if item.is_virtual or settings.get_external_count():
        raise ValueError(f"`{item.name}` keeps its numbers in other files")
    if item.chunks is None:
        return
    size = math.prod(item.chunks) * item.dtype.itemsize
    if size > _CHUNK:
        raise ValueError(f"`{item.name}` has chunks of {size >> 20} MiB, must be at most {_CHUNK >> 20} MiB")
    filters = [settings.get_filter(place)[0] for place in range(settings.get_nfilters())]
    shuffle, fletcher, deflate = 2, 3, 1
    if len(packing := [number for number in filters if number not in (shuffle, fletcher)]) > 1:
        raise ValueError(f"`{item.name}` is compressed more than once")
    stored: list[Any] = []
    item.id.chunk_iter(stored.append)
    for chunk in stored:
        if chunk.size > size + 4096:
            raise ValueError(f"`{item.name}` has a chunk that is larger packed than unpacked")
        if packing == [deflate] and chunk.size * _DEFLATE > FREE:
            mask, packed = item.id.read_direct_chunk(chunk.chunk_offset)
            if not mask and len(zlib.decompressobj().decompress(packed, size + 1)) > size:
                raise ValueError(f"`{item.name}` has a chunk that unpacks to more than {size} bytes")


@contextmanager
def parquet(source: Path) -> Iterator[list[Column]]:
    """The columns of numbers of a Parquet file, with the units that `TestRun.to_pandas` gave them."""
    need("pyarrow")
    import pyarrow as pa
    import pyarrow.parquet

    wrong = "not a Parquet file that can be read"
    budget = Budget(source)

    def read(name: str) -> Array:
        rows = file.metadata.num_rows
        with understood(source, wrong):
            values, at = np.empty(rows), 0
            for batch in file.iter_batches(65536, columns=[name]):
                if batch.num_columns != 1:
                    raise ValueError(f"two columns are called `{name}`")
                values[at : at + batch.num_rows] = batch.column(0).to_numpy(zero_copy_only=False)
                at += batch.num_rows
            if at != rows:
                raise ValueError(f"{at} rows, must be {rows}")
            return values

    with understood(source, wrong):
        file = pyarrow.parquet.ParquetFile(source, memory_map=True)
    with file:
        with understood(source, wrong):
            numeric = (pa.types.is_integer, pa.types.is_floating)
            names = [f.name for f in file.schema_arrow if any(is_kind(f.type) for is_kind in numeric)]
            units = _units_of(file.schema_arrow.pandas_metadata)
            check_unpacked(file.metadata, ordinary_size(source))
            take = partial(budget.take, 8 * file.metadata.num_rows)
        yield [Column(name, units.get(name), partial(read, name), take) for name in names]


def _units_of(about: Any) -> dict[str, str]:
    """The attribute ``units`` of a data frame, from what pandas notes of it in a file."""
    for name in ("attributes", "units"):
        about = about.get(name) if isinstance(about, dict) else None
    units = about if isinstance(about, dict) else {}
    return {name: unit for name, unit in units.items() if isinstance(unit, str)}


def _is_vector(shape: tuple[int, ...]) -> bool:
    return sum(extent != 1 for extent in shape) == 1


def _commonest(source: Path, found: list[tuple[str, int]]) -> list[tuple[str, int]]:
    """The vectors of the most frequent length, because a file may contain other arrays."""
    if not found:
        raise WrongFileError(f"{source}: no one-dimensional arrays of numbers in it")
    sizes = [size for _, size in found]
    common = max(set(sizes), key=sizes.count)
    return [(name, size) for name, size in found if size == common]
