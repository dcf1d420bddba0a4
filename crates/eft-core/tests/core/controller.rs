//! The controller: Eq. (1) after the compensation, limits, faults, lanes.

use eft_core::{
    Calibration, Compensation, CompensationInput, CompensationState, Controller, ControllerInput,
    ControllerOutput, ControllerState, CurvePiece, Deviations, Flags, Input, Lanes, LeadNetwork, Learning,
    Parameters, Real, Realization, Scalar, status,
};
use proptest::prelude::*;

use crate::rig;

fn input<T: Real>(i: &Input<f64>) -> ControllerInput<T> {
    let of = T::from_f64;
    ControllerInput {
        command: of(i.command),
        next_command: of(i.next_command),
        velocity: of(i.velocity),
        force: of(i.force),
        spool: of(i.spool),
        supply_pressure: of(i.supply_pressure),
    }
}

fn step<T: Real, const N: usize>(
    c: &Controller<T, N>,
    state: &mut ControllerState<T>,
    i: &ControllerInput<T>,
) -> ControllerOutput<T> {
    c.step(state, i, &c.nominal(), |compensation| compensation)
}

/// A controller of one realization with any of its switches.
fn parameters(realization: Realization) -> impl Strategy<Value = Parameters<'static>> {
    let switches = any::<[bool; 4]>();
    (rig::parameters(), switches).prop_map(move |(p, [feedforward, look_ahead, supply, curve])| Parameters {
        realization,
        feedforward,
        look_ahead,
        supply_correction: supply,
        learning: Learning { adaptive: curve, curve_correction: curve, ..Learning::OFF },
        valve_command: 10.0,
        valve_command_rate: 2.0e4,
        ..p
    })
}

#[test]
fn valve_command_is_equation_1() {
    let p = rig::PARAMETERS;
    let c = Controller::<f64, 21>::new(&p).unwrap();
    let compensation = Compensation::<f64, 21>::new(&p).unwrap();
    let (mut state, mut alone) = (ControllerState::default(), CompensationState::default());
    let mut last = 0.0;
    for n in 0..200 {
        let t = f64::from(n) / p.sample_rate;
        let (command, force) = (8900.0 * (30.0 * t).sin(), 8000.0 * (30.0 * t - 0.2).sin());
        let (velocity, spool) = (0.3 * (20.0 * t).cos(), 0.2 * (20.0 * t).cos());
        let sample = CompensationInput { velocity, force, spool, supply: 1.0, further_flow: 0.0 };
        let v_c = compensation.step(&mut alone, &sample, &compensation.nominal()).value;
        let error = 5.6e-5 * (command - force);
        let expected = 0.8059 * (error + v_c) + 2.0e-4 * (error - last) * p.sample_rate;
        last = error;
        let out =
            step(&c, &mut state, &input(&Input { command, velocity, force, spool, ..Input::default() }));
        assert!((out.valve_command - expected).abs() < 1e-12);
        assert_eq!((out.compensation, out.status), (v_c, 0));
    }
}

#[test]
fn an_analog_force_loop_gets_the_compensation() {
    let p = Parameters { valve_command: 0.1, valve_command_rate: 1.0, ..rig::PARAMETERS };
    let digital = Controller::<f64, 21>::new(&p).unwrap();
    let analog = Controller::<f64, 21>::new(&Parameters { realization: Realization::Analog, ..p }).unwrap();
    let (mut one, mut other) = (ControllerState::default(), ControllerState::default());
    for n in 0..200 {
        let wave = (0.1 * f64::from(n)).sin();
        let i = Input {
            command: 9e3 * wave,
            velocity: 0.3 * wave,
            force: 8e3,
            spool: 0.2 * wave,
            ..Input::default()
        };
        let (closed, open) = (step(&digital, &mut one, &input(&i)), step(&analog, &mut other, &input(&i)));
        assert_eq!((open.valve_command, open.compensation), (closed.compensation, closed.compensation));
        assert_eq!(open.status, closed.status & !(status::COMMAND_LIMITED | status::RATE_LIMITED));
    }
}

/// Inputs side by side.
fn together<T: Real, const L: usize>(single: &[ControllerInput<T>; L]) -> ControllerInput<Lanes<T, L>> {
    let of = |pick: fn(&ControllerInput<T>) -> T| Lanes::from_lanes(|lane| pick(&single[lane]));
    ControllerInput {
        command: of(|i| i.command),
        next_command: of(|i| i.next_command),
        velocity: of(|i| i.velocity),
        force: of(|i| i.force),
        spool: of(|i| i.spool),
        supply_pressure: of(|i| i.supply_pressure),
    }
}

