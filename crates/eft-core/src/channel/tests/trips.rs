//! What the output is after a trip and without one, and with an open force loop.

use super::*;
use crate::channel::state::CalibrationHistory;
use crate::parameters::Levels;
use crate::table::FlowTable;

#[test]
fn a_held_output_has_the_authority_of_the_last_tick() {
    for realization in [Realization::Digital, Realization::Analog] {
        let channel = Channel::<f64, 21>::new(&Parameters { realization, ..RIG }).unwrap();
        let mut state = channel.at_rest();
        for tick in 0..200 {
            channel.step(&mut state, &Input { displacement: 0.0, ..swing(tick) });
        }
        state.protection.shut_down_by(Cause::Request);
        // A quarter of a shutdown of a tenth of a second.
        let last = (0..102)
            .map(|_| channel.step(&mut state, &Input { displacement: 0.0, ..swing(200) }))
            .last()
            .unwrap();
        let held = channel.hold(&state);
        assert!((held.authority - 0.75).abs() < 3e-3 && held.authority == last.authority, "{held:?}");
        assert!(last.voltage.abs() > 1e-3 && held.voltage == last.voltage, "{held:?}, {last:?}");
        assert_eq!((held.compensation, held.status), (last.compensation, status::HELD));
    }
}

#[test]
fn without_a_protection_every_command_is_permitted_and_the_whole_output_passes() {
    let channel = Channel::<f64, 21>::new(&Parameters { protection: None, ..RIG }).unwrap();
    let mut state = channel.at_rest();
    for tick in 1..400 {
        let input = swing(tick);
        let out = channel.step(&mut state, &input);
        let held = channel.hold(&state);
        assert_eq!((out.permitted_command, out.authority), (input.command, 1.0));
        assert_eq!((held.voltage, held.authority), (out.voltage, 1.0));
    }
}

#[test]
fn after_a_trip_a_share_of_the_velocity_is_compensated_and_with_an_open_loop_that_of_a_trusted_sensor() {
    // A linear valve without delay: the compensation is A·ẋ/(K_v·G_p·K_s) at once.
    let rig = Parameters { mode: crate::Mode::Linear, response_delay: 0.0, protection: WATCHED, ..RIG };
    let channel = Channel::<f64, 21>::new(&rig).unwrap();
    // The opening passes the piston's flow, so that there is no null bias.
    let spool = FlowTable::<f64, 21>::new(rig.openings, rig.flows).unwrap().opening(rig.piston_area * 0.1);
    let moves =
        Input { command: 0.0, velocity: 0.1, force: 0.0, spool, displacement: 0.0, ..Input::default() };
    for (cause, opens, share) in [
        (Cause::Request, false, 0.95),
        (Cause::ForceLevel, false, 0.95),
        (Cause::ForceLost, true, 0.93),
        // The velocity may be wrong, so the displacement is followed. It is at rest.
        (Cause::ForceLevel, true, 0.0),
    ] {
        let mut state = channel.at_rest();
        for _ in 0..4 {
            channel.step(&mut state, &moves);
        }
        if opens {
            state.protection.shut_down_by(cause)
        } else {
            state.protection.trip_by(cause)
        }
        let found = channel.step(&mut state, &moves).compensation;
        let whole = rig.piston_area * 0.1 / (rig.flow_gain * rig.proportional_gain * rig.valve_gain);
        assert!((found - share * whole).abs() < 1e-6 * whole, "{cause:?}: {found}, not {}", share * whole);
    }
}

