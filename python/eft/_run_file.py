"""A test as a file: a NumPy archive of its traces, with the rig as TOML among them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from eft import _foreign as foreign
from eft._files import beside
from eft._native import Command, Rig

if TYPE_CHECKING:
    from eft._run import TestRun

_FORMAT = 1
_TOLD = {"format": "i", "version": "U", "rig": "U", "dtype": "U", "sample_rate": "f"}
"""What a run says of itself, and the kind of each."""
_FINITE = ("command", "force", "displacement", "velocity", "spool", "load_pressure", "valve_command")
"""Traces of the plant, which ends where it diverges; a sensor may well report NaN."""


def write(run: TestRun, traces: Sequence[str], path: Path) -> Path:
    """Write a run with its traces, by the names of the fields; returns the path."""
    about: dict[str, Any] = {
        "format": np.int64(_FORMAT),
        "version": np.array(run.version),
        "rig": np.array(run.rig.to_toml()),
        "seed": np.int64(run.seed),
        "dtype": np.array(run.dtype),
        "sample_rate": np.float64(run.sample_rate),
        # An archive knows no None.
        "found_flows": np.empty(0) if run.found_flows is None else run.found_flows,
    }
    with beside(path) as temporary, temporary.open("wb") as file:
        np.savez(file, allow_pickle=False, **about, **{name: getattr(run, name) for name in traces})
    return path


def read(path: Path, traces: Sequence[str], optional: Sequence[str]) -> dict[str, Any]:
    """Every field of a run that `write` wrote; ValueError where the file is something else."""
    with foreign.opened(path) as file, foreign.understood(path, "not a test saved by eft"):
        stored = foreign.read_arrays(file, {*_TOLD, "found_flows", *traces, *optional})
        return _fields(stored, [*traces, *(name for name in optional if name in stored)])


def _fields(stored: dict[str, NDArray[Any]], traces: Sequence[str]) -> dict[str, Any]:
    told = {name: _told(name, stored[name]) for name in _TOLD}
    if told["format"] > _FORMAT:
        raise ValueError(
            f"format {told['format']} is later than {_FORMAT}, the latest this version of eft reads"
        )
    shape = stored["command"].shape
    rig = Rig(told["rig"])
    # A file of before there was any: what an estimator found is lost.
    unknown = np.nan if rig["compensation.adaptive"] else 1.0
    stored.setdefault("valve_gain_estimate", np.broadcast_to(unknown, shape))
    for name in traces:
        wanted = np.uint32 if name == "status" else np.float64
        if (
            stored[name].dtype != wanted
            or stored[name].shape != shape
            or len(shape) not in (1, 2)
            or 0 in shape
        ):
            raise ValueError(f"{name} is {stored[name].dtype} of shape {stored[name].shape}")
    for name in _FINITE:
        # Without an array as large as the trace.
        if not (np.isfinite(stored[name].min()) and np.isfinite(stored[name].max())):
            raise ValueError(f"{name} has samples that are not finite")
    Command([0.0], told["sample_rate"])  # refuses a rate that no test has
    if told["dtype"] not in ("f32", "f64"):
        raise ValueError(f"dtype is {told['dtype']!r}")
    # A file of before there were any has the table's.
    table = np.asarray(rig["servovalve.flow_table.flows"])
    found = stored.get("found_flows", np.broadcast_to(table, (*shape[:-1], table.size)))
    if found.dtype != np.float64 or found.shape not in ((*shape[:-1], table.size), (0,)):
        raise ValueError(f"found_flows is {found.dtype} of shape {found.shape}")
    return {
        "rig": rig,
        "found_flows": found if found.size else None,
        "sample_rate": told["sample_rate"],
        "dtype": told["dtype"],
        "version": told["version"],
        **{name: stored[name] for name in traces},
    }


def _told(name: str, value: NDArray[Any]) -> Any:
    """What a run says of itself: one value of its kind, a text no longer than a rig."""
    if value.shape or value.dtype.kind not in _TOLD[name] or value.dtype.itemsize > 4 * 1024**2:
        raise ValueError(f"{name} is {value.dtype} of shape {value.shape}")
    return value.item()
