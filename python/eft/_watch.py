"""A test as it runs: plant and controller sample by sample, looked at now and then."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import Literal, NamedTuple, TextIO

import numpy as np

from eft._native import Command, Controller, Plant, Rig, rig_keys

__all__ = ["Watched", "watch"]


class Watched(NamedTuple):
    """What there is to see at one moment of a test."""

    time: float
    """Since the start, s."""
    command: float
    """N."""
    force: float
    """N."""
    error: float
    """Rms of the force error over that of the command, so far; NaN before there is a command."""
    spool: float
    """Opening."""
    flow_gain: float
    """Estimate, over the configured one."""
    response_delay: float
    """Estimate, s."""


def watch(
    rig: Rig, command: Command, *, every: float = 0.1, dtype: Literal["f64", "f32"] = "f64"
) -> Iterator[Watched]:
    """Step plant and controller through a test and look at it now and then.

    The loop is that of a real-time program: `Plant.state` in, `Controller.step`, `Plant.step`. It is
    the digital realization, with ideal sensors, of one actuator.

    Parameters
    ----------
    rig : Rig
        The rig, with a digital force loop.
    command : Command
        The force.
    every : float
        Time between two looks, s.
    dtype : {"f64", "f32"}
        Precision of the controller.

    Returns
    -------
    iterator of Watched
        One for each look, and one of the end.

    Raises
    ------
    ValueError
        If the rig has an analog force loop, several actuators or sensors that are not ideal.

    Examples
    --------
    >>> import eft
    >>> rig = eft.Rig.zhao2005().replace({"controller.realization": "digital"})
    >>> sweep = eft.sine_sweep(2000.0, 0.5, 4.0, 2.0, 1024.0)
    >>> [round(look.time, 3) for look in eft.watch(rig, sweep, every=1.0)]
    [0.0, 1.0, 1.999]
    """
    if not every > 0.0:
        raise ValueError(f"every = {every}: must be above zero, in s")
    check_watchable(rig)
    if command.values.ndim != 1:
        raise ValueError(f"command = {command.values.shape[0]} actuators: must be of one")
    return _looks(rig, command, max(round(every * command.sample_rate), 1), dtype)


def check_watchable(rig: Rig) -> None:
    """Refuse a rig whose test is more than the loop of plant and controller; the message names the key."""
    if rig["structure.kind"] == "shear_building":
        raise ValueError('structure.kind = "shear_building": must have one actuator to be watched')
    if rig["controller.realization"] != "digital" and rig["controller.force_loop"] != "robust":
        raise ValueError(
            'controller.realization = "analog": must be "digital" to be watched, where the loop is stepped '
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
            raise ValueError(f"{key} = {true[key]}: must be left out to be watched, where sensors are ideal")


def _looks(rig: Rig, command: Command, stride: int, dtype: Literal["f64", "f32"]) -> Iterator[Watched]:
    rate, wanted = command.sample_rate, command.values.tolist()
    plant, controller = Plant(rig, rate), Controller(rig, dtype, sample_rate=rate)
    missed = asked = 0.0
    for index, now_wanted in enumerate(wanted):
        now = plant.state
        missed += (now.force - now_wanted) ** 2
        asked += now_wanted**2
        if index % stride == 0 or index == len(wanted) - 1:
            error = float(np.sqrt(missed / asked)) if asked > 0.0 else float("nan")
            yield Watched(
                index / rate,
                now_wanted,
                now.force,
                error,
                now.spool,
                controller.flow_gain_estimate,
                controller.response_delay_estimate,
            )
        following = wanted[min(index + 1, len(wanted) - 1)]
        volts = controller.step(
            now_wanted, now.velocity, now.force, now.spool, now.supply_pressure,
            displacement=now.displacement, acceleration=now.acceleration, next_command=following,
        )  # fmt: skip
        plant.step(volts)


def line(look: Watched) -> str:
    """A look as a line of text."""
    return (
        f"{look.time:8.2f} s  force {look.force / 1e3:+8.2f} kN of {look.command / 1e3:+8.2f} kN  "
        f"error {look.error:6.1%}  spool {look.spool:+5.0%}  flow gain {look.flow_gain:.3f}  "
        f"delay {look.response_delay * 1e3:.2f} ms"
    )


def show(
    rig: Rig,
    command: Command,
    dtype: Literal["f64", "f32"] = "f64",
    *,
    stream: TextIO | None = None,
) -> None:
    """Print every look of a test: on a terminal over the line before it, else line by line."""
    stream = stream or sys.stdout
    terminal = stream.isatty()
    # A log gets twenty lines, a terminal a line that moves.
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
