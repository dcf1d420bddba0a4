//! The loop in continuous time, without a hold and without delays of whole samples.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, RowDVector};

use super::gains::FlowGain;
use super::plant::{LinearPlant, left_out, named};
use crate::Result;
use crate::config::{RigConfig, VelocitySource};
use crate::state_space::StateSpace;

/// The closed loop about rest in continuous time, from one force command (N) per actuator.
///
/// Derivative action and feedforward depend on the command's rate, which is not an input of a state-space
/// model. The direct effect of the command is therefore subtracted from the states: the pilot flow, for
/// example, lacks `K_vp·G_d·C_F/τ` times the command. Without a command they are the states of the rig. A
/// response delay of zero leaves the lead network without a state.
///
/// # Errors
/// A flow curve that does not have the requested slope.
pub(super) fn continuous(rig: &RigConfig, gain: FlowGain) -> Result<StateSpace> {
    let gains = gain.gains(rig)?;
    let plant = LinearPlant::new(rig, &gains);
    let (controller, compensation) = (&rig.controller, &rig.compensation);
    let sensors = &rig.plant().sensors;
    let velocity_lag = sensors.velocity.bandwidth;

    let mut names = plant.names();
    let mut add = |present: bool, name: &str, actuator: usize| {
        present.then(|| {
            names.push(plant.name(name, actuator));
            names.len() - 1
        })
    };
    let controllers: Vec<_> = (0..plant.actuators)
        .map(|i| {
            let lead = add(compensation.lead_delay() > 0.0, "lead", i);
            let sensor = add(velocity_lag.is_some(), "velocity_sensor", i);
            (lead, sensor, add(controller.integrates(), "integral", i))
        })
        .collect();
    let states = names.len();
    let widened = |row: RowDVector<f64>| row.resize_horizontally(states, 0.0);
    let (per_force, per_rate) = if compensation.feedforward {
        let area = rig.actuator.piston_area;
        (rig.actuator.leakage / area, rig.measured_compressibility() / area)
    } else {
        (0.0, 0.0)
    };
    let dc_gain = 1.0 / (controller.proportional_gain * compensation.valve_gain);
    let washout = (1.0 - compensation.lead_alpha) / compensation.lead_alpha;

    // ẋ = A·x + B·u + R·u̇; the demanded opening depends on velocity and command.
    let mut a = plant.a.clone().resize(states, states, 0.0);
    let (mut b, mut r) = (DMatrix::zeros(states, plant.actuators), DMatrix::zeros(states, plant.actuators));
    for (i, (lead_state, velocity_state, integral_state)) in controllers.into_iter().enumerate() {
        let moving = widened(plant.velocity(i));
        let mut velocity = RowDVector::zeros(states);
        match (velocity_state, velocity_lag) {
            (Some(state), Some(corner)) => {
                a.set_row(state, &(moving * (TAU * corner)));
                a[(state, state)] = -TAU * corner;
                velocity[state] = sensors.velocity.gain;
            }
            _ => velocity = moving * sensors.velocity.gain,
        }
        let opening = &velocity * (gains.opening_per_flow * gains.compensated_area);
        let (opening_b, opening_r) = (gains.opening_per_flow * per_force, gains.opening_per_flow * per_rate);

        // The lead network as K·(1 + (1 − α)/α)·opening − K·(1 − α)/α·w with α·T_ld·ẇ = opening − w.
        let mut compensated = RowDVector::zeros(states);
        let mut direct = dc_gain;
        if let Some(state) = lead_state {
            let rate = washout / compensation.lead_delay();
            direct *= 1.0 + washout;
            compensated[state] = -dc_gain * washout;
            a.set_row(state, &(&opening * rate));
            a[(state, state)] -= rate;
            b[(state, i)] = rate * opening_b;
            r[(state, i)] = rate * opening_r;
        }
        compensated += &opening * direct;

        let driven = plant.driven(i);
        let (force, force_rate) = (widened(plant.shown(i)), widened(plant.shown_rate(i)));
        if let Some(state) = integral_state {
            let per_newton = controller.integral_gain * controller.force_sensitivity;
            a.set_row(state, &(&force * -per_newton));
            b[(state, i)] = per_newton;
            a[(driven, state)] += plant.per_volt;
        }
        let fed_back = force * controller.proportional_gain + force_rate * controller.derivative_gain;
        let mut driven_row = a.row_mut(driven);
        driven_row += (compensated * controller.proportional_gain - fed_back * controller.force_sensitivity)
            * plant.per_volt;
        let compensating = controller.proportional_gain * direct;
        let [proportional, derivative] = [controller.proportional_gain, controller.derivative_gain]
            .map(|gain| gain * controller.force_sensitivity);
        b[(driven, i)] = plant.per_volt * (proportional + compensating * opening_b);
        r[(driven, i)] = plant.per_volt * (derivative + compensating * opening_r);
    }

    let (c, outputs) = plant.outputs(states);
    let mut left_out = left_out(rig);
    left_out.extend(named(&[
        (compensation.computation_delay > 0, "compensation.computation_delay"),
        (rig.plant().dac.delay > 0, "dac.delay"),
        (sensors.velocity.delay > 0, "sensors.velocity.delay"),
        (sensors.force.delay > 0, "sensors.force.delay"),
        (controller.force_delay > 0.0, "controller.force_delay"),
        (controller.velocity_source != VelocitySource::Sensor, "controller.velocity_source"),
    ]));
    Ok(StateSpace {
        b: b + &a * &r,
        d: &c * r,
        a,
        c,
        states: names,
        inputs: plant.inputs(),
        outputs,
        left_out,
        sample_time: None,
    })
}

