//! The loop as it runs: the plant exactly carried from sample to sample, the controller one tick at a time.

use nalgebra::{DMatrix, DVector, RowDVector};

use super::chain::Chain;
use super::gains::{FlowGain, Gains};
use super::matrices::exponential;
use super::plant::{LinearPlant, NAMES, PILOT_FLOW, PRESSURE, STATES, VELOCITY, outputs};
use super::state_space::StateSpace;
use crate::checks;
use crate::config::{Realization, RigConfig};
use crate::error::{Error, Result};

/// More states than this make the model too large to be of use; delays by samples are what adds them.
const MOST_STATES: usize = 200;

/// The closed loop about rest, exactly sampled at a rate (Hz), from the samples of the force command (N).
///
/// In the digital realization the valve command is held; in the analog one the force loop runs in continuous time on
/// a command that is linear between samples, and the compensation is held. The command's next sample then acts within
/// the step; the states are therefore those of the rig less their share of the present sample of the command.
///
/// # Errors
/// A sample rate that is not positive and finite; delays of too many samples; a flow curve without the slope asked
/// for.
pub(super) fn sampled(rig: &RigConfig, gain: FlowGain, sample_rate: f64) -> Result<StateSpace> {
    checks::positive("sample_rate", sample_rate, "Hz")?;
    let ticker = Ticker::new(rig, gain, sample_rate)?;
    let states = ticker.names.len();
    if states > MOST_STATES {
        let allowed = format!("must be at most {MOST_STATES}: fewer samples of delay");
        return Err(Error::value("states of the linear model", states, allowed));
    }
    let mut a = DMatrix::zeros(states, states);
    let mut compensated = RowDVector::zeros(states);
    for column in 0..states {
        let mut unit = DVector::zeros(states);
        unit[column] = 1.0;
        let (next, compensation) = ticker.tick(&unit, 0.0, 0.0);
        a.set_column(column, &next);
        compensated[column] = compensation;
    }
    let rest = DVector::zeros(states);
    let (now, compensation) = ticker.tick(&rest, 1.0, 0.0);
    let (ahead, _) = ticker.tick(&rest, 0.0, 1.0);
    let (mut c, mut outputs) = outputs(&ticker.plant, states);
    let last = c.nrows();
    c = c.resize_vertically(last + 1, 0.0);
    c.set_row(last, &compensated);
    outputs.push("compensation".into());
    // X' = A·X + now·u + ahead·u' becomes ordinary with the state X − ahead·u.
    let mut d = &c * &ahead;
    d[last] += compensation;
    Ok(StateSpace {
        b: DMatrix::from_columns(&[now + &a * &ahead]),
        d: DMatrix::from_columns(&[d]),
        a,
        c,
        states: ticker.names,
        outputs,
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
    from_command: DVector<f64>,
    from_command_rate: DVector<f64>,
    from_held: DVector<f64>,
    velocity: Chain,
    force: Chain,
    computation: Chain,
    names: Vec<String>,
}

// The state: the plant's, the controller's, then the chains'.
const LEAD_INPUT: usize = STATES;
const WASHOUT: usize = STATES + 1;
const ERROR: usize = STATES + 2;
const COMMAND: usize = STATES + 3;
const CONTROLLER: [&str; 4] = ["lead_input", "lead_washout", "force_error", "last_command"];

impl<'a> Ticker<'a> {
    fn new(rig: &'a RigConfig, gain: FlowGain, sample_rate: f64) -> Result<Self> {
        let gains = gain.gains(rig)?;
        let plant = LinearPlant::new(rig, &gains);
        let step = exponential(&(within_a_sample(rig, &plant) / sample_rate));
        let column = |i: usize| DVector::from_iterator(STATES, step.column(i).iter().copied().take(STATES));
        let sensor = |at, sensor: &crate::config::Sensor| {
            Chain::new(at, sensor.bandwidth, sensor.delay as usize, sample_rate)
        };
        let velocity = sensor(STATES + CONTROLLER.len(), &rig.sensors.velocity);
        let force = sensor(velocity.end(), &rig.sensors.force);
        let delay = rig.compensation.computation_delay as usize;
        let computation = Chain::new(force.end(), None, delay, sample_rate);
        let known = NAMES.iter().chain(&CONTROLLER).map(|name| (*name).to_owned());
        let chains = [velocity.names("velocity"), force.names("force"), computation.names("compensation")];
        Ok(Self {
            carried: step.view((0, 0), (STATES, STATES)).into_owned(),
            from_command: column(STATES),
            from_command_rate: column(STATES + 1),
            from_held: column(STATES + 2),
            names: known.chain(chains.concat()).collect(),
            rig,
            plant,
            gains,
            sample_rate,
            velocity,
            force,
            computation,
        })
    }

    /// The state after a tick with the command (N) at its start and at its end, and the compensation (V) within it.
    fn tick(&self, state: &DVector<f64>, command: f64, next_command: f64) -> (DVector<f64>, f64) {
        let mut next = DVector::zeros(state.len());
        let velocity = self.velocity.pass(state, &mut next, state[VELOCITY]);
        let true_force = self.plant.force()[PRESSURE] * state[PRESSURE];
        let force = self.force.pass(state, &mut next, true_force);
        let computed = self.compensation(state, &mut next, velocity, command);
        let compensation = self.computation.pass(state, &mut next, computed);

        let control = &self.rig.controller;
        let mut plant = &self.carried * state.rows(0, STATES);
        match control.realization {
            Realization::Analog => {
                plant += &self.from_command * command
                    + &self.from_command_rate * ((next_command - command) * self.sample_rate)
                    + &self.from_held * compensation;
            }
            Realization::Digital => {
                let error = control.force_sensitivity * (command - force);
                let rate = (error - state[ERROR]) * self.sample_rate;
                next[ERROR] = error;
                let held =
                    control.proportional_gain * (error + compensation) + control.derivative_gain * rate;
                plant += &self.from_held * held;
            }
        }
        next.rows_mut(0, STATES).copy_from(&plant);
        (next, compensation)
    }

    /// The compensation (V) computed at this tick.
    fn compensation(
        &self,
        state: &DVector<f64>,
        next: &mut DVector<f64>,
        velocity: f64,
        command: f64,
    ) -> f64 {
        let (compensation, actuator) = (&self.rig.compensation, &self.rig.actuator);
        let mut flow = self.gains.compensated_area * velocity;
        if compensation.feedforward {
            let rate = (command - state[COMMAND]) * self.sample_rate;
            next[COMMAND] = command;
            flow += (actuator.compressibility * rate + actuator.leakage * command) / actuator.piston_area;
        }
        let opening = self.gains.opening_per_flow * flow;
        // The lead network by Tustin's rule, as a gain and a washout.
        let lag =
            2.0 * compensation.lead_alpha * compensation.response_delay / (1.0 - compensation.lead_alpha);
        let period = 1.0 / self.sample_rate;
        let pole = if compensation.response_delay > 0.0 { (lag - period) / (lag + period) } else { 0.0 };
        let rise = 2.0 * compensation.response_delay / (lag + period);
        next[LEAD_INPUT] = opening;
        next[WASHOUT] = pole * state[WASHOUT] + rise * (opening - state[LEAD_INPUT]);
        (opening + next[WASHOUT]) / (self.rig.controller.proportional_gain * compensation.valve_gain)
    }
}

/// What runs between two ticks, beside the plant's states the command (N), its rate (N/s) and what is held (V).
fn within_a_sample(rig: &RigConfig, plant: &LinearPlant) -> DMatrix<f64> {
    let control = &rig.controller;
    let mut a = plant.a.clone().resize(STATES + 3, STATES + 3, 0.0);
    let to_pilot = plant.valve[PILOT_FLOW];
    a[(STATES, STATES + 1)] = 1.0;
    match control.realization {
        Realization::Digital => a[(PILOT_FLOW, STATES + 2)] = to_pilot,
        Realization::Analog => {
            let proportional = to_pilot * control.force_sensitivity * control.proportional_gain;
            let derivative = to_pilot * control.force_sensitivity * control.derivative_gain;
            let fed_back = plant.force() * proportional + plant.force_rate() * derivative;
            for (column, value) in fed_back.iter().enumerate() {
                a[(PILOT_FLOW, column)] -= value;
            }
            a[(PILOT_FLOW, STATES)] = proportional;
            a[(PILOT_FLOW, STATES + 1)] = derivative;
            a[(PILOT_FLOW, STATES + 2)] = to_pilot * control.proportional_gain;
        }
    }
    a
}
