//! Levels and times of a protection in its precision.

use crate::error::{ConfigError, check, range, within};
use crate::integrity::integrity;
use crate::parameters::Levels;

/// A signal this many times its trip level shuts down at once.
const SHUTDOWN_AT: f64 = 1.25;

/// One signal's levels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limit<T> {
    pub(crate) warning: T,
    pub(crate) trip: T,
    pub(crate) shutdown: T,
}
integrity!(Limit<T>: warning, trip, shutdown);

macro_rules! constructor {
    ($t:ty) => {
        impl Limit<$t> {
            /// From a signal's levels; the names are for errors.
            pub(crate) const fn new(
                warning_name: &'static str,
                trip_name: &'static str,
                levels: Levels,
            ) -> Result<Self, ConfigError> {
                let trip = check!(range(trip_name, levels.trip));
                // Without a warning level the trip level is the warning's, so the trip comes first.
                let warning = check!(range(warning_name, levels.warning));
                let warning = if levels.warning < f64::MAX {
                    check!(within(warning_name, warning, 0.0, trip))
                } else {
                    trip
                };
                Ok(Self {
                    warning: warning as $t,
                    trip: trip as $t,
                    shutdown: check!(range(trip_name, SHUTDOWN_AT * trip)) as $t,
                })
            }
        }
    };
}
constructor!(f32);
constructor!(f64);

/// A number of samples that no count reaches.
pub(crate) const NEVER: u32 = u32::MAX;

/// Samples in a time (s) at a rate (Hz); [`NEVER`] for `f64::MAX`.
pub(crate) const fn samples(name: &'static str, time: f64, rate: f64) -> Result<u32, ConfigError> {
    if time >= f64::MAX {
        return Ok(NEVER);
    }
    let samples = check!(within(name, time, 0.0, (NEVER - 1) as f64 / rate)) * rate;
    Ok(samples as u32)
}
