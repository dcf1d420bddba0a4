//! The equations of the valve estimator.

use crate::compensation::LeadNetwork;
use crate::learning::least_squares::{Estimate, GainAndDelay, LeastSquares, Priors, Range, Weight};
use crate::learning::valve::{ValveEstimator, ValveState};

const ALPHA: f64 = 0.2;
const PERIOD: f64 = 1.0 / 256.0;
const SAMPLE: f64 = 1.0 / 4096.0;
const WEIGHT: Weight<f64> = Weight { time: 0.25, forgetting: 0.9 };
const RANGE: Range<f64> = Range { bounds: [1e-3, 2e-2], change: 1.0 };
const ESTIMATOR: ValveEstimator<f64> = ValveEstimator {
    valve_gain: 0.25,
    lead_gain: 12.4,
    lag_per_delay: 2.0 * ALPHA / (1.0 - ALPHA),
    phase_deficit: 0.45,
    sample: SAMPLE,
    sampling_delay: 3.0 * SAMPLE,
    priors: Priors {
        period: PERIOD,
        per_period: 256.0,
        nominal_delay: 5e-3,
        weights: [0.2, 0.3],
        spread: [0.0; 2],
        gain: RANGE,
        delay: RANGE,
    },
};

fn estimates(gain: f64, delay: f64) -> GainAndDelay<f64> {
    GainAndDelay { gain: Estimate::at(gain), delay: Estimate::at(delay) }
}

fn valve(gain: f64, delay: f64) -> ValveState<f64> {
    let mut state = ESTIMATOR.at_rest();
    state.found = estimates(gain, delay);
    state
}

fn near(what: &str, found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{what}: {found:e}, not {expected:e}");
}

#[test]
fn a_valve_at_rest_is_closed_and_stays_closed() {
    let mut state = ESTIMATOR.at_rest();
    assert_eq!(state.opening().to_bits(), 0);
    ESTIMATOR.invert_lead(&mut state, 0.0, false);
    assert_eq!(state.opening().to_bits(), 0);
}

#[test]
fn the_commanded_opening_is_tustins_inverse_of_equation_8() {
    let delay = 7e-3;
    // (αT_ld·s + 1)/(T_ld·s + 1), with s = 2/h·(z − 1)/(z + 1).
    let lead = delay / (1.0 - ALPHA);
    let lag = ALPHA * lead;
    let (mut state, mut last) = (valve(1.0, delay), 0.3);
    ESTIMATOR.invert_lead(&mut state, last, true);
    near("restart", state.opening(), last);
    let mut expected = last;
    for input in [0.35, 0.1, -0.2, -0.2, 0.05] {
        expected = ((2.0 * lead - PERIOD) * expected + (2.0 * lag + PERIOD) * input
            - (2.0 * lag - PERIOD) * last)
            / (2.0 * lead + PERIOD);
        last = input;
        ESTIMATOR.invert_lead(&mut state, input, false);
        assert!((state.opening() - expected).abs() < 1e-14, "{} {expected}", state.opening());
    }
}

#[test]
fn a_restart_forgets_the_last_opening() {
    let (mut one, mut other) = (valve(1.0, 7e-3), valve(1.0, 7e-3));
    ESTIMATOR.invert_lead(&mut one, 3.0, false);
    for state in [&mut one, &mut other] {
        ESTIMATOR.invert_lead(state, 1.0, true);
        ESTIMATOR.invert_lead(state, 2.0, false);
    }
    assert_eq!(one, other);
}

#[test]
fn sums_refer_to_the_configured_delay_after_the_networks_output() {
    let mut sums = LeastSquares::default();
    let (commanded, decrease, spool) = (0.5, -0.04, 0.45);
    ESTIMATOR.add(&valve(1.3, 7e-3), &mut sums, [commanded, decrease], spool, WEIGHT);
    // The inverse in use takes 2 ms more than the configured one, and the spool is three samples ahead, times its gain.
    let known = (2e-3 + 1.3 * 3.0 * SAMPLE) / PERIOD;
    let error = spool - commanded + known * decrease;
    near("openings", sums.matrix[0][0], 0.25 * commanded * commanded);
    near("changes", sums.matrix[1][1], 0.25 * decrease * decrease);
    near("products", sums.matrix[0][1], 0.25 * commanded * decrease);
    near("error by opening", sums.right[0], 0.25 * commanded * error);
    near("error by change", sums.right[1], 0.25 * decrease * error);
}

#[test]
fn gain_and_sampling_delay_explain_the_spool() {
    // The command has the opening of three samples before, so the spool is ahead. The opening rises by 0.04 in a window.
    let (commanded, rise) = (0.5, 0.04);
    let explained = 1.3 * (commanded + rise * 3.0 * SAMPLE / PERIOD);
    let found = ESTIMATOR.residual(&valve(1.3, 7e-3), [commanded, -rise], 0.45);
    near("unexplained", found, 0.45 - explained);
}

/// Square of the amplitude of Eq. (8) for a delay (s) at a squared frequency (1/s²).
fn amplitude(delay: f64, square: f64) -> f64 {
    let lead = delay / (1.0 - ALPHA);
    (1.0 + square * lead * lead) / (1.0 + square * ALPHA * ALPHA * lead * lead)
}

#[test]
fn the_network_is_that_of_both_delays_without_the_added_amplitude() {
    let square = 2500.0;
    for (response, velocity) in [(7e-3_f64, 4e-3_f64), (7e-3, -3e-3), (7e-3, -8e-3), (7e-3, 12e-3)] {
        // The phase of a network falls short by 0.45·(ω·T)³, and the excess over the valve's is added, at most a half.
        let both = response + velocity;
        let cubes = (both * both * both - response * response * response) / velocity;
        let delay = (both + velocity * (0.45 * square * cubes).min(0.5)).max(1e-3);
        let found = ESTIMATOR.lead(&estimates(1.3, response), square, velocity, 0.9);
        let added = libm::sqrt(amplitude(delay, square) / amplitude(response, square));
        let gain = 12.4 * 0.9 / 1.3 / added;
        let expected = LeadNetwork::<f64>::new(gain, delay, ALPHA, 1.0 / SAMPLE).unwrap();
        near("gain", found.gain(), expected.gain());
        near("pole", found.pole(), expected.pole());
        near("rate", found.rate(), expected.rate());
    }
}

#[test]
fn the_motions_frequency_is_that_of_its_changes_over_its_openings() {
    let sums = LeastSquares { matrix: [[3.0, 0.7], [0.7, 0.05]], ..LeastSquares::default() };
    // The prior counts as openings without changes.
    near("mean square", ESTIMATOR.mean_square_frequency(&sums), 0.05 / (3.0 + 0.2) / (PERIOD * PERIOD));
}
