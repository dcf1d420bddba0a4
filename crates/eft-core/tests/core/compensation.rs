//! One sample of the compensation, compared with the paper's equations, and defined for all inputs.

use eft_core::{
    Calibration, Compensation, CompensationInput, CompensationOutput, CompensationState, Mode, Parameters,
    Real, SignFrom, status,
};
use proptest::prelude::*;

use crate::rig;

fn input<T: Real>([velocity, force, spool, further_flow]: [f64; 4]) -> CompensationInput<T> {
    let of = T::from_f64;
    CompensationInput {
        velocity: of(velocity),
        force: of(force),
        spool: of(spool),
        supply: of(1.0),
        further_flow: of(further_flow),
    }
}

/// Required opening by the paper's equations, with a linear search and the standard square root.
fn required_opening(p: &Parameters, velocity: f64, force: f64, spool: f64) -> f64 {
    let flow = p.piston_area * velocity;
    // The step over an overlap takes the rest of the stroke.
    let most = if p.mode == Mode::Linear { 1.0 } else { 1.0 - p.overlap };
    let opening = match p.mode {
        Mode::Off => 0.0,
        Mode::Linear => flow / p.flow_gain,
        Mode::Nonlinear => {
            let direction = if p.sign_from == SignFrom::Demand { flow } else { spool };
            let sign = if direction == 0.0 { 0.0 } else { direction.signum() };
            let radicand = (1.0 - sign * force / (p.piston_area * p.supply_pressure)).max(0.05);
            let demand = flow / radicand.sqrt();
            let (x, q) = (p.openings, p.flows);
            let demand = demand.clamp(q[0], q[20]);
            let i = (1..20).find(|&i| demand < q[i]).unwrap_or(20);
            x[i - 1] + (demand - q[i - 1]) / (q[i] - q[i - 1]) * (x[i] - x[i - 1])
        }
    };
    (p.level * opening).clamp(-most, most)
}

/// The compensation and its nominal calibration.
fn made(p: &Parameters) -> (Compensation<f64, 21>, Calibration<f64>) {
    let c = Compensation::<f64, 21>::new(p).unwrap();
    (c, c.nominal())
}

proptest! {
    #[test]
    fn settled_output_follows_the_paper(
        p in rig::parameters(), velocity in -2.5..2.5f64, force in -1.6e5..1.6e5f64, spool in -1.1..1.1f64,
    ) {
        let (c, calibration) = made(&p);
        let input = input([velocity, force, spool, 0.0]);
        let mut state = c.prime(&input, &calibration);
        let gain = 1.0 / (p.proportional_gain * p.valve_gain);
        let expected = gain * required_opening(&p, velocity, force, spool - p.null_bias);
        prop_assert!((state.output() - expected).abs() < 1e-12 * gain, "{} {expected}", state.output());
        // Primed without a bump: the next steps give the same bits.
        for _ in 0..3 {
            let before = state;
            let out = c.step(&mut state, &input, &calibration);
            prop_assert_eq!(out.value.to_bits(), before.output().to_bits());
            prop_assert_eq!(state, before);
        }
    }

    #[test]
    fn further_flow_counts_like_the_pistons(velocity in -1.0..1.0f64, share in 0.0..1.0f64, force in -1.0e5..1.0e5f64) {
        let (c, calibration) = made(&rig::PARAMETERS);
        let flow = rig::PARAMETERS.piston_area * velocity;
        let of = |velocity, further| c.prime(&input([velocity, force, 0.3, further]), &calibration).output();
        prop_assert!((of(velocity, 0.0) - of(velocity * share, flow * (1.0 - share))).abs() < 1e-12);
    }

    #[test]
    fn a_valve_that_passes_more_is_opened_less(
        velocity in -1.0..1.0f64, force in -1.0e5..1.0e5f64, flow_gain in 0.7..1.35f64,
    ) {
        let (c, nominal) = made(&rig::PARAMETERS);
        let found = Calibration { flow_gain, per_flow_gain: 1.0 / flow_gain, ..nominal };
        let of = |velocity, calibration| c.prime(&input([velocity, force, 0.3, 0.0]), calibration).output();
        prop_assert!((of(velocity, &found) - of(velocity / flow_gain, &nominal)).abs() < 1e-12);
    }
}

