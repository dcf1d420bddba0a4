//! The adaptive controller as a block: total, held on bad samples, primed without a bump, the same in lanes, and the
//! plain one where everything is off.
// A failed index or unwrap is a failed test; bits are compared on purpose.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, clippy::float_cmp)]

mod rig;

use eft_core::{
    AdaptiveCompensation, AdaptiveController, AdaptiveParameters, CompensationParameters, Controller,
    ControllerState, Flags, FlowTable, Lanes, Measurements, Scalar, Tuning, status,
};
use proptest::prelude::*;

const OFF: AdaptiveParameters =
    AdaptiveParameters { feedforward: false, adaptive: false, guard: false, ..rig::ADAPTIVE };

/// With these switches on a rig around the paper's.
fn parameters() -> impl Strategy<Value = AdaptiveParameters> {
    (rig::parameters(), any::<[bool; 4]>()).prop_map(
        |(compensation, [feedforward, adaptive, correct_curve, guard])| AdaptiveParameters {
            compensation,
            feedforward,
            adaptive,
            correct_curve,
            guard,
            ..rig::ADAPTIVE
        },
    )
}

/// One tick's command (N), velocity (m/s), force (N), spool (1) and supply pressure (Pa).
fn ticks() -> impl Strategy<Value = [f64; 5]> {
    let supply = prop_oneof![8 => 1.0e7..2.2e7f64, 1 => rig::samples(1.9e7)];
    (rig::ticks(), supply).prop_map(|([command, v, f, x], p)| [command, v, f, x, p])
}

fn measured<S: Scalar>(velocity: S, force: S, spool: S, supply_pressure: S) -> Measurements<S> {
    Measurements { velocity, force, spool, valve_command: S::splat(0.0), supply_pressure }
}

/// A valve as it is, over the one that its controller knows.
#[derive(Clone, Copy)]
struct Valve {
    /// True flow over the table's (1).
    flow_gain: f64,
    /// The spool's gain over the configured one (1).
    valve_gain: f64,
    /// Delay of the spool behind its command (s).
    delay: f64,
}

/// What is to be found of a sound one.
const SOUND_ESTIMATES: [f64; 3] = [1.0, 1.0, SOUND.delay];

/// As configured.
const SOUND: Valve = Valve { flow_gain: 1.0, valve_gain: 1.0, delay: 5.0e-3 };

impl Valve {
    /// Velocity (m/s), spool (1) and valve command (V) at a time (s) of a swing without force.
    fn swing(&self, time: f64) -> [f64; 3] {
        let wave = |time: f64| 0.3 * (std::f64::consts::TAU * 0.8 * time).sin();
        let spool = self.valve_gain * wave(time - self.delay);
        let table = FlowTable::<f64, 21>::new(&rig::OPENINGS, &rig::flows()).unwrap();
        let velocity = self.flow_gain * table.flow(spool) / rig::PARAMETERS.piston_area;
        [velocity, spool, wave(time) / rig::PARAMETERS.valve_gain]
    }
}

