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
    """Return the traces as a data frame; see `TestRun.to_pandas`."""
    need("pandas")
    import pandas as pd

    index = pd.Index(run.time, name="time")
    if run.command.ndim > 1:
        columns = {
            (name, number): trace
            for name in run._traces
            for number, trace in enumerate(getattr(run, name), start=1)
        }
        return pd.DataFrame(columns, index=index).rename_axis(columns=["signal", "actuator"])
    return pd.DataFrame({name: getattr(run, name) for name in run._traces}, index=index)


def to_xarray(run: TestRun) -> xr.Dataset:
    """Return the traces as a dataset; see `TestRun.to_xarray`."""
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
    """Return force under command; see `TestRun.to_control`."""
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
