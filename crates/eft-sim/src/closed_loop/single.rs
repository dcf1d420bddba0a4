//! Plant and digital side tied together, one actuator a rig: one tick at a time.

use eft_core::{Scalar, status};

use crate::closed_loop::controller::Precision;
use crate::closed_loop::digital_side::{Decision, DigitalSide};
use crate::config::RigConfig;
use crate::error::Result;
use crate::rig::{DetailedPlant, Driver, EnergyBalance, Num, PlantModel, PlantState};

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
    state: P::State,
    digital: DigitalSide<S, C>,
    sample_rate: f64,
    steps: u32,
}

impl<S: Num, C: Scalar<Flags = S::Flags>, P: PlantModel<S>> ClosedLoop<S, C, P>
where
    C::Element: Precision,
{
    /// The loops of `rig(0)`, `rig(1)`, … at rest, one a lane; all of one realization.
    pub(crate) fn new<'a>(
        rig: impl Fn(usize) -> &'a RigConfig,
        sample_rate: f64,
        steps: u32,
    ) -> Result<Self> {
        let plant = P::pack(&rig)?;
        Ok(Self {
            state: plant.at_rest(),
            plant,
            digital: DigitalSide::new(&rig, sample_rate, 0)?,
            sample_rate,
            steps,
        })
    }

    /// Samples, and decides what drives the valve until the next tick; `next_command` is the command then.
    #[inline(always)]
    pub(crate) fn sample(&mut self, command: S, next_command: S) -> Tick<S> {
        let (plant, state) = (&self.plant, &self.state);
        let truth = plant.signals(state);
        let decision = self.digital.sample(command, next_command, truth, |driver| match driver {
            Driver::Held(held) => plant.driven_command(state, held),
            Driver::Analog(analog) => plant.driven_command(state, analog),
            Driver::ThroughCell(analog) => plant.driven_command(state, analog),
        });
        let (at_stop, beyond_stroke) = plant.at_limits(state);
        let limits = S::flag(at_stop, status::SPOOL_STOP) | S::flag(beyond_stroke, status::STROKE_EXCEEDED);
        Tick {
            plant: *P::core(state),
            force: plant.force(state),
            supply_pressure: truth.supply_pressure,
            status: decision.status | limits,
            decision,
        }
    }

    /// Asks the protection, where there is one, for the soft end.
    pub(crate) fn end(&mut self) {
        self.digital.end();
    }

    /// Carries the plant to the next tick.
    #[inline(always)]
    pub(crate) fn advance(&mut self) {
        let period = 1.0 / self.sample_rate;
        let (plant, state, steps) = (&self.plant, self.state, self.steps);
        self.state = match self.digital.driver() {
            Driver::Held(held) => plant.advance_driven(state, &held, period, steps),
            Driver::Analog(analog) => plant.advance_driven(state, &analog, period, steps),
            Driver::ThroughCell(analog) => plant.advance_driven(state, &analog, period, steps),
        };
    }
}

impl<C: Scalar<Flags = u32>> ClosedLoop<f64, C, DetailedPlant<f64>> {
    /// Where the energy went so far.
    pub(crate) fn balance(&self) -> EnergyBalance {
        self.plant.balance(&self.plant.at_rest(), &self.state, 0)
    }
}
