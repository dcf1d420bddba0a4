//! Plant and controller tied together: one tick at a time.

use eft_core::{ControllerState, Real, Scalar, status};

use crate::closed_loop::controller::{Precision, RigController};
use crate::closed_loop::delay_line::DelayLine;
use crate::config::{Realization, RigConfig};
use crate::error::Result;
use crate::rig::{Analog, Held, Num, Plant, PlantState};

/// What is true, and what the controller made of it, at one tick, before the tick's output acts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tick<S: Num> {
    pub(crate) plant: PlantState<S>,
    pub(crate) force: S,
    pub(crate) valve_command: S,
    pub(crate) compensation: S,
    pub(crate) status: S::Flags,
}

/// What the sensors report at one tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Measured<S> {
    pub(crate) velocity: S,
    pub(crate) force: S,
    pub(crate) spool: S,
}

impl<S: Num> Measured<S> {
    /// As the controller reads it, rounded to its precision.
    #[inline(always)]
    fn rounded<C: Scalar>(&self) -> Measured<C> {
        Measured { velocity: convert(self.velocity), force: convert(self.force), spool: convert(self.spool) }
    }
}

/// The same numbers in another precision.
#[inline(always)]
fn convert<A: Scalar, B: Scalar>(from: A) -> B {
    B::from_lanes(|i| B::Element::from_f64(from.lane(i).to_f64()))
}

/// The sampled closed loop of one rig, or of several side by side; `C` is the controller's number.
pub(crate) struct ClosedLoop<S: Num, C: Scalar> {
    plant: Plant<S>,
    state: PlantState<S>,
    controller: RigController<C>,
    controller_state: ControllerState<C>,
    computation: DelayLine<S>,
    realization: Realization,
    analog: Analog<S>,
    held: Held<S>,
    sample_rate: f64,
    steps: u32,
}

impl<S: Num, C: Scalar<Flags = S::Flags>> ClosedLoop<S, C>
where
    C::Element: Precision,
{
    /// The loops of `rig(0)`, `rig(1)`, … at rest, one a lane; all of one realization.
    pub(crate) fn new<'a>(
        rig: impl Fn(usize) -> &'a RigConfig,
        sample_rate: f64,
        steps: u32,
    ) -> Result<Self> {
        let controllers =
            (0..S::LANES).map(|i| C::Element::controller(rig(i), sample_rate)).collect::<Result<Vec<_>>>()?;
        Ok(Self {
            plant: Plant::pack(&rig)?,
            state: PlantState::default(),
            controller: RigController::pack(|i| &controllers[i]),
            controller_state: ControllerState::default(),
            computation: DelayLine::new(|i| rig(i).compensation.computation_delay as usize),
            realization: rig(0).controller.realization,
            analog: Analog::pack(&rig),
            held: Held(S::default()),
            sample_rate,
            steps,
        })
    }

    /// Samples, and decides what drives the valve until the next tick; `next_command` is the command then.
    #[inline(always)]
    pub(crate) fn sample(&mut self, command: S, next_command: S) -> Tick<S> {
        let force = self.plant.force(&self.state);
        let measured = Measured { velocity: self.state.velocity, force, spool: self.state.spool };
        let (valve_command, compensation, flags) = match self.realization {
            Realization::Analog => self.sample_analog(command, next_command, &measured),
            Realization::Digital => self.sample_digital(command, &measured),
        };
        let (at_stop, beyond_stroke) = self.plant.at_limits(&self.state);
        let limits = S::flag(at_stop, status::SPOOL_STOP) | S::flag(beyond_stroke, status::STROKE_EXCEEDED);
        Tick { plant: self.state, force, valve_command, compensation, status: flags | limits }
    }

    /// Carries the plant to the next tick.
    #[inline(always)]
    pub(crate) fn advance(&mut self) {
        let period = 1.0 / self.sample_rate;
        self.state = match self.realization {
            Realization::Analog => self.plant.advance_driven(self.state, &self.analog, period, self.steps),
            Realization::Digital => self.plant.advance_driven(self.state, &self.held, period, self.steps),
        };
    }

    fn sample_analog(&mut self, command: S, next_command: S, measured: &Measured<S>) -> (S, S, S::Flags) {
        let m = measured.rounded::<C>();
        let zero = C::splat(0.0);
        let computed = self.controller.compensation.step(
            &mut self.controller_state.compensation,
            m.velocity,
            m.force,
            m.spool,
            zero,
        );
        let compensation = self.computation.pass(convert(computed.value));
        let rate = (next_command - command) * S::splat(self.sample_rate);
        self.analog = self.analog.at(command, rate, compensation);
        let valve_command = self.plant.driven_command(&self.state, &self.analog);
        (valve_command, compensation, computed.status)
    }

    fn sample_digital(&mut self, command: S, measured: &Measured<S>) -> (S, S, S::Flags) {
        let m = measured.rounded::<C>();
        let computation = &mut self.computation;
        let output = self.controller.step_via(
            &mut self.controller_state,
            convert(command),
            m.velocity,
            m.force,
            m.spool,
            |compensation| convert(computation.pass(convert(compensation))),
        );
        self.held = Held(convert(output.valve_command));
        (self.held.0, convert(output.compensation), output.status)
    }
}
