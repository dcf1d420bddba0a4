//! Protection of the specimen: limits with warning and trip levels, soft start and end, ramp to zero force.
//!
//! The protection has two stages. A *trip* freezes the force command and ramps it to zero, with the force loop still
//! closed. A *shutdown* ramps the whole valve command to that of the closed valve. It follows if measurements stay
//! lost, if the controller refuses its samples, if a signal is far beyond its trip level, or if the force remains after
//! the ramp. A closed valve locks the piston, and a moving mass against locked oil makes a large force. A shutdown must
//! therefore take long compared with the specimen's period, or act together with a bypass valve across the actuator.

use crate::cause::Cause;
use crate::error::{ConfigError, LARGEST, check, positive, within};
use crate::integrity::integrity;
use crate::number::Real;
use crate::parameters::ProtectionParameters;
use crate::protection::limits::{Limit, NEVER, samples};
use crate::protection::oscillation::OscillationWatch;
use crate::protection::ramp::{Position, Ramp};
use crate::protection::state::ProtectionState;
use crate::protection::timing::{Timing, TimingError};
use crate::status;

/// A protection's immutable configuration; one drives any number of channels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Protection<T> {
    force: Limit<T>,
    displacement: Limit<T>,
    velocity: Limit<T>,
    spool: Limit<T>,
    rise: Ramp,
    fall: Ramp,
    /// The ramp down after a trip by a sensor.
    sensor_fall: Ramp,
    /// The ramp down after a trip by the force's level.
    force_fall: Ramp,
    shutdown_ramp: Ramp,
    /// Time in which the piston follows the specimen before the valve closes, if such a time is configured.
    settle_ramp: Option<Ramp>,
    lost_samples: u32,
    fault_samples: u32,
    timing: Timing<T>,
    oscillation: Option<OscillationWatch<T>>,
}
integrity!(
    Protection<T>: force, displacement, velocity, spool, rise, fall, sensor_fall, force_fall, shutdown_ramp,
    settle_ramp, lost_samples, fault_samples, timing, oscillation
);

/// Share of the velocity's compensation after a trip. Below 1 the velocity feedback damps the specimen, also with a
/// calibration that is a few per cent wrong.
const TRIPPED_LEVEL: f64 = 0.95;
/// The same in a shutdown, with the force loop open.
const SETTLING_LEVEL: f64 = 0.93;
/// Share of the ramp's time after a trip by a sensor. It is short, because a yielding specimen moves under a force.
const SENSOR_FALL: f64 = 0.2;
/// Longest such ramp (s). In a slower one the frozen command would move the specimen further.
const LONGEST_SENSOR_FALL: f64 = 0.1;

const fn at_most(longest: f64, time: f64) -> f64 {
    if time > longest { longest } else { time }
}

/// Share of the force's trip level by which a force that follows its command may differ from it.
const FORCE_ERROR: f64 = 0.25;

/// One sample's command and measurements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProtectionInput<T> {
    /// Force command (N).
    pub command: T,
    /// Force (N).
    pub force: T,
    /// Displacement (m).
    pub displacement: T,
    /// Velocity (m/s).
    pub velocity: T,
    /// Spool opening (1).
    pub spool: T,
    /// Alive counter (1), as in [`Input`](crate::Input); NaN is allowed before the first value.
    pub alive: T,
    /// Measured time (s) since the last sample; NaN is allowed before the first value.
    pub period: T,
}

/// One sample's result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Protected<T> {
    /// The force command (N) that may be followed; finite.
    pub command: T,
    /// Factor on the valve command (1).
    pub authority: T,
    /// Factor on the velocity that is compensated for (1).
    pub level: T,
    /// Whether the force loop must be opened. The piston then follows the specimen, damped.
    pub open: bool,
    /// [`status::PROTECTION_WARNING`], [`status::TRIPPED`], [`status::SHUT_DOWN`], [`status::INVALID_COMMAND`],
    /// [`status::MISSED_TICK`].
    pub status: u32,
}

