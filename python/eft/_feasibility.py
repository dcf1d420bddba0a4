"""Feasibility of a test, before it is run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from eft import _native
from eft._display import shown
from eft._finding import GRADES, Finding, Grade
from eft._findings import above, of_demands, of_loop, of_size, of_supply, worst
from eft._findings_of_protection import of_protection
from eft._native import Command, Rig
from eft._prediction import Prediction, of_distrust, of_droop, of_prediction, predicted
from eft._results import Result
from eft._status import Status, cause_of

__all__ = ["Demand", "Feasibility", "check_feasibility"]


@dataclass(frozen=True)
class Demand(Result):
    """The demand of a command on one part of a rig, and the part's capacity."""

    name: str
    """Name of the part."""
    unit: str
    """SI unit; empty for a ratio."""
    required: float
    """The demand of the command."""
    available: float
    """The capacity of the part."""
    advised: float
    """The advised limit."""


@dataclass(frozen=True)
class Feasibility(Result):
    """Whether a rig can follow a command."""

    verdict: Grade
    """In one word, ``"go"``, ``"caution"`` or ``"no"``."""
    reasons: tuple[str, ...]
    """Reasons against a "go", as sentences."""
    demands: tuple[Demand, ...]
    """The demand on each part."""
    scheme: Literal["off", "linear", "nonlinear"]
    """The simplest compensation that suffices."""
    margin: float | None
    """The largest stable compensation level; None if no level is stable."""
    smallest_sample_rate: float | None
    """The smallest tried rate, Hz, from which on the loop is stable, and its largest stable level exceeds the
    rig's own by ``verdict.caution.level_margin`` (2 %), or by half of what it does at 12,800 Hz. With
    self-calibration a stable loop is enough. None if the loop is unstable at 12,800 Hz."""
    lowest_supply_pressure: float
    """The lowest pressure of the supply, Pa, while the valves draw the flow of the demands, without their
    leakage."""
    force_error: float | None
    """Of the force at small motion, below 20 Hz and with the noise of the sensors, rms over rms. For a
    command with power above 20 Hz it is that below 100 Hz. It contains the time until calibration or guard
    have changed the loop. None with more than half of the power above 20 Hz, or without a linear model that
    is stable, at least after calibration or guard."""
    displacement_error: float | None
    """Of the displacement against the ideal one, likewise."""
    left_out: tuple[str, ...]
    """Keys of the rig with an effect that the predicted errors do not contain, such as a known overlap, which
    the controller does not compensate for exactly. ``"command above 100 Hz"`` (or 20 Hz) stands for the
    part of the command there, as of a square wave, if it raises the error by a tenth. The force error
    counts the part above 100 Hz as missed. A test on the virtual rig shows both. Without predicted errors,
    the keys that the linear model does not contain."""


