//! The equations of the least squares.

use crate::learning::least_squares::{Estimate, GainAndDelay, LeastSquares, Priors, Range, Weight};

const PERIOD: f64 = 0.004;
const WEIGHT: Weight<f64> = Weight { time: 0.25, forgetting: 0.9 };
const PRIORS: Priors<f64> = Priors {
    period: PERIOD,
    per_period: 1.0 / PERIOD,
    nominal_delay: 0.005,
    weights: [0.2, 0.3],
    spread: [0.005, 0.07],
    gain: Range { bounds: [0.5, 1.5], change: 10.0 },
    delay: Range { bounds: [0.001, 0.009], change: 10.0 },
};

/// Sums of correlated instruments and regressors.
fn sums(right: [f64; 2]) -> LeastSquares<f64> {
    LeastSquares { matrix: [[2.0, 0.4], [0.7, 3.0]], right }
}

fn near(what: &str, found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{what}: {found:e}, not {expected:e}");
}

#[test]
fn a_window_adds_products_of_instruments_with_regressors_and_the_error() {
    let mut found = sums([0.5, -0.6]);
    let ([z, w], [x, y], error) = ([0.3, -0.8], [0.9, -1.1], 0.05);
    found.add([z, w], [x, y], error, WEIGHT);
    let [[a, b], [c, d]] = found.matrix;
    near("z·x", a, 0.9 * 2.0 + 0.25 * z * x);
    near("z·y", b, 0.9 * 0.4 + 0.25 * z * y);
    near("w·x", c, 0.9 * 0.7 + 0.25 * w * x);
    near("w·y", d, 0.9 * 3.0 + 0.25 * w * y);
    near("z·error", found.right[0], 0.9 * 0.5 + 0.25 * z * error);
    near("w·error", found.right[1], 0.9 * -0.6 + 0.25 * w * error);
}

#[test]
fn a_regressor_of_wrong_sign_leaves_no_negative_square() {
    let mut found = LeastSquares::default();
    found.add([1.0, 1.0], [-1.0, -2.0], 0.1, WEIGHT);
    let [[a, b], [c, d]] = found.matrix;
    assert_eq!([a, d].map(f64::to_bits), [0; 2]);
    near("z·y", b, -0.5);
    near("w·x", c, -0.25);
    // A small square is not raised.
    found.add([0.5, 0.5], [0.5, 0.25], 0.1, WEIGHT);
    near("z·x", found.matrix[0][0], 0.0625);
    near("w·y", found.matrix[1][1], 0.03125);
}

#[test]
fn gain_and_delay_fulfil_the_normal_equations_with_the_priors() {
    for right in [[0.9, 0.0], [0.0, 2.1], [0.6, -1.3]] {
        let mut state = PRIORS.at_rest();
        PRIORS.solve(&mut state, &sums(right));
        let (gain, late) = (state.gain.value - 1.0, (state.delay.value - 0.005) / PERIOD);
        let residuals = [2.2 * gain + 0.4 * late - right[0], 0.7 * gain + 3.3 * late - right[1]];
        assert!(residuals.iter().all(|residual| residual.abs() < 1e-12), "{residuals:?}");
        assert_eq!(
            [state.gain, state.delay].map(|e| (e.beyond.to_bits(), e.away.abs() < 1e-15)),
            [(0, true); 2]
        );
    }
}

#[test]
fn without_information_the_estimates_are_the_configured_ones() {
    let mut state = GainAndDelay { gain: Estimate::at(1.3), delay: Estimate::at(0.007) };
    PRIORS.solve(&mut state, &LeastSquares::default());
    near("gain", state.gain.value, 1.0);
    near("delay", state.delay.value, 0.005);
}

#[test]
fn sums_that_contradict_themselves_change_nothing() {
    let priors = Priors { weights: [0.0; 2], ..PRIORS };
    // A determinant of zero, and a negative one.
    for matrix in [[[1.0, 1.0], [1.0, 1.0]], [[1.0, 2.0], [2.0, 1.0]]] {
        let mut state = GainAndDelay { gain: Estimate::at(1.3), delay: Estimate::at(0.007) };
        let before = state;
        priors.solve(&mut state, &LeastSquares { matrix, right: [0.1, 0.2] });
        assert_eq!(state, before);
        let [gain, delay] = priors.variances(&LeastSquares { matrix, right: [0.1, 0.2] }, &matrix, 0.1);
        near("the prior's gain", gain, 0.005);
        near("the prior's delay", delay, 0.07 * PERIOD * PERIOD);
    }
}

