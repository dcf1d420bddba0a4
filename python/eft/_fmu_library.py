"""The shared libraries of an FMU, by system and processor."""

from __future__ import annotations

import platform
import struct
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

from eft import _native

__all__ = ["Library", "libraries"]

FOLDER = Path(__file__).parent / "data" / "fmu"
"""Libraries for several systems, which a release's wheels hold."""


class Library(NamedTuple):
    """Place of a library in an FMU."""

    folders: tuple[str, str]
    """Names in FMI 2.0 and 3.0; FMI 2.0 has names for x86-64 only."""
    ending: str


PLATFORMS = {
    "x86_64-linux": Library(("linux64", "x86_64-linux"), "so"),
    "aarch64-linux": Library(("aarch64-linux", "aarch64-linux"), "so"),
    "x86_64-windows": Library(("win64", "x86_64-windows"), "dll"),
    "x86_64-darwin": Library(("darwin64", "x86_64-darwin"), "dylib"),
    "aarch64-darwin": Library(("aarch64-darwin", "aarch64-darwin"), "dylib"),
}

_DYNAMIC_SYMBOLS = 11  # SHT_DYNSYM
_UNDEFINED = 0  # SHN_UNDEF
_WEAK = 2 << 4  # STB_WEAK in the upper half of a symbol's type
_SECTION, _SEGMENT, _SYMBOL = "<IIQQQQIIQQ", "<IIQQQQQQ", "<IBBHQQ"


def libraries() -> list[tuple[Library, bytes]]:
    """Return this package's libraries and their places in an FMU.

    Raises
    ------
    ValueError
        On another system than Linux on x86-64 or aarch64, if the package was not installed from a wheel.
    """
    found = []
    for name, library in PLATFORMS.items():
        file = FOLDER / f"eft_fmu-{name}.{library.ending}"
        if file.is_file():
            found.append((library, file.read_bytes()))
        elif sys.platform == "linux" and name == f"{platform.machine()}-linux":
            found.append((library, own()))
    if not found:
        here = f"{sys.platform} on {platform.machine()}"
        allowed = "must be made on Linux on x86-64 or aarch64, or with the package of a release"
        raise ValueError(f"target = 'fmu': {allowed}; this is {here}")
    return found


@cache
def own() -> bytes:
    """Return the extension module as a library that importers without Python can load.

    It contains the functions of FMI and those of Python. Its references to Python become weak: the loader
    accepts unresolved ones as null. No function of FMI uses them.
    """
    return weakened(Path(_native.__file__).read_bytes())


def weakened(elf: bytes) -> bytes:
    """Make an ELF library's references to Python weak, and remove the data for debuggers."""
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
    # The sections are after the loaded part, and a loader does not need them.
    struct.pack_into("<Q", data, 40, 0)
    struct.pack_into("<HHH", data, 58, 0, 0, 0)
    return bytes(data[:end])
