"""Reads signals from files of measurements, and from saved runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from os import PathLike
from pathlib import Path

from eft._foreign import LARGEST, ordinary_size
from eft._native import Rig
from eft._run import TestRun
from eft.traces import _binary, _tdms, _text, _uff
from eft.traces._traces import Column, Traces
from eft.traces._units import parse_header


def read_traces(
    path: str | PathLike[str],
    *,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    sample_rate: float | None = None,
    gaps: bool = False,
    rig: Rig | None = None,
) -> Traces:
    r"""Read the signals of a test and convert them to SI units.

    The suffix selects the format: ``.csv``, ``.txt``, ``.tsv``, ``.dat``, ``.asc``, ``.lvm`` (text); ``.mat``
    (SciPy, from 7.3 on h5py); ``.h5``, ``.hdf5`` (h5py); ``.parquet`` (pyarrow); ``.tdms`` (npTDMS);
    ``.uff``, ``.unv`` (dataset 58, pyuff). Any other file must be a run that `TestRun.save` wrote.

    The name of a column states its quantity, and the unit follows the name: ``force (kip)``, ``force_kip``,
    ``force, kip``, ``force / kip`` or ``force in kip``.
    The unit may also be in a line below the names. An HDF5 dataset has it in its attribute ``units``, a TDMS
    channel in its property ``unit_string``. A column without a unit is refused unless `units` names one.
    Text may be separated by tabs, semicolons, commas or blanks, have decimal commas, and begin with a
    preamble as MTS and LabVIEW write it.

    Parameters
    ----------
    path : path-like
        The file.
    columns : mapping, optional
        Header of the column with a quantity, if its name is not recognised.
    units : mapping, optional
        Unit of a quantity, if the file does not state it.
    sample_rate : float, optional
        In Hz, for a file without a time column.
    rig : Rig, optional
        Its ``servovalve.spool_sensitivity`` and ``spool_stroke`` convert a spool opening in V.
    gaps : bool
        Whether samples may be missing, as NaN or, in a CSV, an empty cell; they become NaN.

    Returns
    -------
    Traces
        The signals by quantity.

    Raises
    ------
    OSError
        If the file cannot be read, or is a pipe or a device.
    ValueError
        If the file is invalid; the message names the place and the allowed values.

    Examples
    --------
    >>> import tempfile
    >>> import eft
    >>> from eft.traces import read_traces
    >>> with tempfile.NamedTemporaryFile("w", suffix=".csv") as file:
    ...     _ = file.write("time (s),force (kip)\n0,0\n0.5,1\n1,2\n")
    ...     file.flush()
    ...     measured = read_traces(file.name)
    >>> measured.sample_rate, [round(force) for force in measured["force"]]
    (2.0, [0, 4448, 8896])
    """
    source = Path(path)
    size = ordinary_size(source)
    if size > LARGEST:
        raise ValueError(f"{source}: {size / 1024**3:.1f} GiB, must be at most {LARGEST / 1024**3:g} GiB")
    reader = _READERS.get(source.suffix.lower())
    if reader is None:
        return Traces.from_run(TestRun.load(source), str(source))
    columns = columns or {}
    with reader(source) if reader is not _text.text else _text.text(source, _wanted(columns), gaps) as raw:
        return Traces.from_columns(
            str(source), raw, columns=columns, units=units or {}, sample_rate=sample_rate, gaps=gaps, rig=rig
        )


def _wanted(columns: Mapping[str, str]) -> Callable[[Sequence[str]], list[int]]:
    """The columns that hold a known quantity, or that the caller names."""
    chosen = set(columns.values())

    def places(headers: Sequence[str]) -> list[int]:
        return [i for i, header in enumerate(headers) if header in chosen or parse_header(header)[0]]

    return places


_READERS: dict[str, Callable[..., AbstractContextManager[list[Column]]]] = {
    **dict.fromkeys((".csv", ".txt", ".tsv", ".dat", ".asc", ".lvm"), _text.text),
    ".mat": _binary.mat,
    ".h5": _binary.hdf5,
    ".hdf5": _binary.hdf5,
    ".parquet": _binary.parquet,
    ".tdms": _tdms.tdms,
    **dict.fromkeys((".uff", ".unv", ".uf"), _uff.uff),
}
MEASURED = frozenset(_READERS)
"""Suffixes of files of measurements."""
