//! Protection of the specimen: limits with warning and trip levels, soft start and end, ramp to zero force.
//!
//! Two stages. A *trip* freezes the force command and takes it to zero along a ramp, the force loop still closed:
//! the specimen is let down gently. A *shutdown* takes the whole valve command to zero, for when the loop itself
//! cannot be trusted: measurements stay lost, the controller refuses its samples and holds its output, a signal goes
//! well beyond its trip level, or the force stays when the ramp is over. A closed valve locks the piston, and a moving mass against locked oil makes a large force: the
//! shutdown must be slow against the specimen's period, or act with a bypass valve across the actuator.

use crate::controller::ControllerOutput;
use crate::error::{ConfigError, LARGEST, check, positive, range, whole};
use crate::protection_parameters::{Limit, ProtectionParameters, share};
use crate::scalar::{Flags, Mask, Scalar};
use crate::status;

/// A protection's immutable configuration; one drives any number of channels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Protection<S> {
    force: Limit<S>,
    displacement: Limit<S>,
    velocity: Limit<S>,
    spool: Limit<S>,
    rise: S,
    fall: S,
    shut: S,
    lost_samples: S,
    fault_samples: S,
}

/// What a protection remembers. `default()` is a rig at rest before the start.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct ProtectionState<S> {
    /// Share of the command (1) that goes through.
    scale: S,
    /// Share of the valve command (1) that is taken away.
    shut_share: S,
    /// The last valid command (N), since a trip the one there was.
    command: S,
    /// Samples in a row (1) of which a measurement is lost, the command is lost, that the controller refused.
    lost: S,
    unasked: S,
    refused: S,
    /// Samples in a row with a fault that the controller reports (1).
    faulty: S,
    /// 1 once a fault has persisted.
    distrusted: S,
    /// 1 once tripped, once shut down, once the end is asked for.
    tripped: S,
    shut_down: S,
    ending: S,
}

/// One sample's result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Protected<S: Scalar> {
    /// The force command (N) that may be followed; finite.
    pub command: S,
    /// Factor on the valve command (1).
    pub authority: S,
    /// [`status::PROTECTION_WARNING`], [`status::TRIPPED`], [`status::SHUT_DOWN`], [`status::INVALID_COMMAND`].
    pub status: S::Flags,
}