// SR-06
#[test]
fn after_a_trip_a_brake_is_taken_from_the_command() {
    let levels = Levels { warning: 15e3, trip: 20e3 };
    let speeds = Levels { warning: 1.2, trip: 1.2 };
    let protection = WATCHED.map(|p| ProtectionParameters { force: levels, velocity: speeds, ..p });
    let channel = Channel::<f64, 21>::new(&Parameters { protection, ..RIG }).unwrap();
    for velocity in [0.1, -0.1] {
        let moves = |tick: i32| {
            let displacement = velocity * f64::from(tick) / RIG.sample_rate;
            Input { command: 2e3, velocity, displacement, ..swing(0) }
        };
        let mut state = channel.at_rest();
        assert_eq!(channel.step(&mut state, &moves(0)).permitted_command, 2e3);
        state.protection.trip();
        for tick in 1..400 {
            let removed = f64::from(tick) / 2048.0;
            let foreseen = channel.preview(&state, 2e3);
            let permitted = channel.step(&mut state, &moves(tick)).permitted_command;
            assert!((foreseen - permitted).abs() < 30.0, "{velocity} {tick}: {foreseen}, then {permitted}");
            if tick == 399 {
                // Up to 40 % of the warning level, at a sixth of the velocity's level; twice the share that the ramp
                // removed.
                let brake = 2.0 * removed * 6e3 * 0.95 * velocity / 0.2;
                let expected = 2e3 * (1.0 - removed) - brake;
                assert!((permitted - expected).abs() < 2.0, "{velocity}: {permitted}, not {expected}");
            }
        }
    }
}

#[test]
fn without_its_velocity_the_force_loop_has_half_its_gains() {
    let channel = Channel::<f64, 21>::new(&Parameters { protection: WATCHED, ..RIG }).unwrap();
    let rests =
        Input { command: 0.0, velocity: 0.0, displacement: 0.0, force: 0.0, spool: 0.0, ..Input::default() };
    let answer = |cause| {
        let mut state = channel.at_rest();
        channel.step(&mut state, &rests);
        state.protection.trip_by(cause);
        state.plausibility.distrust(cause);
        for _ in 0..1000 {
            channel.step(&mut state, &rests);
        }
        let answer = |force| channel.step(&mut { state }, &Input { force, ..rests }).voltage;
        answer(50.0) - answer(0.0)
    };
    let [whole, half] = [Cause::SpoolLost, Cause::VelocityLost].map(answer);
    assert!(whole < -1e-3 && (half - 0.5 * whole).abs() < 1e-9, "{half}, {whole}");
}

#[test]
fn a_primed_channel_takes_a_new_operating_point_for_no_fault() {
    let channel = Channel::<f64, 21>::new(&Parameters { protection: WATCHED, ..RIG }).unwrap();
    let table = FlowTable::<f64, 21>::new(RIG.openings, RIG.flows).unwrap();
    // A piston that swings under a dead load, in balance with the valve's flow.
    let swing = |time: f64, load: f64| {
        let rate = core::f64::consts::TAU * 2.0;
        let velocity = 0.2 * libm::sin(rate * time);
        let root = libm::sqrt(1.0 - velocity.signum() * load / (RIG.piston_area * RIG.supply_pressure));
        let leaked = RIG.leakage / RIG.piston_area * load;
        Input {
            command: load,
            force: load,
            velocity,
            displacement: -0.2 / rate * libm::cos(rate * time),
            spool: table.opening((RIG.piston_area * velocity + leaked) / root),
            ..still(0)
        }
    };
    for distrusts in [false, true] {
        let mut state = channel.at_rest();
        for (start, load) in [(0.0, 0.0), (0.13, 12e3), (0.4, -20e3)] {
            let at = |tick: i32| swing(start + f64::from(tick) / RIG.sample_rate, load);
            channel.prime(&mut state, &at(0));
            let last = (0..4096).map(|tick| channel.step(&mut state, &at(tick))).last().unwrap();
            assert_eq!(state.cause(), Cause::None, "{start}");
            assert_eq!(last.status & status::SPOOL_DISTRUSTED != 0, distrusts && start > 0.0);
            if distrusts {
                state.plausibility.distrust(Cause::SpoolLost);
            }
        }
    }
}

