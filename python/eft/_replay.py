"""The learner's estimates from a recorded test."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt

from eft import _native
from eft._measured_force import check_force
from eft._measured_motion import motion_factor
from eft._native import FlowTable, Rig
from eft._read_only import ReadOnly
from eft._run import TestRun
from eft._sections import Calibration, calibration_of

if TYPE_CHECKING:
    import pandas

    from eft.traces import Traces

__all__ = ["Replay", "replay"]

_NEEDED = ("command", "velocity", "force", "spool", "valve_command")

_LARGEST_FORCE = 30.0
"""Largest rms of the force over that of its command. An unstable test has much more force."""

_MOTION = {"velocity": 2.0, "spool": 50.0}
"""Largest factor between the displacement and that by another signal. The flow also varies with the load."""


@dataclass(frozen=True, eq=False)
class Replay(ReadOnly):
    """The learner's estimates from a recorded test, one value per window of ticks."""

    time: npt.NDArray[np.float64]
    """Time since the start at which the window closed, s."""
    flow_gain_estimate: npt.NDArray[np.float64]
    """True flow over the flow table's."""
    response_delay_estimate: npt.NDArray[np.float64]
    """Delay of the spool by its sensor, s."""
    velocity_delay_estimate: npt.NDArray[np.float64]
    """Delay of the velocity after the spool by their sensors, s."""
    valve_gain_estimate: npt.NDArray[np.float64]
    """The spool's gain over the configured one."""
    null_offset_estimate: npt.NDArray[np.float64]
    """Commanded opening at which the valve passes nothing at no load."""
    flow_gain_deviation: npt.NDArray[np.float64]
    """Standard deviation of the flow gain by noise and model errors; infinite where nothing was learned."""
    response_delay_deviation: npt.NDArray[np.float64]
    """The same of the response delay, s."""
    velocity_delay_deviation: npt.NDArray[np.float64]
    """The same of the velocity's delay, s."""
    valve_gain_deviation: npt.NDArray[np.float64]
    """The same of the spool's gain."""
    null_offset_deviation: npt.NDArray[np.float64]
    """The same of the null offset."""
    level: npt.NDArray[np.float64]
    """The guard's factor on the compensation level."""
    test_ratio: npt.NDArray[np.float64]
    """Unexplained part of the measurements over the allowed part; above 1 nothing is learned."""
    status: npt.NDArray[np.uint32]
    """Bits of `eft.Status` about the learning."""
    found_flows: npt.NDArray[np.float64]
    """Flow found at each opening of the rig's flow table by the end, m³/s."""
    calibration: Calibration | None
    """Result of the learning; None if nothing was learned."""

    def __repr__(self) -> str:
        return f"<eft.Replay: {self.time.size} windows to {self.time[-1]:.6g} s>"

    def to_pandas(self) -> pandas.DataFrame:
        """Return the windows as a data frame with the time as its index.

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
        >>> rig = eft.Rig.zhao2005()
        >>> run = eft.simulate(rig, eft.sine_sweep(2000.0, 0.5, 5.0, 4.0, 1024.0))
        >>> eft.replay(rig, run).to_pandas().index.name
        'time'
        """
        import pandas

        names = [
            "flow_gain_estimate",
            "response_delay_estimate",
            "velocity_delay_estimate",
            "valve_gain_estimate",
            "null_offset_estimate",
            "flow_gain_deviation",
            "response_delay_deviation",
            "velocity_delay_deviation",
            "valve_gain_deviation",
            "null_offset_deviation",
            "level",
            "test_ratio",
        ]
        columns = {name: getattr(self, name) for name in [*names, "status"]}
        return pandas.DataFrame(columns, index=pandas.Index(self.time, name="time"))