impl<S: Scalar> Protection<S> {
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
        state: &mut ProtectionState<S>,
        command: S,
        force: S,
        displacement: S,
        velocity: S,
        spool: S,
    ) -> Protected<S> {
        let (zero, one, half) = (S::splat(0.0), S::splat(1.0), S::splat(0.5));
        let before = state.tripped.gt(half);
        let commanded = command.abs().le(S::splat(LARGEST));
        state.command = S::select(commanded & !before, command, state.command);
        state.unasked = in_a_row(state.unasked, !commanded);
        let most = S::splat(f32::MAX as f64);
        let mut valid = S::Mask::splat(true);
        let mut size = |value: S| {
            let finite = value.abs().le(most);
            valid = valid & finite;
            // What is not finite is lost, not large.
            S::select(finite, value.abs(), zero)
        };
        let sizes = [
            (self.force, size(force)),
            (self.displacement, size(displacement)),
            (self.velocity, size(velocity)),
            (self.spool, size(spool)),
        ];
        let over = |level: fn(&Limit<S>) -> S| {
            sizes.iter().fold(S::Mask::splat(false), |any, (limit, size)| any | size.gt(level(limit)))
        };
        state.lost = in_a_row(state.lost, !valid);
        let lost = state.lost.gt(self.lost_samples);
        // The ramp is over and the force is still there, or a sensor lied: the loop does not do what it should.
        let unruly = force.abs().gt(self.force.warning) | state.distrusted.gt(half);
        let stays = before & state.scale.le(zero) & unruly;
        let shut = state.shut_down.gt(half) | lost | over(|limit| limit.shutdown) | stays;
        let tripped = before | shut | over(|limit| limit.trip) | state.unasked.gt(self.lost_samples);
        state.tripped = S::select(tripped, one, zero);
        state.shut_down = S::select(shut, one, zero);
        state.scale = self.next_scale(state);
        state.shut_share = S::select(shut, (state.shut_share + self.shut).limit(zero, one), zero);
        let warning = over(|limit| limit.warning);
        Protected {
            command: state.scale * state.command,
            authority: one - state.shut_share,
            status: S::flag(warning, status::PROTECTION_WARNING)
                | S::flag(tripped, status::TRIPPED)
                | S::flag(shut, status::SHUT_DOWN)
                | S::flag(!commanded, status::INVALID_COMMAND),
        }
    }

    /// Counts samples in a row by what the controller reports of them. Those that it refused, so that it holds its
    /// output ([`status::INVALID_MEASUREMENT`], [`status::INVALID_COMMAND`]), shut down when they persist as lost
    /// measurements do. Those of which a measurement cannot be right, though it looks plausible
    /// ([`status::ADAPTATION_FROZEN`], [`status::STUCK_MEASUREMENT`]), trip when they persist; the ramp down is
    /// followed by a shutdown then. After each [`step`](Self::step).
    #[inline(always)]
    pub fn watch(&self, state: &mut ProtectionState<S>, flags: S::Flags) {
        let raised = |faults: u32| S::Mask::from_lanes(|i| flags.lane(i) & faults != 0);
        let one = S::splat(1.0);
        state.refused =
            in_a_row(state.refused, raised(status::INVALID_MEASUREMENT | status::INVALID_COMMAND));
        state.shut_down = S::select(state.refused.gt(self.lost_samples), one, state.shut_down);
        state.faulty = in_a_row(state.faulty, raised(status::ADAPTATION_FROZEN | status::STUCK_MEASUREMENT));
        let before = state.tripped.gt(S::splat(0.5));
        let trips = state.faulty.gt(self.fault_samples) & !before;
        state.tripped = S::select(trips, one, state.tripped);
        state.distrusted = S::select(trips, one, state.distrusted);
    }

    /// The controller's output as it may drive the valve: the authority on its valve command, the flags of both. What
    /// the controller refused, faults that it reports, and a stuck sensor are [watched](Self::watch). After each
    /// [`step`](Self::step), with what this gave.
    ///
    /// # Cost
    /// Independent of history.
    #[inline(always)]
    pub fn apply(
        &self,
        state: &mut ProtectionState<S>,
        protected: &Protected<S>,
        output: ControllerOutput<S>,
    ) -> ControllerOutput<S> {
        self.watch(state, output.status);
        ControllerOutput {
            valve_command: output.valve_command * protected.authority,
            status: output.status | protected.status,
            ..output
        }
    }

    /// What the next [`step`](Self::step) will make of a command (N) if nothing new happens.
    #[inline(always)]
    pub fn preview(&self, state: &ProtectionState<S>, command: S) -> S {
        let followed = command.abs().le(S::splat(LARGEST)) & !state.tripped.gt(S::splat(0.5));
        self.next_scale(state) * S::select(followed, command, state.command)
    }

    /// Protections of single rigs side by side.
    pub fn pack<'a>(lane: impl Fn(usize) -> &'a Protection<S::Element>) -> Self
    where
        S::Element: 'a,
    {
        let limit = |pick: fn(&Protection<S::Element>) -> &Limit<S::Element>| Limit {
            warning: S::from_lanes(|i| pick(lane(i)).warning),
            trip: S::from_lanes(|i| pick(lane(i)).trip),
            shutdown: S::from_lanes(|i| pick(lane(i)).shutdown),
        };
        Self {
            force: limit(|p| &p.force),
            displacement: limit(|p| &p.displacement),
            velocity: limit(|p| &p.velocity),
            spool: limit(|p| &p.spool),
            rise: S::from_lanes(|i| lane(i).rise),
            fall: S::from_lanes(|i| lane(i).fall),
            shut: S::from_lanes(|i| lane(i).shut),
            lost_samples: S::from_lanes(|i| lane(i).lost_samples),
            fault_samples: S::from_lanes(|i| lane(i).fault_samples),
        }
    }

    #[inline(always)]
    fn next_scale(&self, state: &ProtectionState<S>) -> S {
        let down = (state.tripped + state.ending).gt(S::splat(0.5));
        let change = S::select(down, -self.fall, self.rise);
        (state.scale + change).limit(S::splat(0.0), S::splat(1.0))
    }
}

impl<S: Scalar> ProtectionState<S> {
    /// Trips from outside, at the last command: an emergency stop, or another actuator of the same specimen.
    pub fn trip(&mut self) {
        self.tripped = S::splat(1.0);
    }

    /// Asks for the soft end: the command, still followed, fades along the ramp.
    pub fn end(&mut self) {
        self.ending = S::splat(1.0);
    }

    /// Where the ramp has reached zero.
    pub fn is_down(&self) -> S::Mask {
        self.scale.le(S::splat(0.0))
    }
}

/// How many samples in a row (1) it has been so.
#[inline(always)]
fn in_a_row<S: Scalar>(count: S, so: S::Mask) -> S {
    S::select(so, count + S::splat(1.0), S::splat(0.0))
}