#[test]
fn an_open_loop_does_not_follow_a_piston_that_rests() {
    let channel = Channel::<f64, 21>::new(&Parameters { protection: WATCHED, ..RIG }).unwrap();
    for (velocity, follows) in [(0.005, false), (0.05, true)] {
        let mut state = channel.at_rest();
        let mut compensation = f64::NAN;
        for tick in 0..200 {
            let (displacement, spool) = (velocity * f64::from(tick) / RIG.sample_rate, 0.0);
            let moves = Input { command: 0.0, force: 0.0, velocity, displacement, spool, ..still(0) };
            if tick == 60 {
                state.protection.shut_down_by(Cause::ForceLost);
            }
            compensation = channel.step(&mut state, &moves).compensation;
        }
        assert_eq!(compensation > 0.0, follows, "{velocity}: {compensation}");
    }
}

// SR-10
#[test]
fn an_opened_loop_compensates_for_the_null_bias_and_not_for_a_fault() {
    // A bias that was learned is already in the output, and must not be added again.
    for (integral_gain, learned) in [(0.0, 0.0), (4.0, 0.0), (0.0, 0.01)] {
        let learning = Learning { curve_correction: true, ..Learning::ADAPTIVE };
        let rig = Parameters { integral_gain, learning, protection: WATCHED, ..RIG };
        let channel = Channel::<f64, 21>::new(&rig).unwrap();
        let mut state = channel.at_rest();
        let mut calibration = *state.calibration();
        calibration.null_offset = learned;
        calibration.null_signal = learned / (rig.proportional_gain * rig.valve_gain);
        state.history = CalibrationHistory::new(calibration);
        let mut voltage = |force: f64, spool: f64, ticks: u32, opens: bool| {
            let input = Input { command: 0.0, velocity: 0.0, displacement: 0.0, force, spool, ..still(0) };
            let mut last = f64::NAN;
            for _ in 0..ticks {
                if opens {
                    state.protection.shut_down_by(Cause::ForceLost);
                }
                let out = channel.step(&mut state, &input);
                if let Some(window) = out.window {
                    calibration.window = window.number;
                    channel.publish(&mut state, calibration);
                }
                assert_eq!(out.status & status::TRIPPED != 0, opens, "{integral_gain} {learned}");
                last = out.voltage;
            }
            last
        };
        // The piston stands although the spool is open.
        voltage(0.0, 0.01, 5 * 4096, false);
        // A load cell that lies for 0.1 s winds an integral up.
        voltage(800.0, 0.01, 410, false);
        voltage(800.0, 0.01, 200, true);
        // It keeps standing with the opening at which it stood, for which the valve needs 0.1 V.
        let opened = voltage(800.0, 0.01, 200, true);
        assert!((opened - 0.01 / RIG.valve_gain).abs() < 0.003, "{integral_gain} {learned}: {opened}");
        // And so does the closed valve.
        let closed = voltage(800.0, 0.01, 5 * 4096, true);
        assert_eq!(channel.hold(&state).authority, 0.0);
        assert!((closed - 0.01 / RIG.valve_gain).abs() < 0.003, "{integral_gain} {learned}: {closed}");
        assert_eq!(channel.hold(&state).voltage, closed, "{integral_gain} {learned}");
    }
}

// SR-10
#[test]
fn an_opened_loop_keeps_a_known_null_bias() {
    for (integral_gain, curve_correction) in [(0.0, false), (4.0, false), (0.0, true), (4.0, true)] {
        let learning = Learning { adaptive: curve_correction, curve_correction, ..Learning::OFF };
        let rig = Parameters { integral_gain, learning, null_bias: 0.03, protection: WATCHED, ..RIG };
        let channel = Channel::<f64, 21>::new(&rig).unwrap();
        let mut state = channel.at_rest();
        let still = Input { command: 0.0, force: 0.0, spool: 0.03, ..still(0) };
        let mut opened = f64::NAN;
        for tick in 0..4096 {
            if tick >= 3000 {
                state.protection.shut_down_by(Cause::ForceLost);
            }
            let now = Input { velocity: 0.0, displacement: 0.0, ..still };
            opened = channel.step(&mut state, &now).voltage;
            // The flow at the known null is none, so that nothing is left to compensate for.
            let held = 0.03 / RIG.valve_gain;
            assert!((opened - held).abs() < 1e-9, "{integral_gain} {curve_correction} {tick}: {opened}");
        }
        assert!(opened > 0.0);
    }
}