/// What the levels say of the measurements of a sample.
struct Exceeded {
    /// The first trip level that is exceeded.
    cause: Cause,
    /// Whether a warning level is exceeded, and a level that opens the loop at once.
    warning: bool,
    shutdown: bool,
    /// Whether a measurement is not finite.
    lost: bool,
}

impl<T: Real> Protection<T> {
    /// One sample.
    ///
    /// # NaN
    /// A measurement that is not finite counts as lost. A command that is not finite or beyond [`LARGEST`] is replaced
    /// by the last valid one and raises [`status::INVALID_COMMAND`]. If it stays lost, the test trips.
    ///
    /// # Cost
    /// Independent of history.
    #[inline(always)]
    pub fn step(&self, state: &mut ProtectionState<T>, input: &ProtectionInput<T>) -> Protected<T> {
        let ProtectionInput { command, force, displacement, velocity, spool, alive, period } = *input;
        let (zero, one) = (T::splat(0.0), T::splat(1.0));
        let timing_error = self.timing.step(&mut state.timing, alive, period);
        let was_tripped = state.tripped.is_set();
        let command_valid = command.abs() <= T::splat(LARGEST);
        if command_valid && !was_tripped {
            state.command = command;
        }
        count(&mut state.lost_commands, !command_valid);
        // The closed loop stops a motion that only the flow balance shows, with a smaller force than a closed valve.
        let loop_stops = state.motion_by_flow && !state.command_ramp.is_zero();
        let Exceeded { mut cause, warning, mut shutdown, lost } =
            self.exceeded([force, displacement, velocity, spool], loop_stops);
        count(&mut state.lost_measurements, lost);
        // A force that remains after the ramp, or a wrong sensor, shows that the loop does not work.
        let force_remains = force.abs() > self.force.warning || state.fault_persists;
        let uncontrolled = was_tripped && state.command_ramp.is_zero() && force_remains;
        let measurements_lost = state.lost_measurements > self.lost_samples;
        if state.lost_commands > self.lost_samples && cause == Cause::None {
            cause = Cause::CommandLost;
        }
        if measurements_lost && cause == Cause::None {
            cause = Cause::MeasurementLost;
        }
        if let Some(error) = timing_error
            && self.timing.persists(&state.timing)
            && cause == Cause::None
        {
            cause = error.cause();
            if error == TimingError::Old {
                // Old samples allow neither a closed loop nor following the motion.
                (shutdown, state.motion_unknown) = (true, true);
            }
        }
        if state.tripped.is_corrupt() || state.shut_down.is_corrupt() {
            (cause, shutdown) = (Cause::StateCorrupt, true);
        }
        if let (Some(_), Cause::ForceLevel, false) = (&self.settle_ramp, cause, loop_stops) {
            // A loop with a correct sensor keeps the force near its command.
            let share = state.command_ramp.share::<T>();
            shutdown |= (share * state.command - force).abs() > T::splat(FORCE_ERROR) * self.force.trip;
        }
        state.trip_by(cause);
        state.shut_down.set_if(measurements_lost || shutdown || uncontrolled);
        state.tripped.set_if(state.shut_down.is_set());
        state.command_ramp = self.next_command_ramp(state);
        let level = self.continue_shutdown(state);
        let flag = |raised: bool, bit: u32| if raised { bit } else { 0 };
        let scale = state.command_ramp.share::<T>();
        let shut_down = state.shut_down.is_set();
        let command = if state.command_ramp.is_zero() { zero } else { scale * state.command };
        if let (Some(watch), false) = (&self.oscillation, shut_down) {
            // A ramp does not stabilise an unstable loop, so the loop opens at the next sample.
            if watch.step(&mut state.oscillation, command - force) {
                state.shut_down_by(Cause::ForceOscillation);
            }
        }
        Protected {
            command,
            authority: one - state.valve_ramp.share(),
            level,
            open: shut_down && self.settle_ramp.is_some(),
            status: flag(warning, status::PROTECTION_WARNING)
                | flag(state.tripped.is_set(), status::TRIPPED)
                | flag(shut_down, status::SHUT_DOWN)
                | flag(!command_valid, status::INVALID_COMMAND)
                | flag(timing_error.is_some(), status::MISSED_TICK)
                | (state.cause as u32) << status::CAUSE_SHIFT,
        }
    }