macro_rules! tests {
    ($module:ident, $t:ty, $controller:path) => {
        mod $module {
            use super::*;

            fn controller(p: &AdaptiveParameters) -> AdaptiveController<$t, 21> {
                $controller(p, &FlowTable::<$t, 21>::new(&rig::OPENINGS, &rig::flows()).unwrap())
            }

            /// What is learned of a valve in some seconds of swinging, under this tuning: flow gain, the spool's gain, delay;
            /// and the last flags.
            fn learned(valve: Valve, tuning: Tuning) -> ([f64; 3], u32) {
                let c = controller(&AdaptiveParameters { tuning, guard: false, ..rig::ADAPTIVE }).compensation;
                let (mut state, mut flags) = (c.at_rest(), 0);
                for i in 0..20_000_u32 {
                    let [velocity, spool, valve_command] =
                        valve.swing(f64::from(i) / 4096.0).map(|a| a as $t);
                    let m = Measurements {
                        velocity,
                        force: 0.0,
                        spool,
                        valve_command,
                        supply_pressure: 1.9e7,
                    };
                    flags = c.step(&mut state, 0.0, &m).status;
                }
                let found = [state.flow_gain(), state.valve_gain(), state.response_delay()];
                (found.map(f64::from), flags)
            }

            // Each is found where no bound stands before it; the first of the bounds that does is the estimate's own, for
            // the models' disagreement is let pass.
            #[test]
            fn estimates_stop_at_their_bounds() {
                let bounded = Tuning { error_share: 1.0, ..Tuning::DEFAULT };
                let wide = (0.01, 10.0);
                let free = Tuning { flow_gain: wide, valve_gain: wide, response_delay: wide, ..bounded };
                let cases = [
                    (0, Valve { flow_gain: 1.6, ..SOUND }, 1.6, 1.35),
                    (0, Valve { flow_gain: 0.5, ..SOUND }, 0.5, 0.7),
                    (1, Valve { valve_gain: 1.5, ..SOUND }, 1.5, 1.25),
                    (1, Valve { valve_gain: 0.6, ..SOUND }, 0.6, 0.8),
                    (2, Valve { delay: 30.0e-3, ..SOUND }, 30.0e-3, 20.0e-3),
                    (2, Valve { delay: 0.5e-3, ..SOUND }, 0.5e-3, 1.0e-3),
                ];
                for (estimate, valve, truth, bound) in cases {
                    let (found, flags) = learned(valve, free);
                    assert!((found[estimate] - truth).abs() < 0.16 * SOUND_ESTIMATES[estimate], "{found:?}");
                    assert_eq!(flags & status::ESTIMATE_BOUNDED, 0);
                    let (found, flags) = learned(valve, bounded);
                    assert!((found[estimate] - bound).abs() < 1e-3 * SOUND_ESTIMATES[estimate], "{found:?}");
                    assert_ne!(flags & status::ESTIMATE_BOUNDED, 0);
                }
            }

            #[test]
            fn lanes_learn_what_single_rigs_do() {
                type Wide = Lanes<$t, 4>;
                let rigs = [
                    (rig::ADAPTIVE, Valve { flow_gain: 1.06, ..SOUND }),
                    (
                        AdaptiveParameters { correct_curve: true, ..rig::ADAPTIVE },
                        Valve { flow_gain: 0.95, ..SOUND },
                    ),
                    (
                        AdaptiveParameters { feedforward: false, guard: false, ..rig::ADAPTIVE },
                        Valve { valve_gain: 1.05, delay: 7.0e-3, ..SOUND },
                    ),
                    (AdaptiveParameters { adaptive: false, ..rig::ADAPTIVE }, SOUND),
                ];
                let single = rigs.map(|(p, _)| controller(&p).compensation);
                let wide = AdaptiveCompensation::<Wide, 21>::pack(|i| &single[i]);
                let mut states = single.map(|c| c.at_rest());
                let mut packed = wide.at_rest();
                for i in 0..12_000_u32 {
                    let time = f64::from(i) / 4096.0;
                    // The last of them pumps, for its guard.
                    let force = |lane: usize, v: $t| if lane == 3 { 2.0e4 * v } else { 0.0 };
                    let measured = |lane: usize| {
                        let [velocity, spool, valve_command] = rigs[lane].1.swing(time).map(|a| a as $t);
                        let force = force(lane, velocity);
                        // One loses what its sensor taught while it stuck, the others go on.
                        let stuck = lane == 0 && (6500..7500).contains(&i);
                        let velocity = if stuck { 0.1 } else { velocity };
                        Measurements { velocity, force, spool, valve_command, supply_pressure: 1.9e7 }
                    };
                    let side_by_side = Measurements {
                        velocity: Wide::from_lanes(|lane| measured(lane).velocity),
                        force: Wide::from_lanes(|lane| measured(lane).force),
                        spool: Wide::from_lanes(|lane| measured(lane).spool),
                        valve_command: Wide::from_lanes(|lane| measured(lane).valve_command),
                        supply_pressure: Wide::splat(1.9e7),
                    };
                    let together = wide.step(&mut packed, Wide::splat(0.0), &side_by_side);
                    for lane in 0..4 {
                        let alone = single[lane].step(&mut states[lane], 0.0, &measured(lane));
                        assert_eq!(together.value.lane(lane).to_bits(), alone.value.to_bits());
                        assert_eq!(together.status.lane(lane), alone.status);
                        let (one, all) = (&states[lane], &packed);
                        let both = [
                            (one.flow_gain(), all.flow_gain()),
                            (one.valve_gain(), all.valve_gain()),
                            (one.response_delay(), all.response_delay()),
                            (one.level(), all.level()),
                        ];
                        assert!(both.iter().all(|(one, all)| one.to_bits() == all.lane(lane).to_bits()));
                    }
                }
                for lane in 0..4 {
                    for opening in [-0.25, 0.1, 0.25] {
                        let found = single[lane].found_flow(&states[lane], opening);
                        let packed = wide.found_flow(&packed, Wide::splat(opening as f64)).lane(lane);
                        assert_eq!(found.to_bits(), packed.to_bits());
                    }
                    assert!(single[lane].found_flow(&states[lane], <$t>::NAN).is_nan());
                    let end = |opening| single[lane].found_flow(&states[lane], opening).to_bits();
                    assert_eq!([end(2.0), end(<$t>::INFINITY)], [end(1.0); 2]);
                }
                assert!((states[0].flow_gain() - 1.06).abs() < 0.01, "{}", states[0].flow_gain());
                assert!((states[2].valve_gain() - 1.05).abs() < 0.01, "{}", states[2].valve_gain());
                assert!((states[2].response_delay() - 7.0e-3).abs() < 2e-4, "{}", states[2].response_delay());
                assert!(states[3].level() < 0.99, "{}", states[3].level());
            }

            proptest! {
                #[test]
                fn finite_and_held_where_a_sample_is_bad(
                    p in parameters(), samples in prop::collection::vec(ticks(), 1..120),
                ) {
                    let c = controller(&p);
                    let mut state = c.at_rest();
                    let mut last = 0.0;
                    for tick in samples {
                        let [command, v, f, x, supply] = tick.map(|a| a as $t);
                        let out = c.step(&mut state, command, &measured(v, f, x, supply));
                        prop_assert!(out.valve_command.abs() <= 10.0);
                        prop_assert!(out.compensation.is_finite());
                        let share = supply / 1.9e7;
                        let bad = out.status & (status::INVALID_MEASUREMENT | status::INVALID_COMMAND) != 0;
                        let good = command.abs() <= 1.0e12 && v.abs() <= 3.0 && f.abs() <= 2.0e5
                            && x.abs() <= 1.2 && (0.051..=3.99).contains(&share);
                        prop_assert!(!(good && bad), "refused a good sample");
                        if bad {
                            prop_assert_eq!(out.valve_command.to_bits(), (last as $t).to_bits());
                        }
                        last = out.valve_command;
                        let learned = &state.compensation;
                        prop_assert!((0.69..=1.36).contains(&learned.flow_gain()));
                        prop_assert!((0.79..=1.26).contains(&learned.valve_gain()));
                        prop_assert!((0.5..=1.0).contains(&learned.level()));
                        prop_assert!(learned.response_delay().is_finite());
                    }
                }

                #[test]
                fn primed_it_steps_without_a_bump(p in parameters(), tick in ticks()) {
                    let c = controller(&p);
                    let [command, v, f, x, supply] = tick.map(|a| a as $t);
                    let mut state = c.prime(command, &measured(v, f, x, supply));
                    let held = c.hold(&state);
                    prop_assert_eq!(held.status, status::HELD);
                    prop_assert!(held.valve_command.abs() <= 10.0);
                    let out = c.step(&mut state, command, &measured(v, f, x, supply));
                    prop_assert_eq!(out.valve_command.to_bits(), held.valve_command.to_bits());
                    prop_assert_eq!(out.compensation.to_bits(), held.compensation.to_bits());
                }

                #[test]
                fn lanes_give_the_bits_of_single_rigs(
                    ps in prop::collection::vec(parameters(), 4),
                    samples in prop::collection::vec([ticks(), ticks(), ticks(), ticks()], 1..80),
                ) {
                    type Wide = Lanes<$t, 4>;
                    let rate = |p: &AdaptiveParameters| AdaptiveParameters {
                        compensation: CompensationParameters { sample_rate: 4096.0, ..p.compensation }, ..*p
                    };
                    let single: Vec<_> = ps.iter().map(|p| controller(&rate(p))).collect();
                    let wide = AdaptiveController::<Wide, 21>::pack(|i| &single[i]);
                    let mut states: Vec<_> = single.iter().map(AdaptiveController::at_rest).collect();
                    let mut packed = wide.at_rest();
                    for tick in samples {
                        let input = |k: usize| Wide::from_lanes(|i| tick[i][k] as $t);
                        let out = wide.step(&mut packed, input(0), &measured(input(1), input(2), input(3), input(4)));
                        for i in 0..4 {
                            let [command, v, f, x, supply] = tick[i].map(|a| a as $t);
                            let alone = single[i].step(&mut states[i], command, &measured(v, f, x, supply));
                            prop_assert_eq!(out.valve_command.lane(i).to_bits(), alone.valve_command.to_bits());
                            prop_assert_eq!(out.compensation.lane(i).to_bits(), alone.compensation.to_bits());
                            prop_assert_eq!(out.status.lane(i), alone.status);
                        }
                    }
                }

                #[test]
                fn everything_off_it_is_the_papers_scheme_bit_for_bit(
                    p in rig::parameters(), samples in prop::collection::vec(rig::ticks(), 1..120),
                ) {
                    let c = controller(&AdaptiveParameters { compensation: p, ..OFF });
                    let table = FlowTable::<$t, 21>::new(&rig::OPENINGS, &rig::flows()).unwrap();
                    let plain = Controller::<$t, 21> {
                        compensation: eft_core::Compensation::<$t, 21>::new(&p, &table).unwrap(),
                        servovalve: c.servovalve,
                        limiter: c.limiter,
                    };
                    let (mut state, mut plain_state) = (c.at_rest(), ControllerState::default());
                    for tick in samples {
                        let [command, v, f, x] = tick.map(|a| a as $t);
                        let out = c.step(&mut state, command, &measured(v, f, x, 1.9e7));
                        let expected = plain.step(&mut plain_state, command, v, f, x);
                        prop_assert_eq!(out.valve_command.to_bits(), expected.valve_command.to_bits());
                        prop_assert_eq!(out.compensation.to_bits(), expected.compensation.to_bits());
                        // The estimators' watch over bad samples goes on.
                        prop_assert_eq!(out.status & !status::ADAPTATION_FROZEN & !status::INVALID_MEASUREMENT,
                            expected.status & !status::INVALID_MEASUREMENT);
                    }
                }
            }
        }
    };
}
#[test]
fn flow_gain_is_found_at_every_sample_rate_that_is_allowed() {
    let table = FlowTable::<f64, 21>::new(&rig::OPENINGS, &rig::flows()).unwrap();
    let at = |sample_rate, p: AdaptiveParameters| AdaptiveParameters {
        compensation: CompensationParameters { sample_rate, ..rig::PARAMETERS },
        ..p
    };
    for rate in [200.0, 256.0, 1024.0, 20_000.0] {
        let c = AdaptiveCompensation::<f64, 21>::new(&at(rate, rig::ADAPTIVE), &table).unwrap();
        let mut state = c.at_rest();
        let mut time = 0.0;
        while time < 10.0 {
            let [velocity, spool, valve_command] = Valve { flow_gain: 1.06, ..SOUND }.swing(time);
            let m = Measurements { valve_command, ..measured(velocity, 0.0, spool, 1.9e7) };
            c.step(&mut state, 0.0, &m);
            time += 1.0 / rate;
        }
        assert!((state.flow_gain() - 1.06).abs() < 0.01, "{rate} Hz: {}", state.flow_gain());
    }
    let refused = AdaptiveCompensation::<f64, 21>::new(&at(199.0, rig::ADAPTIVE), &table).unwrap_err();
    assert!(refused.to_string().starts_with("sample_rate = 199: must lie in [200, "), "{refused}");
    // What does not average asks for nothing.
    assert!(AdaptiveCompensation::<f64, 21>::new(&at(10.0, OFF), &table).is_ok());
}

