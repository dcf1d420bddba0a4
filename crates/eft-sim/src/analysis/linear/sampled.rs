//! The sampled loop: the plant is integrated exactly from sample to sample, the controller runs one tick at a
//! time.

use nalgebra::{DMatrix, DVector};

use super::chain::Chain;
use super::gains::{FlowGain, Gains};
use super::plant::{LinearPlant, left_out};
use crate::checks;
use crate::config::{Realization, RigConfig};
use crate::error::{Error, Result};
use crate::state_space::StateSpace;
use crate::state_space::matrices::exponential;

/// Largest number of states of a model. Samples of delay and stories add states.
pub(super) const MOST_STATES: usize = 400;

/// The closed loop about rest, exactly sampled at a rate (Hz), from the samples of one force command (N) per
/// actuator.
///
/// In the digital realization the valve command is held; in the analog one the force loop runs in continuous
/// time on a command that is linear between samples, and the compensation is held. The next sample of the
/// command then acts within the step. The effect of the present sample is therefore subtracted from the
/// states of the rig.
///
/// # Errors
/// A sample rate that is not positive and finite; delays of too many samples; a flow curve that does
/// not have the requested slope.
pub(super) fn sampled(rig: &RigConfig, gain: FlowGain, sample_rate: f64) -> Result<StateSpace> {
    checks::sample_rate("sample_rate", sample_rate)?;
    let ticker = Ticker::new(rig, gain, sample_rate)?;
    let (states, inputs) = (ticker.names.len(), ticker.plant.actuators);
    if states > MOST_STATES {
        let allowed = format!("must be at most {MOST_STATES}: fewer samples of delay, or fewer stories");
        return Err(Error::value("states of the linear model", states, allowed));
    }
    let mut a = DMatrix::zeros(states, states);
    let mut compensated = DMatrix::zeros(inputs, states);
    let none = DVector::zeros(inputs);
    for column in 0..states {
        let mut unit = DVector::zeros(states);
        unit[column] = 1.0;
        let (next, compensation) = ticker.tick(&unit, &none, &none);
        a.set_column(column, &next);
        compensated.set_column(column, &compensation);
    }
    let rest = DVector::zeros(states);
    let (mut now, mut ahead) = (DMatrix::zeros(states, inputs), DMatrix::zeros(states, inputs));
    let mut at_once = DMatrix::zeros(inputs, inputs);
    for column in 0..inputs {
        let mut unit = DVector::zeros(inputs);
        unit[column] = 1.0;
        let (next, compensation) = ticker.tick(&rest, &unit, &none);
        now.set_column(column, &next);
        at_once.set_column(column, &compensation);
        ahead.set_column(column, &ticker.tick(&rest, &none, &unit).0);
    }
    let (mut c, mut outputs) = ticker.plant.outputs(states);
    let last = c.nrows();
    c = c.resize_vertically(last + inputs, 0.0);
    c.rows_mut(last, inputs).copy_from(&compensated);
    outputs.extend((0..inputs).map(|actuator| ticker.plant.name("compensation", actuator)));
    // X' = A·X + now·u + ahead·u' takes the standard form with the state X − ahead·u.
    let mut d = &c * &ahead;
    let mut last_rows = d.rows_mut(last, inputs);
    last_rows += at_once;
    Ok(StateSpace {
        b: now + &a * &ahead,
        d,
        a,
        c,
        states: ticker.names,
        inputs: ticker.plant.inputs(),
        outputs,
        left_out: left_out(rig),
        sample_time: Some(1.0 / sample_rate),
    })
}

/// One tick of the linear loop.
struct Ticker<'a> {
    rig: &'a RigConfig,
    plant: LinearPlant,
    gains: Gains,
    sample_rate: f64,
    carried: DMatrix<f64>,
    /// Effect of the signals within a sample, in the order of [`within_a_sample`], on the plant's states.
    driven: DMatrix<f64>,
    digital: Vec<DigitalSide>,
    names: Vec<String>,
}