macro_rules! constructor {
    ($t:ty) => {
        impl Protection<$t> {
            /// From its parameters.
            ///
            /// # Errors
            /// A level that is negative or not a number, a warning above its trip, a time outside [0, 1e6] s, lost
            /// samples that are no whole number in [0, 1e5], a sample rate that is not positive.
            pub const fn new(p: &ProtectionParameters) -> Result<Self, ConfigError> {
                let rate = check!(positive("sample_rate", p.sample_rate));
                Ok(Self {
                    force: check!(Limit::<$t>::new("force_warning", "force_trip", p.force)),
                    displacement: check!(Limit::<$t>::new(
                        "displacement_warning",
                        "displacement_trip",
                        p.displacement
                    )),
                    velocity: check!(Limit::<$t>::new("velocity_warning", "velocity_trip", p.velocity)),
                    spool: check!(Limit::<$t>::new("spool_warning", "spool_trip", p.spool)),
                    rise: check!(share("start_time", p.start_time, rate)) as $t,
                    fall: check!(share("ramp_time", p.ramp_time, rate)) as $t,
                    shut: check!(share("shutdown_time", p.shutdown_time, rate)) as $t,
                    lost_samples: check!(whole("lost_samples", p.lost_samples, 1e5)) as $t,
                    // Beyond what the count can reach where there is no limit.
                    fault_samples: check!(range(
                        "fault_time",
                        check!(range("fault_time", p.fault_time)) * rate
                    )) as $t,
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
    use crate::protection_parameters::Levels;

    fn protection() -> Protection<f64> {
        Protection::<f64>::new(&ProtectionParameters {
            force: Levels { warning: 80.0, trip: 100.0 },
            displacement: Levels { warning: 0.5, trip: 1.0 },
            velocity: Levels::NONE,
            spool: Levels::NONE,
            start_time: 0.0,
            ramp_time: 0.01,
            shutdown_time: 0.004,
            lost_samples: 3.0,
            fault_time: 0.005,
            sample_rate: 1000.0,
        })
        .unwrap()
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
            assert!((out.command - expected).abs() < 1e-9, "sample {n}: {}", out.command);
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
            assert!((command - expected).abs() < 1e-9, "sample {n}: {command}");
            let expected = if n > 11 { status::TRIPPED | status::SHUT_DOWN } else { status::TRIPPED };
            assert_eq!(status, expected, "sample {n}");
        }
    }

    #[test]
    fn the_controllers_output_is_scaled_flagged_and_watched() {
        let (p, mut state, mut watched) =
            (protection(), ProtectionState::default(), ProtectionState::default());
        for n in 0..40_u32 {
            // Lost from the tenth sample on.
            let force = if n < 10 { 20.0 } else { f64::NAN };
            let permitted = p.step(&mut state, 50.0, force, 0.1, 0.0, 0.0);
            let flags = if n > 2 { status::STUCK_MEASUREMENT } else { 0 };
            let output = ControllerOutput { valve_command: 4.0, compensation: 3.0, status: flags };
            let out = p.apply(&mut state, &permitted, output);
            assert_eq!(p.step(&mut watched, 50.0, force, 0.1, 0.0, 0.0), permitted);
            p.watch(&mut watched, flags);
            assert_eq!(state, watched);
            assert_eq!((out.valve_command, out.compensation), (4.0 * permitted.authority, 3.0));
            assert_eq!(out.status, flags | permitted.status);
            // Five samples are waited for; the trip shows at the next.
            assert_eq!(out.status & status::TRIPPED != 0, n > 8, "{n}");
            assert_eq!(permitted.authority < 1.0, n >= 13, "{n}");
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
        let p = Protection::<f64>::new(&ProtectionParameters {
            force: Levels::NONE,
            displacement: Levels::NONE,
            velocity: Levels::NONE,
            spool: Levels::NONE,
            start_time: 0.004,
            ramp_time: 0.004,
            shutdown_time: 0.0,
            lost_samples: 0.0,
            fault_time: f64::MAX,
            sample_rate: 1000.0,
        })
        .unwrap();
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
        let with = |force| {
            Protection::<f32>::new(&ProtectionParameters {
                force,
                displacement: Levels::NONE,
                velocity: Levels::NONE,
                spool: Levels::NONE,
                start_time: 0.0,
                ramp_time: 0.0,
                shutdown_time: 0.0,
                lost_samples: 0.0,
                fault_time: f64::MAX,
                sample_rate: 1000.0,
            })
        };
        assert!(with(Levels::NONE).is_ok());
        assert!(with(Levels { warning: 2.0, trip: 1.0 }).is_err());
        assert!(with(Levels { warning: f64::NAN, trip: 1.0 }).is_err());
        let waiting = |lost_samples| {
            let levels = Levels::NONE;
            Protection::<f64>::new(&ProtectionParameters {
                force: levels,
                displacement: levels,
                velocity: levels,
                spool: levels,
                start_time: 0.0,
                ramp_time: 0.0,
                shutdown_time: 0.0,
                lost_samples,
                fault_time: f64::MAX,
                sample_rate: 1000.0,
            })
        };
        let refusal = waiting(0.5).unwrap_err();
        assert_eq!(refusal, ConfigError::NotWhole { parameter: "lost_samples", value: 0.5 });
        assert!(waiting(1e5).is_ok() && waiting(1e5 + 1.0).is_err() && waiting(f64::NAN).is_err());
    }
}
