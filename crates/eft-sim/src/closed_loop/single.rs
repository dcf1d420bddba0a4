//! Plant and digital side tied together, one actuator a rig: one tick at a time.

use eft_core::{Scalar, status};

use crate::closed_loop::controller::Precision;
use crate::closed_loop::digital_side::{Decision, DigitalSide, DigitalState, Outside};
use crate::config::RigConfig;
use crate::error::Result;
use crate::rig::{DetailedPlant, DetailedState, Driver, EnergyBalance, Num, Pace, PlantModel, PlantState};

/// What is true, and what the digital side made of it, at one tick, before the tick's output acts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tick<S: Num> {
    pub(crate) plant: PlantState<S>,
    pub(crate) force: S,
    pub(crate) supply_pressure: S,
    pub(crate) decision: Decision<S>,
    pub(crate) status: S::Flags,
}

/// The sampled closed loop of one rig, or of several side by side; `C` is the controller's number.
pub(crate) struct ClosedLoop<S: Num, C: Scalar, P: PlantModel<S>> {
    plant: P,
    digital: DigitalSide<S, C>,
    pace: Pace,
}

/// Everything that changes from tick to tick and fits into registers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LoopState<C: Scalar, X> {
    plant: X,
    digital: DigitalState<C>,
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
        LoopState { plant: self.plant.at_rest(), digital: DigitalState::default() }
    }

    /// Samples, and decides what drives the valve until the next tick; `next_command` is the command then.
    #[inline(always)]
    pub(crate) fn sample(
        &mut self,
        state: &mut LoopState<C, P::State>,
        command: S,
        next_command: S,
    ) -> Tick<S> {
        let (plant, now) = (&self.plant, &state.plant);
        let truth = plant.signals(now);
        let decision =
            self.digital.sample(&mut state.digital, command, next_command, truth, |driver| match driver {
                Driver::Held(held) => plant.driven_command(now, held),
                Driver::Analog(analog) => plant.driven_command(now, analog),
                Driver::ThroughCell(analog) => plant.driven_command(now, analog),
            });
        let (at_stop, beyond_stroke) = plant.at_limits(now);
        let limits = S::flag(at_stop, status::SPOOL_STOP) | S::flag(beyond_stroke, status::STROKE_EXCEEDED);
        Tick {
            plant: *P::core(now),
            force: plant.force(now),
            supply_pressure: truth.supply_pressure,
            status: decision.status | limits,
            decision,
        }
    }

    /// Puts a controller from outside in the place of the rig's own.
    pub(crate) fn controlled_by(&mut self, outside: Outside) {
        self.digital.controlled_by(outside);
    }

    /// Asks the protection, where there is one, for the soft end.
    pub(crate) fn end(&mut self) {
        self.digital.end();
    }

    /// Carries the plant to the next tick under what the last sample decided.
    #[inline(always)]
    pub(crate) fn advance(&self, state: &mut LoopState<C, P::State>, driver: &Driver<S>) {
        let (plant, now, pace) = (&self.plant, state.plant, self.pace);
        state.plant = match driver {
            Driver::Held(held) => plant.advance_driven(now, held, pace),
            Driver::Analog(analog) => plant.advance_driven(now, analog, pace),
            Driver::ThroughCell(analog) => plant.advance_driven(now, analog, pace),
        };
    }
}

impl<C: Scalar<Flags = u32>> ClosedLoop<f64, C, DetailedPlant<f64>> {
    /// Where the energy went so far.
    pub(crate) fn balance(&self, state: &LoopState<C, DetailedState<f64>>) -> EnergyBalance {
        self.plant.balance(&self.plant.at_rest(), &state.plant, 0)
    }
}
