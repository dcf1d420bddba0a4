"""A test as a file: a compressed NumPy archive of its traces, with the rig as TOML among them.

Format 2. Each member is a NumPy array in its own format (``.npy``), deflated; `numpy.load` reads it:

- ``format``: 2;
- ``version``: of the library that ran the test;
- ``rig``: the rig as TOML;
- ``seed``: of the sensors' noise;
- ``dtype``: precision of the controller, ``f64`` or ``f32``;
- ``sample_rate``: Hz;
- ``about``: JSON with ``date`` (ISO 8601), ``record`` (its name), ``scale``, ``mass`` (kg), ``energy`` (J by
  name, or null where it is unknown), ``whole`` (whether it is a whole test), ``stopped`` (why an external
  structure ended it), ``interrupted`` (whether Ctrl-C did), ``outside`` (whether there was a structure),
  ``controlled`` (whether an external controller replaced the rig's), ``calibrations`` (of each actuator, or
  null), ``floor`` (number of the actuator in a building, or null), ``units`` (of each trace) and ``absent``
  (traces that the version knew and the rig has not);
- ``found_flows``: m³/s, empty if unknown;
- ``status``: bits of `eft.Status`, one word per sample;
- each trace: one value per sample, with the shape (actuators, samples) for several actuators; a single number
  if it is constant; the name of another trace if it has the same values.

Format 1 is not compressed, has no ``about``, and repeats every trace.

A trace of this version that is neither in ``units`` nor in ``absent`` was not recorded by the version that
wrote the file. A trace of ``units`` without an array is damage.
"""

from __future__ import annotations

import json
import sys
import zipfile
from collections.abc import Mapping
from dataclasses import asdict
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from eft import _foreign as foreign
from eft._energy import EnergyBalance
from eft._files import atomic_write
from eft._floors import floor_mass
from eft._native import Command, Rig
from eft._sections import calibration_of, plain
from eft._table import OPTIONAL, TRACES

if TYPE_CHECKING:
    from eft._run import TestRun

_FORMAT = 2
_TOLD = {"format": "i", "version": "U", "rig": "U", "dtype": "U", "sample_rate": "f"}
"""Fields that describe a run, and their types."""
_FINITE = ("command", "force", "displacement", "velocity", "spool", "load_pressure", "valve_command")
"""Traces of the plant, which must be finite; a sensor may report NaN."""
_FIRST = (
    *("command", "force", "displacement", "velocity", "spool", "load_pressure", "valve_command"),
    *("compensation", "supply_pressure", "measured_force", "measured_displacement", "measured_velocity"),
    *("measured_spool", "measured_supply_pressure", "flow_gain_estimate", "response_delay_estimate", "level"),
)
"""Traces that every version recorded, and all that is sure of format 1, which has no table of them."""
_LEVEL = 1
"""Level of compression; the highest level takes five times as long and saves a twentieth."""