/// The estimate of the gain after one step with this rate, from a value towards a result.
fn approached(change: f64, from: f64, result: f64) -> Estimate<f64> {
    let priors = Priors { gain: Range { change, ..PRIORS.gain }, weights: [0.0, 1.0], ..PRIORS };
    let mut state = GainAndDelay { gain: Estimate::at(from), ..PRIORS.at_rest() };
    let known = LeastSquares { matrix: [[2.0, 0.0], [0.0, 1.0]], right: [2.0 * (result - 1.0), 0.0] };
    priors.solve(&mut state, &known);
    state.gain
}

#[test]
fn an_estimate_moves_at_a_limited_rate() {
    for (from, result, value) in [(1.0, 1.25, 1.125), (1.0, 0.75, 0.875), (1.0, 1.0625, 1.0625)] {
        let found = approached(0.125, from, result);
        near("value", found.value, value);
        // How far the result still is.
        near("away", found.away, result - value);
        assert_eq!(found.beyond.to_bits(), 0);
    }
}

#[test]
fn an_estimate_stops_at_its_bounds_and_reports_the_distance() {
    for (result, bound) in [(2.0, 1.5), (0.25, 0.5)] {
        let found = approached(10.0, 1.0, result);
        near("value", found.value, bound);
        near("beyond", found.beyond, (result - bound).abs());
        near("away", found.away, result - bound);
    }
}

/// The squares of one window have no inverse, and the priors hardly add to those of a fast motion.
#[test]
fn rounding_makes_no_variance_negative() {
    let priors = Priors::<f32> {
        period: 0.004,
        per_period: 250.0,
        nominal_delay: 0.005,
        weights: [1e-6, 1e-9],
        spread: [0.0; 2],
        gain: Range { bounds: [0.5, 1.5], change: 10.0 },
        delay: Range { bounds: [0.001, 0.009], change: 10.0 },
    };
    for n in 1..1000_u16 {
        let (opening, decrease) = (0.3 * libm::sinf(f32::from(n)), 0.2 * libm::cosf(f32::from(n)));
        let mut sums = LeastSquares::default();
        let regressors = [opening, decrease];
        sums.add(regressors, regressors, 0.0, Weight { time: 0.004, forgetting: 1.0 });
        let variances = priors.variances(&sums, &sums.matrix, 1.0);
        assert!(variances.iter().all(|variance| *variance >= 0.0), "{regressors:?}: {variances:?}");
    }
}

/// Truths anywhere in their ranges, and little evidence without noise: the priors are the only error.
#[test]
fn the_share_of_the_priors_is_the_error_without_noise() {
    let spread = [1.0 / 12.0, 4.0 / 3.0];
    let wide = Range { bounds: [-10.0, 10.0], change: 10.0 };
    let priors = Priors { spread, gain: wide, delay: wide, ..PRIORS };
    let matrix = [[0.1, 0.02], [0.03, 0.2]];
    let [mut gain_square, mut delay_square] = [0.0; 2];
    let steps = 40_u32;
    let middle = |n: u32| (2.0 * f64::from(n) + 1.0) / f64::from(steps) - 1.0;
    for (n, m) in (0..steps).flat_map(|n| (0..steps).map(move |m| (n, m))) {
        let (gain, delay) = (0.5 * middle(n), 2.0 * middle(m));
        let right = matrix.map(|[on_gain, on_delay]| on_gain * gain + on_delay * delay);
        let mut state = priors.at_rest();
        priors.solve(&mut state, &LeastSquares { matrix, right });
        let error =
            [state.gain.value - 1.0 - gain, state.delay.value - priors.nominal_delay - PERIOD * delay];
        gain_square += error[0] * error[0] / f64::from(steps * steps);
        delay_square += error[1] * error[1] / f64::from(steps * steps);
    }
    let found = priors.variances(&LeastSquares { matrix, right: [0.0; 2] }, &matrix, 0.0);
    // The middles of the steps have 1/1600 less variance than the whole range.
    for (found, square) in found.into_iter().zip([gain_square, delay_square]) {
        assert!((square / found - 1.0).abs() < 1e-3, "{found} {square}");
    }
}
