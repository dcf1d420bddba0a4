"""A test as a file: a NumPy archive of its traces, with the rig as TOML among them."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from eft._files import beside
from eft._native import Rig

if TYPE_CHECKING:
    from eft._run import TestRun

_FORMAT = 1


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
    with path.open("rb") as file:
        try:
            opened = np.load(file, allow_pickle=False)
            if not isinstance(opened, np.lib.npyio.NpzFile):
                raise ValueError("a single array")
            with opened as archive:
                stored = {name: archive[name] for name in archive.files}
                return _fields(stored, [*traces, *(name for name in optional if name in stored)])
        except (
            ValueError,
            KeyError,
            EOFError,
            MemoryError,
            zipfile.BadZipFile,
            NotImplementedError,
        ) as error:
            reason = f"has no {error}" if isinstance(error, KeyError) else str(error)
            if "pickle" in reason:
                reason = "no archive of arrays"  # NumPy's guess is advice that nobody should follow
            raise ValueError(f"{path}: not a test saved by eft: {reason}") from None


def _fields(stored: dict[str, NDArray[Any]], traces: Sequence[str]) -> dict[str, Any]:
    if (version := int(stored["format"])) > _FORMAT:
        raise ValueError(f"format {version} is later than {_FORMAT}, the latest this version of eft reads")
    shape = stored["command"].shape
    rig = Rig(str(stored["rig"]))
    # A file of before there was any: what an estimator found is lost.
    unknown = np.nan if rig["compensation.adaptive"] else 1.0
    stored.setdefault("valve_gain_estimate", np.broadcast_to(unknown, shape))
    for name in traces:
        wanted = np.uint32 if name == "status" else np.float64
        if stored[name].dtype != wanted or stored[name].shape != shape or not shape:
            raise ValueError(f"{name} is {stored[name].dtype} of shape {stored[name].shape}")
    dtype = str(stored["dtype"])
    if dtype not in ("f32", "f64"):
        raise ValueError(f"dtype is {dtype!r}")
    # A file of before there were any has the table's.
    table = np.asarray(rig["servovalve.flow_table.flows"])
    found = stored.get("found_flows", np.broadcast_to(table, (*shape[:-1], table.size)))
    if found.dtype != np.float64 or found.shape not in ((*shape[:-1], table.size), (0,)):
        raise ValueError(f"found_flows is {found.dtype} of shape {found.shape}")
    return {
        "rig": rig,
        "found_flows": found if found.size else None,
        "sample_rate": float(stored["sample_rate"]),
        "dtype": dtype,
        "version": str(stored["version"]),
        **{name: stored[name] for name in traces},
    }
