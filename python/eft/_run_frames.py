"""A test as a data frame, and as a response of python-control."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from eft._extras import need

if TYPE_CHECKING:
    import pandas as pd

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
        return pd.DataFrame(columns, index=index, copy=False).rename_axis(columns=["signal", "actuator"])
    return pd.DataFrame({name: getattr(run, name) for name in run._traces}, index=index, copy=False)


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
