//! The equations of the flow estimator.

use crate::learning::flow::{FlowEstimator, FlowSample};
use crate::learning::least_squares::{Estimate, GainAndDelay, LeastSquares, Priors, Range, Weight};

const PERIOD: f64 = 0.004;
const WEIGHT: Weight<f64> = Weight { time: 0.25, forgetting: 0.9 };
const RANGE: Range<f64> = Range { bounds: [-1.0, 2.0], change: 1.0 };
const ESTIMATOR: FlowEstimator<f64> = FlowEstimator {
    priors: Priors {
        period: PERIOD,
        per_period: 1.0 / PERIOD,
        nominal_delay: 3e-3,
        weights: [1e-9; 2],
        spread: [0.0; 2],
        gain: RANGE,
        delay: RANGE,
    },
};

fn estimates(gain: f64, delay: f64) -> GainAndDelay<f64> {
    GainAndDelay { gain: Estimate::at(gain), delay: Estimate::at(delay) }
}

fn near(what: &str, found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{what}: {found:e}, not {expected:e}");
}

#[test]
fn both_flows_are_shifted_by_half_of_the_delay() {
    let (gain, delay) = (1.2, 5e-3);
    let [measured, measured_change] = [0.7, 0.05];
    let [predicted, predicted_change] = [0.4, 0.03];
    let s =
        ESTIMATOR.sample(&estimates(gain, delay), [measured, measured_change], [predicted, predicted_change]);
    let at_one_instant = |flow: f64, change: f64, shift: f64| flow + shift * change / PERIOD;
    let residual = at_one_instant(measured, measured_change, 0.5 * delay)
        - gain * at_one_instant(predicted, predicted_change, -0.5 * delay);
    near("residual", s.residual, residual);
    near("change by a window's delay", s.delay_regressor, -0.5 * (0.05 + 1.2 * 0.03));
    near("measured", s.measured, measured);
    near("predicted", s.predicted, predicted);
}

#[test]
fn sums_refer_to_the_configured_gain_and_delay() {
    let sample = FlowSample { measured: 0.7, predicted: 0.4, delay_regressor: -0.05, residual: 9.0 };
    let mut sums = LeastSquares::default();
    ESTIMATOR.add(&mut sums, &sample, [0.5, -0.2], WEIGHT);
    // A gain of 1, and the configured delay of three quarters of a window.
    let error = 0.7 - 0.4 + 0.75 * 0.05;
    near("gain", sums.matrix[0][0], 0.25 * 0.5 * 0.4);
    near("delay", sums.matrix[1][1], 0.25 * 0.2 * 0.05);
    near("error by gain", sums.right[0], 0.25 * 0.5 * error);
    near("error by delay", sums.right[1], -0.25 * 0.2 * error);
}

#[test]
fn the_earlier_flow_lags_by_the_delay_and_keeps_its_amplitude() {
    let (delay, square) = (6e-3, 900.0);
    // One and a half windows late.
    let share = 1.0 / 2.5;
    let back = 1.0 + 0.5 * square * delay * (delay + PERIOD);
    let (lagged, now) = ([3.0, 5.0], [7.0, 11.0]);
    let synchronize = |delay: f64| ESTIMATOR.synchronize(&estimates(1.0, delay), lagged, now, square);
    // A late velocity: the table's flow has to wait.
    let ([measured, flow], [measured_out, flow_out]) = synchronize(delay);
    near("measured", measured, 7.0);
    near("table's", flow, 5.0 + share * 6.0);
    near("measured", measured_out, 7.0);
    near("table's", flow_out, back * flow);
    // A late spool: the measured flow has to wait.
    let ([measured, flow], [measured_out, flow_out]) = synchronize(-delay);
    near("measured", measured, 3.0 + share * 4.0);
    near("table's", flow, 11.0);
    near("measured", measured_out, back * measured);
    near("table's", flow_out, 11.0);
    // No delay: both pass.
    assert_eq!(synchronize(0.0), (now, now));
}

#[test]
fn a_lagged_swing_keeps_its_size() {
    for (omega, delay) in [(10.0, 1e-3), (35.0, 4e-3), (20.0, 8e-3)] {
        let swing = |n: f64| libm::sin(omega * PERIOD * n);
        let (mut lagged, mut largest) = ([0.0; 2], 0.0_f64);
        for n in 0..4000_u32 {
            let now = [0.0, swing(f64::from(n))];
            let (next, [_, flow]) = ESTIMATOR.synchronize(&estimates(1.0, delay), lagged, now, omega * omega);
            lagged = next;
            largest = if n > 2000 { largest.max(flow) } else { 0.0 };
        }
        assert!((largest - 1.0).abs() < 2e-3, "{omega} 1/s, {delay} s: {largest}");
    }
}

#[test]
fn a_lag_of_less_than_a_window_is_one() {
    // A delay of half a window, smaller than the bound of a comparison with anything but zero.
    let ([measured, flow], _) = ESTIMATOR.synchronize(&estimates(1.0, 0.5 * PERIOD), [0.0; 2], [1.0; 2], 0.0);
    near("measured", measured, 1.0);
    near("table's", flow, 1.0 / 1.5);
}
