//! Protection of the specimen: limits with warning and trip levels, soft start and end, ramp to zero force.
//!
//! Two stages. A *trip* freezes the force command and takes it to zero along a ramp, the force loop still closed:
//! the specimen is let down gently. A *shutdown* takes the whole valve command to zero, for when the loop itself
//! cannot be trusted: measurements stay lost, the controller refuses its samples and holds its output, a signal goes
//! well beyond its trip level, or the force stays when the ramp is over. A closed valve locks the piston, and a moving mass against locked oil makes a large force: the
//! shutdown must be slow against the specimen's period, or act with a bypass valve across the actuator.

use crate::error::{ConfigError, LARGEST, check, positive, within};
use crate::number::Real;
use crate::protection::limits::{Limit, NEVER, ProtectionParameters, samples};
use crate::protection::ramp::{Position, Ramp};
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
    shut: Ramp,
    lost_samples: u32,
    fault_samples: u32,
}

/// What a protection remembers. `default()` is a rig at rest before the start.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct ProtectionState<T> {
    /// Share of the command that goes through.
    scale: Position,
    /// Share of the valve command that is taken away.
    shut: Position,
    /// The last valid command (N), since a trip the one there was.
    command: T,
    /// Samples in a row of which a measurement is lost, the command is lost, that the controller refused.
    lost: u32,
    unasked: u32,
    refused: u32,
    /// Samples in a row with a fault that the controller reports.
    faulty: u32,
    /// Once a fault has persisted.
    distrusted: bool,
    tripped: bool,
    shut_down: bool,
    /// Once the end is asked for.
    ending: bool,
}

/// One sample's result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Protected<T> {
    /// The force command (N) that may be followed; finite.
    pub command: T,
    /// Factor on the valve command (1).
    pub authority: T,
    /// [`status::PROTECTION_WARNING`], [`status::TRIPPED`], [`status::SHUT_DOWN`], [`status::INVALID_COMMAND`].
    pub status: u32,
}

impl<T: Real> Protection<T> {
    /// One sample: the force command (N) and the measured force (N), displacement (m), velocity (m/s) and spool
    /// opening (1).
    ///
    /// # NaN
    /// A measurement that is not finite counts as lost. In place of a command that is not finite or beyond
    /// [`LARGEST`] the last valid one is followed and [`status::INVALID_COMMAND`] raised; when it stays lost the test
    /// is tripped.
    ///
    /// # Cost
    /// Independent of history.
    #[inline(always)]
    pub fn step(
        &self,
        state: &mut ProtectionState<T>,
        command: T,
        force: T,
        displacement: T,
        velocity: T,
        spool: T,
    ) -> Protected<T> {
        let (zero, one) = (T::splat(0.0), T::splat(1.0));
        let before = state.tripped;
        let commanded = command.abs() <= T::splat(LARGEST);
        if commanded && !before {
            state.command = command;
        }
        count(&mut state.unasked, !commanded);
        let [mut warning, mut trip, mut shutdown, mut valid] = [false, false, false, true];
        for (limit, value) in [
            (&self.force, force),
            (&self.displacement, displacement),
            (&self.velocity, velocity),
            (&self.spool, spool),
        ] {
            let size = value.abs();
            // What is not finite is lost, not large.
            if !(size <= T::splat(f32::MAX as f64)) {
                valid = false;
            } else if size > limit.warning {
                // The levels are in this order.
                warning = true;
                if size > limit.trip {
                    trip = true;
                    shutdown |= size > limit.shutdown;
                }
            }
        }
        count(&mut state.lost, !valid);
        // The ramp is over and the force is still there, or a sensor lied: the loop does not do what it should.
        let unruly = force.abs() > self.force.warning || state.distrusted;
        let stays = before && state.scale.is_zero() && unruly;
        state.shut_down |= state.lost > self.lost_samples || shutdown || stays;
        state.tripped |= state.shut_down || trip || state.unasked > self.lost_samples;
        state.scale = self.next_scale(state);
        state.shut = if state.shut_down { state.shut.up(self.shut) } else { Position::default() };
        let flag = |raised: bool, bit: u32| if raised { bit } else { 0 };
        let scale = state.scale.share::<T>();
        Protected {
            command: if state.scale.is_zero() { zero } else { scale * state.command },
            authority: one - state.shut.share(),
            status: flag(warning, status::PROTECTION_WARNING)
                | flag(state.tripped, status::TRIPPED)
                | flag(state.shut_down, status::SHUT_DOWN)
                | flag(!commanded, status::INVALID_COMMAND),
        }
    }

