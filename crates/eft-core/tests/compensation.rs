//! One sample of the compensation: against the paper's equations, and total on every input.
// A failed index or unwrap is a failed test; bits are compared on purpose.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, clippy::float_cmp)]

mod rig;

use eft_core::{
    Compensation, CompensationParameters, CompensationState, ConfigError, FlowTable, Mode, SignFrom, status,
};
use proptest::prelude::*;

fn table<const N: usize>() -> FlowTable<f64, N> {
    FlowTable::<f64, N>::new(&rig::OPENINGS, &rig::flows()).unwrap()
}

fn compensation(p: &CompensationParameters) -> Compensation<f64, 21> {
    Compensation::<f64, 21>::new(p, &table()).unwrap()
}

/// Required opening by the paper's words, with a linear search and a real square root.
fn required_opening(p: &CompensationParameters, velocity: f64, force: f64, spool: f64) -> f64 {
    let flow = p.piston_area * velocity;
    let opening = match p.mode {
        Mode::Off => 0.0,
        Mode::Linear => flow / p.flow_gain,
        Mode::Nonlinear => {
            let direction = if p.sign_from == SignFrom::Demand { flow } else { spool };
            let sign = if direction == 0.0 { 0.0 } else { direction.signum() };
            let radicand = (1.0 - sign * force / (p.piston_area * p.supply_pressure)).max(0.05);
            let demand = flow / radicand.sqrt();
            let (x, q) = (rig::OPENINGS, rig::flows());
            let demand = demand.clamp(q[0], q[20]);
            let i = (1..20).find(|&i| demand < q[i]).unwrap_or(20);
            x[i - 1] + (demand - q[i - 1]) / (q[i] - q[i - 1]) * (x[i] - x[i - 1])
        }
    };
    (p.level * opening).clamp(-1.0, 1.0)
}

proptest! {
    #[test]
    fn settled_output_follows_the_paper(
        p in rig::parameters(), velocity in -2.5..2.5f64, force in -1.6e5..1.6e5f64, spool in -1.1..1.1f64,
    ) {
        let c = compensation(&p);
        let mut state = c.prime(velocity, force, spool, 0.0);
        let gain = 1.0 / (p.proportional_gain * p.valve_gain);
        let expected = gain * required_opening(&p, velocity, force, spool);
        prop_assert!((state.output() - expected).abs() < 1e-12 * gain, "{} {expected}", state.output());
        // Primed without a bump: the step gives the same bits, and again.
        for _ in 0..3 {
            let before = state;
            let out = c.step(&mut state, velocity, force, spool, 0.0);
            prop_assert_eq!(out.value.to_bits(), before.output().to_bits());
            prop_assert_eq!(state, before);
        }
    }

    #[test]
    fn further_flow_counts_like_the_pistons(velocity in -1.0..1.0f64, share in 0.0..1.0f64, force in -1.0e5..1.0e5f64) {
        let c = compensation(&rig::PARAMETERS);
        let flow = rig::PARAMETERS.piston_area * velocity;
        let whole = c.prime(velocity, force, 0.3, 0.0).output();
        let parts = c.prime(velocity * share, force, 0.3, flow * (1.0 - share)).output();
        prop_assert!((whole - parts).abs() < 1e-12);
    }
}