def check_feasibility(rig: Rig, command: Command) -> Feasibility:
    """Compare the demands of a force command with the capacity of a rig before a test.

    For a shear building the demands are those of the actuator with the largest ones; the pump's mean flow is
    that of all actuators. With self-calibration or the guard, the stability is that of the loop before any
    calibration. A loop that stays unstable after the calibration, or at the level to which the guard reduces
    it, is a "no". Any other unstable loop is a caution then, because only a test on the virtual rig shows the
    result. ``eft check`` runs such a test. A loop in which a deviation grows 20 times until self-calibration
    has found gains and delays, at the learner's largest rates, is a "no".

    The errors of force and displacement are those of the linear model at small motion. With self-calibration
    its estimates move to the learned values at their largest rates, from the first motion that is large
    enough to learn from, and the guard reduces the level meanwhile. A flow or valve gain that differs so
    much that the learner takes it for the fault of a sensor is not learned. All controllers of a building are
    taken to learn the same. With a guard alone the level is the configured one until the motion is large
    enough for it, also in an unstable loop.
    A large opening, a limit, or a signal that stays within one step for many samples makes larger errors.
    They contain:

    - noise, resolution and bias of the sensors; resolution counts as white noise of the rounding;
    - an unknown null bias of the valve, until an integral part of the force loop has found it. One that
      self-calibration learns, with a bias of the velocity in it, counts wholly for the first 0.8 s;
    - an unknown lap of the spool, or an overlap that the scheme does not compensate for, by the flow gain
      that is nearest to it at the openings of the test, and the rest to first order. Above a fiftieth of the
      opening the errors are uncertain by about a third, and ``left_out`` names the lap;
    - an oscillation about null by an unknown underlap, where the openings are small;
    - friction, in the force's error only;
    - flow curve and load pressure without the nonlinear scheme, as an unknown lap. A simpler scheme than the
      advised one is a caution only if an error comes near its limit, or is unknown.

    The pressure to which the supply falls under the flow of the demands is judged as after the test, by
    ``verdict.caution.supply_pressure`` and ``verdict.no.supply_pressure``. These are cautions as well:

    - a peak of the command, as of a record in a wrong unit, below a thousandth of the actuator's capacity
      or of the load cell's range, or of which noise and resolution of the load cell exceed the share
      ``verdict.caution.force_error``;
    - with the plausibility watch of the protection, a level of the force below an eighth of the actuator's
      capacity, or a sample rate below 250 times the natural frequency. In a building it is that of each floor
      while the others are at rest;
    - with the watch, a play of the attachment of 0.02 mm or more, or of 0.1 mm if the motion is measured at
      the structure;
    - a flow or valve gain that self-calibration may take for the fault of a sensor because of noise in its
      band beside the motion, if the displacement's error without learning exceeds its limit;
    - a droop without ``compensation.supply_correction``, if the displacement's error at the lowest pressure
      exceeds its limit;
    - biased sensors that trip the protection within a second at rest;
    - a command that begins with a jump, if the feedforward demands more flow than the valve passes;
    - a compensated overlap whose ratio to the rms opening exceeds ``verdict.caution.force_error``;
    - a play of the attachment whose error exceeds that or ``verdict.caution.oscillation``.

    Parameters
    ----------
    rig : Rig
        The rig.
    command : Command
        The force to be applied.

    Returns
    -------
    Feasibility
        Verdict, reasons, demands, the simplest scheme that suffices, margin, sample rate, predicted errors.

    Raises
    ------
    ValueError
        If the command does not fit the rig.

    Examples
    --------
    >>> import eft
    >>> command = eft.sine_sweep(2000.0, 0.5, 5.0, duration=10.0, sample_rate=4096.0)
    >>> eft.check_feasibility(eft.Rig.zhao2005(), command).verdict
    'go'
    """
    found = _native.check_feasibility(rig, command)
    rate = command.sample_rate
    errors = predicted(rig, command)
    findings = [*of_size(rig, float(np.abs(command.values).max())), *of_demands(found["demands"])]
    findings += [*of_loop(rig, rate), *_settings(rig, found, rate, errors)]
    findings += _until_learned(rig, rate)
    findings += of_supply(rig, found["lowest_supply_pressure"], found["demands"])
    findings += of_protection(rig, rate)
    findings += _at_rest(rig, command)
    findings += _start(rig, command, found["demands"])
    left_out = _left_out(rig, rate) if errors is None else errors.left_out
    if errors is not None:
        findings += of_prediction(rig, rate, errors)
        findings += of_distrust(rig, command, errors)
        if droop := list(of_droop(rig, command, found["lowest_supply_pressure"], errors)):
            findings += droop
            left_out = tuple(dict.fromkeys((*left_out, "supply.droop")))
    findings.sort(key=lambda one: -GRADES.index(one.grade))
    demands = tuple(Demand(**demand) for demand in found.pop("demands"))
    reasons = tuple(one.sentence for one in findings)
    grade = worst(one.grade for one in findings)
    return Feasibility(
        grade,
        reasons,
        demands,
        **found,
        force_error=None if errors is None else errors.force.whole,
        displacement_error=None if errors is None else errors.displacement.whole,
        left_out=left_out,
    )


