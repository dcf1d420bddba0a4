//! The constants of a learner, from the rig's parameters and their documented meaning.

use super::*;
use crate::learning::design::window_ticks;
use crate::learning::deviation::MEAN_CORRELATION;
use crate::learning::learner::Learner;
use crate::learning::tuning as t;

/// A rig in which no constant has the value of another one.
const RIG: Parameters = Parameters {
    sample_rate: 1000.0,
    piston_area: 2.0e-3,
    compressibility: 3.0e-13,
    leakage: 5.0e-10,
    flow_gain: 7.0e-3,
    force_sensitivity: 1.1e-4,
    proportional_gain: 1.3,
    valve_gain: 0.17,
    response_delay: 9.0e-3,
    velocity_delay: 4.0e-3,
    computation_delay: 3,
    lead_alpha: 0.2,
    learning: Learning { curve_correction: true, ..Learning::ADAPTIVE },
    ..Parameters::ZHAO2005
};
/// Eight samples are a window of this rig.
const PERIOD: f64 = 8.0e-3;

fn learner() -> Learner<f64, 21> {
    of(&RIG)
}

fn of(parameters: &Parameters) -> Learner<f64, 21> {
    Learner::<f64, 21>::new(parameters).unwrap()
}

fn same(what: &str, found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{what}: {found:e}, not {expected:e}");
}

/// Flow (m³/s) that the force loop demands for a force error of 1 N.
fn flow_per_error() -> f64 {
    RIG.force_sensitivity * RIG.proportional_gain * RIG.valve_gain * RIG.flow_gain
}

#[test]
fn a_window_is_the_longest_power_of_two_with_200_windows_a_second() {
    for (sample_rate, ticks) in [
        (200.0, 8),
        (3199.9, 8),
        (3200.0, 16),
        (6399.9, 16),
        (6400.0, 32),
        (204_799.9, 512),
        (204_800.0, 1024),
        (409_600.0, 1024),
        (1e9, 1024),
    ] {
        assert_eq!(window_ticks(sample_rate), ticks, "{sample_rate} Hz");
    }
    same("period", learner().gate.period, PERIOD);
    same("share of a tick", learner().per_window, 0.125);
}

#[test]
fn a_force_leaks_and_compresses_as_in_equation_7() {
    // Load pressure is force over area.
    let force = 1000.0;
    same("leakage", learner().flow_per_force * force, RIG.leakage * force / RIG.piston_area);
    let rate = force / RIG.piston_area / PERIOD;
    same("compression", learner().flow_per_change * force, RIG.compressibility * rate);
    let (largest, pressure) = (learner().largest, RIG.supply_pressure);
    same("largest flow", largest.flow, 8.0 * (RIG.greatest_flow() + RIG.leakage * pressure));
    same("largest force", largest.force, 8.0 * RIG.piston_area * pressure);
    same("largest opening", largest.opening, 8.0);
    same("piston", learner().piston_area, RIG.piston_area);
    same("flow gain", learner().flow_gain, RIG.flow_gain);
}

#[test]
fn the_guard_refers_to_the_natural_velocity_feedback() {
    // The flow of a velocity of 1 m/s raises the force until leakage and force loop supply it.
    let added_damping =
        RIG.piston_area * RIG.piston_area / (RIG.leakage + flow_per_error() * RIG.piston_area);
    same("overcompensation", learner().guard.per_added_damping, 1.0 / added_damping);
    same("force error", learner().guard.force_per_flow, 1.0 / flow_per_error());
}

#[test]
fn the_guard_expects_the_flow_of_the_command_only_from_a_feedforward() {
    for (feedforward, expected) in [(false, 0.0), (true, 1.0)] {
        let found = of(&Parameters { feedforward, ..RIG }).guard.fed_forward;
        assert!((found - expected).abs() < 1e-15, "{feedforward}: {found}");
    }
}

#[test]
fn the_guard_integrates_as_the_loop_does() {
    let integrates = Parameters { realization: Realization::Digital, integral_gain: 20.0, ..RIG };
    let corner = integrates.integral_gain / integrates.proportional_gain;
    same("integral part", of(&integrates).guard.integrated, corner * PERIOD);
    same("tolerance", of(&integrates).guard.tolerated, 0.03);
    for without in [RIG, Parameters { realization: Realization::Analog, ..integrates }] {
        same("no integral part", of(&without).guard.integrated + 1.0, 1.0);
        same("tolerance without", of(&without).guard.tolerated, 0.01);
    }
}

#[test]
fn a_flow_and_an_opening_compare_by_the_flow_gain() {
    let per_square_flow = 1.0 / 7.0e-3 / 7.0e-3;
    same("gate", learner().gate.per_square_flow, per_square_flow);
    same("deviation", learner().deviation.per_square_flow, per_square_flow);
    same("excitation", learner().gate.excitation, RIG.learning.excitation * RIG.learning.excitation);
}

#[test]
fn leakage_exceeds_the_oils_flow_below_their_corner() {
    let corner = RIG.leakage / RIG.compressibility;
    same("corner", learner().deviation.leakage_corner, corner * corner + t::SLOWEST);
    // Without leakage the lowest frequency remains.
    let tight = of(&Parameters { leakage: 0.0, ..RIG });
    same("lowest frequency", tight.deviation.leakage_corner, t::SLOWEST);
}

