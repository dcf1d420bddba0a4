"""The criteria of one controller on one rig under one command."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from eft._iteration import iterate
from eft._native import Command, Rig
from eft._run import TestRun
from eft._simulate import simulate
from eft._status import Status
from eft.benchmark._controllers import Competitor, made, told
from eft.benchmark._criteria import slow_error

BAND = (0.5, 9.5)
"""Band of the ratio of force and command in a sweep, Hz."""
_UNSTABLE = 1.0
"""Force error (rms over rms) above which a test is lost."""
_OTHER_SEED = 7919
"""Added to the seed of the noise for the test after an iteration, so that the drive does not contain the
noise."""

NAN = math.nan


@dataclass(frozen=True)
class Row:
    """A controller on a rig under a command: the criteria, which are NaN for a lost test."""

    controller: str
    """Name of the controller."""
    case: str
    """Name of the rig."""
    test: str
    """Name of the command."""
    lost: str
    """Reason for a lost test in one sentence; empty otherwise."""
    nrmse: float = NAN
    """Rms force error over rms command (J2)."""
    slow_error: float = NAN
    """The same for the force below 20 Hz."""
    delay: float = NAN
    """Delay of the force behind the command, s (J1)."""
    peak_error: float = NAN
    """Largest force error over the largest command (J3)."""
    lowest_ratio: float = NAN
    """Least force over command from 0.5 to 9.5 Hz; NaN for an earthquake."""
    highest_ratio: float = NAN
    """Largest force over command from 0.5 to 9.5 Hz; NaN for an earthquake."""
    displacement_error: float = NAN
    """Rms displacement error against the ideal response, over its rms (J4)."""
    peak_displacement: float = NAN
    """Largest displacement over the largest of the ideal response."""
    max_spool: float = NAN
    """Largest spool opening."""
    energy: float = NAN
    """Hydraulic energy taken from the supply, J."""


def judge(
    competitor: Competitor, rig: Rig, names: tuple[str, str], command: Command, ideal_peak: float
) -> Row:
    """Run a test and judge it; any error of the controller makes it a lost test."""
    case, test = names
    try:
        run = _run(competitor, rig.replace(dict(competitor.settings)), command)
    except Exception as error:
        # An external controller may raise any exception.
        return Row(competitor.name, case, test, told(error))
    if lost := _lost(run, command):
        return Row(competitor.name, case, test, lost)
    metrics = run.metrics()
    lowest = highest = NAN
    if test.startswith("sweep"):
        ratio = run.fft_ratio(*BAND).ratio
        lowest, highest = float(ratio.min()), float(ratio.max())
    return Row(
        competitor.name,
        case,
        test,
        "",
        nrmse=metrics["nrmse"],
        slow_error=slow_error(run.command, run.force, run.sample_rate),
        delay=metrics["delay"],
        peak_error=metrics["peak_error"],
        lowest_ratio=lowest,
        highest_ratio=highest,
        displacement_error=metrics["displacement_error"],
        peak_displacement=float(np.abs(run.displacement).max()) / ideal_peak,
        max_spool=metrics["max_spool"],
        energy=_energy(run),
    )


def _run(competitor: Competitor, rig: Rig, command: Command) -> TestRun:
    if competitor.make is not None:
        return simulate(rig, command, controller=made(competitor, rig, command.sample_rate))
    if not competitor.repeats:
        return simulate(rig, command)
    drive = iterate(rig, command, repeats=competitor.repeats).drive
    again = rig.replace({"truth.sensors.seed": rig.plant["sensors.seed"] + _OTHER_SEED})
    run = simulate(again, drive)
    # The reference is the desired force.
    return TestRun(
        rig=run.rig,
        sample_rate=run.sample_rate,
        dtype=run.dtype,
        version=run.version,
        status=run.status,
        _values={**run._values, "command": command.values[: len(run)]},
    )


def _lost(run: TestRun, command: Command) -> str:
    if not run.success or len(run) < len(command):
        return "the simulated state diverged"
    if run.flags & Status.STROKE_EXCEEDED:
        return "the piston left its stroke"
    error = run.metrics(fft=False).nrmse
    return "" if error <= _UNSTABLE else f"unstable: the force error is {100.0 * error:.3g} %"


def _energy(run: TestRun) -> float:
    """Energy of the flow through the valve at the supply's pressure."""
    plant = run.rig.plant
    oil, leakage = plant["actuator.compressibility"], plant["actuator.leakage"]
    flow = plant["actuator.piston_area"] * run.velocity + leakage * run.load_pressure
    flow += oil * np.gradient(run.load_pressure, 1.0 / run.sample_rate)
    return float(np.sum(run.supply_pressure * np.abs(flow)) / run.sample_rate)
