"""A test as a data frame, as a dataset of xarray, and as a response of python-control."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from eft._extras import need
from eft._status import Status
from eft._table import TRACES

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from eft._run import TestRun


def to_pandas(run: TestRun) -> pd.DataFrame:
    """Return a copy of the traces as a data frame indexed by time in s (needs pandas).

    For several actuators the columns have two levels, the signal and the actuator counted from 1. The
    attribute ``units`` of the frame has the unit of each signal. ``to_parquet`` keeps it for
    `eft.traces.read_traces`.

    Returns
    -------
    pandas.DataFrame

    Raises
    ------
    ModuleNotFoundError
        If pandas is not installed.

    Examples
    --------
    >>> import eft
    >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 5.0, 4.0, 1024.0))
    >>> run.to_pandas()["force"].size
    4096
    """
    need("pandas")
    import pandas as pd

    index = pd.Index(run.time, name="time")
    if run.command.ndim > 1:
        columns = {
            (name, number): trace
            for name in run._traces
            for number, trace in enumerate(getattr(run, name), start=1)
        }
        frame = pd.DataFrame(columns, index=index).rename_axis(columns=["signal", "actuator"])
    else:
        frame = pd.DataFrame({name: getattr(run, name) for name in run._traces}, index=index)
    units = {name: _about(name).get("units", "1") for name in run._traces}
    frame.attrs["units"] = {"time": "s", **units}
    return frame


def to_xarray(run: TestRun) -> xr.Dataset:
    """Return a copy of the traces as a dataset over ``time`` in s (needs xarray).

    Each trace has the attributes ``units`` and ``long_name``. For several actuators the first dimension
    is ``actuator``, counted from 1. The dataset's attributes are rig (as TOML), version, sample rate,
    dtype, seed and date. Those of record, scale, mass and `stopped` follow if the run has them.

    Returns
    -------
    xarray.Dataset

    Raises
    ------
    ModuleNotFoundError
        If xarray is not installed.

    Examples
    --------
    >>> import eft
    >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 5.0, 4.0, 1024.0))
    >>> run.to_xarray()["load_pressure"].attrs
    {'units': 'Pa', 'long_name': 'Load pressure'}
    """
    need("xarray")
    import xarray as xr

    coordinates: dict[str, Any] = {"time": ("time", run.time.copy(), {"units": "s", "long_name": "Time"})}
    dimensions = ["time"]
    if run.command.ndim > 1:
        dimensions = ["actuator", "time"]
        numbers = np.arange(1, run.command.shape[0] + 1)
        coordinates["actuator"] = ("actuator", numbers, {"long_name": "Actuator, from the ground"})
    variables = {name: (dimensions, getattr(run, name).copy(), _about(name)) for name in run._traces}
    # An attribute of a file cannot be None.
    told = {
        "record": run.record or None,
        "scale": run.scale,
        "mass": run.mass,
        "stopped": run.stopped or None,
    }
    origin = {
        "rig": run.rig.to_toml(),
        "version": run.version,
        "sample_rate": run.sample_rate,
        "dtype": run.dtype,
        "seed": run.seed,
        "date": run.date,
        **{name: value for name, value in told.items() if value is not None},
    }
    return xr.Dataset(variables, coordinates, origin)


def _about(name: str) -> dict[str, Any]:
    """Attributes of a trace by the conventions for climate and forecast data, which xarray's tools know."""
    if name in TRACES:
        return {"units": TRACES[name].unit or "1", "long_name": TRACES[name].doc}
    flags = {(flag.name or "").lower(): int(flag) for flag in Status}
    masks = np.array(list(flags.values()), dtype=np.uint32)
    return {"long_name": "Status flags", "flag_masks": masks, "flag_meanings": " ".join(flags)}


def to_control(run: TestRun) -> Any:
    """Return force (output) under command (input) as a python-control ``TimeResponseData``.

    Returns
    -------
    control.TimeResponseData

    Raises
    ------
    ModuleNotFoundError
        If python-control is not installed.

    Examples
    --------
    >>> import eft
    >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 5.0, 4.0, 1024.0))
    >>> run.to_control().output_labels
    ['force']
    """
    need("control")
    import control

    numbers = [""] if run.command.ndim == 1 else [f"_{n + 1}" for n in range(run.command.shape[0])]
    return control.TimeResponseData(
        run.time,
        run.force,
        inputs=run.command,
        issiso=run.command.ndim == 1,
        output_labels=[f"force{number}" for number in numbers],
        input_labels=[f"command{number}" for number in numbers],
        title="effective force test",
    )