    /// Compares force, displacement, velocity and spool with their levels.
    #[inline(always)]
    fn exceeded(&self, [force, displacement, velocity, spool]: [T; 4], loop_stops: bool) -> Exceeded {
        let mut found = Exceeded { cause: Cause::None, warning: false, shutdown: false, lost: false };
        for (limit, value, level) in [
            (&self.force, force, Cause::ForceLevel),
            (&self.displacement, displacement, Cause::DisplacementLevel),
            (&self.velocity, velocity, Cause::VelocityLevel),
            (&self.spool, spool, Cause::SpoolLevel),
        ] {
            let size = value.abs();
            // A value that is not finite is lost, not large.
            if !(size <= T::splat(f32::MAX as f64)) {
                found.lost = true;
            } else if size > limit.warning {
                // The levels are in this order.
                found.warning = true;
                if size > limit.trip {
                    found.cause = if found.cause == Cause::None { level } else { found.cause };
                    found.shutdown |= size > limit.shutdown && !(loop_stops && level == Cause::ForceLevel);
                }
            }
        }
        found
    }

    /// Continues a shutdown, if there is one, and returns the factor on the velocity (1).
    #[inline(always)]
    fn continue_shutdown(&self, state: &mut ProtectionState<T>) -> T {
        let one = T::splat(1.0);
        if !state.shut_down.is_set() {
            state.valve_ramp = Position::default();
            return match self.settle_ramp {
                Some(_) if state.tripped.is_set() => T::splat(TRIPPED_LEVEL),
                _ => one,
            };
        }
        let Some(settle) = self.settle_ramp else {
            state.valve_ramp = state.valve_ramp.up(self.shutdown_ramp);
            return one;
        };
        state.settling = state.settling.up(settle);
        let settled = state.settling.share::<T>();
        if state.motion_unknown || !(settled < one) {
            state.valve_ramp = state.valve_ramp.up(self.shutdown_ramp);
        }
        // It fades during the last two thirds of the time.
        let left = T::splat(1.5) * (one - settled);
        T::splat(SETTLING_LEVEL) * if left < one { left } else { one }
    }

    /// Counts samples in a row by the controller's flags. Call it after each [`step`](Self::step).
    ///
    /// Refused samples, for which the output is held ([`status::INVALID_MEASUREMENT`], [`status::INVALID_COMMAND`]),
    /// shut down if they persist, like lost measurements. Samples with a wrong but finite measurement
    /// ([`status::ADAPTATION_FROZEN`], [`status::STUCK_MEASUREMENT`]) trip if they persist, and a shutdown follows the
    /// ramp. An expired calibration ([`status::CALIBRATION_EXPIRED`]) trips.
    #[inline(always)]
    pub fn watch(&self, state: &mut ProtectionState<T>, flags: u32) {
        let raised = |faults: u32| flags & faults != 0;
        count(&mut state.refused_samples, raised(status::INVALID_MEASUREMENT | status::INVALID_COMMAND));
        if state.refused_samples > self.lost_samples {
            state.trip_by(Cause::Refused);
            state.shut_down.set();
        }
        if raised(status::CALIBRATION_EXPIRED) {
            state.trip_by(Cause::CalibrationExpired);
        }
        count(&mut state.faulty_samples, raised(status::ADAPTATION_FROZEN | status::STUCK_MEASUREMENT));
        let trips = self.fault_samples != NEVER && state.faulty_samples > self.fault_samples;
        if trips && !state.tripped.is_set() {
            state.trip_by(Cause::ModelContradicted);
            state.fault_persists = true;
        }
    }