#[test]
fn the_phase_of_a_lead_network_differs_from_its_delay_by_the_stated_share() {
    for lead_alpha in [0.05, 0.1, 0.4] {
        let share = of(&Parameters { lead_alpha, ..RIG }).valve.phase_deficit;
        // Phase of Eq. (8) at a small `ωT`.
        let angle = 1e-3;
        let lead = angle / (1.0 - lead_alpha);
        let phase = libm::atan(lead) - libm::atan(lead_alpha * lead);
        let found = (1.0 - phase / angle) / (angle * angle);
        assert!((share / found - 1.0).abs() < 1e-4, "α {lead_alpha}: {share}, not {found}");
    }
}

#[test]
fn half_a_sample_is_half_of_its_period() {
    same("half a sample", learner().deviation.half_sample, 0.5e-3);
}

#[test]
fn the_spools_offset_averages_the_errors_of_half_their_correlation() {
    let shorter = 0.5 * t::CURVE_CORRELATION / t::CURVE_AVERAGE;
    same("share of the mean", MEAN_CORRELATION, shorter);
}

#[test]
fn priors_weigh_openings_flows_and_rates() {
    let (flow, valve) = (learner().flow.priors, learner().valve.priors);
    let changes = PERIOD * PERIOD;
    // The flow's instruments are openings, and its regressors are flows.
    same("flow gain", flow.weights[0], t::FLOW_GAIN_PRIOR * 7.0e-3);
    same("velocity delay", flow.weights[1], t::VELOCITY_DELAY_PRIOR * 7.0e-3 * changes);
    same("valve gain", valve.weights[0], t::VALVE_GAIN_PRIOR);
    same("response delay", valve.weights[1], t::RESPONSE_DELAY_PRIOR * changes);
    for priors in [flow, valve] {
        same("period", priors.period, PERIOD);
        same("windows per second", priors.per_period, 125.0);
    }
}

#[test]
fn delays_start_as_configured_and_reach_as_far_as_stated() {
    let (flow, valve) = (learner().flow.priors, learner().valve.priors);
    same("velocity delay", flow.nominal_delay, 4.0e-3);
    same("least velocity delay", flow.delay.bounds[0], 4.0e-3 - 9.0e-3);
    same("greatest velocity delay", flow.delay.bounds[1], 4.0e-3 + 18.0e-3);
    same("response delay", valve.nominal_delay, 9.0e-3);
    same("greatest response delay", valve.delay.bounds[1], 4.0 * 9.0e-3);
    for (priors, bounds) in [(flow, RIG.learning.flow_gain_bounds), (valve, RIG.learning.valve_gain_bounds)] {
        assert_eq!(priors.gain.bounds.map(f64::to_bits), bounds.map(f64::to_bits));
        // Twice the configured response delay in a second.
        same("rate of a delay", priors.delay.change, 2.0 * 9.0e-3 * PERIOD);
    }
}

#[test]
fn a_response_delay_is_at_least_two_samples() {
    // A fifth of 9 ms is less than two samples, and a fifth of 20 ms is more.
    for (response_delay, least) in [(9.0e-3, 2.0e-3), (20.0e-3, 4.0e-3)] {
        let priors = of(&Parameters { response_delay, ..RIG }).valve.priors;
        same("least", priors.delay.bounds[0], least);
        same("configured", priors.nominal_delay, response_delay);
    }
    // A faster valve starts at the bound, and has no range.
    let fast = of(&Parameters { response_delay: 0.4e-3, ..RIG }).valve.priors;
    same("configured", fast.nominal_delay, 2.0e-3);
    assert_eq!(fast.delay.bounds.map(f64::to_bits), [2.0e-3_f64.to_bits(); 2]);
}

#[test]
fn the_valve_has_the_inverse_network_of_the_configured_one() {
    let valve = learner().valve;
    same("opening per volt", valve.valve_gain, 0.17);
    same("volts per opening", valve.lead_gain, 1.0 / (1.3 * 0.17));
    // Tustin's lag is twice the time constant αT/(1 − α).
    same("lag", valve.lag_per_delay, 2.0 * 0.25);
    same("sample", valve.sample, 1e-3);
    // One sample of hold, and three of computation.
    same("sampling delay", valve.sampling_delay, 4e-3);
}

#[test]
fn parts_of_the_learner_are_switched_on_by_their_parameters() {
    let on = |adaptive, curve_correction, guard| {
        let learner = of(&Parameters {
            learning: Learning { adaptive, curve_correction, guard, ..RIG.learning },
            ..RIG
        });
        [learner.adapts, learner.corrects, learner.guards]
    };
    assert_eq!(on(true, true, false), [true, true, false]);
    assert_eq!(on(true, false, true), [true, false, true]);
    // A correction needs the estimate of the flow gain.
    assert_eq!(on(false, true, true), [false, false, true]);
}

/// The mean over a window of 4 to 8 ms passes a part of a hum of 58 Hz, so the taps must have their zero there.
#[test]
fn the_estimators_do_not_see_hum_at_any_sample_rate() {
    for sample_rate in [1000.0, 3277.0, 4096.0, 100e3] {
        let [ends, middle] = of(&Parameters { sample_rate, ..RIG }).filter.taps;
        let angle = core::f64::consts::TAU * 58.0 * f64::from(window_ticks(sample_rate)) / sample_rate;
        let gain = middle + 2.0 * ends * libm::cos(angle);
        assert!(gain.abs() < 1e-12 && (middle + 2.0 * ends - 1.0).abs() < 1e-15, "{sample_rate}: {gain}");
    }
}
