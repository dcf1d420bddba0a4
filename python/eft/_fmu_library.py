"""The shared library of an FMU: the extension module, which an importer without Python can load."""

from __future__ import annotations

import platform
import struct
import sys
from functools import cache
from pathlib import Path

from eft import _native

__all__ = ["library"]

FOLDERS = {"x86_64": ("linux64", "x86_64-linux"), "aarch64": ("aarch64-linux", "aarch64-linux")}
"""Folders of a processor's library in an FMU, by FMI 2.0 and 3.0; the former has no name for aarch64."""

_DYNAMIC_SYMBOLS = 11  # SHT_DYNSYM
_UNDEFINED = 0  # SHN_UNDEF
_WEAK = 2 << 4  # STB_WEAK in the upper half of a symbol's type
_SECTION, _SEGMENT, _SYMBOL = "<IIQQQQIIQQ", "<IIQQQQQQ", "<IBBHQQ"


@cache
def library() -> tuple[bytes, tuple[str, str]]:
    """Return this package's library with weak references to Python, and its folders by version of FMI.

    The extension module holds the functions of FMI beside those of Python, which an importer need not have.
    A weak reference that nothing resolves is null, and the loader goes on; no function of FMI follows one.

    Raises
    ------
    ValueError
        On another system than Linux on x86-64 or aarch64.
    """
    machine = platform.machine()
    if sys.platform != "linux" or machine not in FOLDERS:
        here = f"{sys.platform} on {machine}"
        raise ValueError(f"target = 'fmu': must be made on Linux on x86-64 or aarch64, and this is {here}")
    return weakened(Path(_native.__file__).read_bytes()), FOLDERS[machine]


def weakened(elf: bytes) -> bytes:
    """Make an ELF library's references to Python weak, and leave out what only debuggers read."""
    data = bytearray(elf)
    (segments, sections) = struct.unpack_from("<QQ", data, 32)
    size, count = struct.unpack_from("<HH", data, 58)
    table = [struct.unpack_from(_SECTION, data, sections + size * i) for i in range(count)]
    for _, kind, _, _, offset, length, names, *_ in table:
        if kind != _DYNAMIC_SYMBOLS:
            continue
        for place in range(offset, offset + length, struct.calcsize(_SYMBOL)):
            name, info, _, section, *_ = struct.unpack_from(_SYMBOL, data, place)
            start = table[names][4] + name
            if section == _UNDEFINED and data[start : start + 3].lstrip(b"_").startswith(b"Py"):
                data[place + 4] = _WEAK | (info & 15)
    size, count = struct.unpack_from("<HH", data, 54)
    loaded = (struct.unpack_from(_SEGMENT, data, segments + size * i) for i in range(count))
    end = max(offset + length for _, _, offset, _, _, length, *_ in loaded)
    # The sections stand behind what is loaded, and a loader needs none.
    struct.pack_into("<Q", data, 40, 0)
    struct.pack_into("<HHH", data, 58, 0, 0, 0)
    return bytes(data[:end])