def _left_out(rig: Rig, rate: float) -> tuple[str, ...]:
    """What the linear model itself does not contain."""
    try:
        return tuple(_native.linearize(rig, sampled=True, sample_rate=rate).left_out)
    except ValueError:
        return ()


_LARGEST_GROWTH = 20.0
"""Growth of a deviation until self-calibration has its estimates: 5 % of the command become the whole."""


def _until_learned(rig: Rig, rate: float) -> Iterator[Finding]:
    """A finding if an unstable loop grows too far before it is calibrated."""
    if not rig["compensation.adaptive"]:
        return
    try:
        exponent = _native.growth_until_learned(rig, rate)
    except ValueError:
        return  # there is no linear model
    if exponent > np.log(_LARGEST_GROWTH):
        growth = f"{np.exp(exponent):.0f} times" if exponent < np.log(1e4) else "without a limit"
        yield Finding(
            "no",
            f"A deviation grows {growth} until self-calibration has found gains and delays, which change "
            "slowly. Configure them nearer to the true ones: eft identify finds them.",
        )


def _at_rest(rig: Rig, command: Command) -> Iterator[Finding]:
    """A finding if biased sensors trip the protection before anything moves."""
    plant, sensors = rig.plant, ("force", "velocity", "displacement", "spool", "acceleration")
    biased = [name for name in sensors if plant[f"sensors.{name}.bias"]]
    if not (rig["protection.enabled"] and biased):
        return
    rate = command.sample_rate
    still = Command(np.zeros((*command.values.shape[:-1], max(round(rate), 2))), rate)
    status = np.atleast_2d(_native.simulate(rig, still, "f64")["status"])
    tripped = np.argwhere((status & (Status.TRIPPED | Status.SHUT_DOWN)).T)
    if tripped.size:
        sample, actuator = tripped[0]
        cause = cause_of(int(status[actuator, sample])).name.lower().replace("_", " ")
        yield Finding(
            "caution",
            f"The protection trips at rest after {sample / rate:.2g} s ({cause}) with the bias of the "
            f"{' and the '.join(biased)} sensor. Set it to zero before the test.",
        )


def _start(rig: Rig, command: Command, demands: Iterable[Mapping[str, Any]]) -> Iterator[Finding]:
    """A caution about a jump at the start, whose flow the feedforward demands within one sample."""
    soft = rig["protection.enabled"] and rig["protection.start_time"] > 0.0
    if soft or not rig["compensation.feedforward"]:
        return
    first = float(np.abs(command.values[..., 0]).max())
    flow = rig["actuator.compressibility"] * first * command.sample_rate / rig["actuator.piston_area"]
    [passed] = [one["available"] for one in demands if one["name"] == "flow"]
    if flow > passed:
        yield Finding(
            "caution",
            f"The command begins with a jump to {shown('force')(first)}. The feedforward demands its flow "
            f"within one sample, {flow / passed:.2g} times what the valve passes. Begin the command at zero, "
            "or set protection.start_time.",
        )


_SCHEMES = ("off", "linear", "nonlinear")
_NEARLY = 0.8
"""Share of a limit up to which a predicted error is certain enough for a simpler scheme."""


def _settings(
    rig: Rig, found: Mapping[str, Any], rate: float, errors: Prediction | None
) -> Iterator[Finding]:
    """Findings on a scheme that is too simple and a sample rate that is too low."""
    mode, needed, least = rig["compensation.mode"], found["scheme"], found["smallest_sample_rate"]
    small = errors is not None and not (
        above(rig, "force_error", errors.force.whole / _NEARLY)
        or above(rig, "displacement_error", errors.displacement.whole / _NEARLY)
    )
    if _SCHEMES.index(mode) < _SCHEMES.index(needed) and not small:
        change = (("compensation.mode", needed),)
        yield Finding("caution", f"{needed.capitalize()} compensation is needed, {mode} is set.", change)
    # Without a safe rate the rate is not the cause, and the loop has its own finding.
    if least is not None and least > rate:
        sentence = f"The sample rate {rate:g} Hz is below the smallest safe one, {least:.0f} Hz."
        yield Finding("caution", sentence)
