"""Make the page of the virtual rig: the module, packed into one HTML file. `make explore` calls it."""

from __future__ import annotations

import base64
import gzip
import sys
from pathlib import Path

import zopfli.gzip

LARGEST = 300_000
"""Bytes that the page may take on its way, compressed as servers do."""


def without_names(module: bytes) -> bytes:
    """The module without its custom sections, which hold names for debuggers."""
    kept, at = bytearray(module[:8]), 8
    while at < len(module):
        size, shift, end = 0, 0, at + 1
        while True:
            byte = module[end]
            size |= (byte & 0x7F) << shift
            shift, end = shift + 7, end + 1
            if byte < 0x80:
                break
        if module[at] != 0:
            kept += module[at : end + size]
        at = end + size
    return bytes(kept)


def main(module: Path, page: Path) -> None:
    """Write `page` from the template in this folder."""
    # A browser unpacks it as any other; a twentieth smaller than by `gzip`.
    small = zopfli.gzip.compress(without_names(module.read_bytes()))
    packed = base64.b64encode(small).decode("ascii")
    template = (Path(__file__).parent / "explore.html").read_text(encoding="utf-8")
    text = template.replace("@MODULE@", packed)
    size = len(gzip.compress(text.encode("utf-8"), 9))
    if size > LARGEST:
        raise SystemExit(f"{page}: {size} bytes compressed, must be at most {LARGEST}")
    page.parent.mkdir(parents=True, exist_ok=True)
    new = page.with_suffix(".new")
    new.write_text(text, encoding="utf-8")
    new.replace(page)
    print(f"{page}: {size} bytes compressed")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
