//! The loop in continuous time: no hold, no delay by samples.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector, RowDVector};

use super::gains::FlowGain;
use super::plant::{LinearPlant, NAMES, PILOT_FLOW, VELOCITY, outputs};
use super::state_space::StateSpace;
use crate::config::{Realization, RigConfig};
use crate::error::Result;

/// The closed loop about rest in continuous time, from the force command (N).
///
/// Derivative action and feedforward see the command's rate, which is no input of a state-space model: the states
/// are the rig's less what the command itself puts into them (the pilot flow less `K_vp·G_d·C_F/τ` times the
/// command, for example). Without a command they are the rig's. A response delay of zero leaves the lead network
/// without a state.
///
/// # Errors
/// A flow curve without the slope asked for.
pub(super) fn continuous(rig: &RigConfig, gain: FlowGain) -> Result<StateSpace> {
    let gains = gain.gains(rig)?;
    let plant = LinearPlant::new(rig, &gains);
    let (controller, compensation) = (&rig.controller, &rig.compensation);
    let leads = compensation.response_delay > 0.0;
    let velocity_lag = rig.sensors.velocity.bandwidth;
    // The analog force loop is wired to the load cell in front of the filter.
    let digital = controller.realization == Realization::Digital;
    let force_lag = rig.sensors.force.bandwidth.filter(|_| digital);

    let mut names: Vec<String> = NAMES.iter().map(|name| (*name).to_owned()).collect();
    let mut add = |present: bool, name: &str| {
        present.then(|| {
            names.push(name.into());
            names.len() - 1
        })
    };
    let lead_state = add(leads, "lead");
    let velocity_state = add(velocity_lag.is_some(), "velocity_sensor");
    let force_state = add(force_lag.is_some(), "force_sensor");
    let states = names.len();
    let mut a = plant.a.clone().resize(states, states, 0.0);
    let widened = |row: RowDVector<f64>| row.resize_horizontally(states, 0.0);

    // Measured signals as rows over the state.
    let mut velocity = RowDVector::zeros(states);
    velocity[velocity_state.unwrap_or(VELOCITY)] = 1.0;
    if let (Some(state), Some(corner)) = (velocity_state, velocity_lag) {
        a[(state, VELOCITY)] = TAU * corner;
        a[(state, state)] = -TAU * corner;
    }
    let (mut force, mut force_rate) = (widened(plant.force()), widened(plant.force_rate()));
    if let (Some(state), Some(corner)) = (force_state, force_lag) {
        let mut filtered = RowDVector::zeros(states);
        filtered[state] = 1.0;
        force_rate = (force - &filtered) * (TAU * corner);
        a.set_row(state, &force_rate);
        force = filtered;
    }

    // ẋ = A·x + b·u + r·u̇; the demanded opening is that of velocity and command.
    let (mut b, mut r) = (DVector::zeros(states), DVector::zeros(states));
    let (per_force, per_rate) = if compensation.feedforward {
        let area = rig.actuator.piston_area;
        (rig.actuator.leakage / area, rig.actuator.compressibility / area)
    } else {
        (0.0, 0.0)
    };
    let opening = &velocity * (gains.opening_per_flow * gains.compensated_area);
    let (opening_b, opening_r) = (gains.opening_per_flow * per_force, gains.opening_per_flow * per_rate);

    // The lead network as K·(1 + (1 − α)/α)·opening − K·(1 − α)/α·w with α·T_ld·ẇ = opening − w.
    let dc_gain = 1.0 / (controller.proportional_gain * compensation.valve_gain);
    let mut compensated = RowDVector::zeros(states);
    let mut direct = dc_gain;
    if let Some(state) = lead_state {
        let washout = (1.0 - compensation.lead_alpha) / compensation.lead_alpha;
        let rate = washout / compensation.response_delay;
        direct *= 1.0 + washout;
        compensated[state] = -dc_gain * washout;
        a.set_row(state, &(&opening * rate));
        a[(state, state)] -= rate;
        b[state] = rate * opening_b;
        r[state] = rate * opening_r;
    }
    compensated += &opening * direct;

    let to_pilot = plant.valve[PILOT_FLOW];
    let fed_back = force * controller.proportional_gain + force_rate * controller.derivative_gain;
    let mut pilot_row = a.row_mut(PILOT_FLOW);
    pilot_row +=
        (compensated * controller.proportional_gain - fed_back * controller.force_sensitivity) * to_pilot;
    let compensating = controller.proportional_gain * direct;
    b[PILOT_FLOW] =
        to_pilot * (controller.proportional_gain * controller.force_sensitivity + compensating * opening_b);
    r[PILOT_FLOW] =
        to_pilot * (controller.derivative_gain * controller.force_sensitivity + compensating * opening_r);

    let (c, outputs) = outputs(&plant, states);
    Ok(StateSpace {
        b: DMatrix::from_columns(&[b + &a * &r]),
        d: DMatrix::from_columns(&[&c * r]),
        a,
        c,
        states: names,
        outputs,
        sample_time: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Complex;

    fn model(change: impl Fn(&mut RigConfig), gain: FlowGain) -> StateSpace {
        let mut rig = RigConfig::zhao2005();
        change(&mut rig);
        continuous(&rig, gain).unwrap()
    }

    fn mode_near(model: &StateSpace, frequency: f64) -> Complex<f64> {
        let distance = |m: &super::super::Mode| {
            (m.frequency - frequency).abs() + if m.pole.im < 0.0 { 1e9 } else { 0.0 }
        };
        let modes = model.modes().unwrap();
        modes.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap().pole
    }

    #[test]
    fn modes_of_the_reference_model() {
        let nominal = model(|_| (), FlowGain::Nominal);
        let structural = mode_near(&nominal, 1.6);
        assert!((structural.re + 0.2884).abs() < 1e-4 && (structural.im - 9.910).abs() < 1e-3);
        let fast = mode_near(&nominal, 64.7);
        assert!((fast.re + 21.39).abs() < 0.01 && (fast.im - 406.6).abs() < 0.1);
        let at = |delay| {
            mode_near(&model(|rig| rig.compensation.response_delay = delay, FlowGain::Nominal), 64.7).re
        };
        assert!((at(3e-3) + 17.2).abs() < 0.05);
        assert!((at(0.0) + 12.2).abs() < 0.05);
        assert!((mode_near(&model(|_| (), FlowGain::Steeper), 64.7).re + 19.8).abs() < 0.05);
        assert!((mode_near(&model(|_| (), FlowGain::Shallower), 64.7).re + 20.7).abs() < 0.05);
    }

    #[test]
    fn the_transfer_function_is_that_of_the_block_diagram() {
        // Fig. 1 written out: the flow balance K_a·s·P + C_l·P + A·s·x = K_v·H_s·v, solved for F over F_c.
        let rig = RigConfig::zhao2005();
        let model = continuous(&rig, FlowGain::Nominal).unwrap();
        let (valve, actuator, structure) = (&rig.servovalve, &rig.actuator, &rig.structure);
        let (control, comp) = (&rig.controller, &rig.compensation);
        assert_eq!(StateSpace { d: DMatrix::zeros(5, 1), ..model.clone() }, model, "strictly proper");
        for frequency in [0.1, 1.0, 1.58, 5.0, 20.0, 64.7, 300.0] {
            let s = Complex::new(0.0, std::f64::consts::TAU * frequency);
            let spool_area = valve.spool_area;
            let denominator = s * s * (valve.pilot_time_constant * spool_area)
                + s * spool_area
                + valve.spool_sensitivity * valve.pilot_flow_gain;
            let valve_response = (denominator / (valve.pilot_flow_gain / valve.spool_stroke)).inv();
            let mobility = s / (s * s * structure.mass + s * structure.damping + structure.stiffness);
            let long = comp.response_delay / (1.0 - comp.lead_alpha);
            let lead = (s * long + 1.0) / (s * (comp.lead_alpha * long) + 1.0) / comp.valve_gain;
            let loop_gain = (s * control.derivative_gain + control.proportional_gain)
                * control.force_sensitivity
                * valve_response
                * comp.flow_gain;
            let swallowed = mobility * actuator.piston_area;
            let leaked = (s * actuator.compressibility + actuator.leakage) / actuator.piston_area;
            let given =
                lead * valve_response * comp.flow_gain * actuator.piston_area / comp.flow_gain * mobility;
            let expected = loop_gain / (loop_gain + leaked + swallowed - given);
            let got = model.response("force", frequency).unwrap();
            assert!(
                (got - expected).norm() < 1e-10 * expected.norm(),
                "{frequency} Hz: {got} and {expected}"
            );
            let moved = model.response("velocity", frequency).unwrap();
            assert!((moved - expected * mobility).norm() < 1e-10 * moved.norm());
        }
    }

    #[test]
    fn with_feedforward_the_command_s_own_flow_is_there_without_an_error() {
        // Where valve and lead cancel, a force loop whose flow is all demanded has nothing left to do: at low
        // frequency the response is 1 but for the load cell's own loop, not 1 − 1/47.
        let mut rig = RigConfig::zhao2005();
        rig.compensation.valve_gain = valve_response_at_rest(&rig);
        let droop = |rig: &RigConfig| {
            (continuous(rig, FlowGain::Nominal).unwrap().response("force", 0.0).unwrap().re - 1.0).abs()
        };
        assert!((droop(&rig) - 1.0 / 48.0).abs() < 2e-3, "{}", droop(&rig));
        rig.compensation.feedforward = true;
        assert!(droop(&rig) < 1e-9, "{}", droop(&rig));
        // And at 5 Hz the command's rate counts.
        let error = |rig: &RigConfig| {
            (continuous(rig, FlowGain::Nominal).unwrap().response("force", 5.0).unwrap()
                - Complex::new(1.0, 0.0))
            .norm()
        };
        let with = error(&rig);
        rig.compensation.feedforward = false;
        assert!(with < 0.2 * error(&rig), "{with}, without {}", error(&rig));
    }

    fn valve_response_at_rest(rig: &RigConfig) -> f64 {
        1.0 / (rig.servovalve.spool_sensitivity * rig.servovalve.spool_stroke)
    }

    #[test]
    fn sensors_add_their_lags_where_the_signal_passes_them() {
        let order = |change: &dyn Fn(&mut RigConfig)| model(change, FlowGain::Nominal).states.len();
        assert_eq!(order(&|_| ()), 6);
        assert_eq!(order(&|rig| rig.compensation.response_delay = 0.0), 5);
        assert_eq!(order(&|rig| rig.sensors.velocity.bandwidth = Some(100.0)), 7);
        assert_eq!(
            order(&|rig| rig.sensors.force.bandwidth = Some(100.0)),
            6,
            "the analog loop is in front of it"
        );
        let lagged = |bandwidth| {
            model(
                |rig| {
                    rig.controller.realization = Realization::Digital;
                    rig.sensors.velocity.bandwidth = bandwidth;
                    rig.sensors.force.bandwidth = bandwidth;
                },
                FlowGain::Nominal,
            )
            .response("force", 20.0)
            .unwrap()
        };
        let distance = |bandwidth| (lagged(Some(bandwidth)) - lagged(None)).norm();
        assert!(distance(1e6) < 1e-3 * distance(300.0));
    }
}