#[cfg(test)]
mod tests {
    use super::super::{Mode as Vibration, inverse_dynamics};
    use super::*;
    use crate::config::{Mode, MotionAt, RigValues};
    use nalgebra::Complex;

    fn changed(change: impl Fn(&mut RigValues)) -> RigConfig {
        RigConfig::zhao2005().with(change).unwrap()
    }

    fn model(change: impl Fn(&mut RigValues), gain: FlowGain) -> StateSpace {
        continuous(&changed(change), gain).unwrap()
    }

    fn mode_near(model: &StateSpace, frequency: f64) -> Complex<f64> {
        let distance =
            |m: &Vibration| (m.frequency - frequency).abs() + if m.pole.im < 0.0 { 1e9 } else { 0.0 };
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
        let plain = RigConfig::zhao2005();
        let model = continuous(&plain, FlowGain::Nominal).unwrap();
        assert_eq!(StateSpace { d: DMatrix::zeros(5, 1), ..model.clone() }, model, "strictly proper");
        for (motor, attachment, motion_at) in [
            (None, None, MotionAt::Piston),
            (Some(250.0), None, MotionAt::Piston),
            (None, Some(5e8), MotionAt::Piston),
            (Some(400.0), Some(2e8), MotionAt::Structure),
        ] {
            let rig = changed(|rig| {
                rig.servovalve.torque_motor_frequency = motor;
                rig.servovalve.torque_motor_damping = 0.5;
                rig.actuator.attachment_stiffness = attachment;
                rig.sensors.motion_at = motion_at;
            });
            let model = continuous(&rig, FlowGain::Nominal).unwrap();
            let (valve, actuator, structure) = (&rig.servovalve, &rig.actuator, &rig.structure);
            let (control, comp) = (&rig.controller, &rig.compensation);
            for frequency in [0.1, 1.0, 1.58, 5.0, 20.0, 64.7, 300.0] {
                let s = Complex::new(0.0, std::f64::consts::TAU * frequency);
                let spool_area = valve.spool_area;
                // The torque motor is part of the inner loop: its inverse before the pilot's and the spool's
                // lags.
                let armature = motor.map_or(Complex::ONE, |natural| {
                    let relative = s / (TAU * natural);
                    relative * relative + relative + 1.0
                });
                let lags = s * s * (valve.pilot_time_constant * spool_area) + s * spool_area;
                let denominator = lags * armature + valve.spool_sensitivity * valve.pilot_flow_gain;
                let valve_response = (denominator / (valve.pilot_flow_gain / valve.spool_stroke)).inv();
                assert!(
                    (valve_response / inverse_dynamics::valve_response(&rig, frequency) - 1.0).norm() < 1e-12
                );
                let mobility = s / (s * s * structure.mass + s * structure.damping + structure.stiffness);
                // The piston moves more than the structure by F/k.
                let of_piston = mobility + attachment.map_or(Complex::ZERO, |stiffness| s / stiffness);
                let measured = if motion_at == MotionAt::Piston { of_piston } else { mobility };
                let long = comp.response_delay / (1.0 - comp.lead_alpha);
                let lead = (s * long + 1.0) / (s * (comp.lead_alpha * long) + 1.0) / comp.valve_gain;
                let loop_gain = (s * control.derivative_gain + control.proportional_gain)
                    * control.force_sensitivity
                    * valve_response
                    * comp.flow_gain;
                let swallowed = of_piston * actuator.piston_area;
                let leaked = (s * actuator.compressibility + actuator.leakage) / actuator.piston_area;
                let given =
                    lead * valve_response * comp.flow_gain * actuator.piston_area / comp.flow_gain * measured;
                let expected = loop_gain / (loop_gain + leaked + swallowed - given);
                let got = model.response("force", frequency).unwrap();
                assert!(
                    (got - expected).norm() < 1e-9 * expected.norm(),
                    "{motor:?} {attachment:?} {frequency} Hz: {got} and {expected}"
                );
                let moved = model.response("velocity", frequency).unwrap();
                assert!((moved - expected * mobility).norm() < 1e-9 * moved.norm());
            }
        }
    }

