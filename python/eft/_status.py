"""The status flags of a step."""

from __future__ import annotations

from enum import IntEnum, IntFlag


class Status(IntFlag):
    """The flags of a step. Each bit has the same meaning in Rust, C and files."""

    SPOOL_WARNING = 1 << 0
    """Measured or required spool opening beyond the warning level (the paper advises 60 %)."""
    DEMAND_SATURATED = 1 << 1
    """The demanded flow lies beyond the flow table, or the required opening beyond the spool's stroke."""
    LOAD_PRESSURE_FLOORED = 1 << 2
    """The radicand of the load-pressure correction was raised to its floor."""
    COMMAND_LIMITED = 1 << 3
    """The valve command was limited."""
    RATE_LIMITED = 1 << 4
    """The rate of the valve command was limited."""
    INVALID_MEASUREMENT = 1 << 5
    """A measurement was not finite or out of its range; the last output was held."""
    INVALID_COMMAND = 1 << 6
    """The force command was not finite; the output was held, or a protection took the last valid command.
    Or the next command was not finite, and the feedforward took the last valid one."""
    HELD = 1 << 7
    """The output was held on request."""
    SPOOL_STOP = 1 << 8
    """The true spool was at a stop."""
    STROKE_EXCEEDED = 1 << 9
    """The piston was beyond its stroke."""
    DIVERGED = 1 << 10
    """The simulated state was not finite, and the run ended here."""
    MISSED_TICK = 1 << 11
    """A tick was missed, or its sample was old or at the wrong time."""
    ADAPTATION_FROZEN = 1 << 12
    """The estimates were frozen, because a measurement was bad or contradicted the models."""
    ESTIMATE_BOUNDED = 1 << 13
    """An estimate was at one of its bounds."""
    LEVEL_REDUCED = 1 << 14
    """The overcompensation guard had reduced the compensation level."""
    PROTECTION_WARNING = 1 << 15
    """A measurement was beyond its warning level."""
    TRIPPED = 1 << 16
    """The protection had tripped, and the force command was ramped to zero."""
    SHUT_DOWN = 1 << 17
    """The protection ramped the whole valve command to that of the closed valve."""
    STUCK_MEASUREMENT = 1 << 18
    """A measurement repeated to the last bit, or the last valid supply pressure replaced an invalid one."""
    CALIBRATION_LATE = 1 << 19
    """The learner's last calibration was late or missing, so an older one was in use."""
    FORCE_LOOP_OPEN = 1 << 20
    """The force loop was open, for example because the force was distrusted."""
    FORCE_DISTRUSTED = 1 << 21
    """The protection distrusted the force."""
    DISPLACEMENT_DISTRUSTED = 1 << 22
    """The protection distrusted the displacement."""
    VELOCITY_DISTRUSTED = 1 << 23
    """The protection distrusted the velocity."""
    SPOOL_DISTRUSTED = 1 << 24
    """The protection distrusted the spool opening."""
    CALIBRATION_EXPIRED = 1 << 25
    """The calibration in use was older than its age limit."""


class Cause(IntEnum):
    """What tripped a protection first."""

    NONE = 0
    """Nothing tripped."""
    REQUEST = 1
    """A request from outside."""
    FORCE_LEVEL = 2
    """The force was beyond its trip level."""
    DISPLACEMENT_LEVEL = 3
    """The displacement was beyond its trip level."""
    VELOCITY_LEVEL = 4
    """The velocity was beyond its trip level."""
    SPOOL_LEVEL = 5
    """The spool opening was beyond its trip level."""
    COMMAND_LOST = 6
    """The force command stayed lost."""
    MEASUREMENT_LOST = 7
    """Measurements stayed lost."""
    REFUSED = 8
    """The controller kept rejecting its samples."""
    MODEL_CONTRADICTED = 9
    """The estimators' models stayed contradicted, or a measurement stayed stuck."""
    FORCE_LOST = 10
    """The force stayed lost."""
    DISPLACEMENT_LOST = 11
    """The displacement stayed lost."""
    VELOCITY_LOST = 12
    """The velocity stayed lost."""
    SPOOL_LOST = 13
    """The spool opening stayed lost."""
    FORCE_IMPLAUSIBLE = 14
    """The force contradicted the actuator's flow balance, jumped, or was stuck."""
    DISPLACEMENT_IMPLAUSIBLE = 15
    """The displacement contradicted the velocity and the flow, or jumped."""
    VELOCITY_IMPLAUSIBLE = 16
    """The velocity contradicted displacement and flow, jumped, or was stuck."""
    SPOOL_IMPLAUSIBLE = 17
    """The spool opening contradicted command and flow, or jumped."""
    FLOW_IMPLAUSIBLE = 18
    """The valve's flow differed from the piston's, but the sensors agreed. Check supply, valve and curve."""
    VALVE_IMPLAUSIBLE = 19
    """The spool did not follow its command, but the flow followed the spool."""
    STATE_CORRUPT = 20
    """A latch in the controller's memory was changed from outside."""
    SAMPLES_OLD = 21
    """The alive counter stopped or skipped."""
    SAMPLE_PERIOD = 22
    """The measured sample period was outside its tolerance."""
    CALIBRATION_EXPIRED = 23
    """The learner published nothing for longer than its age limit."""
    FORCE_OSCILLATION = 24
    """The force error from about 30 to 150 Hz persisted or grew, because the loop shook the oil column."""


CAUSE_SHIFT = 26
"""Bit of a status at which the number of the first cause begins."""
CAUSE_BITS = 0x1F << CAUSE_SHIFT
"""The bits of that number."""


def cause_of(status: int) -> Cause:
    """Return the first cause of a trip that a status contains."""
    return Cause((status & CAUSE_BITS) >> CAUSE_SHIFT)


_ENDS = (
    (Status.DIVERGED, "diverged", "the simulated state diverged"),
    (Status.STROKE_EXCEEDED, "stroke_exceeded", "the piston left its stroke"),
    (Status.TRIPPED | Status.SHUT_DOWN, "tripped", "the protection ended the test"),
)
ENDED = Status.STROKE_EXCEEDED | Status.TRIPPED | Status.SHUT_DOWN
"""Each of these ends a test, although the simulation continues."""


def status_of(flags: Status) -> tuple[str, str | None]:
    """One word on whether the test is complete, or why not."""
    for flag, word, reason in _ENDS:
        if flags & flag:
            return word, reason
    return "completed", None
