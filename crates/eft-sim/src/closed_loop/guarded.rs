//! The protection of a simulated rig: what the configuration says about it, and its place in the loop.

use eft_core::{
    Flags, Levels, Mask, Protected, Protection, ProtectionParameters, ProtectionState, Scalar, status,
};

use crate::config::RigConfig;
use crate::error::{Error, Result};
use crate::rig::Num;
use crate::sensors::Signals;

/// The protection of one actuator, or of several rigs' side by side.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Guarded<S: Scalar> {
    protection: Protection<S>,
    state: ProtectionState<S>,
    /// Factor on the valve command until the next tick.
    pub(crate) authority: S,
}

impl<S: Num> Guarded<S> {
    /// Those of `rig(0)`, `rig(1)`, … one a lane, or none where no lane has it on.
    ///
    /// # Errors
    /// What the core refuses.
    pub(crate) fn new<'a>(rig: impl Fn(usize) -> &'a RigConfig, sample_rate: f64) -> Result<Option<Self>> {
        if !(0..S::LANES).any(|i| rig(i).protection.enabled) {
            return Ok(None);
        }
        let lanes = (0..S::LANES).map(|i| protection(rig(i), sample_rate)).collect::<Result<Vec<_>>>()?;
        Ok(Some(Self {
            protection: Protection::pack(|i| &lanes[i]),
            state: ProtectionState::default(),
            authority: S::splat(1.0),
        }))
    }

    /// The command (N) now and at the next tick that may be followed, and flags.
    pub(crate) fn protect(&mut self, command: S, next: S, measured: &Signals<S>) -> (S, S, S::Flags) {
        let Signals { force, displacement, velocity, spool, .. } = *measured;
        let Protected { command, authority, status } =
            self.protection.step(&mut self.state, command, force, displacement, velocity, spool);
        self.authority = authority;
        (command, self.protection.preview(&self.state, next), status)
    }

    /// What the controller reported of this tick, whose command (N) was let through.
    pub(crate) fn watch(&mut self, status: S::Flags, command: S) {
        let fault = S::Mask::from_lanes(|i| status.lane(i) & status::ADAPTATION_FROZEN != 0);
        self.protection.watch(&mut self.state, fault, command);
    }

    /// Back to the start, nothing tripped.
    pub(crate) fn reset(&mut self) {
        self.state = ProtectionState::default();
        self.authority = S::splat(1.0);
    }

    /// Trips from outside, at a command (N).
    pub(crate) fn trip(&mut self, command: S) {
        self.state.trip(command);
    }

    /// Asks for the soft end.
    pub(crate) fn end(&mut self) {
        self.state.end();
    }
}

impl Guarded<f64> {
    /// Whether nothing has happened since the start.
    pub(crate) fn is_at_rest(&self) -> bool {
        self.state == ProtectionState::default()
    }
}

/// What the configuration says; a lane whose protection is off has no limits.
fn protection(rig: &RigConfig, sample_rate: f64) -> Result<Protection<f64>> {
    let p = &rig.protection;
    let levels = |warning: Option<f64>, trip: Option<f64>| {
        let trip = trip.filter(|_| p.enabled).unwrap_or(f64::MAX);
        Levels { warning: warning.filter(|_| p.enabled).unwrap_or(trip), trip }
    };
    let parameters = ProtectionParameters {
        force: levels(p.force_warning, p.force_trip),
        displacement: levels(p.displacement_warning, p.displacement_trip),
        velocity: levels(p.velocity_warning, p.velocity_trip),
        spool: levels(p.spool_warning, p.spool_trip),
        start_time: if p.enabled { p.start_time } else { 0.0 },
        ramp_time: p.ramp_time,
        shutdown_time: p.shutdown_time,
        lost_samples: if p.enabled { f64::from(p.lost_samples) } else { 1e5 },
        fault_time: p.fault_time.filter(|_| p.enabled).unwrap_or(f64::MAX),
        sample_rate,
    };
    Protection::new(&parameters).map_err(Error::from)
}
