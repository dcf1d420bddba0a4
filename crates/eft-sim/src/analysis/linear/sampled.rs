//! The sampled loop: the plant is integrated exactly from sample to sample, the controller runs one tick at a
//! time.

use nalgebra::DMatrix;

use super::chain::{AnyDelay, Chain, Signal};
use super::disturbance::Disturbance;
use super::gains::{FlowGain, Gains};
use super::plant::{LinearPlant, left_out};
use super::velocity_signal::VelocitySignal;
use crate::config::{Realization, RigConfig};
use crate::state_space::StateSpace;
use crate::state_space::matrices::exponential;
use crate::{Result, checks};

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
    Ok(model(Ticker::new(rig, gain, sample_rate)?))
}

/// The same with the mean flow gain and the [`Disturbance`]s of each actuator as further inputs.
///
/// # Errors
/// As [`sampled`].
pub(super) fn disturbed(rig: &RigConfig, sample_rate: f64) -> Result<StateSpace> {
    let ticker = Ticker::new(rig, FlowGain::Mean, sample_rate)?;
    let (_, columns) = ticker.disturbed();
    let mut model = model(ticker);
    let commands = model.b.ncols();
    model.b = model.b.resize_horizontally(commands + columns.ncols(), 0.0);
    model.b.columns_mut(commands, columns.ncols()).copy_from(&columns);
    model.d = model.d.resize_horizontally(commands + columns.ncols(), 0.0);
    Ok(model)
}

/// The loop in standard form.
fn model(ticker: Ticker<'_>) -> StateSpace {
    let (states, inputs) = (ticker.names.len(), ticker.plant.actuators);
    let (next, signals) = ticker.cases();
    let a = next.columns(0, states).into_owned();
    let (now, ahead) = (next.columns(states, inputs), next.columns(states + inputs, inputs));
    let (mut c, mut outputs) = ticker.plant.outputs(states);
    let last = c.nrows();
    c = c.resize_vertically(last + signals.nrows(), 0.0);
    c.rows_mut(last, signals.nrows()).copy_from(&signals.columns(0, states));
    for signal in ["compensation", "measured_velocity"] {
        outputs.extend((0..inputs).map(|actuator| ticker.plant.name(signal, actuator)));
    }
    // X' = A·X + now·u + ahead·u' takes the standard form with the state X − ahead·u.
    let mut d = &c * ahead;
    let mut last_rows = d.rows_mut(last, signals.nrows());
    last_rows += signals.columns(states, inputs);
    StateSpace {
        b: now + &a * ahead,
        d,
        a,
        c,
        states: ticker.names,
        inputs: ticker.plant.inputs(),
        outputs,
        left_out: left_out(ticker.rig),
        sample_time: Some(1.0 / ticker.sample_rate),
    }
}

/// One tick of the linear loop.
pub(super) struct Ticker<'a> {
    rig: &'a RigConfig,
    plant: LinearPlant,
    gains: Gains,
    sample_rate: f64,
    /// Delay (s) for which the lead network compensates.
    lead: f64,
    carried: DMatrix<f64>,
    /// Effect of the signals within a sample, in the order of [`within_a_sample`], on the plant's states.
    driven: DMatrix<f64>,
    digital: Vec<DigitalSide>,
    names: Vec<String>,
}