/// Index of a controller's first state, and the chains of its signals.
struct DigitalSide {
    at: usize,
    velocity: Chain,
    force: Chain,
    computation: Chain,
    converter: Chain,
}

// Index of the first of a controller's states; the states of the chains follow.
const LEAD_INPUT: usize = 0;
const WASHOUT: usize = 1;
const ERROR: usize = 2;
const COMMAND: usize = 3;
const INTEGRAL: usize = 4;
const CONTROLLER: [&str; 5] = ["lead_input", "lead_washout", "force_error", "last_command", "integral"];

/// Names of the controller's states. The integral exists only with an integral gain.
fn controller_states(rig: &RigConfig) -> &'static [&'static str] {
    if rig.controller.integrates() { &CONTROLLER } else { &CONTROLLER[..INTEGRAL] }
}

// Number of an actuator's signals within a sample: the command (N), its rate (N/s) and the held voltage (V).
const SIGNALS: usize = 3;

impl<'a> Ticker<'a> {
    fn new(rig: &'a RigConfig, gain: FlowGain, sample_rate: f64) -> Result<Self> {
        let gains = gain.gains(rig)?;
        let plant = LinearPlant::new(rig, &gains);
        let states = plant.states();
        let step = exponential(&(within_a_sample(rig, &plant) / sample_rate));
        let mut names = plant.names();
        let mut digital = Vec::with_capacity(plant.actuators);
        for actuator in 0..plant.actuators {
            let at = names.len();
            let own = controller_states(rig);
            let sensors = &rig.plant().sensors;
            let (velocity, force) = (&sensors.velocity, &sensors.force);
            let velocity =
                Chain::new(at + own.len(), velocity.bandwidth, velocity.delay as usize, sample_rate);
            // The bandwidth of the load cell is part of the plant.
            let force = Chain::new(velocity.end(), None, force.delay as usize, sample_rate);
            let delay = rig.compensation.computation_delay as usize;
            let computation = Chain::new(force.end(), None, delay, sample_rate);
            let delay = rig.plant().dac.delay as usize;
            let converter = Chain::new(computation.end(), None, delay, sample_rate);
            names.extend(own.iter().map(|name| plant.name(name, actuator)));
            let chains = [
                velocity.names("velocity"),
                force.names("force"),
                computation.names("compensation"),
                converter.names("converter"),
            ];
            for chain in chains {
                names.extend(chain.iter().map(|name| plant.name(name, actuator)));
            }
            digital.push(DigitalSide { at, velocity, force, computation, converter });
        }
        Ok(Self {
            carried: step.view((0, 0), (states, states)).into_owned(),
            driven: step.view((0, states), (states, SIGNALS * plant.actuators)).into_owned(),
            digital,
            names,
            rig,
            plant,
            gains,
            sample_rate,
        })
    }