#[test]
fn a_gap_of_one_lane_does_not_affect_the_others() {
    let rates = [4096.0, 4096.0, 8192.0, 4096.0];
    let [single, continuing] = [0.01, f64::MAX].map(|gap_time| {
        rates.map(|sample_rate| {
            let p = Parameters { sample_rate, valve_command_rate: 2.0e3, gap_time, ..rig::LEARNING };
            Controller::<f64, 21>::new(&p).unwrap()
        })
    });
    let wide = Controller::<Lanes<f64, 4>, 21>::pack(&|i| &single[i]);
    let calibrations = single.each_ref().map(Controller::nominal);
    let calibration = side_by_side(&calibrations);
    // The last gap of the first lane ends during one of the second. Those of the fourth are too short. At the end all
    // lanes have a gap.
    let lost = [[100..160, 200..300], [250..900, 0..0], [400..470, 500..590], [600..639, 0..0]];
    let (mut states, mut packed) = ([ControllerState::default(); 4], ControllerState::default());
    let mut resumed = 0;
    for tick in 0..1200_u32 {
        let sine = (0.004 * f64::from(tick)).sin();
        let mut i =
            Input { command: 3e3 * sine, velocity: 0.5 * sine, force: 2.9e3 * sine, ..Input::default() };
        (i.spool, i.next_command) = (0.3 * sine, i.command);
        let ticks: [_; 4] = std::array::from_fn(|lane| {
            let bad = lost[lane].iter().any(|gap| gap.contains(&tick)) || (1000..1100).contains(&tick);
            input(&if bad { Input { force: f64::NAN, ..i } } else { i })
        });
        let out = wide.step(&mut packed, &together(&ticks), &calibration, |compensation| compensation);
        for lane in 0..4 {
            let before = states[lane];
            let alone = step(&single[lane], &mut states[lane], &ticks[lane]);
            assert_eq!(out.valve_command.lane(lane), alone.valve_command, "lane {lane}, tick {tick}");
            assert_eq!(out.compensation.lane(lane), alone.compensation, "lane {lane}, tick {tick}");
            assert_eq!(out.status.lane(lane), alone.status, "lane {lane}, tick {tick}");
            let continued = step(&continuing[lane], &mut { before }, &ticks[lane]);
            resumed += u32::from(continued.compensation != alone.compensation);
        }
    }
    // After each gap of more than 10 ms, and at no other sample.
    assert_eq!(resumed, 2 + 1 + 1 + 4);
}

proptest! {
    #[test]
    fn limits_hold(
        commands in prop::collection::vec(rig::inputs(), 1..80), amplitude in 0.0..10.0f64, rate in 0.0..1.0e4f64,
        other in 0.0..10.0f64,
    ) {
        let p = Parameters { valve_command: amplitude, valve_command_rate: rate, ..rig::PARAMETERS };
        let c = Controller::<f64, 21>::new(&p).unwrap();
        let mut state = ControllerState::default();
        let mut last = 0.0;
        for i in commands {
            let out = step(&c, &mut state, &input(&i));
            prop_assert!(out.valve_command.abs() <= amplitude);
            prop_assert!((out.valve_command - last).abs() <= rate / p.sample_rate * (1.0 + 1e-9) + 1e-12);
            last = out.valve_command;
        }
        // New limits hold from their first tick.
        let narrow = Controller::<f64, 21>::new(&Parameters { valve_command: other, ..p }).unwrap();
        let asked = Input { command: 1.0e5, velocity: 0.0, force: 0.0, spool: 0.0, ..Input::default() };
        prop_assert!(step(&narrow, &mut state, &input(&asked)).valve_command.abs() <= other);
    }
}