    #[test]
    fn with_feedforward_the_commands_flow_needs_no_force_error() {
        // If valve and lead cancel and all flow is fed forward, the force error vanishes. At low frequency
        // the response is then 1 apart from the load cell's own loop, and not 1 − 1/47.
        let rig = changed(|rig| rig.compensation.valve_gain = valve_response_at_rest(rig));
        let droop = |rig: &RigConfig| {
            (continuous(rig, FlowGain::Nominal).unwrap().response("force", 0.0).unwrap().re - 1.0).abs()
        };
        assert!((droop(&rig) - 1.0 / 48.0).abs() < 2e-3, "{}", droop(&rig));
        let fed = rig.with(|rig| rig.compensation.feedforward = true).unwrap();
        assert!(droop(&fed) < 1e-9, "{}", droop(&fed));
        // At 5 Hz the command's rate matters.
        let error = |rig: &RigConfig| {
            (continuous(rig, FlowGain::Nominal).unwrap().response("force", 5.0).unwrap()
                - Complex::new(1.0, 0.0))
            .norm()
        };
        let with = error(&fed);
        assert!(with < 0.2 * error(&rig), "{with}, without {}", error(&rig));
    }

    fn valve_response_at_rest(rig: &RigValues) -> f64 {
        1.0 / (rig.servovalve.spool_sensitivity * rig.servovalve.spool_stroke)
    }

    #[test]
    fn sensors_add_their_lags_in_either_realization() {
        let order = |change: &dyn Fn(&mut RigValues)| model(change, FlowGain::Nominal).states.len();
        assert_eq!(order(&|_| ()), 6);
        assert_eq!(order(&|rig| rig.compensation.response_delay = 0.0), 5);
        assert_eq!(order(&|rig| rig.sensors.velocity.bandwidth = Some(100.0)), 7);
        assert_eq!(order(&|rig| rig.sensors.force.bandwidth = Some(100.0)), 7);
        let lagged = |bandwidth| {
            let with = |rig: &mut RigValues| {
                rig.sensors.velocity.bandwidth = bandwidth;
                rig.sensors.force.bandwidth = bandwidth;
            };
            model(with, FlowGain::Nominal).response("force", 20.0).unwrap()
        };
        let distance = |bandwidth| (lagged(Some(bandwidth)) - lagged(None)).norm();
        assert!(distance(1e6) < 1e-3 * distance(300.0));
    }

    #[test]
    fn a_load_cell_with_a_mass_before_it_is_the_block_between_force_and_loop() {
        // The measured force is F·(1 − m_p·s·Y)/(s/ω + 1), with the structure's mobility Y; the loop is
        // closed by hand.
        let rig = changed(|rig| {
            rig.compensation.mode = Mode::Off;
            (rig.sensors.force.bandwidth, rig.sensors.cell_mass) = (Some(200.0), Some(300.0));
        });
        let with = continuous(&rig, FlowGain::Nominal).unwrap();
        let plain = changed(|rig| rig.compensation.mode = Mode::Off);
        let plain = continuous(&plain, FlowGain::Nominal).unwrap();
        let structure = &rig.structure;
        for frequency in [0.5, 1.58, 10.0, 60.0] {
            let s = Complex::new(0.0, TAU * frequency);
            // F = G·(F_c − F) without the cell, F = G·(F_c − H·F) with it.
            let closed = plain.response("force", frequency).unwrap();
            let open = closed / (1.0 - closed);
            let mobility = s / (s * s * structure.mass + s * structure.damping + structure.stiffness);
            let cell = (1.0 - s * mobility * 300.0) / (s / (TAU * 200.0) + 1.0);
            let expected = open / (open * cell + 1.0);
            let got = with.response("force", frequency).unwrap();
            assert!((got - expected).norm() < 1e-9 * expected.norm(), "{frequency}: {got} and {expected}");
        }
    }