/// Index of a controller's first state, and the chains of its signals.
struct DigitalSide {
    at: usize,
    velocity: VelocitySignal,
    force: Chain,
    computation: Chain,
    converter: Chain,
    /// The delay of the command by the known latency of the load cell.
    command: Option<AnyDelay>,
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
    pub(super) fn new(rig: &'a RigConfig, gain: FlowGain, sample_rate: f64) -> Result<Self> {
        let gains = gain.gains(rig)?;
        let plant = LinearPlant::new(rig, &gains);
        let states = plant.states();
        let step = exponential(&(within_a_sample(rig, &plant) / sample_rate));
        let mut names = plant.names();
        let mut digital = Vec::with_capacity(plant.actuators);
        for actuator in 0..plant.actuators {
            let at = names.len();
            let own = controller_states(rig);
            let velocity = VelocitySignal::new(rig, at + own.len(), sample_rate)?;
            // The bandwidth of the load cell is part of the plant.
            let delay = rig.plant().sensors.force.delay as usize;
            let force = Chain::new(velocity.end(), None, delay, sample_rate);
            let delay = rig.compensation.computation_delay as usize;
            let computation = Chain::new(force.end(), None, delay, sample_rate);
            let delay = rig.plant().dac.delay as usize;
            let converter = Chain::new(computation.end(), None, delay, sample_rate);
            names.extend(own.iter().map(|name| plant.name(name, actuator)));
            let chains = [
                velocity.names(),
                force.names("force"),
                computation.names("compensation"),
                converter.names("converter"),
            ];
            for chain in chains {
                names.extend(chain.iter().map(|name| plant.name(name, actuator)));
            }
            let late = rig.controller.force_delay * sample_rate;
            let command = (late > 0.0).then(|| AnyDelay::new(names.len(), late));
            let aged = command.map_or_else(Vec::new, |command| command.names("command"));
            names.extend(aged.iter().map(|name| plant.name(name, actuator)));
            digital.push(DigitalSide { at, velocity, force, computation, converter, command });
        }
        let allowed = format!("must be at most {MOST_STATES}: fewer samples of delay, or fewer stories");
        checks::require(names.len() <= MOST_STATES, "states of the linear model", names.len(), allowed)?;
        Ok(Self {
            carried: step.view((0, 0), (states, states)).into_owned(),
            driven: step.view((0, states), (states, SIGNALS * plant.actuators)).into_owned(),
            digital,
            names,
            lead: rig.first_lead(sample_rate)?,
            rig,
            plant,
            gains,
            sample_rate,
        })
    }

    /// The state matrix, and the effect of each actuator's [`Disturbance`]s on the states.
    pub(super) fn disturbed(&self) -> (DMatrix<f64>, DMatrix<f64>) {
        let (states, inputs) = (self.names.len(), self.plant.actuators);
        let next = self.cases().0;
        let disturbances = next.columns(states + 2 * inputs, Disturbance::COUNT * inputs).into_owned();
        (next.columns(0, states).into_owned(), disturbances)
    }

    /// The output matrix of the plant's signals and their names.
    pub(super) fn outputs(&self) -> (DMatrix<f64>, Vec<String>) {
        self.plant.outputs(self.names.len())
    }

    /// A [`tick`](Self::tick) for each state, then for each command at its start, for each command at its end, and for each
    /// source of noise.
    fn cases(&self) -> (DMatrix<f64>, DMatrix<f64>) {
        let (states, inputs) = (self.names.len(), self.plant.actuators);
        let size = states + (2 + Disturbance::COUNT) * inputs;
        let cases = DMatrix::identity(size, size);
        let rows = |first: usize, count: usize| cases.rows(first, count).into_owned();
        let commands = rows(states, inputs);
        let noise = rows(states + 2 * inputs, Disturbance::COUNT * inputs);
        self.tick(&rows(0, states), &commands, &rows(states + inputs, inputs), &noise)
    }

