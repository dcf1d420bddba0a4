//! The adaptive controller as a block: total, held on bad samples, primed without a bump, the same in lanes, and the
//! plain one where everything is off.
// A failed index or unwrap is a failed test; bits are compared on purpose.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, clippy::float_cmp)]

mod rig;

use eft_core::{
    AdaptiveController, AdaptiveParameters, Controller, ControllerState, Flags, FlowTable, Lanes,
    Measurements, Scalar, status,
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

macro_rules! tests {
    ($module:ident, $t:ty, $controller:path) => {
        mod $module {
            use super::*;

            fn controller(p: &AdaptiveParameters) -> AdaptiveController<$t, 21> {
                $controller(p, &FlowTable::<$t, 21>::new(&rig::OPENINGS, &rig::flows()).unwrap())
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
                        compensation: eft_core::CompensationParameters { sample_rate: 4096.0, ..p.compensation }, ..*p
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
tests!(single, f32, rig::adaptive_f32);
tests!(double, f64, rig::adaptive_f64);