def save(run: TestRun, path: str | PathLike[str]) -> Path:
    """Write the test to a compressed NumPy archive, from which `load` restores the same bits.

    The file contains the rig as TOML, the version, the seed, the precision, the date and the units. It
    also contains the `energy`, and name, scale and mass of a ground motion. It is written under another
    name and then renamed, so `path` is never incomplete. One floor of a building is saved without the others,
    so its displacement error and drift are unknown after `load`.

    Parameters
    ----------
    path : path-like
        The file. A suffix of another format, such as ``.csv`` or ``.mat``, is refused; `eft.traces.write_run`
        writes those.

    Returns
    -------
    pathlib.Path
        `path` without an added suffix.

    Raises
    ------
    OSError
        If the file cannot be written.
    ValueError
        If the suffix is that of another format.

    Examples
    --------
    >>> import eft
    >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 5.0, 4.0, 1024.0))
    >>> run.save("run.eft").name
    'run.eft'
    """
    target, values = Path(path), run._values
    _check_suffix(target)
    about = {
        "date": run.date,
        "record": run.record,
        "scale": run.scale,
        "mass": None if run.mass is None else np.asarray(run.mass).tolist(),
        "energy": None if run.energy is None else asdict(run.energy),
        "whole": run._whole,
        "stopped": run.stopped,
        "interrupted": run.interrupted,
        "outside": run._outside,
        "controlled": run._controlled,
        "calibrations": plain(run._calibrations),
        "floor": run._floor,
        "units": {name: TRACES[name].unit for name in values},
        "absent": [name for name in TRACES if name not in values and name not in run._unrecorded],
    }
    arrays: dict[str, Any] = {
        "format": np.int64(_FORMAT),
        "version": run.version,
        "rig": run.rig.to_toml(),
        "seed": np.int64(run.seed),
        "dtype": run.dtype,
        "sample_rate": np.float64(run.sample_rate),
        "about": json.dumps(about),
        # An archive cannot store None.
        "found_flows": np.empty(0) if run.found_flows is None else run.found_flows,
        **{name: _kept(name, values) for name in values},
        "status": run.status,
    }
    with (
        atomic_write(target) as temporary,
        zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED, compresslevel=_LEVEL) as archive,
    ):
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.asanyarray(array), allow_pickle=False)
    return target


def _check_suffix(path: Path) -> None:
    """Refuse a name that promises another format to the program that opens the file."""
    from eft.traces._write import foreign_suffix

    if foreign_suffix(path):
        raise ValueError(
            f"{path}: `save` writes a run file, not `{path.suffix}`; use `eft.traces.write_run(run, path)`, "
            "or the suffix `.eft`"
        )


def _kept(name: str, values: Mapping[str, NDArray[Any]]) -> Any:
    """The stored form of a trace: the name of an equal trace, a number if it is constant, or its samples."""
    other, trace = TRACES[name].otherwise, values[name]
    if values.get(other) is trace:
        return other
    return trace.flat[0] if trace.size and not any(trace.strides) else trace


def read(path: Path) -> dict[str, Any]:
    """Every field of a run from a file of `save`; ValueError for another file."""
    with foreign.opened(path) as file, foreign.understood(path, "not a test saved by eft"):
        return _fields(foreign.read_arrays(file, {*_TOLD, "about", "found_flows", *TRACES, "status"}))


def _fields(stored: dict[str, NDArray[Any]]) -> dict[str, Any]:
    told = {name: _told(name, stored[name], kind) for name, kind in _TOLD.items()}
    if told["format"] > _FORMAT:
        raise ValueError(
            f"format {told['format']} is later than {_FORMAT}, the latest this version of eft reads"
        )
    shape = stored["command"].shape
    if len(shape) not in (1, 2) or 0 in shape:
        raise ValueError(f"command is {stored['command'].dtype} of shape {shape}")
    rig = Rig(told["rig"])
    about = (
        _about(_told("about", stored["about"], "U"), shape) if told["format"] > 1 else dict(_ABOUT_FORMAT_1)
    )
    floor = about.get("_floor")
    if floor is not None and (type(floor) is not int or floor not in range(np.size(floor_mass(rig)))):
        raise ValueError(f"floor is {floor!r}")
    recorded, absent = {*_FIRST, *about.pop("units")}, about.pop("absent")
    values: dict[str, Any] = {}
    unrecorded = []
    for name in TRACES:
        if name in stored or name in recorded:
            values[name] = _trace(name, stored[name], values, shape)
        elif name not in absent:
            unrecorded.append(name)
    for name in _FINITE:
        # Checked without another array of the trace's size.
        if not (np.isfinite(values[name].min()) and np.isfinite(values[name].max())):
            raise ValueError(f"{name} has samples that are not finite")
    status = stored["status"]
    if status.dtype != np.uint32 or status.shape != shape:
        raise ValueError(f"status is {status.dtype} of shape {status.shape}")
    Command([0.0], told["sample_rate"])  # raises for an invalid rate
    if told["dtype"] not in ("f32", "f64"):
        raise ValueError(f"dtype is {told['dtype']!r}")
    # An older file without this field has the table's flows.
    table = np.asarray(rig["servovalve.flow_table.flows"])
    found = stored.get("found_flows", np.broadcast_to(table, (*shape[:-1], table.size)))
    if found.dtype != np.float64 or found.shape not in ((*shape[:-1], table.size), (0,)):
        raise ValueError(f"found_flows is {found.dtype} of shape {found.shape}")
    return {
        "rig": rig,
        "sample_rate": told["sample_rate"],
        "dtype": told["dtype"],
        "version": told["version"],
        "_values": values,
        "_unrecorded": frozenset(unrecorded),
        "status": status,
        "found_flows": found if found.size else None,
        **about,
    }


