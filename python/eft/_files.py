"""Atomic writing of files: after an interruption a file is either the old or the new one."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """A temporary name in the folder of `path`; renamed to `path` at the end, removed after an error.

    Raises
    ------
    OSError
        If `path` exists and is not an ordinary file, for example a device, which would be replaced. If the
        file cannot be written, for example on a full disk.
    """
    check_replaceable(path)
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
    except OSError as error:
        # The name of the temporary file would tell nobody anything.
        raise type(error)(error.errno, error.strerror, str(path)) from None
    os.close(handle)
    temporary = Path(name)
    try:
        try:
            yield temporary
        except OSError as error:
            # Of a full disk the error has no name.
            if error.filename is not None or error.errno is None:
                raise
            raise type(error)(error.errno, error.strerror, str(path)) from error
        # mkstemp allows access for the owner only; a report has the access rights of ordinary files.
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def check_replaceable(path: Path) -> None:
    """Refuse a target that exists and is not an ordinary file: a folder, a device, a pipe."""
    if path.is_dir():
        raise IsADirectoryError(21, "is a folder, must be a file", str(path))
    if path.exists() and not path.is_file():
        raise OSError(22, "is no ordinary file, and would be replaced by one", str(path))


def write_text(path: Path, text: str) -> None:
    """Write a text file under a temporary name and rename it."""
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file under a temporary name and rename it."""
    with atomic_write(path) as temporary:
        temporary.write_bytes(content)
