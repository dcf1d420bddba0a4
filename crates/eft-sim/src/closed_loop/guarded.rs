//! The protection of a simulated rig: what the configuration says about it, and its place in the loop.

use eft_core::{
    ControllerOutput, Levels, Protected, Protection, ProtectionParameters, ProtectionState, Scalar,
};

use crate::closed_loop::controller::Precision;
use crate::closed_loop::signals::convert;
use crate::config::RigConfig;
use crate::error::Result;
use crate::rig::Num;
use crate::sensors::Signals;

/// The protection of one actuator, or of several rigs' side by side, in the controller's precision.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Guarded<C: Scalar> {
    protection: Protection<C>,
    state: ProtectionState<C>,
    last: Protected<C>,
}

impl<C: Scalar> Guarded<C>
where
    C::Element: Precision,
{
    /// Those of `rig(0)`, `rig(1)`, … one a lane, or none where no lane has it on.
    ///
    /// # Errors
    /// What the core refuses.
    pub(crate) fn new<'a>(rig: impl Fn(usize) -> &'a RigConfig, sample_rate: f64) -> Result<Option<Self>> {
        if !(0..C::LANES).any(|i| rig(i).protection.enabled) {
            return Ok(None);
        }
        let lanes = (0..C::LANES)
            .map(|i| C::Element::protection(&protection_parameters(rig(i), sample_rate)))
            .collect::<Result<Vec<_>>>()?;
        Ok(Some(Self {
            protection: Protection::pack(|i| &lanes[i]),
            state: ProtectionState::default(),
            last: untouched(),
        }))
    }

    /// The command (N) now and at the next tick that may be followed, and flags.
    pub(crate) fn protect<S: Num>(&mut self, command: S, next: S, measured: &Signals<S>) -> (C, C, C::Flags) {
        self.last = self.protection.step(
            &mut self.state,
            convert(command),
            convert(measured.force),
            convert(measured.displacement),
            convert(measured.velocity),
            convert(measured.spool),
        );
        (self.last.command, self.protection.preview(&self.state, convert(next)), self.last.status)
    }

    /// What a whole controller's output becomes.
    pub(crate) fn apply(&mut self, output: ControllerOutput<C>) -> ControllerOutput<C> {
        self.protection.apply(&mut self.state, &self.last, output)
    }

    /// Factor on the valve command until the next tick.
    pub(crate) fn authority(&self) -> C {
        self.last.authority
    }

    /// What a compensation alone reported of this tick.
    pub(crate) fn watch(&mut self, status: C::Flags) {
        self.protection.watch(&mut self.state, status);
    }

    /// Back to the start, nothing tripped.
    pub(crate) fn reset(&mut self) {
        self.state = ProtectionState::default();
        self.last = untouched();
    }

    /// Trips from outside.
    pub(crate) fn trip(&mut self) {
        self.state.trip();
    }

    /// Asks for the soft end.
    pub(crate) fn end(&mut self) {
        self.state.end();
    }
    /// Whether nothing has happened since the start.
    pub(crate) fn is_at_rest(&self) -> bool {
        self.state == ProtectionState::default()
    }
}

fn untouched<C: Scalar>() -> Protected<C> {
    Protected { command: C::splat(0.0), authority: C::splat(1.0), status: C::Flags::default() }
}

/// What the configuration says; a rig whose protection is off has no limits.
pub(crate) fn protection_parameters(rig: &RigConfig, sample_rate: f64) -> ProtectionParameters {
    let p = &rig.protection;
    let levels = |warning: Option<f64>, trip: Option<f64>| {
        let trip = trip.filter(|_| p.enabled).unwrap_or(f64::MAX);
        Levels { warning: warning.filter(|_| p.enabled).unwrap_or(trip), trip }
    };
    ProtectionParameters {
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
    }
}