def _trace(name: str, stored: NDArray[Any], values: Mapping[str, Any], shape: tuple[int, ...]) -> Any:
    other = TRACES[name].otherwise
    if stored.dtype.kind == "U" and not stored.shape and stored.item() == other and other in values:
        return values[other]
    if stored.dtype != np.float64 or stored.shape not in (shape, ()):
        raise ValueError(f"{name} is {stored.dtype} of shape {stored.shape}")
    return stored if stored.shape else np.broadcast_to(stored, shape)


_ABOUT_FORMAT_1: dict[str, Any] = {"_whole": False, "units": (), "absent": OPTIONAL}
"""The origin of a run of format 1, which may be a part of a test."""


def _about(text: str, shape: tuple[int, ...]) -> dict[str, Any]:
    """The origin of a run, and its tables of traces."""
    about = json.loads(text)
    energy, mass, scale = about["energy"], about["mass"], about["scale"]
    # Older files have no "stopped".
    for name in ("date", "record", "stopped"):
        if not isinstance(about.setdefault(name, ""), str):
            raise ValueError(f"{name} is {about[name]!r}")
    if scale is not None:
        if not _is_number(scale):
            raise ValueError(f"scale is {scale!r}")
        scale = float(scale)
    if mass is not None:
        if not all(_is_number(one) and one > 0.0 for one in (mass if isinstance(mass, list) else [mass])):
            raise ValueError(f"mass is {mass!r}")
        mass = np.asarray(mass, dtype=np.float64)
        if mass.shape not in ((), shape[:-1]):
            raise ValueError(f"mass is of shape {mass.shape}")
    # Older files do not say which traces the rig has not.
    tables = {"units": list(about["units"]), "absent": about.get("absent", list(OPTIONAL))}
    for name, table in tables.items():
        if not isinstance(table, list) or not all(isinstance(one, str) for one in table):
            raise ValueError(f"{name} is {about[name]!r}")
    calibrations = about.get("calibrations", [None] * (shape[0] if len(shape) > 1 else 1))
    return {
        "date": about["date"],
        "record": about["record"],
        "scale": scale,
        "mass": float(mass) if mass is not None and not mass.shape else mass,
        "_energy": None
        if energy is None
        else EnergyBalance(**{name: float(x) for name, x in energy.items()}),
        "_whole": about["whole"] is True,
        "stopped": about["stopped"],
        "interrupted": about.get("interrupted") is True,
        "_outside": about.get("outside") is True,
        "_controlled": about.get("controlled") is True,
        # Older files have none.
        "_calibrations": tuple(map(calibration_of, calibrations)),
        "_floor": about.get("floor"),
        **tables,
    }


def _is_number(value: Any) -> bool:
    """Whether a value of JSON is a finite number, which a truth value or a text is not."""
    return type(value) in (int, float) and abs(value) <= sys.float_info.max


def _told(name: str, value: NDArray[Any], kind: str) -> Any:
    """One field that describes a run, of its type; a text is at most as long as a rig."""
    if value.shape or value.dtype.kind not in kind or value.dtype.itemsize > 4 * 1024**2:
        raise ValueError(f"{name} is {value.dtype} of shape {value.shape}")
    return value.item()