    /// The state after a tick with the commands (N) at its start and at its end, and the compensation (V) within it.
    fn tick(
        &self,
        state: &DVector<f64>,
        command: &DVector<f64>,
        next_command: &DVector<f64>,
    ) -> (DVector<f64>, DVector<f64>) {
        let mut next = DVector::zeros(state.len());
        let mut signals = DVector::zeros(SIGNALS * self.plant.actuators);
        let mut compensations = DVector::zeros(self.plant.actuators);
        let control = &self.rig.controller;
        for (i, side) in self.digital.iter().enumerate() {
            let (command, next_command) = (command[i], next_command[i]);
            let moving = (self.plant.velocity(i) * state.rows(0, self.plant.states()))[0];
            let read = self.rig.plant().sensors.velocity.gain * moving;
            let velocity = side.velocity.pass(state, &mut next, read);
            let shown = (self.plant.shown(i) * state.rows(0, self.plant.states()))[0];
            let force = side.force.pass(state, &mut next, shown);
            let computed = self.compensation(side.at, state, &mut next, velocity, command);
            let compensation = side.computation.pass(state, &mut next, computed);
            compensations[i] = compensation;
            let within = match control.realization {
                Realization::Analog => {
                    let compensation = side.converter.pass(state, &mut next, compensation);
                    compensations[i] = compensation;
                    [command, (next_command - command) * self.sample_rate, compensation]
                }
                Realization::Digital => {
                    let error = control.force_sensitivity * (command - force);
                    let rate = (error - state[side.at + ERROR]) * self.sample_rate;
                    next[side.at + ERROR] = error;
                    let proportional = control.proportional_gain * (error + compensation);
                    let mut output = proportional + control.derivative_gain * rate;
                    if control.integrates() {
                        let held = state[side.at + INTEGRAL];
                        next[side.at + INTEGRAL] = held + control.integral_gain / self.sample_rate * error;
                        output += held;
                    }
                    [0.0, 0.0, side.converter.pass(state, &mut next, output)]
                }
            };
            for (k, value) in within.into_iter().enumerate() {
                signals[SIGNALS * i + k] = value;
            }
        }
        let plant = &self.carried * state.rows(0, self.plant.states()) + &self.driven * signals;
        next.rows_mut(0, plant.len()).copy_from(&plant);
        (next, compensations)
    }

    /// The compensation (V) computed at this tick by the controller with its first state at index `at`.
    fn compensation(
        &self,
        at: usize,
        state: &DVector<f64>,
        next: &mut DVector<f64>,
        velocity: f64,
        command: f64,
    ) -> f64 {
        let (compensation, actuator) = (&self.rig.compensation, &self.rig.actuator);
        let compressibility = self.rig.measured_compressibility();
        let mut flow = self.gains.compensated_area * velocity;
        if compensation.feedforward {
            let rate = (command - state[at + COMMAND]) * self.sample_rate;
            next[at + COMMAND] = command;
            flow += (compressibility * rate + actuator.leakage * command) / actuator.piston_area;
        }
        let opening = self.gains.opening_per_flow * flow;
        // The lead network by Tustin's rule, as a gain and a washout.
        let delay = compensation.lead_delay();
        let lag = 2.0 * compensation.lead_alpha * delay / (1.0 - compensation.lead_alpha);
        let period = 1.0 / self.sample_rate;
        let pole = if delay > 0.0 { (lag - period) / (lag + period) } else { 0.0 };
        let rise = 2.0 * delay / (lag + period);
        let (input, washout) = (at + LEAD_INPUT, at + WASHOUT);
        next[input] = opening;
        next[washout] = pole * state[washout] + rise * (opening - state[input]);
        (opening + next[washout]) / (self.rig.controller.proportional_gain * compensation.valve_gain)
    }
}

/// The equations between two ticks: the plant's states, then for each actuator the command (N), its rate
/// (N/s) and the held voltage (V).
fn within_a_sample(rig: &RigConfig, plant: &LinearPlant) -> DMatrix<f64> {
    let control = &rig.controller;
    let states = plant.states();
    let size = states + SIGNALS * plant.actuators;
    let mut a = plant.a.clone().resize(size, size, 0.0);
    for i in 0..plant.actuators {
        let (driven, command) = (plant.driven(i), states + SIGNALS * i);
        let (rate, held) = (command + 1, command + 2);
        a[(command, rate)] = 1.0;
        match control.realization {
            Realization::Digital => a[(driven, held)] = plant.per_volt,
            Realization::Analog => {
                let proportional = plant.per_volt * control.force_sensitivity * control.proportional_gain;
                let derivative = plant.per_volt * control.force_sensitivity * control.derivative_gain;
                let fed_back = plant.shown(i) * proportional + plant.shown_rate(i) * derivative;
                for (column, value) in fed_back.iter().enumerate() {
                    a[(driven, column)] -= value;
                }
                a[(driven, command)] = proportional;
                a[(driven, rate)] = derivative;
                a[(driven, held)] = plant.per_volt * control.proportional_gain;
            }
        }
    }
    a
}