proptest! {
    /// Anti-windup and NaN rule: only good samples are summed, up to a fifth of the opening.
    #[test]
    fn an_integral_part_adds_the_limited_sum_of_good_errors(
        p in parameters(Realization::Digital), integral_gain in 0.1..100.0f64,
        ticks in prop::collection::vec(rig::inputs(), 1..120),
    ) {
        // The step over an overlap depends on the integral.
        let p = Parameters { valve_command: f64::MAX, valve_command_rate: f64::MAX, overlap: 0.0, ..p };
        let with = Controller::<f64, 21>::new(&Parameters { integral_gain, ..p }).unwrap();
        let without = Controller::<f64, 21>::new(&Parameters { integral_gain: 0.0, ..p }).unwrap();
        let [mut state, mut plain] = [ControllerState::default(); 2];
        let (mut sum, limit) = (0.0_f64, 0.2 / p.valve_gain);
        for i in ticks.iter().map(input) {
            let (out, like) = (step(&with, &mut state, &i), step(&without, &mut plain, &i));
            prop_assert_eq!((out.status, out.compensation), (like.status, like.compensation));
            if out.status & (status::INVALID_COMMAND | status::INVALID_MEASUREMENT) == 0 {
                let added = out.valve_command - like.valve_command;
                let rounding = 1e-12 * (1.0 + out.valve_command.abs());
                prop_assert!((added - sum).abs() <= rounding, "{added} V, not {sum} V");
                let error = p.force_sensitivity * (i.command - i.force);
                sum = (sum + integral_gain * error / p.sample_rate).clamp(-limit, limit);
            }
        }
    }
}

proptest! {
    /// A valve whose null is at `b` is the valve without a bias behind the spool opening less `b`. So the compensation
    /// for a spool that is `b` further open is the same, and `b/(G_p·K_s)` of voltage holds the spool there.
    #[test]
    fn a_known_null_bias_moves_the_zero_of_the_spool(
        p in parameters(Realization::Digital), null_bias in -0.5..0.5f64,
        ticks in prop::collection::vec(rig::inputs(), 1..120),
    ) {
        let p = Parameters { valve_command: f64::MAX, valve_command_rate: f64::MAX, ..p };
        let p = Parameters { spool_range: f64::MAX, spool_warning: f64::MAX, null_bias: 0.0, ..p };
        let with = Controller::<f64, 21>::new(&Parameters { null_bias, ..p }).unwrap();
        let without = Controller::<f64, 21>::new(&p).unwrap();
        let [mut state, mut plain] = [with.at_rest(), without.at_rest()];
        let signal = null_bias / (p.proportional_gain * p.valve_gain);
        for i in &ticks {
            let moved = Input { spool: i.spool + null_bias, ..*i };
            // Less the rounding by the sum.
            let i = &Input { spool: moved.spool - null_bias, ..*i };
            let (out, like) = (step(&with, &mut state, &input(&moved)), step(&without, &mut plain, &input(i)));
            prop_assert_eq!(out.status, like.status);
            let rounding = 1e-12 * (1.0 + like.compensation.abs());
            let added = out.compensation - like.compensation;
            prop_assert!((added - signal).abs() <= rounding, "{added} V, not {signal} V");
            let rounding = 1e-11 * (1.0 + like.valve_command.abs());
            let opened = p.valve_gain * (out.valve_command - like.valve_command);
            prop_assert!((opened - null_bias).abs() <= rounding, "{opened}, not {null_bias}");
        }
    }
}

/// Calibrations side by side.
fn side_by_side<T: Real, const L: usize>(single: &[Calibration<T>; L]) -> Calibration<Lanes<T, L>> {
    let of = |pick: fn(&Calibration<T>) -> T| Lanes::from_lanes(|lane| pick(&single[lane]));
    Calibration {
        window: 0,
        status: Default::default(),
        flow_gain: of(|c| c.flow_gain),
        per_flow_gain: of(|c| c.per_flow_gain),
        lead: LeadNetwork::pack(&|lane| &single[lane].lead),
        response_delay: of(|c| c.response_delay),
        velocity_delay: of(|c| c.velocity_delay),
        null_offset: of(|c| c.null_offset),
        null_signal: of(|c| c.null_signal),
        valve_gain: of(|c| c.valve_gain),
        level: of(|c| c.level),
        deviations: Deviations {
            flow_gain: of(|c| c.deviations.flow_gain),
            valve_gain: of(|c| c.deviations.valve_gain),
            response_delay: of(|c| c.deviations.response_delay),
            velocity_delay: of(|c| c.deviations.velocity_delay),
            null_offset: of(|c| c.deviations.null_offset),
        },
        test_ratio: of(|c| c.test_ratio),
        curve: std::array::from_fn(|n| CurvePiece {
            offset: Lanes::from_lanes(|lane| single[lane].curve[n].offset),
            slope: Lanes::from_lanes(|lane| single[lane].curve[n].slope),
        }),
    }
}