    #[test]
    fn the_model_contains_leakage_and_supply_and_names_missing_effects() {
        let rig = changed(|rig| rig.servovalve.leakage.proportional = 5e-12);
        let leaking = changed(|rig| rig.actuator.leakage += 5e-12);
        let poles = |rig: &RigConfig| continuous(rig, FlowGain::Nominal).unwrap().poles().unwrap();
        assert_eq!(poles(&rig), poles(&leaking));
        let low = RigConfig::zhao2005()
            .replace(&[
                ("supply.schedule.times", toml::Value::Array(vec![0.0.into()])),
                ("supply.schedule.pressures", toml::Value::Array(vec![(0.81 * 1.9e7).into()])),
            ])
            .unwrap();
        let slow = changed(|rig| rig.servovalve.flow_gain_scale = 0.9);
        for (a, b) in poles(&low).iter().zip(poles(&slow)) {
            assert!((a - b).norm() < 1e-9 * b.norm());
        }
        let none =
            low.replace(&[("supply.schedule.pressures", toml::Value::Array(vec![0.0.into()]))]).unwrap();
        let error = continuous(&none, FlowGain::Nominal).unwrap_err().to_string();
        assert!(error.starts_with("supply.schedule.pressures = 0: must be positive at the start"), "{error}");
        assert!(continuous(&rig, FlowGain::Nominal).unwrap().left_out.is_empty());
        let rig = rig.with(|rig| {
            rig.servovalve.overlap = 0.01;
            rig.compensation.computation_delay = 2;
        });
        let rig = rig.unwrap();
        let left_out = continuous(&rig, FlowGain::Nominal).unwrap().left_out;
        assert_eq!(left_out, ["servovalve.overlap", "compensation.computation_delay"]);
        let rig = rig.with(|rig| {
            rig.controller.velocity_source = VelocitySource::Derivative;
            rig.compensation.adaptive = true;
        });
        let rig = rig.unwrap();
        let left_out = continuous(&rig, FlowGain::Nominal).unwrap().left_out;
        let expected = [
            "servovalve.overlap",
            "compensation.adaptive",
            "compensation.computation_delay",
            "controller.velocity_source",
        ];
        assert_eq!(left_out, expected);
    }

    #[test]
    fn a_building_has_the_linear_structure_of_one_story_and_the_modes_of_three() {
        let list = |value: f64, n: usize| toml::Value::Array(vec![value.into(); n]);
        let building = |n: usize| {
            RigConfig::zhao2005()
                .replace(&[
                    ("structure.kind", "shear_building".into()),
                    ("structure.stories.masses", list(7040.0, n)),
                    ("structure.stories.dampings", list(4330.0, n)),
                    ("structure.stories.stiffnesses", list(693.8e3, n)),
                ])
                .unwrap()
        };
        let one = continuous(&building(1), FlowGain::Nominal).unwrap();
        let plain = model(|_| (), FlowGain::Nominal);
        assert_eq!((&one.a, &one.b, &one.c, &one.d), (&plain.a, &plain.b, &plain.c, &plain.d));
        assert_eq!((one.inputs[0].as_str(), one.outputs[0].as_str()), ("command_1", "force_1"));
        // With actuators of almost no area the building keeps its own modes: 2·√(k/m)·sin((2j − 1)π/(2(2n +
        // 1))).
        let loose = building(3).with(|rig| {
            rig.compensation.mode = Mode::Off;
            rig.actuator.piston_area = 1e-7;
        });
        let modes = continuous(&loose.unwrap(), FlowGain::Nominal).unwrap().modes().unwrap();
        for j in 1..=3 {
            let angle = f64::from(2 * j - 1) * std::f64::consts::PI / 14.0;
            let expected = 2.0 * (693.8e3_f64 / 7040.0).sqrt() * angle.sin() / TAU;
            let near = modes.iter().map(|mode| (mode.frequency / expected - 1.0).abs()).fold(1.0, f64::min);
            assert!(near < 1e-6, "mode {j} at {expected} Hz");
        }
    }
}