    /// Counts samples in a row by what the controller reports of them. Those that it refused, so that it holds its
    /// output ([`status::INVALID_MEASUREMENT`], [`status::INVALID_COMMAND`]), shut down when they persist as lost
    /// measurements do. Those of which a measurement cannot be right, though it looks plausible
    /// ([`status::ADAPTATION_FROZEN`], [`status::STUCK_MEASUREMENT`]), trip when they persist; the ramp down is
    /// followed by a shutdown then. After each [`step`](Self::step).
    #[inline(always)]
    pub fn watch(&self, state: &mut ProtectionState<T>, flags: u32) {
        let raised = |faults: u32| flags & faults != 0;
        count(&mut state.refused, raised(status::INVALID_MEASUREMENT | status::INVALID_COMMAND));
        state.shut_down |= state.refused > self.lost_samples;
        count(&mut state.faulty, raised(status::ADAPTATION_FROZEN | status::STUCK_MEASUREMENT));
        let trips = self.fault_samples != NEVER && state.faulty > self.fault_samples && !state.tripped;
        state.tripped |= trips;
        state.distrusted |= trips;
    }

    /// Factor on the valve command (1) since the last [`step`](Self::step).
    pub fn authority(&self, state: &ProtectionState<T>) -> T {
        T::splat(1.0) - state.shut.share()
    }

    /// What the next [`step`](Self::step) will make of a command (N) if nothing new happens.
    #[inline(always)]
    pub fn preview(&self, state: &ProtectionState<T>, command: T) -> T {
        let followed = command.abs() <= T::splat(LARGEST) && !state.tripped;
        self.next_scale(state).share::<T>() * if followed { command } else { state.command }
    }

    #[inline(always)]
    fn next_scale(&self, state: &ProtectionState<T>) -> Position {
        if state.tripped | state.ending { state.scale.down(self.fall) } else { state.scale.up(self.rise) }
    }
}

impl<T: Real> ProtectionState<T> {
    /// Trips from outside, at the last command: an emergency stop, or another actuator of the same specimen.
    pub fn trip(&mut self) {
        self.tripped = true;
    }

    /// Asks for the soft end: the command, still followed, fades along the ramp.
    pub fn end(&mut self) {
        self.ending = true;
    }

    /// Whether the ramp has reached zero.
    pub fn is_down(&self) -> bool {
        self.scale.is_zero()
    }
}

/// Counts how often in a row it has been so.
#[inline(always)]
fn count(counter: &mut u32, so: bool) {
    *counter = if so { counter.saturating_add(1) } else { 0 };
}

macro_rules! constructor {
    ($t:ty) => {
        impl Protection<$t> {
            /// From its parameters and the sample rate (Hz).
            ///
            /// # Errors
            /// A level that is negative or not a number, a warning above its trip, a ramp longer than 10⁹ samples, more
            /// than 10⁵ lost samples, a fault time beyond 2³² samples, a sample rate that is not positive.
            pub const fn new(p: &ProtectionParameters, sample_rate: f64) -> Result<Self, ConfigError> {
                let rate = check!(positive("sample_rate", sample_rate));
                check!(within("lost_samples", p.lost_samples as f64, 0.0, 1e5));
                let limit = Limit::<$t>::new("displacement_warning", "displacement_trip", p.displacement);
                Ok(Self {
                    force: check!(Limit::<$t>::new("force_warning", "force_trip", p.force)),
                    displacement: check!(limit),
                    velocity: check!(Limit::<$t>::new("velocity_warning", "velocity_trip", p.velocity)),
                    spool: check!(Limit::<$t>::new("spool_warning", "spool_trip", p.spool)),
                    rise: check!(Ramp::new("start_time", p.start_time, rate)),
                    fall: check!(Ramp::new("ramp_time", p.ramp_time, rate)),
                    shut: check!(Ramp::new("shutdown_time", p.shutdown_time, rate)),
                    lost_samples: p.lost_samples,
                    fault_samples: check!(samples("fault_time", p.fault_time, rate)),
                })
            }
        }
    };
}
constructor!(f32);
constructor!(f64);

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "shares of a power of two are exact")]
mod tests {
    use super::*;
    use crate::protection::limits::Levels;

    fn protection() -> Protection<f64> {
        let parameters = ProtectionParameters {
            force: Levels { warning: 80.0, trip: 100.0 },
            displacement: Levels { warning: 0.5, trip: 1.0 },
            ramp_time: 0.01,
            shutdown_time: 0.004,
            lost_samples: 3,
            fault_time: 0.005,
            ..ProtectionParameters::DEFAULT
        };
        Protection::<f64>::new(&parameters, 1000.0).unwrap()
    }

    #[test]
    fn within_the_limits_nothing_changes() {
        let (p, mut state) = (protection(), ProtectionState::default());
        for command in [0.0, 40.0, -79.0] {
            let out = p.step(&mut state, command, command, 0.1, 9.0, 1.0);
            assert_eq!((out.command, out.authority, out.status), (command, 1.0, 0));
        }
        assert_eq!(p.step(&mut state, 1.0, -81.0, 0.1, 0.0, 0.0).status, status::PROTECTION_WARNING);
    }