    /// The states after a tick with the commands (N) at its start and at its end, and within it the compensations
    /// (V) and then the velocities (m/s) that the controllers use. Each column is a case; the noise has a row for each
    /// [`Disturbance`] of each actuator.
    fn tick(
        &self,
        state: &DMatrix<f64>,
        commands: &DMatrix<f64>,
        next_commands: &DMatrix<f64>,
        noise: &DMatrix<f64>,
    ) -> (DMatrix<f64>, DMatrix<f64>) {
        let cases = state.ncols();
        let mut next = DMatrix::zeros(state.nrows(), cases);
        let mut signals = DMatrix::zeros(SIGNALS * self.plant.actuators, cases);
        let mut within = DMatrix::zeros(2 * self.plant.actuators, cases);
        let control = &self.rig.controller;
        let plant = state.rows(0, self.plant.states());
        for (i, side) in self.digital.iter().enumerate() {
            let asked = [commands.row(i).into_owned(), next_commands.row(i).into_owned()];
            let [command, next_command] = match &side.command {
                Some(delay) => delay.pass(state, &mut next, asked.clone()),
                None => asked.clone(),
            };
            // A feedforward that looks ahead acts on the true force, which is not late.
            let looks_ahead = self.rig.compensation.look_ahead && control.realization == Realization::Digital;
            let fed = if looks_ahead { &asked[0] } else { &command };
            let noise = noise.rows(Disturbance::COUNT * i, Disturbance::COUNT);
            let of = |source: Disturbance| noise.row(source as usize);
            let measured = of(Disturbance::Force) + of(Disturbance::ForceResolution);
            let force = side.force.pass(state, &mut next, self.plant.shown(i) * plant) + measured;
            let velocity = side.velocity.pass(&self.plant, i, state, &mut next, &force, &noise);
            let computed = self.compensation(side.at, state, &mut next, &velocity, fed);
            let mut compensation = side.computation.pass(state, &mut next, computed);
            match control.realization {
                Realization::Analog => {
                    compensation += of(Disturbance::Converter);
                    compensation = side.converter.pass(state, &mut next, compensation);
                    // The load cell's noise is constant within a sample, as a difference of the command.
                    signals.set_row(SIGNALS * i, &(&command - of(Disturbance::Force)));
                    signals.set_row(SIGNALS * i + 1, &((next_command - &command) * self.sample_rate));
                    signals.set_row(SIGNALS * i + 2, &compensation);
                }
                Realization::Digital => {
                    let error = (command - force) * control.force_sensitivity;
                    let rate = (&error - state.row(side.at + ERROR)) * self.sample_rate;
                    let mut output =
                        (&error + &compensation) * control.proportional_gain + rate * control.derivative_gain;
                    if control.integrates() {
                        let held = state.row(side.at + INTEGRAL);
                        let added = &error * (control.integral_gain / self.sample_rate);
                        next.set_row(side.at + INTEGRAL, &(held + added));
                        output += held;
                    }
                    next.set_row(side.at + ERROR, &error);
                    output += of(Disturbance::Converter);
                    signals.set_row(SIGNALS * i + 2, &side.converter.pass(state, &mut next, output));
                }
            }
            within.set_row(i, &compensation);
            within.set_row(self.plant.actuators + i, &velocity);
        }
        let moved = &self.carried * plant + &self.driven * signals;
        next.rows_mut(0, moved.nrows()).copy_from(&moved);
        (next, within)
    }

    /// The compensation (V) computed at this tick by the controller with its first state at index `at`.
    fn compensation(
        &self,
        at: usize,
        state: &DMatrix<f64>,
        next: &mut DMatrix<f64>,
        velocity: &Signal,
        command: &Signal,
    ) -> Signal {
        let (compensation, actuator) = (&self.rig.compensation, &self.rig.actuator);
        let mut flow = velocity * self.gains.compensated_area;
        if compensation.feedforward {
            let rate = (command - state.row(at + COMMAND)) * self.sample_rate;
            next.set_row(at + COMMAND, command);
            let compressed = rate * self.rig.measured_compressibility() + command * actuator.leakage;
            flow += compressed / actuator.piston_area;
        }
        let opening = flow * self.gains.opening_per_flow;
        // The lead network by Tustin's rule, as a gain and a washout.
        let delay = self.lead;
        let lag = 2.0 * compensation.lead_alpha * delay / (1.0 - compensation.lead_alpha);
        let period = 1.0 / self.sample_rate;
        let pole = if delay > 0.0 { (lag - period) / (lag + period) } else { 0.0 };
        let rise = 2.0 * delay / (lag + period);
        let (input, washout) = (at + LEAD_INPUT, at + WASHOUT);
        let washed = state.row(washout) * pole + (&opening - state.row(input)) * rise;
        next.set_row(input, &opening);
        next.set_row(washout, &washed);
        (opening + washed) / (self.rig.controller.proportional_gain * compensation.valve_gain)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::VelocitySource;

    #[test]
    fn a_learning_controller_knows_the_delay_of_its_own_derivative() {
        let derived = RigConfig::zhao2005()
            .with(|rig| rig.controller.velocity_source = VelocitySource::Derivative)
            .unwrap();
        let own = derived.velocity_delay(4096.0).unwrap();
        let told = derived.with(|rig| rig.compensation.velocity_delay = own).unwrap();
        let learns = derived.with(|rig| rig.compensation.adaptive = true).unwrap();
        let of = |rig: &RigConfig| sampled(rig, FlowGain::Mean, 4096.0).unwrap().a;
        assert!((of(&told) - of(&learns)).amax() < 1e-12 && of(&told) != of(&derived));
    }
}
