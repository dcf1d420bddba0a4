"""Reading of files from outside: ordinary files only, in bounded memory, with errors of one sentence."""

from __future__ import annotations

import json
import math
import os
import stat
import struct
import warnings
import zipfile
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

FREE = 64 * 1024**2
"""Memory in bytes that even a small file may use."""
LARGEST = 2 * 1024**3
"""Memory in bytes that no file may exceed, to protect against a wrong file."""
_RATIO = 100
"""Largest ratio of bytes in memory to bytes of the file. Compressed measurements hardly reach it."""
_SHOWN = 200
"""Largest number of characters of another library's message."""


class WrongFileError(ValueError):
    """An invalid file; the message is a sentence and names the file."""


class Budget:
    """The memory budget of one file; it is charged before memory is allocated."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._left = self.whole = min(LARGEST, FREE + _RATIO * ordinary_size(path))

    def take(self, size: int) -> None:
        """Charge `size` bytes for data that is kept."""
        self._left -= size
        if self._left < 0:
            declared = (self.whole - self._left) / 1024**2
            raise WrongFileError(
                f"{self._path}: declares {declared:.0f} MiB of numbers, "
                f"must be at most {self.whole / 1024**2:.0f} MiB for a file of this size"
            )


def ordinary_size(path: Path) -> int:
    """The size of an ordinary file in bytes; OSError for anything else, which is not opened."""
    return _checked(path, path.stat())


def _checked(path: Path, about: os.stat_result) -> int:
    if stat.S_ISDIR(about.st_mode):
        raise IsADirectoryError(21, "is a folder, must be a file", str(path))
    if not stat.S_ISREG(about.st_mode):
        raise OSError(22, "is a pipe or a device, must be an ordinary file", str(path))
    # They call themselves ordinary, but a read can wait or fail.
    if os.path.realpath(path).startswith(("/proc/", "/sys/")):
        raise OSError(22, "is a file of the kernel, must be an ordinary file", str(path))
    return about.st_size


def check_no_links(folder: Path) -> None:
    """Refuse a folder with symbolic links: writing and removing could affect other folders."""
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.is_symlink():
                raise WrongFileError(
                    f"{entry.path}: is a symbolic link, and the folder must hold its own files"
                )


def descriptor(path: Path, flags: int) -> int:
    """Open an ordinary file only; return its file descriptor."""
    # Without O_NONBLOCK the call waits for the other end of a pipe.
    number = os.open(path, flags | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0), 0o666)
    try:
        _checked(path, os.fstat(number))
    except OSError:
        os.close(number)
        raise
    return number


@contextmanager
def opened(path: Path) -> Iterator[BinaryIO]:
    """Open an ordinary file to read; a pipe or a device is refused at once."""
    with os.fdopen(descriptor(path, os.O_RDONLY), "rb") as file:
        yield file


def read_text(path: Path, largest: int, kind: str) -> str:
    """A text in UTF-8 of at most `largest` bytes; `kind` names the kind of file for the message."""
    with opened(path) as file:
        data = file.read(largest + 1)
    if len(data) > largest:
        raise WrongFileError(f"{path}: larger than {largest >> 20} MiB, which no {kind} is")
    try:
        # Some editors begin a file with a byte order mark.
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise WrongFileError(f"{path}: not a text file in UTF-8: byte {error.start + 1}") from None


@contextmanager
def understood(path: Path, wrong: str) -> Iterator[None]:
    """Replace any exception of a parser by one sentence: the path, `wrong`, and the reason.

    For a damaged file the libraries raise many kinds of exceptions, not only ValueError and OSError.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except (WrongFileError, ImportError):
        raise
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        if isinstance(error, KeyError):
            reason = f"has no {reason}"
        shown = reason if len(reason) <= _SHOWN else reason[:_SHOWN] + "…"
        raise WrongFileError(f"{path}: {wrong}: {shown}") from None


def read_json(path: Path, kind: str) -> Any:
    """Parse a JSON text, unless its structure would need much more memory than its characters."""
    text = read_text(path, FREE, kind)
    objects = 72 * (text.count("[") + text.count("{")) + 40 * text.count(",")
    if objects > FREE + 4 * len(text):
        raise WrongFileError(f"{path}: damaged: nothing but brackets and commas")
    with understood(path, "damaged"):
        return json.loads(text)


def read_arrays(file: BinaryIO, names: Collection[str]) -> dict[str, NDArray[Any]]:
    """Read arrays of a NumPy archive by name, if they exist, in memory bounded by the file's size."""
    size = os.fstat(file.fileno()).st_size
    if _directory_size(file, size) > 1024**2:
        raise ValueError("the directory of the archive is larger than 1 MiB")
    with zipfile.ZipFile(file) as archive:
        members = {name: member for member in archive.infolist() if (name := member.filename[:-4]) in names}
        declared = sum(member.file_size for member in members.values())
        allowed = max(size, min(LARGEST, FREE + _RATIO * size))
        if declared > allowed:
            raise ValueError(
                f"its arrays declare {declared >> 20} MiB, "
                f"must be at most {allowed >> 20} MiB for a file of this size"
            )
        return {name: _array(archive, name, member) for name, member in members.items()}


def _array(archive: zipfile.ZipFile, name: str, member: zipfile.ZipInfo) -> NDArray[Any]:
    with archive.open(member) as stream:
        version = np.lib.format.read_magic(stream)
        read = (
            np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        )
        shape, _, dtype = read(stream)
        # NumPy allocates the size that the header declares.
        declared = math.prod(shape) * dtype.itemsize
        if dtype.hasobject or declared != member.file_size - stream.tell() or min(shape, default=0) < 0:
            raise ValueError(f"{name} declares {declared} bytes of {dtype}, and has others")
    with archive.open(member) as stream:
        array: NDArray[Any] = np.lib.format.read_array(stream, allow_pickle=False)
        _check_text(name, array)
        return array


def _check_text(name: str, array: NDArray[Any]) -> None:
    """Refuse texts with numbers that are no characters; Python does not check them."""
    if array.dtype.kind == "U":
        codes = np.frombuffer(array.tobytes(), np.dtype(np.uint32).newbyteorder(array.dtype.byteorder))
        if np.any((codes > 0x10FFFF) | ((codes >= 0xD800) & (codes <= 0xDFFF))):
            raise ValueError(f"{name} is no text")


def _directory_size(file: BinaryIO, size: int) -> int:
    """Bytes of a ZIP archive's directory by its end record; `zipfile` makes an object of each entry."""
    length = min(size, 22 + 65535 + 76)
    file.seek(size - length)
    tail = file.read(length)
    file.seek(0)
    at = len(tail) - 22 if tail[-22:-18] == b"PK\5\6" and tail[-2:] == b"\0\0" else tail.rfind(b"PK\5\6")
    if at < 0 or len(tail) < at + 22:
        raise ValueError("no archive of arrays")
    if at >= 76 and tail[at - 20 : at - 16] == b"PK\6\7":
        return int(struct.unpack_from("<Q", tail, at - 36)[0])
    return int(struct.unpack_from("<L", tail, at + 12)[0])


def check_unpacked(about: Any, size: int) -> None:
    """Refuse a Parquet file whose pages unpack to far more than its rows need; `about` is its metadata.

    The metadata of single columns is not read, because Arrow ends the process if it is damaged.
    """
    declared = sum(about.row_group(place).total_byte_size for place in range(about.num_row_groups))
    if declared > FREE + 4 * size + 16 * about.num_rows * about.num_columns:
        raise ValueError(f"declares {declared >> 20} MiB for {about.num_rows} rows")
