"""Storage of a study's rows: memory, or a folder of Parquet files that stays valid after a kill."""

from __future__ import annotations

import contextlib
import json
import os
import re
import reprlib
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, Protocol

from eft import _foreign as foreign
from eft._extras import need
from eft._files import atomic_write, write_text
from eft._run import TestRun
from eft._study._arrow import arrow_array
from eft._study._checked import checked_about, read_part
from eft._study._plan import FORMAT, configuration_hash
from eft._study._rows import Column, Outcome, Row

ABOUT = "_study.json"
"""Readers of folders of Parquet files ignore names that begin with `_`."""
_TRACES = "_traces"
_LOCK = "_lock"
_PART = re.compile(r"part-([0-9]{6,9})\.parquet")

Columns = dict[str, list[Any]]


class Store(Protocol):
    """Stores chunks and returns them."""

    def numbers(self) -> Sequence[int]:
        """Which chunks are there, in their order."""

    def put(self, number: int, outcomes: Sequence[Outcome]) -> None:
        """Keep a chunk."""

    def read(self, number: int, names: Sequence[str] | None = None) -> Columns:
        """A chunk by columns."""

    def run(self, index: int) -> TestRun:
        """The traces of a test."""


class Memory:
    """Rows in memory, column by column."""

    def __init__(self, table: Sequence[Column]) -> None:
        self._names = [column.name for column in table]
        self._chunks: dict[int, Columns] = {}
        self._runs: dict[int, TestRun] = {}

    def numbers(self) -> Sequence[int]:
        """Which chunks are there, in their order."""
        return sorted(self._chunks)

    def put(self, number: int, outcomes: Sequence[Outcome]) -> None:
        """Keep a chunk."""
        self._chunks[number] = by_column([outcome.row for outcome in outcomes], self._names)
        self._runs |= {outcome.row["index"]: outcome.run for outcome in outcomes if outcome.run is not None}

    def read(self, number: int, names: Sequence[str] | None = None) -> Columns:
        """A chunk by columns."""
        chunk = self._chunks[number]
        return chunk if names is None else {name: chunk[name] for name in names}

    def run(self, index: int) -> TestRun:
        """The traces of a test."""
        return self._runs[index]


