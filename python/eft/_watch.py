"""Observation of a running test: plant and controller are stepped sample by sample."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import Any, Literal, NamedTuple, TextIO

import numpy as np

from eft._display import shown
from eft._floors import actuators_of
from eft._native import Command, Controller, Plant, Rig, check_rig, rig_keys
from eft._numbers import real_number

__all__ = ["Watched", "watch"]


class Watched(NamedTuple):
    """The signals at one moment of a test; for several actuators all except the time are arrays."""

    time: float
    """Time since the start, s."""
    command: Any
    """N."""
    force: Any
    """N."""
    error: Any
    """Rms of the force error over that of the command, until now; NaN before the command starts."""
    spool: Any
    """Opening."""
    flow_gain: Any
    """Estimate, over the configured one."""
    response_delay: Any
    """Estimate, s."""


def watch(
    rig: Rig, command: Command, *, every: float = 0.1, dtype: Literal["f64", "f32"] = "f64"
) -> Iterator[Watched]:
    """Step plant and controller through a test and return their state at intervals.

    The loop is that of a real-time program: `Plant.state` in, `Controller.step`, `Plant.step`. It is
    the digital realization, with ideal sensors; a building has a controller for each actuator.

    Parameters
    ----------
    rig : Rig
        The rig, with a digital force loop.
    command : Command
        The force.
    every : float
        Time between two results, s.
    dtype : {"f64", "f32"}
        Precision of the controller.

    Returns
    -------
    iterator of Watched
        One at each interval, and one at the end.

    Raises
    ------
    ValueError
        If the rig has an analog force loop or sensors that are not ideal, or the command does not fit it.

    Examples
    --------
    >>> import eft
    >>> rig = eft.Rig.zhao2005().replace({"controller.realization": "digital"})
    >>> sweep = eft.sine_sweep(2000.0, 0.5, 4.0, 2.0, 1024.0)
    >>> [round(look.time, 3) for look in eft.watch(rig, sweep, every=1.0)]
    [0.0, 1.0, 1.999]
    """
    check_rig(rig)
    every = real_number("every", every)
    if not every > 0.0:
        raise ValueError(f"every = {every}: must be above zero, in s")
    check_watchable(rig)
    floors = actuators_of(rig)
    given = command.values.shape[0] if command.values.ndim > 1 else 1
    if given != floors:
        raise ValueError(f"command = {given} actuators: must be of {floors}, as the rig has")
    return _looks(rig, command, max(round(every * command.sample_rate), 1), dtype)


def check_watchable(rig: Rig) -> None:
    """Refuse a rig that needs more than the loop of plant and controller; the message names the key."""
    if rig["controller.realization"] != "digital" and rig["controller.force_loop"] != "robust":
        raise ValueError(
            'controller.realization = "analog": must be "digital" for watching, which steps the loop '
            "sample by sample"
        )
    true = rig.plant
    for row in rig_keys():
        key, section = row["key"], row["key"].partition(".")[0]
        if (
            section in ("sensors", "dac")
            and key != "sensors.seed"
            and true[key] not in (None, row["default"])
        ):
            raise ValueError(f"{key} = {true[key]}: must be left out for watching, which has ideal sensors")


def _looks(rig: Rig, command: Command, stride: int, dtype: Literal["f64", "f32"]) -> Iterator[Watched]:
    rate, alone = command.sample_rate, command.values.ndim == 1
    wanted = np.atleast_2d(command.values).T.tolist()
    plant = Plant(rig, rate)
    controllers = [Controller(rig, dtype, sample_rate=rate) for _ in wanted[0]]
    missed, asked = np.zeros(len(controllers)), np.zeros(len(controllers))
    for index, now_wanted in enumerate(wanted):
        now = plant.state
        traces = [_each(getattr(now, name)) for name in _SEEN]
        force, spool = traces[1], traces[2]
        missed += np.subtract(force, now_wanted) ** 2
        asked += np.square(now_wanted)
        if index % stride == 0 or index == len(wanted) - 1:
            with np.errstate(invalid="ignore", divide="ignore"):
                error = np.sqrt(missed / np.where(asked > 0.0, asked, np.nan))
            seen = (
                now_wanted, force, error, spool,
                [one.flow_gain_estimate for one in controllers],
                [one.response_delay_estimate for one in controllers],
            )  # fmt: skip
            yield Watched(index / rate, *(float(one[0]) if alone else np.array(one) for one in seen))
        following = wanted[min(index + 1, len(wanted) - 1)]
        volts = [
            controller.step(
                wanted_here, velocity, force, spool, supply_pressure,
                displacement=displacement, acceleration=acceleration, next_command=later,
            )
            for controller, wanted_here, later, (
                velocity, force, spool, supply_pressure, displacement, acceleration
            ) in zip(controllers, now_wanted, following, zip(*traces, strict=True), strict=True)
        ]  # fmt: skip
        plant.step(volts[0] if alone else volts)


_SEEN = ("velocity", "force", "spool", "supply_pressure", "displacement", "acceleration")
"""The inputs of a controller from the plant."""


def _each(value: Any) -> list[float]:
    """One number per actuator."""
    return [float(one) for one in np.atleast_1d(value)]


def line(look: Watched) -> str:
    """A result as a line of text; for several actuators the one with the largest error."""
    worst = int(np.argmax(np.nan_to_num(np.atleast_1d(look.error))))
    _, command, force, error, spool, gain, delay = (
        float(np.atleast_1d(one)[min(worst, np.size(one) - 1)]) for one in look
    )
    unit = shown("force")
    missed = "     –" if np.isnan(error) else f"{error:6.1%}"
    where = f"actuator {worst + 1}  " if np.size(look.force) > 1 else ""
    return (
        f"{look.time:8.2f} s  {where}force {force * unit.factor:+8.2f} {unit.unit} of "
        f"{command * unit.factor:+8.2f} {unit.unit}  error {missed}  spool {spool:+5.0%}  "
        f"flow gain {gain:.3f}  delay {delay * 1e3:.2f} ms"
    )


def show(
    rig: Rig,
    command: Command,
    dtype: Literal["f64", "f32"] = "f64",
    *,
    stream: TextIO | None = None,
) -> None:
    """Print every result of a test: on a terminal in the same line, otherwise line by line."""
    stream = stream or sys.stdout
    terminal = stream.isatty()
    # A log gets twenty lines, a terminal one changing line.
    every = 0.1 if terminal else max(command.duration / 20.0, 1.0 / command.sample_rate)
    for look in watch(rig, command, every=every, dtype=dtype):
        print(
            f"\r{line(look)}" if terminal else line(look),
            end="" if terminal else "\n",
            file=stream,
            flush=True,
        )
    if terminal:
        print(file=stream)
