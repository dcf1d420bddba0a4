"""Writes the signals of a test for other programs: CSV, HDF5, Parquet, MAT, TDMS."""

from __future__ import annotations

import io
from collections.abc import Callable
from os import PathLike
from pathlib import Path

import numpy as np

from eft._extras import need
from eft._files import atomic_write, check_replaceable
from eft._run import TestRun
from eft.traces._tdms import write_tdms
from eft.traces._traces import Traces
from eft.traces._units import si_unit


def write_run(run: TestRun, path: str | PathLike[str]) -> Path:
    """Write a run in the format that the suffix names.

    ``.csv``, ``.h5`` or ``.hdf5`` (needs h5py), ``.parquet`` (needs pandas and pyarrow), ``.mat`` (needs
    SciPy; names such as ``force_N`` and ``velocity_mps``), ``.tdms`` (needs npTDMS); ``.eft`` and ``.npz`` as
    `TestRun.save`. Only the last two keep the whole run. The file is written under another name and then
    renamed.

    Parameters
    ----------
    run : TestRun
        The run.
    path : path-like
        The file.

    Returns
    -------
    pathlib.Path
        The file.

    Raises
    ------
    OSError
        If the file cannot be written.
    ValueError
        If the suffix is not one of these, or if a run of several actuators is to have one of another program.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eft
    >>> from eft.traces import write_run
    >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 4.0, 1.0, 512.0))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     written = write_run(run, pathlib.Path(folder) / "run.csv")
    ...     written.read_text().splitlines()[0][:8]
    'time (s)'
    """
    target = Path(path)
    check_output(target, building=run.command.ndim > 1)
    if (write := _WRITERS[target.suffix.lower()]) is None:
        return run.save(target)
    with atomic_write(target) as temporary:
        write(run, temporary)
    return target


def check_output(path: Path, *, building: bool = False) -> None:
    """Raise before the work the errors that would occur after it.

    Raises
    ------
    ValueError
        If the suffix is not allowed, for the test of a building or at all.
    OSError
        If the folder does not exist.
    """
    if path.suffix.lower() not in _WRITERS:
        suffixes = ", ".join(_WRITERS)
        raise ValueError(f"{path}: cannot write `{path.suffix}`; the suffix must be one of {suffixes}")
    if building and foreign_suffix(path):
        raise ValueError(
            f"{path}: `{path.suffix}` has one actuator; the suffix for a building must be .eft or .npz, and "
            "`eft.traces.write_run(run.actuator(i), path)` writes floor i"
        )
    check_folder(path)


def foreign_suffix(path: Path) -> bool:
    """Whether the suffix names a format other than the run file."""
    return _WRITERS.get(path.suffix.lower()) is not None


def check_folder(path: Path) -> None:
    """Refuse a target whose folder does not exist, or that a file cannot replace."""
    if not path.parent.is_dir():
        raise FileNotFoundError(2, "no such folder", str(path.parent))
    check_replaceable(path)


def _columns(run: TestRun) -> dict[str, np.ndarray]:
    traces = Traces.from_run(run)
    return {"time": traces.time, **traces.columns}


def _csv(run: TestRun, path: Path) -> None:
    columns = _columns(run)
    header = ",".join(f"{name} ({si_unit(name)})" for name in columns)
    # Nine digits are more than any sensor has, and enough for f32.
    np.savetxt(path, np.column_stack(list(columns.values())), "%.9g", ",", header=header, comments="")


def _parquet(run: TestRun, path: Path) -> None:
    need("pandas")
    import pandas as pd

    columns = {f"{name} ({si_unit(name)})": values for name, values in _columns(run).items()}
    pd.DataFrame(columns).to_parquet(path, index=False)


def _hdf5(run: TestRun, path: Path) -> None:
    need("h5py")
    import h5py

    # In memory, because a file that cannot be written makes the library of HDF5 end the process.
    content = io.BytesIO()
    with h5py.File(content, "w") as file:
        for name, values in _columns(run).items():
            file.create_dataset(name, data=values, compression="gzip").attrs["units"] = si_unit(name)
        file.create_dataset("status", data=run.status, compression="gzip")
        file.attrs.update(
            rig=run.rig.to_toml(), version=run.version, dtype=run.dtype, sample_rate=run.sample_rate
        )
    path.write_bytes(content.getbuffer())


def _mat(run: TestRun, path: Path) -> None:
    need("scipy")
    from scipy.io import savemat

    columns = {f"{name}{_SUFFIXES[si_unit(name)]}": values for name, values in _columns(run).items()}
    savemat(path, columns, do_compression=True, oned_as="column")


_SUFFIXES = {"1": "", "m/s": "_mps", "m/s2": "_mps2", "m3/s": "_m3ps"} | {
    unit: f"_{unit}" for unit in ("s", "N", "m", "Pa", "V")
}
"""Suffix of a variable's name for each unit, because a name cannot contain a slash."""


def _tdms(run: TestRun, path: Path) -> None:
    columns = {name: (si_unit(name), values) for name, values in Traces.from_run(run).columns.items()}
    write_tdms(columns, run.sample_rate, path)


_WRITERS: dict[str, Callable[[TestRun, Path], None] | None] = {
    ".eft": None,
    ".npz": None,
    ".csv": _csv,
    ".h5": _hdf5,
    ".hdf5": _hdf5,
    ".parquet": _parquet,
    ".mat": _mat,
    ".tdms": _tdms,
}