    #[test]
    fn a_trip_takes_the_frozen_command_to_zero_and_stays() {
        let (p, mut state) = (protection(), ProtectionState::default());
        p.step(&mut state, 90.0, 90.0, 0.0, 0.0, 0.0);
        for n in 1..=20 {
            // The force obeys; the command would go on.
            let out =
                p.step(&mut state, 90.0 + f64::from(n), if n == 1 { 101.0 } else { 0.0 }, 0.0, 0.0, 0.0);
            let expected = 91.0 * (1.0 - 0.1 * f64::from(n)).max(0.0);
            assert!((out.command - expected).abs() < 1e-7, "sample {n}: {}", out.command);
            assert_eq!((out.authority, out.status & status::TRIPPED), (1.0, status::TRIPPED));
            assert_eq!(out.status & status::SHUT_DOWN, 0);
        }
    }

    #[test]
    fn far_beyond_the_trip_the_valve_is_shut() {
        let (p, mut state) = (protection(), ProtectionState::default());
        let shares = [0.75, 0.5, 0.25, 0.0, 0.0];
        for share in shares {
            let out = p.step(&mut state, 50.0, -126.0, 0.0, 0.0, 0.0);
            assert_eq!(out.authority, share);
            assert_ne!(out.status & status::SHUT_DOWN, 0);
        }
    }

    #[test]
    fn a_force_that_stays_after_the_ramp_shuts_down() {
        let (p, mut state) = (protection(), ProtectionState::default());
        let shut = |state: &mut _| p.step(state, 50.0, 101.0, 0.0, 0.0, 0.0).status & status::SHUT_DOWN != 0;
        let first = (0..30).position(|_| shut(&mut state));
        // The first step rises to the whole command and trips at once, so the ramp starts from 0.
        assert!(first.is_some_and(|n| n <= 11), "{first:?}");
    }

    #[test]
    fn a_fault_that_persists_trips_and_the_ramp_follows() {
        let (p, mut state) = (protection(), ProtectionState::default());
        let mut command_with = |fault: bool| {
            let out = p.step(&mut state, 60.0, 0.0, 0.1, 0.0, 0.0);
            let flags = if fault { status::ADAPTATION_FROZEN } else { status::SPOOL_WARNING };
            p.watch(&mut state, flags);
            (out.command, out.status)
        };
        for fault in [true, true, true, true, true, false, true, true, true, true, true, true] {
            assert_eq!(command_with(fault), (60.0, 0));
        }
        for n in 1..=12 {
            let expected = 60.0 * (1.0 - 0.1 * f64::from(n)).max(0.0);
            let (command, status) = command_with(false);
            assert!((command - expected).abs() < 1e-7, "sample {n}: {command}");
            let expected = if n > 10 { status::TRIPPED | status::SHUT_DOWN } else { status::TRIPPED };
            assert_eq!(status, expected, "sample {n}");
        }
    }

    #[test]
    fn lost_samples_are_waited_for_then_shut_down() {
        let (p, mut state) = (protection(), ProtectionState::default());
        let mut status_of = |force: f64| p.step(&mut state, 50.0, force, 0.0, 0.0, 0.0).status;
        for force in [1.0, f64::NAN, f64::INFINITY, f64::NAN, 1.0, f64::NAN, f64::NAN, f64::NAN] {
            assert_eq!(status_of(force), 0);
        }
        assert_eq!(status_of(f64::NAN), status::TRIPPED | status::SHUT_DOWN);
        assert_eq!(status_of(1.0), status::TRIPPED | status::SHUT_DOWN);
    }

    #[test]
    fn start_and_end_are_soft_and_foreseen() {
        let soft =
            ProtectionParameters { start_time: 0.004, ramp_time: 0.004, ..ProtectionParameters::DEFAULT };
        let p = Protection::<f64>::new(&soft, 1000.0).unwrap();
        let mut state = ProtectionState::default();
        let step = |state: &mut ProtectionState<f64>| {
            let foreseen = p.preview(state, 8.0);
            let out = p.step(state, 8.0, 0.0, 0.0, 0.0, 0.0);
            assert_eq!(out.command, foreseen);
            assert_eq!(out.status, 0);
            out.command
        };
        assert_eq!([0; 5].map(|_| step(&mut state)), [2.0, 4.0, 6.0, 8.0, 8.0]);
        state.end();
        assert_eq!([0; 5].map(|_| step(&mut state)), [6.0, 4.0, 2.0, 0.0, 0.0]);
        assert!(state.is_down());
    }

    #[test]
    fn bad_parameters_are_named() {
        let made = |p: ProtectionParameters| Protection::<f32>::new(&p, 1000.0);
        let with = |force| made(ProtectionParameters { force, ..ProtectionParameters::DEFAULT });
        assert!(with(Levels::NONE).is_ok());
        assert!(with(Levels { warning: 2.0, trip: 1.0 }).is_err());
        assert!(with(Levels { warning: f64::NAN, trip: 1.0 }).is_err());
        let waiting =
            |lost_samples| made(ProtectionParameters { lost_samples, ..ProtectionParameters::DEFAULT });
        assert!(waiting(100_000).is_ok() && waiting(100_001).is_err());
        let faulty = |fault_time| made(ProtectionParameters { fault_time, ..ProtectionParameters::DEFAULT });
        assert!(faulty(4e6).is_ok() && faulty(5e6).is_err() && faulty(f64::NAN).is_err());
    }
}