macro_rules! totality {
    ($name:ident, $t:ty) => {
        mod $name {
            use super::*;

            fn compensation(p: &Parameters) -> Compensation<$t, 21> {
                Compensation::<$t, 21>::new(p).unwrap()
            }

            /// One sample of velocity (m/s), force (N), spool (1) and further flow (m³/s), by the nominal calibration.
            fn step(
                c: &Compensation<$t, 21>,
                state: &mut CompensationState<$t>,
                sample: [f64; 4],
            ) -> CompensationOutput<$t> {
                c.step(state, &input(sample), &c.nominal())
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
                        let [v, f, x, q] = [velocity, force, spool, further].map(|a| f64::from(a as $t));
                        let before = state;
                        let out = step(&c, &mut state, [v, f, x, q]);
                        prop_assert!(f64::from(out.value).abs() <= bound);
                        prop_assert_eq!(out.value.to_bits(), state.output().to_bits());
                        let good = v.abs() <= p.velocity_range && f.abs() <= p.force_range
                            && x.abs() <= p.spool_range as $t as f64 && q.abs() <= 1.0e12;
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
                    for [_, v, f, x] in ticks {
                        step(&c, &mut all, [v, f, x, 0.0]);
                        if c.accepts(v as $t, f as $t, x as $t) {
                            step(&c, &mut good_only, [v, f, x, 0.0]);
                        }
                        prop_assert_eq!(all, good_only);
                    }
                }

                #[test]
                fn swapping_a_configuration_at_rest_changes_only_what_it_says(
                    p in rig::parameters(), response_delay in 0.0..0.02f64, velocity in -0.3..0.3f64,
                ) {
                    let (old, new) = (compensation(&p), compensation(&Parameters { response_delay, ..p }));
                    let sample = [velocity, 100.0, 0.1, 0.0];
                    let mut state = old.prime(&input(sample), &old.nominal());
                    let before = state.output();
                    prop_assert_eq!(step(&new, &mut state, sample).value.to_bits(), before.to_bits());
                }
            }

            #[test]
            fn reset_equals_fresh() {
                let c = compensation(&rig::PARAMETERS);
                let run = |state: &mut CompensationState<$t>| -> Vec<_> {
                    let sample = |n: f64| [0.01 * n, 50.0 * n, 0.005 * n, 0.0];
                    (0..50).map(|n| step(&c, state, sample(f64::from(n))).value.to_bits()).collect()
                };
                let mut state = CompensationState::default();
                let first = run(&mut state);
                state = CompensationState::default();
                assert_eq!(run(&mut state), first);
            }

            #[test]
            fn flags_say_what_happened() {
                let c = compensation(&rig::PARAMETERS);
                let status =
                    |v, f, x| step(&c, &mut CompensationState::default(), [v, f, x, 0.0]).status;
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
    let p = rig::PARAMETERS;
    for (name, parameters) in [
        ("accepted", p),
        ("level", Parameters { level: -0.1, ..p }),
        ("piston_area", Parameters { piston_area: 0.0, ..p }),
        ("supply_pressure", Parameters { supply_pressure: f64::NAN, ..p }),
        ("flow_gain", Parameters { flow_gain: -1.0, ..p }),
        ("valve_gain", Parameters { valve_gain: 0.0, ..p }),
        ("proportional_gain", Parameters { proportional_gain: f64::INFINITY, ..p }),
        ("response_delay", Parameters { response_delay: 2.0, ..p }),
        ("lead_alpha", Parameters { lead_alpha: 0.0, ..p }),
        ("sample_rate", Parameters { sample_rate: -1.0, ..p }),
        ("velocity_range", Parameters { velocity_range: -1.0, ..p }),
        ("force_range", Parameters { force_range: f64::NAN, ..p }),
        ("spool_range", Parameters { spool_range: f64::INFINITY, ..p }),
        ("spool_warning", Parameters { spool_warning: -1.0, ..p }),
    ] {
        assert_eq!(rig::refused(Compensation::<f32, 21>::new(&parameters)), name);
    }
}