def replay(
    rig: Rig,
    test: TestRun | Traces | str | PathLike[str],
    *,
    dtype: Literal["f64", "f32"] = "f64",
) -> Replay:
    """Run a rig's learner on a recorded test and return its estimates.

    The learner is that of the controller. The rig and the recorded test may have self-calibration off. The
    estimates do not change the recorded signals.

    Parameters
    ----------
    rig : Rig
        The rig as configured in the controller.
    test : TestRun, Traces, str or os.PathLike
        A run, or a file for `eft.traces.read_traces`, with command (N), velocity (m/s), force (N), spool
        opening and valve command (V). With a compensation signal (V) the valve command is that after the
        tick, as in a run. Without it, it is that sampled with the others. ``compensation.supply_correction``
        also needs the supply pressure (Pa). An estimated velocity needs the displacement (m). The readings of
        sensors are used if the run has them.
    dtype : {"f64", "f32"}
        The precision of the arithmetic.

    Returns
    -------
    Replay
        Estimates, test ratio and flags, one per window.

    Raises
    ------
    ValueError
        If a signal is missing, if the force has another sign or unit than its command, if the displacement is
        not that of the velocity at these times (without a velocity, of the spool's flow), or if the learner
        refuses the rig.

    Examples
    --------
    >>> import eft
    >>> rig = eft.Rig.zhao2005()
    >>> truth = rig.replace({"servovalve.flow_gain_scale": 0.95})
    >>> run = eft.simulate(truth, eft.sine_sweep(4000.0, 0.5, 4.0, 8.0, 4096.0))
    >>> f"{eft.replay(rig, run).flow_gain_estimate[-1]:.2f}"
    '0.95'
    """
    from eft.traces import Traces, read_traces

    _native.check_rig(rig)
    if isinstance(test, TestRun):
        if test._building is not None and isinstance(each := rig["calibration"], list):
            rig = rig.replace({"calibration": each[test._building[1]]})
        test = Traces.from_run(test)
    elif not isinstance(test, Traces):
        test = read_traces(test)
    names = [*_NEEDED]
    if rig["compensation.supply_correction"]:
        names.append("supply_pressure")
    if rig["controller.velocity_source"] != "sensor":
        names = [name for name in names if name != "velocity"] + ["displacement"]
    if rig["controller.velocity_source"] == "accelerometer":
        names.append("acceleration")
    signals = {}
    for name in names:
        reported = f"measured_{name}"
        signals[name] = test[reported if reported in test.columns else name]
    check_force(signals["command"], signals["force"], _LARGEST_FORCE)
    _check_motion(rig, test, signals)
    if "compensation" in test.columns:
        signals["valve_command"] = _before_the_tick(rig, test)
    signals["next_command"] = np.append(signals["command"][1:], signals["command"][-1:])
    found = _native.replay(rig, signals, test.sample_rate, dtype)
    return Replay(**found | {"calibration": calibration_of(found["calibration"])})


def _check_motion(rig: Rig, test: Traces, signals: dict[str, npt.NDArray[np.float64]]) -> None:
    """Refuse times, or a displacement, in another unit than the signal that moves the piston."""
    reported = "measured_displacement" if "measured_displacement" in test.columns else "displacement"
    if reported not in test.columns:
        return
    source = "velocity" if "velocity" in signals else "spool"
    if source == "velocity":
        velocity = signals["velocity"]
    else:
        table = FlowTable(rig["servovalve.flow_table.openings"], rig["servovalve.flow_table.flows"])
        velocity = table.flow(signals["spool"]) / rig["actuator.piston_area"]
    factor, most = motion_factor(test.time, test.sample_rate, velocity, test[reported]), _MOTION[source]
    if factor is not None and not 1.0 / most <= factor <= most:
        raise ValueError(
            f"{test.name}: displacement = {factor:.3g} times that by the {source}: must be "
            f"{1.0 / most:g} to {most:g} times: check the unit of the times, and sign and unit of both"
        )


def _before_the_tick(rig: Rig, test: Traces) -> npt.NDArray[np.float64]:
    """The valve command (V) until each tick, which the learner uses, from that after it."""
    after = test["valve_command"]
    if rig["controller.realization"] == "digital":
        return np.concatenate(([0.0], after[:-1]))
    gain = float(rig["controller.proportional_gain"])
    return after - gain * np.diff(test["compensation"], prepend=0.0)
