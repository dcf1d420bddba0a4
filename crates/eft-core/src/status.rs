//! The flags that a step reports. They have the same bits in Rust, C, Python and files.

use core::fmt;

use crate::cause::Cause;

/// The measured or required spool opening is beyond its warning level.
pub const SPOOL_WARNING: u32 = 1 << 0;
/// The demanded flow is beyond the flow table, or the opening beyond the stroke.
pub const DEMAND_SATURATED: u32 = 1 << 1;
/// The load-pressure correction is at its limit.
pub const LOAD_PRESSURE_FLOORED: u32 = 1 << 2;
/// The valve command was cut to its limit.
pub const COMMAND_LIMITED: u32 = 1 << 3;
/// The valve command's rate was cut to its limit.
pub const RATE_LIMITED: u32 = 1 << 4;
/// A measurement is not finite or out of its range; the last output is held.
pub const INVALID_MEASUREMENT: u32 = 1 << 5;
/// The command or next command is not finite; the last output or command is held.
pub const INVALID_COMMAND: u32 = 1 << 6;
/// The output was held on request.
pub const HELD: u32 = 1 << 7;
/// The spool is at a stop (set by the simulated rig).
pub const SPOOL_STOP: u32 = 1 << 8;
/// The piston is beyond its stroke (set by the rig).
pub const STROKE_EXCEEDED: u32 = 1 << 9;
/// The simulated state was no longer finite; the run ends here (set by the rig).
pub const DIVERGED: u32 = 1 << 10;
/// A tick was missed, or a sample is old, missing or of the wrong period.
///
/// The caller sets it after a missed tick, when the last output is held. A protection sets it from the alive counter or
/// the period.
pub const MISSED_TICK: u32 = 1 << 11;
/// Nothing is learned: samples are bad, or the models do not explain them.
pub const ADAPTATION_FROZEN: u32 = 1 << 12;
/// An estimate is at one of its bounds.
pub const ESTIMATE_BOUNDED: u32 = 1 << 13;
/// The overcompensation guard has reduced the compensation level.
pub const LEVEL_REDUCED: u32 = 1 << 14;
/// A measurement is beyond its warning level.
pub const PROTECTION_WARNING: u32 = 1 << 15;
/// The protection has tripped: the force command is frozen and ramps to zero.
pub const TRIPPED: u32 = 1 << 16;
/// The protection ramps the whole valve command to that of the closed valve.
pub const SHUT_DOWN: u32 = 1 << 17;
/// A measurement repeats to the last bit, as from a stuck sensor.
///
/// Also: the last valid supply pressure replaces an invalid one, or the load pressure has failed and is ignored.
pub const STUCK_MEASUREMENT: u32 = 1 << 18;
/// The learner's last calibration came late or is missing.
pub const CALIBRATION_LATE: u32 = 1 << 19;
/// The force loop is open; an analog controller must open its own.
pub const FORCE_LOOP_OPEN: u32 = 1 << 20;
/// The force is distrusted: it was lost for too long, or contradicted.
pub const FORCE_DISTRUSTED: u32 = 1 << 21;
/// The displacement is distrusted.
pub const DISPLACEMENT_DISTRUSTED: u32 = 1 << 22;
/// The velocity is distrusted.
pub const VELOCITY_DISTRUSTED: u32 = 1 << 23;
/// The spool opening is distrusted.
pub const SPOOL_DISTRUSTED: u32 = 1 << 24;
/// The calibration in use is older than its age limit.
pub const CALIBRATION_EXPIRED: u32 = 1 << 25;

/// Lowest of the five bits of a status that hold the first cause of a trip.
pub const CAUSE_SHIFT: u32 = 26;
/// Those five bits, to be shifted to the right.
pub const CAUSE: u32 = 0x1f << CAUSE_SHIFT;

/// What tripped the protection first according to a status; [`Cause::None`] before any trip.
pub fn cause(status: u32) -> Cause {
    let number = (status & CAUSE) >> CAUSE_SHIFT;
    Cause::NAMES.iter().find(|(cause, _)| *cause as u32 == number).map_or(Cause::None, |(cause, _)| *cause)
}

/// The names of a status's flags, and the cause of a trip: `command_limited tripped(force_level)`. For messages, not
/// for a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Words(pub u32);

impl Words {
    fn parts(self) -> impl Iterator<Item = &'static str> {
        let flags = NAMES.iter().filter(move |(bit, _)| self.0 & bit != 0);
        let flags = flags.enumerate().flat_map(|(n, (_, name))| [if n == 0 { "" } else { " " }, name]);
        let tripped = self.0 & CAUSE != 0;
        flags.chain(if tripped { ["(", cause(self.0).name(), ")"] } else { [""; 3] })
    }
}

impl fmt::Display for Words {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.parts().try_for_each(|part| f.write_str(part))
    }
}

#[cfg(feature = "defmt")]
impl defmt::Format for Words {
    fn format(&self, f: defmt::Formatter<'_>) {
        self.parts().for_each(|part| defmt::write!(f, "{=str}", part));
    }
}

/// Every flag of this module with its name, lowest bit first.
pub const NAMES: [(u32, &str); 26] = [
    (SPOOL_WARNING, "spool_warning"),
    (DEMAND_SATURATED, "demand_saturated"),
    (LOAD_PRESSURE_FLOORED, "load_pressure_floored"),
    (COMMAND_LIMITED, "command_limited"),
    (RATE_LIMITED, "rate_limited"),
    (INVALID_MEASUREMENT, "invalid_measurement"),
    (INVALID_COMMAND, "invalid_command"),
    (HELD, "held"),
    (SPOOL_STOP, "spool_stop"),
    (STROKE_EXCEEDED, "stroke_exceeded"),
    (DIVERGED, "diverged"),
    (MISSED_TICK, "missed_tick"),
    (ADAPTATION_FROZEN, "adaptation_frozen"),
    (ESTIMATE_BOUNDED, "estimate_bounded"),
    (LEVEL_REDUCED, "level_reduced"),
    (PROTECTION_WARNING, "protection_warning"),
    (TRIPPED, "tripped"),
    (SHUT_DOWN, "shut_down"),
    (STUCK_MEASUREMENT, "stuck_measurement"),
    (CALIBRATION_LATE, "calibration_late"),
    (FORCE_LOOP_OPEN, "force_loop_open"),
    (FORCE_DISTRUSTED, "force_distrusted"),
    (DISPLACEMENT_DISTRUSTED, "displacement_distrusted"),
    (VELOCITY_DISTRUSTED, "velocity_distrusted"),
    (SPOOL_DISTRUSTED, "spool_distrusted"),
    (CALIBRATION_EXPIRED, "calibration_expired"),
];

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;

    use super::*;

    #[test]
    fn words_name_flags_and_cause() {
        assert_eq!(Words(0).to_string(), "");
        assert_eq!(Words(COMMAND_LIMITED).to_string(), "command_limited");
        let tripped = SPOOL_WARNING | TRIPPED | (Cause::ForceLevel as u32) << CAUSE_SHIFT;
        assert_eq!(Words(tripped).to_string(), "spool_warning tripped(force_level)");
    }
}