macro_rules! totality {
    ($name:ident, $t:ty) => {
        mod $name {
            use super::*;

            fn compensation(p: &CompensationParameters) -> Compensation<$t, 21> {
                let table = FlowTable::<$t, 21>::new(&rig::OPENINGS, &rig::flows()).unwrap();
                Compensation::<$t, 21>::new(p, &table).unwrap()
            }

            proptest! {
                #[test]
                fn every_input_leaves_output_finite_and_limited(
                    p in rig::parameters(), ticks in prop::collection::vec((rig::ticks(), rig::samples(0.02)), 1..60),
                ) {
                    let c = compensation(&p);
                    let mut state = CompensationState::default();
                    let bound = 2.0 / p.lead_alpha / (p.proportional_gain * p.valve_gain) * 1.001;
                    for ([_, velocity, force, spool], further) in ticks {
                        let [v, f, x, q] = [velocity, force, spool, further].map(|a| a as $t);
                        let before = state;
                        let out = c.step(&mut state, v, f, x, q);
                        prop_assert!(f64::from(out.value).abs() <= bound);
                        prop_assert_eq!(out.value.to_bits(), state.output().to_bits());
                        let good = f64::from(v).abs() <= p.velocity_range && f64::from(f).abs() <= p.force_range
                            && f64::from(x).abs() <= p.spool_range as $t as f64 && f64::from(q).abs() <= 1.0e12;
                        prop_assert_eq!(out.status & status::INVALID_MEASUREMENT == 0, good);
                        if !good {
                            prop_assert_eq!(state, before);
                            prop_assert_eq!(out.status, status::INVALID_MEASUREMENT);
                        }
                    }
                }

                #[test]
                fn invalid_samples_are_as_if_they_had_not_been(
                    ticks in prop::collection::vec(rig::ticks(), 1..60),
                ) {
                    let c = compensation(&rig::PARAMETERS);
                    let (mut all, mut good_only) = (CompensationState::default(), CompensationState::default());
                    for tick in ticks {
                        let [_, v, f, x] = tick.map(|a| a as $t);
                        c.step(&mut all, v, f, x, 0.0);
                        if c.accepts(v, f, x) {
                            c.step(&mut good_only, v, f, x, 0.0);
                        }
                        prop_assert_eq!(all, good_only);
                    }
                }

                #[test]
                fn swapping_a_configuration_at_rest_changes_only_what_it_says(
                    p in rig::parameters(), delay in 0.0..0.02f64, v in -0.3..0.3f64,
                ) {
                    let velocity = v as $t;
                    let (old, new) = (compensation(&p), compensation(&CompensationParameters { response_delay: delay, ..p }));
                    let mut state = old.prime(velocity, 100.0, 0.1, 0.0);
                    let before = state.output();
                    prop_assert_eq!(new.step(&mut state, velocity, 100.0, 0.1, 0.0).value.to_bits(), before.to_bits());
                }
            }

            #[test]
            fn reset_equals_fresh_and_hold_changes_nothing() {
                let c = compensation(&rig::PARAMETERS);
                let run = |state: &mut CompensationState<$t>| -> Vec<_> {
                    (0..50).map(|n| c.step(state, 0.01 * n as $t, 50.0 * n as $t, 0.005 * n as $t, 0.0).value.to_bits()).collect()
                };
                let mut state = CompensationState::default();
                let first = run(&mut state);
                let before = state;
                let held = c.hold(&state);
                assert_eq!((held.value, held.status), (before.output(), status::HELD));
                assert_eq!(state, before);
                state = CompensationState::default();
                assert_eq!(run(&mut state), first);
            }

            #[test]
            fn flags_say_what_happened() {
                let c = compensation(&rig::PARAMETERS);
                let status = |v: $t, f: $t, x: $t| c.step(&mut CompensationState::default(), v, f, x, 0.0).status;
                assert_eq!(status(0.1, 0.0, 0.1), 0);
                assert_eq!(status(0.1, 0.0, 0.7), status::SPOOL_WARNING);
                assert_eq!(status(0.9, 0.0, 0.1), status::SPOOL_WARNING);
                assert_eq!(status(1.5, 0.0, 0.1), status::SPOOL_WARNING | status::DEMAND_SATURATED);
                assert_eq!(status(0.01, 1.55e5, 0.1), status::LOAD_PRESSURE_FLOORED);
                assert_eq!(status(0.01, 1.55e5, -0.1), 0);
                assert_eq!(status(0.01, 1.55e5, 0.0), 0);
                assert_eq!(status(3.1, 0.0, 0.1), status::INVALID_MEASUREMENT);
            }
        }
    };
}
totality!(single, f32);
totality!(double, f64);

#[test]
fn refusals_name_the_parameter() {
    let refusal = |p: CompensationParameters| match Compensation::<f32, 21>::new(
        &p,
        &FlowTable::<f32, 21>::new(&rig::OPENINGS, &rig::flows()).unwrap(),
    ) {
        Ok(_) => "accepted",
        Err(
            ConfigError::NotFinite { parameter }
            | ConfigError::NotPositive { parameter, .. }
            | ConfigError::OutOfRange { parameter, .. },
        ) => parameter,
        Err(_) => "another error",
    };
    let p = rig::PARAMETERS;
    assert_eq!(refusal(p), "accepted");
    assert_eq!(refusal(CompensationParameters { level: -0.1, ..p }), "level");
    assert_eq!(refusal(CompensationParameters { piston_area: 0.0, ..p }), "piston_area");
    assert_eq!(refusal(CompensationParameters { supply_pressure: f64::NAN, ..p }), "supply_pressure");
    assert_eq!(refusal(CompensationParameters { flow_gain: -1.0, ..p }), "flow_gain");
    assert_eq!(refusal(CompensationParameters { valve_gain: 0.0, ..p }), "valve_gain");
    assert_eq!(
        refusal(CompensationParameters { proportional_gain: f64::INFINITY, ..p }),
        "proportional_gain"
    );
    assert_eq!(refusal(CompensationParameters { response_delay: 2.0, ..p }), "response_delay");
    assert_eq!(refusal(CompensationParameters { lead_alpha: 0.0, ..p }), "lead_alpha");
    assert_eq!(refusal(CompensationParameters { sample_rate: -1.0, ..p }), "sample_rate");
    assert_eq!(refusal(CompensationParameters { velocity_range: -1.0, ..p }), "velocity_range");
    assert_eq!(refusal(CompensationParameters { force_range: f64::NAN, ..p }), "force_range");
    assert_eq!(refusal(CompensationParameters { spool_range: f64::INFINITY, ..p }), "spool_range");
    assert_eq!(refusal(CompensationParameters { spool_warning: -1.0, ..p }), "spool_warning");
}