class Folder:
    """One Parquet file per chunk, written under a temporary name and renamed."""

    def __init__(self, path: Path) -> None:
        # Imported here, so that a missing package is reported before the first test.
        need("pyarrow", "study")
        import pyarrow.parquet

        self.path = path
        self._parquet = pyarrow.parquet
        self._schema: Any = None

    @classmethod
    def open(cls, path: Path) -> tuple[Folder, dict[str, Any]]:
        """The folder of a study, and its description."""
        folder = cls(path)
        about = folder._about() if path.is_dir() else None
        if about is None:
            raise ValueError(f"{path}: not a study: there is no {ABOUT} in it")
        folder._take(about)
        return folder, about

    def begin(self, description: Mapping[str, Any], table: Sequence[Column], chunk: int) -> int:
        """Begin in an empty folder, or resume the study in it; returns the size of its chunks.

        Raises
        ------
        ValueError
            If it holds another study; the message says what differs.
        """
        about = self._about()
        if about is None:
            about = {
                "format": FORMAT,
                "configuration": configuration_hash(description),
                "chunk": chunk,
                "study": description,
                "columns": [column._asdict() for column in table],
            }
            write_text(self.path / ABOUT, json.dumps(about, indent=1, ensure_ascii=False) + "\n")
        elif differences := list(_differences(about["study"], json.loads(json.dumps(description)))):
            shown = "; ".join(differences[:5]) + ("; and more" if len(differences) > 5 else "")
            raise ValueError(f"{self.path}: holds another study and cannot be resumed with this one: {shown}")
        self._take(about)
        self._sweep()
        return int(about["chunk"])

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Make the folder and lock it against other processes until this process ends.

        Raises
        ------
        ValueError
            If it contains anything other than a study.
        """
        if self.path.exists() and not self.path.is_dir():
            raise NotADirectoryError(20, "is a file, must be a folder or nothing yet", str(self.path))
        self.path.mkdir(exist_ok=True)
        self._check_own()
        others = {entry.name for entry in self.path.iterdir()} - {_LOCK}
        if others and ABOUT not in others and not all(name.startswith("._study-") for name in others):
            raise ValueError(f"{self.path}: holds other files: must be a study, empty, or not there yet")
        no_links = getattr(os, "O_NOFOLLOW", 0)
        lock = foreign.descriptor(self.path / _LOCK, os.O_RDWR | os.O_CREAT | no_links)
        with os.fdopen(lock, "r+b") as file:
            try:
                _lock(file)
            except (BlockingIOError, PermissionError):
                raise ValueError(f"{self.path}: another process is at work on this study") from None
            except OSError:
                pass  # Without locks of the file system two processes repeat work, but do no damage.
            yield

    def numbers(self) -> Sequence[int]:
        """Which chunks are there, in their order."""
        found = (_PART.fullmatch(part.name) for part in self.path.glob("part-*.parquet"))
        return sorted(
            number for name in found if name and (number := int(name[1])) * self._chunk < self._tests
        )

    def complete(self) -> Sequence[int]:
        """Chunks without failed tests, which need no second attempt."""
        return [n for n in self.numbers() if "failed" not in self.read(n, ["status"])["status"]]

    def put(self, number: int, outcomes: Sequence[Outcome]) -> None:
        """Keep a chunk."""
        need("pyarrow", "study")
        import pyarrow as pa

        # The traces are written first, so that an existing part is complete.
        for outcome in outcomes:
            if outcome.run is not None:
                (self.path / _TRACES).mkdir(exist_ok=True)
                outcome.run.save(self._trace(outcome.row["index"]))
        columns = by_column([outcome.row for outcome in outcomes], self._schema.names)
        arrays = [arrow_array(columns[field.name], field.type) for field in self._schema]
        table = pa.Table.from_arrays(arrays, schema=self._schema)
        with atomic_write(self._part(number)) as temporary:
            self._parquet.write_table(table, temporary, compression="zstd")

    def read(self, number: int, names: Sequence[str] | None = None) -> Columns:
        """A chunk by columns."""
        start = number * self._chunk
        tests = range(start, min(start + self._chunk, self._tests))
        return read_part(self._part(number), self._schema, tests, names)

    def run(self, index: int) -> TestRun:
        """The traces of a test."""
        return TestRun.load(self._trace(index))

    def _take(self, about: Mapping[str, Any]) -> None:
        self._schema = _schema([Column(**column) for column in about["columns"]], about)
        self._chunk, self._tests = about["chunk"], about["study"]["tests"]

    def _check_own(self) -> None:
        for folder in (self.path, self.path / _TRACES):
            if folder.is_dir():
                foreign.check_no_links(folder)

    def _part(self, number: int) -> Path:
        return self.path / f"part-{number:06d}.parquet"

    def _trace(self, index: int) -> Path:
        return self.path / _TRACES / f"{index:08d}.eft"

    def _about(self) -> dict[str, Any] | None:
        self._check_own()
        file = self.path / ABOUT
        if not file.exists():
            return None
        return checked_about(file, foreign.read_json(file, "description of a study"))

    def _sweep(self) -> None:
        """Remove the incomplete files of a killed process; the lock ensures that no other process runs."""
        patterns = (".part-*.parquet", "._study-*.json", f"{_TRACES}/.*.eft")
        for leftover in [file for pattern in patterns for file in self.path.glob(pattern)]:
            with contextlib.suppress(FileNotFoundError):
                leftover.unlink()


def _lock(file: IO[bytes]) -> None:
    """Lock a file until it is closed; OSError if another process has locked it, or if there are no locks."""
    if sys.platform == "win32":
        import msvcrt

        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
    else:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def by_column(rows: Sequence[Row], names: Sequence[str]) -> Columns:
    """Columns with these names from rows."""
    return {name: [row[name] for row in rows] for name in names}


def _schema(table: Sequence[Column], about: Mapping[str, Any]) -> Any:
    need("pyarrow", "study")
    import pyarrow as pa

    types = {
        "int": pa.int64(), "flags": pa.uint32(), "float": pa.float64(), "bool": pa.bool_(),
        "str": pa.string(), "list": pa.list_(pa.float64()),
    }  # fmt: skip
    study = about["study"]
    metadata = {
        "eft.format": str(FORMAT),
        "eft.version": study["version"],
        "eft.configuration": about["configuration"],
        "eft.seed": str(study["parameters"].get("seed", "")),
        "eft.rig": json.dumps(study["rig"], ensure_ascii=False),
    }
    return pa.schema(
        [
            pa.field(column.name, types[column.type], metadata={"unit": column.unit, "doc": column.doc})
            for column in table
        ],
        metadata=metadata,
    )


def _differences(there: Any, here: Any, name: str = "") -> Iterator[str]:
    """The differences of two descriptions by dotted names."""
    if isinstance(there, dict) and isinstance(here, dict):
        for key in [*there, *(key for key in here if key not in there)]:
            below = f"{name}.{key}" if name else key
            if key not in here or key not in there:
                where = "there" if key in there else "here"
                yield f"{below} is only {where}"
            else:
                yield from _differences(there[key], here[key], below)
    elif there != here:
        yield f"{name} is {reprlib.repr(there)} there, {reprlib.repr(here)} here"
