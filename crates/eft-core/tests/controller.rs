//! The whole tick: Eq. (1) behind the compensation, limits, faults, lanes.
// A failed index or unwrap is a failed test; bits are compared on purpose.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, clippy::float_cmp)]

mod rig;

use eft_core::{
    Compensation, CompensationParameters, Controller, ControllerState, Flags, FlowTable, Lanes, Limiter,
    Scalar, ServovalveController, status,
};
use proptest::prelude::*;

macro_rules! controller {
    ($t:ty, $p:expr, $amplitude:expr, $rate:expr) => {{
        let p: &CompensationParameters = $p;
        let table = FlowTable::<$t, 21>::new(&rig::OPENINGS, &rig::flows()).unwrap();
        Controller::<$t, 21> {
            compensation: Compensation::<$t, 21>::new(p, &table).unwrap(),
            servovalve: ServovalveController::<$t>::new(5.6e-5, p.proportional_gain, 2.0e-4, p.sample_rate)
                .unwrap(),
            limiter: Limiter::<$t>::new($amplitude, $rate, p.sample_rate).unwrap(),
        }
    }};
}

#[test]
fn valve_command_is_equation_1() {
    let p = rig::PARAMETERS;
    let c = controller!(f64, &p, f64::MAX, f64::MAX);
    let mut state = ControllerState::default();
    let mut alone = eft_core::CompensationState::default();
    let mut last = 0.0;
    for n in 0..200 {
        let t = f64::from(n) / p.sample_rate;
        let (command, force) = (8900.0 * (30.0 * t).sin(), 8000.0 * (30.0 * t - 0.2).sin());
        let (velocity, spool) = (0.3 * (20.0 * t).cos(), 0.2 * (20.0 * t).cos());
        let v_c = c.compensation.step(&mut alone, velocity, force, spool, 0.0).value;
        let error = 5.6e-5 * (command - force);
        let expected = 0.8059 * (error + v_c) + 2.0e-4 * (error - last) * p.sample_rate;
        last = error;
        let out = c.step(&mut state, command, velocity, force, spool);
        assert!((out.valve_command - expected).abs() < 1e-12);
        assert_eq!((out.compensation, out.status), (v_c, 0));
    }
}

proptest! {
    #[test]
    fn limits_hold(
        commands in prop::collection::vec(rig::ticks(), 1..80), amplitude in 0.0..10.0f64, rate in 0.0..1.0e4f64,
        other in 0.0..10.0f64,
    ) {
        let c = controller!(f64, &rig::PARAMETERS, amplitude, rate);
        let mut state = ControllerState::default();
        let mut last = 0.0;
        for [command, v, f, x] in commands {
            let out = c.step(&mut state, command, v, f, x);
            prop_assert!(out.valve_command.abs() <= amplitude);
            prop_assert!((out.valve_command - last).abs() <= rate / rig::PARAMETERS.sample_rate * (1.0 + 1e-9) + 1e-12);
            last = out.valve_command;
        }
        // New limits hold from their first tick.
        let narrow = controller!(f64, &rig::PARAMETERS, other, rate);
        prop_assert!(narrow.step(&mut state, 1.0e5, 0.0, 0.0, 0.0).valve_command.abs() <= other);
    }
}

macro_rules! totality {
    ($name:ident, $t:ty) => {
        mod $name {
            use super::*;

            proptest! {
                #[test]
                fn bad_ticks_hold_flag_and_leave_no_trace(
                    p in rig::parameters(), ticks in prop::collection::vec(rig::ticks(), 1..80), limited in any::<bool>(),
                ) {
                    let (amplitude, rate) = if limited { (10.0, 2.0e4) } else { (f64::MAX, f64::MAX) };
                    let c = controller!($t, &p, amplitude, rate);
                    let mut state = ControllerState::default();
                    let mut good_only = state;
                    let faults = status::INVALID_COMMAND | status::INVALID_MEASUREMENT;
                    let mut last = 0.0;
                    for tick in ticks {
                        let [command, v, f, x] = tick.map(|a| a as $t);
                        let before = state;
                        let out = c.step(&mut state, command, v, f, x);
                        prop_assert!(out.valve_command.is_finite() && out.compensation.is_finite());
                        let measured = c.compensation.accepts(v, f, x);
                        prop_assert_eq!(out.status & status::INVALID_MEASUREMENT == 0, measured);
                        prop_assert_eq!(out.status & status::INVALID_COMMAND == 0, command.abs() <= 1.0e12);
                        if out.status & faults == 0 {
                            c.step(&mut good_only, command, v, f, x);
                        } else {
                            prop_assert_eq!(state, before);
                            prop_assert_eq!(out.valve_command.to_bits(), (last as $t).to_bits());
                        }
                        prop_assert_eq!(state, good_only);
                        last = out.valve_command;
                    }
                }

                #[test]
                fn primed_controller_steps_without_a_bump(
                    p in rig::parameters(), [command, v, f, x] in rig::ticks(), amplitude in 0.1..20.0f64, rate in 0.0..1.0e3f64,
                ) {
                    let c = controller!($t, &p, amplitude, rate);
                    let [command, v, f, x] = [command, v, f, x].map(|a| a as $t);
                    let primed = c.prime(command, v, f, x, 0.0);
                    let mut state = primed;
                    let held = c.hold(&primed);
                    let out = c.step(&mut state, command, v, f, x);
                    prop_assert_eq!(out.valve_command.to_bits(), held.valve_command.to_bits());
                    prop_assert_eq!(out.compensation.to_bits(), held.compensation.to_bits());
                    prop_assert_eq!(state, primed);
                    prop_assert_eq!(held.status, status::HELD);
                }

                #[test]
                fn lanes_give_the_bits_of_single_rigs(
                    ps in prop::collection::vec(rig::parameters(), 4),
                    ticks in prop::collection::vec([rig::ticks(), rig::ticks(), rig::ticks(), rig::ticks()], 1..40),
                ) {
                    type Wide = Lanes<$t, 4>;
                    let single: Vec<_> = ps.iter().map(|p| controller!($t, p, 10.0, 2.0e4)).collect();
                    let wide = Controller::<Wide, 21>::pack(|i| &single[i]);
                    let mut states = [ControllerState::default(); 4];
                    let mut packed = ControllerState::<Wide>::default();
                    for tick in ticks {
                        let input = |k: usize| Wide::from_lanes(|i| tick[i][k] as $t);
                        let out = wide.step(&mut packed, input(0), input(1), input(2), input(3));
                        for i in 0..4 {
                            let [command, v, f, x] = tick[i].map(|a| a as $t);
                            let alone = single[i].step(&mut states[i], command, v, f, x);
                            prop_assert_eq!(out.valve_command.lane(i).to_bits(), alone.valve_command.to_bits());
                            prop_assert_eq!(out.compensation.lane(i).to_bits(), alone.compensation.to_bits());
                            prop_assert_eq!(out.status.lane(i), alone.status);
                        }
                    }
                }
            }
        }
    };
}
totality!(single, f32);
totality!(double, f64);
