//! What a protection is made from: levels, times, and what they are in its own precision.

use crate::error::{ConfigError, check, range, within};

/// A signal this many times its trip level shuts down at once.
const SHUTDOWN_AT: f64 = 1.25;

/// Warning and trip level of one signal, in its unit; `f64::MAX` is no limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Levels {
    /// Above it [`PROTECTION_WARNING`](crate::status::PROTECTION_WARNING) is raised.
    pub warning: f64,
    /// Above it the test is tripped.
    pub trip: f64,
}

impl Levels {
    /// No limit.
    pub const NONE: Self = Self { warning: f64::MAX, trip: f64::MAX };
}

/// What a protection is made from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProtectionParameters {
    /// Levels of the force (N).
    pub force: Levels,
    /// Levels of the displacement (m).
    pub displacement: Levels,
    /// Levels of the velocity (m/s).
    pub velocity: Levels,
    /// Levels of the spool opening (1).
    pub spool: Levels,
    /// Time (s) from zero to the whole command at the start; 0 for none.
    pub start_time: f64,
    /// Time (s) from the whole command to zero after a trip or at the end.
    pub ramp_time: f64,
    /// Time (s) from the whole valve command to zero in a shutdown.
    pub shutdown_time: f64,
    /// So many lost or refused samples in a row (1), a whole number, are waited for before the shutdown; so many lost
    /// commands before the trip.
    pub lost_samples: f64,
    /// Time (s) for which a fault that the controller reports is waited for before the trip; `f64::MAX` for ever.
    pub fault_time: f64,
    /// Sample rate (Hz).
    pub sample_rate: f64,
}

/// One signal's levels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limit<S> {
    pub(crate) warning: S,
    pub(crate) trip: S,
    pub(crate) shutdown: S,
}

macro_rules! constructor {
    ($t:ty) => {
        impl Limit<$t> {
            /// Of a signal's levels; the names are those of the errors.
            pub(crate) const fn new(
                warning: &'static str,
                trip: &'static str,
                levels: Levels,
            ) -> Result<Self, ConfigError> {
                let highest = check!(range(trip, levels.trip));
                let lowest = check!(range(warning, levels.warning));
                check!(within(warning, lowest, 0.0, highest));
                Ok(Self {
                    warning: lowest as $t,
                    trip: highest as $t,
                    shutdown: check!(range(trip, SHUTDOWN_AT * highest)) as $t,
                })
            }
        }
    };
}
constructor!(f32);
constructor!(f64);

/// The share (1) of a ramp of a time (s) that one sample makes at a rate (Hz).
pub(crate) const fn share(name: &'static str, time: f64, rate: f64) -> Result<f64, ConfigError> {
    let samples = check!(within(name, time, 0.0, 1e6)) * rate;
    Ok(if samples > 1.0 { 1.0 / samples } else { 1.0 })
}