#[test]
fn a_tuning_that_makes_no_sense_is_refused_by_name() {
    let table = FlowTable::<f64, 21>::new(&rig::OPENINGS, &rig::flows()).unwrap();
    let t = Tuning::DEFAULT;
    for (name, tuning) in [
        ("low_pass", Tuning { low_pass: f64::NAN, ..t }),
        ("memory", Tuning { memory: 0.0, ..t }),
        ("flow_gain", Tuning { flow_gain: (1.3, 0.7), ..t }),
        ("flow_gain", Tuning { flow_gain: (-1.0, 1.3), ..t }),
        ("valve_gain", Tuning { valve_gain: (f64::NAN, f64::NAN), ..t }),
        ("rates", Tuning { rates: (0.5, -0.2, 2.0), ..t }),
        ("priors", Tuning { priors: (1e-7, 1e-6, f64::INFINITY), ..t }),
        ("error_share", Tuning { error_share: 2.0, ..t }),
        ("guard_time", Tuning { guard_time: 1e-6, ..t }),
    ] {
        let refused =
            AdaptiveCompensation::<f64, 21>::new(&AdaptiveParameters { tuning, ..rig::ADAPTIVE }, &table);
        let why = refused.unwrap_err().to_string();
        assert!(why.starts_with(name), "{name}: {why}");
    }
}

tests!(single, f32, rig::adaptive_f32);
tests!(double, f64, rig::adaptive_f64);