    /// Factor on the valve command (1) since the last [`step`](Self::step).
    pub fn authority(&self, state: &ProtectionState<T>) -> T {
        T::splat(1.0) - state.valve_ramp.share()
    }

    /// The command (N) that the next [`step`](Self::step) will permit for a command (N), if nothing new happens.
    #[inline(always)]
    pub fn preview(&self, state: &ProtectionState<T>, command: T) -> T {
        let follows = command.abs() <= T::splat(LARGEST) && !state.tripped.is_set();
        self.next_command_ramp(state).share::<T>() * if follows { command } else { state.command }
            - state.brake
    }

    #[inline(always)]
    fn next_command_ramp(&self, state: &ProtectionState<T>) -> Position {
        if !(state.tripped.is_set() | state.end_requested) {
            state.command_ramp.up(self.rise)
        } else if state.cause.is_of_sensors() {
            state.command_ramp.down(self.sensor_fall)
        } else if state.cause == Cause::ForceLevel {
            state.command_ramp.down(self.force_fall)
        } else {
            state.command_ramp.down(self.fall)
        }
    }
}

/// Counts samples in a row with a condition.
#[inline(always)]
fn count(counter: &mut u32, condition: bool) {
    *counter = if condition { counter.saturating_add(1) } else { 0 };
}

macro_rules! constructor {
    ($t:ty) => {
        impl Protection<$t> {
            /// From its parameters and the sample rate (Hz).
            ///
            /// # Errors
            /// A level that is negative or not a number, a warning above its trip, a ramp longer than 10⁹ samples, more
            /// than 10⁵ lost samples, a fault time beyond 2³² samples, a period's tolerance that is negative, an
            /// oscillation limit or a sample rate that is not positive.
            pub const fn new(p: &ProtectionParameters, sample_rate: f64) -> Result<Self, ConfigError> {
                let rate = check!(positive("sample_rate", sample_rate));
                check!(within("lost_samples", p.lost_samples as f64, 0.0, 1e5));
                let longest = if p.plausibility.is_some() { LONGEST_SENSOR_FALL } else { f64::MAX };
                let limit = Limit::<$t>::new("displacement_warning", "displacement_trip", p.displacement);
                // A channel has a parameter `spool_warning` of its own.
                let spool = Limit::<$t>::new("protection.spool_warning", "spool_trip", p.spool);
                Ok(Self {
                    force: check!(Limit::<$t>::new("force_warning", "force_trip", p.force)),
                    displacement: check!(limit),
                    velocity: check!(Limit::<$t>::new("velocity_warning", "velocity_trip", p.velocity)),
                    spool: check!(spool),
                    rise: check!(Ramp::new("start_time", p.start_time, rate)),
                    fall: check!(Ramp::new("ramp_time", p.ramp_time, rate)),
                    sensor_fall: check!(Ramp::new(
                        "ramp_time",
                        at_most(LONGEST_SENSOR_FALL, SENSOR_FALL * p.ramp_time),
                        rate
                    )),
                    // A wrong velocity may have driven the force to its level before the watch notices it.
                    force_fall: check!(Ramp::new("ramp_time", at_most(longest, p.ramp_time), rate)),
                    shutdown_ramp: check!(Ramp::new("shutdown_time", p.shutdown_time, rate)),
                    settle_ramp: match &p.plausibility {
                        Some(watch) => Some(check!(Ramp::new("settle_time", watch.settle_time, rate))),
                        None => None,
                    },
                    lost_samples: p.lost_samples,
                    fault_samples: check!(samples("fault_time", p.fault_time, rate)),
                    timing: check!(Timing::<$t>::new(p, rate)),
                    oscillation: check!(OscillationWatch::<$t>::new(p.oscillation_limit, rate)),
                })
            }
        }
    };
}
constructor!(f32);
constructor!(f64);
