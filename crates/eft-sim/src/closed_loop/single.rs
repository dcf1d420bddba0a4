//! Plant and digital side tied together, one actuator a rig: one tick at a time.

use eft_core::{ControllerState, Scalar, status};

use crate::closed_loop::controller::Precision;
use crate::closed_loop::digital_side::{Decision, DigitalSide, Driven};
use crate::closed_loop::outside::Outside;
use crate::config::RigConfig;
use crate::error::Result;
use crate::rig::{
    DetailedPlant, DetailedState, Driver, DriverKind, EnergyBalance, Num, Pace, PlantModel, PlantState,
};

/// What is true, and what the digital side made of it, at one tick, before the tick's output acts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tick<S: Num> {
    pub(crate) plant: PlantState<S>,
    pub(crate) force: S,
    pub(crate) supply_pressure: S,
    pub(crate) acceleration: S,
    pub(crate) decision: Decision<S>,
    pub(crate) status: S::Flags,
}

/// The sampled closed loop of one rig, or of several side by side; `C` is the controller's number.
pub(crate) struct ClosedLoop<S: Num, C: Scalar, P: PlantModel<S>>
where
    C::Element: Precision,
{
    plant: P,
    digital: DigitalSide<S, C>,
    pace: Pace,
}

/// A plant in a state.
struct Standing<'a, P, X> {
    plant: &'a P,
    state: &'a X,
}

impl<S: Num, P: PlantModel<S>> Driven<S> for Standing<'_, P, P::State> {
    #[inline(always)]
    fn command(&self, driver: &Driver<S>) -> S {
        match driver.kind {
            DriverKind::Held => self.plant.driven_command(self.state, &driver.held),
            DriverKind::Analog => self.plant.driven_command(self.state, &driver.cell.analog()),
            DriverKind::ThroughCell => self.plant.driven_command(self.state, &driver.cell),
        }
    }
}

/// Everything that changes from tick to tick and fits into registers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LoopState<C: Scalar, X> {
    plant: X,
    digital: ControllerState<C>,
}

impl<S: Num, C: Scalar<Flags = S::Flags>, P: PlantModel<S>> ClosedLoop<S, C, P>
where
    C::Element: Precision,
{
    /// The loops of `rig(0)`, `rig(1)`, … one a lane; all of one realization.
    pub(crate) fn new<'a>(rig: impl Fn(usize) -> &'a RigConfig, pace: Pace) -> Result<Self> {
        Ok(Self { plant: P::pack(&rig, pace)?, digital: DigitalSide::new(&rig, pace.sample_rate, 0)?, pace })
    }

    /// The state at rest.
    pub(crate) fn at_rest(&self) -> LoopState<C, P::State> {
        LoopState { plant: self.plant.at_rest(), digital: ControllerState::default() }
    }

    /// Whether all the rest is what [`DigitalSide::is_plain`] says.
    pub(crate) fn is_plain(&self) -> bool {
        self.digital.is_plain()
    }

    /// Samples, and decides what drives the valve until the next tick; `next_command` is the command then.
    /// `PLAIN` is what [`is_plain`](Self::is_plain) says.
    #[inline(always)]
    pub(crate) fn sample<const PLAIN: bool>(
        &mut self,
        state: &mut LoopState<C, P::State>,
        command: S,
        next_command: S,
    ) -> Tick<S> {
        let (plant, now) = (&self.plant, &state.plant);
        let truth = plant.signals(now);
        let standing = Standing { plant, state: now };
        let decision =
            self.digital.sample::<PLAIN>(&mut state.digital, command, next_command, truth, &standing);
        let (at_stop, beyond_stroke) = plant.at_limits(now);
        let limits = S::flag(at_stop, status::SPOOL_STOP) | S::flag(beyond_stroke, status::STROKE_EXCEEDED);
        Tick {
            plant: *P::core(now),
            force: plant.force(now),
            supply_pressure: truth.supply_pressure,
            acceleration: truth.acceleration,
            status: decision.status | limits,
            decision,
        }
    }

    /// Puts a controller from outside in the place of the rig's own.
    pub(crate) fn controlled_by(&mut self, outside: Outside) {
        self.digital.controlled_by(outside);
    }

    /// Where the plant's state is one to go on from.
    #[inline(always)]
    pub(crate) fn is_bounded(&self, state: &LoopState<C, P::State>) -> S::Mask {
        P::core(&state.plant).is_bounded()
    }

    /// Puts the plants back to rest where the mask is true.
    pub(crate) fn restart(&self, state: &mut LoopState<C, P::State>, at: S::Mask) {
        state.plant = self.plant.restarted(state.plant, at);
    }

    /// As [`DigitalSide::found_flows`].
    pub(crate) fn found_flows(&self, openings: &[f64], lane: usize) -> Option<Vec<f64>> {
        self.digital.found_flows(openings, lane)
    }

    /// Asks the protection, where there is one, for the soft end.
    pub(crate) fn end(&mut self) {
        self.digital.end();
    }

    /// What of the way to the next tick can be computed beside the sample.
    #[inline(always)]
    pub(crate) fn look_ahead(&self, state: &LoopState<C, P::State>) -> P::Ahead {
        self.plant.look_ahead(&state.plant)
    }

    /// Carries the plant to the next tick under what the last sample decided.
    #[inline(always)]
    pub(crate) fn advance(&self, state: &mut LoopState<C, P::State>, ahead: P::Ahead, driver: &Driver<S>) {
        let (plant, now, pace) = (&self.plant, state.plant, self.pace);
        state.plant = match driver.kind {
            DriverKind::Held => plant.advance_driven(now, ahead, &driver.held, pace),
            DriverKind::Analog => plant.advance_driven(now, ahead, &driver.cell.analog(), pace),
            DriverKind::ThroughCell => plant.advance_driven(now, ahead, &driver.cell, pace),
        };
    }
}

impl<C: Scalar<Flags = u32>> ClosedLoop<f64, C, DetailedPlant<f64>>
where
    C::Element: Precision,
{
    /// Where the energy went so far.
    pub(crate) fn balance(&self, state: &LoopState<C, DetailedState<f64>>) -> EnergyBalance {
        self.plant.balance(&self.plant.at_rest(), &state.plant, 0)
    }
}