#[test]
fn a_rig_with_a_known_null_bias_rests_and_shuts_down_at_its_null() {
    for (realization, null_bias) in
        [(Realization::Digital, 0.08), (Realization::Digital, -0.2), (Realization::Analog, 0.08)]
    {
        let channel =
            Channel::<f64, 21>::new(&Parameters { realization, null_bias, protection: WATCHED, ..RIG })
                .unwrap();
        let digital = realization == Realization::Digital;
        let held = null_bias / RIG.valve_gain / if digital { 1.0 } else { RIG.proportional_gain };
        let mut state = channel.at_rest();
        let before = channel.hold(&state);
        assert!((before.voltage - held).abs() < 1e-12, "{null_bias}: {before:?}");
        let still = Input { command: 0.0, force: 0.0, spool: null_bias, valve_command: f64::NAN, ..still(0) };
        let still = Input { velocity: 0.0, displacement: 0.0, ..still };
        for tick in 0..4096 {
            let out = channel.step(&mut state, &still);
            // Spool and command stand at the null from the first sample on.
            assert_eq!(state.plausibility.spool(), null_bias, "{tick}");
            assert!(
                (out.voltage - held).abs() < 1e-12 && out.status & status::TRIPPED == 0,
                "{tick}: {out:?}"
            );
        }
        // The command keeps a digital loop's output away from the null until the shutdown ends.
        let asks = Input { command: 2000.0, ..still };
        let out = channel.step(&mut state, &asks);
        assert_eq!((out.voltage - held).abs() > 0.05, digital, "{out:?}");
        state.protection.shut_down_by(Cause::Request);
        state.protection.motion_unknown = true;
        let ended = (0..4096).map(|_| channel.step(&mut state, &asks)).last().unwrap();
        assert!(ended.authority == 0.0 && (ended.voltage - held).abs() < 1e-12, "{ended:?}");
        assert_eq!(channel.hold(&state).voltage, ended.voltage);
    }
}

#[test]
fn the_null_bias_of_a_swing_is_its_mean() {
    let channel = Channel::<f64, 21>::new(&Parameters { protection: WATCHED, ..RIG }).unwrap();
    let mut state = channel.at_rest();
    let mut opened = f64::NAN;
    for tick in 0..40_000 {
        // A blocked piston and a spool that swings by a hundredth at 1.3 Hz: a flow gain that is wrong.
        let spool = 0.01 * libm::cos(0.002 * f64::from(tick));
        let input = Input { command: 0.0, velocity: 0.0, displacement: 0.0, force: 0.0, spool, ..still(0) };
        if tick >= 39_500 {
            state.protection.shut_down_by(Cause::ForceLost);
        }
        opened = channel.step(&mut state, &input).voltage;
    }
    assert!(opened.abs() < 0.05 * 0.01 / RIG.valve_gain, "{opened}");
}

#[test]
fn an_opened_loop_has_no_derivative_kick() {
    let channel = Channel::<f64, 21>::new(&Parameters { protection: WATCHED, ..RIG }).unwrap();
    let mut state = channel.at_rest();
    let away =
        Input { command: 0.0, velocity: 0.0, force: 2000.0, spool: 0.0, displacement: 0.0, ..still(0) };
    for _ in 0..100 {
        channel.step(&mut state, &away);
    }
    state.protection.shut_down_by(Cause::ForceLevel);
    // The derivative gain times the change of the error would be 0.09 V. The leakage by the force needs a small
    // opening.
    let opened = channel.step(&mut state, &away).voltage;
    assert!(opened.abs() < 1e-3, "{opened}");
}