macro_rules! totality {
    ($name:ident, $t:ty) => {
        mod $name {
            use super::*;

            fn controller(p: &Parameters) -> Controller<$t, 21> {
                Controller::<$t, 21>::new(p).unwrap()
            }

            proptest! {
                #[test]
                fn bad_ticks_hold_flag_and_leave_no_trace(
                    p in rig::parameters(), ticks in prop::collection::vec(rig::inputs(), 1..80), limited in any::<bool>(),
                ) {
                    let (valve_command, valve_command_rate) = if limited { (10.0, 2.0e4) } else { (f64::MAX, f64::MAX) };
                    let c = controller(&Parameters { valve_command, valve_command_rate, ..p });
                    let compensation = Compensation::<$t, 21>::new(&p).unwrap();
                    let mut state = ControllerState::default();
                    let mut good_only = state;
                    let faults = status::INVALID_COMMAND | status::INVALID_MEASUREMENT;
                    let (mut last, mut lost) = (0.0, 0.0);
                    for tick in ticks {
                        let tick = input::<$t>(&tick);
                        let out = step(&c, &mut state, &tick);
                        prop_assert!(out.valve_command.is_finite() && out.compensation.is_finite());
                        let measured = compensation.accepts(tick.velocity, tick.force, tick.spool);
                        prop_assert_eq!(out.status & status::INVALID_MEASUREMENT == 0, measured);
                        prop_assert_eq!(out.status & status::INVALID_COMMAND == 0, tick.command.abs() <= 1.0e12);
                        if out.status & faults != 0 {
                            prop_assert_eq!(out.valve_command.to_bits(), (last as $t).to_bits());
                            prop_assert_eq!(c.hold(&state), c.hold(&good_only));
                            lost += 1.0;
                            continue;
                        }
                        // After a gap the old state is not used.
                        if lost > p.gap_time * p.sample_rate {
                            good_only = state;
                        } else {
                            step(&c, &mut good_only, &tick);
                        }
                        prop_assert_eq!(state, good_only);
                        (last, lost) = (out.valve_command, 0.0);
                    }
                }

                #[test]
                fn primed_controller_steps_without_a_bump(
                    p in parameters(Realization::Digital), tick in rig::inputs(), amplitude in 0.1..20.0f64, rate in 0.0..1.0e3f64,
                ) {
                    let c = controller(&Parameters { valve_command: amplitude, valve_command_rate: rate, ..p });
                    // After long at one command, the next one is the same.
                    let tick = input::<$t>(&Input { next_command: tick.command, ..tick });
                    let primed = c.prime(&ControllerState::default(), &tick, &c.nominal());
                    let mut state = primed;
                    let held = c.hold(&primed);
                    let out = step(&c, &mut state, &tick);
                    prop_assert_eq!(out.valve_command.to_bits(), held.valve_command.to_bits());
                    prop_assert_eq!(out.compensation.to_bits(), held.compensation.to_bits());
                    // An integral part sums up a force error that lasts.
                    let rests = p.integral_gain == 0.0 || tick.command == tick.force;
                    if rests && out.status & (status::INVALID_COMMAND | status::INVALID_MEASUREMENT) == 0 {
                        prop_assert_eq!(state, primed);
                    }
                    prop_assert_eq!(held.status, status::HELD);
                }

                #[test]
                fn lanes_give_the_bits_of_single_rigs(
                    ps in prop_oneof![
                        prop::collection::vec(parameters(Realization::Digital), 4),
                        prop::collection::vec(parameters(Realization::Analog), 4),
                    ],
                    ticks in prop::collection::vec([rig::inputs(), rig::inputs(), rig::inputs(), rig::inputs()], 1..40),
                    flow_gain in 0.7..1.3f64, slope in 0.8..1.2f64,
                ) {
                    type Wide = Lanes<$t, 4>;
                    let single: Vec<_> = ps.iter().map(controller).collect();
                    let wide = Controller::<Wide, 21>::pack(&|i| &single[i]);
                    let calibrations: [_; 4] = std::array::from_fn(|i| {
                        let per_flow_gain = 1.0 / (flow_gain as $t + 0.1 * i as $t);
                        let mut c = Calibration { per_flow_gain, ..single[i].nominal() };
                        c.curve[7 + i] = CurvePiece { offset: 1e-4, slope: slope as $t };
                        c
                    });
                    let calibration = side_by_side(&calibrations);
                    let mut states = [ControllerState::default(); 4];
                    let mut packed = ControllerState::<Wide>::default();
                    for tick in ticks {
                        let ticks = tick.map(|i| input::<$t>(&i));
                        let out = wide.step(&mut packed, &together(&ticks), &calibration, |compensation| compensation);
                        for i in 0..4 {
                            let alone = single[i].step(&mut states[i], &ticks[i], &calibrations[i], |compensation| compensation);
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
