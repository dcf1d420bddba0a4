"""Channels of TDMS files, as LabVIEW writes them, and a run as such a file."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eft._extras import need
from eft._foreign import Budget, WrongFileError, opened, ordinary_size, understood
from eft.traces._traces import Column
from eft.traces._units import quantity_of

Array = NDArray[np.float64]

_WRONG = "not a TDMS file that can be read"
_LARGEST_INDEX = 200_000
"""Largest number of segments and objects of a file, because each needs memory."""


@contextmanager
def _quiet() -> Iterator[None]:
    """Without the messages of npTDMS on the terminal, which can contain kilobytes of a damaged file."""
    from nptdms.log import log_manager

    terminal = log_manager.console_handler
    level = terminal.level
    terminal.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        terminal.setLevel(level)


@contextmanager
def tdms(source: Path) -> Iterator[list[Column]]:
    """The numeric channels of all groups of a TDMS file; ``unit_string`` is the unit."""
    need("nptdms")
    from nptdms import TdmsFile

    budget = Budget(source)
    size = ordinary_size(source)
    with _quiet(), opened(source) as raw:
        with understood(source, _WRONG):
            _check_segments(raw, size)
            raw.seek(0)
            file = TdmsFile.open(raw)
            truncated = file.file_status.incomplete_final_segment
        if truncated:
            raise WrongFileError(f"{source}: its last segment is incomplete, and samples may be missing")
        with understood(source, _WRONG):
            found: dict[str, Any] = {}
            for group in file.groups():
                for channel in group.channels():
                    if channel.dtype is None or np.dtype(channel.dtype).kind not in "fiu" or not len(channel):
                        continue
                    if len(channel) * np.dtype(channel.dtype).itemsize > size:
                        raise ValueError(f"`{channel.name}` declares {len(channel)} values")
                    if channel.name in found:
                        raise WrongFileError(f"{source}: two channels are called `{channel.name}`")
                    found[channel.name] = channel
            if not found:
                raise WrongFileError(f"{source}: no channels of numbers in it")
            columns = [
                Column(
                    name,
                    _text(channel.properties.get("unit_string")),
                    partial(_read, source, channel),
                    partial(budget.take, 8 * len(channel)),
                )
                for name, channel in found.items()
            ]
            columns += _clock(source, found)
        yield columns


def _read(source: Path, channel: Any) -> Array:
    with understood(source, _WRONG):
        values = np.array(channel[:], dtype=np.float64)
        if values.shape != (len(channel),):
            raise ValueError(f"`{channel.name}` has values of shape {values.shape}")
        return values


def _clock(source: Path, found: Mapping[str, Any]) -> list[Column]:
    """The time of a waveform, if no channel has it."""
    if any(quantity_of(name.partition("(")[0]) == "time" for name in found):
        return []
    about = {
        (channel.properties.get("wf_start_offset", 0.0), channel.properties.get("wf_increment"), len(channel))
        for channel in found.values()
    }
    if len(about) != 1:
        raise WrongFileError(f"{source}: the channels differ in length, start or step; must be one waveform")
    start, step, count = about.pop()
    if step is None:
        return []
    return [Column("time", "s", lambda: float(start) + float(step) * np.arange(count, dtype=np.float64))]


def _text(unit: object) -> str | None:
    return unit.strip() or None if isinstance(unit, str) else None


def _check_segments(raw: Any, size: int) -> None:
    """Refuse a file with so many segments that their index would need much memory."""
    at = segments = 0
    while at + 28 <= size:
        raw.seek(at)
        lead = raw.read(28)
        if lead[:4] != b"TDSm":
            return  # npTDMS reports the error
        length = int.from_bytes(lead[12:20], "little")
        metadata = int.from_bytes(lead[20:28], "little")
        segments += 1 + metadata // 20
        if segments > _LARGEST_INDEX:
            raise ValueError(f"an index of more than {_LARGEST_INDEX} entries")
        if length >= size:
            return
        at += 28 + length


def write_tdms(columns: Mapping[str, tuple[str, Array]], sample_rate: float, path: Path) -> None:
    """Write columns, each with its unit, as the waveforms of one group."""
    need("nptdms")
    from nptdms import ChannelObject, RootObject, TdmsWriter

    step = 1.0 / sample_rate
    with TdmsWriter(str(path)) as writer:
        root = RootObject(properties={"sample_rate": sample_rate})
        channels = [
            ChannelObject(
                "test", name, values,
                properties={"unit_string": unit, "wf_increment": step, "wf_start_offset": 0.0},
            )
            for name, (unit, values) in columns.items()
        ]  # fmt: skip
        writer.write_segment([root, *channels])
