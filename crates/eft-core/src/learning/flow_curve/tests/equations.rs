//! The equations of the correction, with numbers of which none is another one or 1.

use super::super::{CurveEvidence, CurveSample, CurveState, Direction, FlowCurve};
use crate::compensation::{CurveGrid, NODES};

/// Two steps per m³/s.
const CURVE: FlowCurve<f64> = FlowCurve {
    grid: CurveGrid::over(3.5),
    known_null: 0.0,
    forgotten: 0.25,
    average: 0.125,
    correlation: 30.0,
    disturbance: 500.0,
    change: 1.0,
    null_change: 1.0,
    drift: 1e-3,
};
/// A sample at three and a half steps.
const SAMPLE: CurveSample<f64> = CurveSample {
    demand: 3.4,
    instrument: 3.5,
    departures: 0.06,
    passed: 3.7,
    slope: 8.0,
    error: 0.2,
    reading: 0.03,
};

fn near(what: &str, found: f64, expected: f64) {
    assert!(
        (found - expected).abs() <= 1e-12 * expected.abs().max(1e-3),
        "{what}: {found:e}, not {expected:e}"
    );
}

/// Evidence without a zero.
fn evidence() -> CurveEvidence<f64> {
    let back = Direction {
        slopes: 700.0,
        slope_instruments: -90.0,
        slope_errors: 4.0,
        flows: 50.0,
        flow_errors: -3.0,
    };
    let forth = Direction {
        slopes: 800.0,
        slope_instruments: 70.0,
        slope_errors: 9.0,
        flows: 60.0,
        flow_errors: 5.0,
    };
    CurveEvidence {
        directions: [back, forth],
        asymmetry: 0.05,
        null: 3e-3,
        sensor: 7e-3,
        readings: 4.0,
        departures: [0.0; NODES],
        windows: 6.0,
        squares: 0.3,
        instrument_departures: 0.9,
        common: 0.02,
        recent_departures: 0.7,
        recent_flows: 9.0,
    }
}

fn state() -> CurveState<f64> {
    CurveState { offset: 5e-3, ..CurveState::default() }
}

#[test]
fn a_sample_is_in_steps_and_compares_the_table_with_the_corrected_flow() {
    let mut learned = evidence();
    // Four steps backwards.
    learned.departures[4] = -0.1;
    let s = CURVE.sample(&learned, -2.0, [-1.9, 0.7], [0.02, 0.011]);
    near("demand", s.demand, -4.0);
    near("passed", s.passed, -3.8);
    near("slope", s.slope, 1.4);
    near("departures", s.departures, -0.1);
    near("reading", s.reading, 0.011);
    // The corrected flow is 5 % of the size and the departure more.
    let added = 0.05 * 4.0 - 0.1;
    near("error", s.error, -3.8 - (-4.0 + added));
    near("instrument", s.instrument, -3.8 + 1.4 * 0.02 - added);
}

#[test]
fn a_residual_excludes_the_offset_that_was_found_and_is_not_yet_in_use() {
    let found = FlowCurve::residual(&state(), &evidence(), &SAMPLE);
    near("residual", found, 0.2 - 2e-3 * 8.0);
}

#[test]
fn the_variance_is_the_mean_square_of_correlated_residuals_and_ten_first_ones() {
    near("variance", CURVE.variance(&evidence()), 30.0 * (0.3 + 10.0 * 4e-4) / 16.0);
    near("mean square", CURVE.mean_square(&evidence()), (0.3 + 10.0 * 4e-4) / 16.0);
}

#[test]
fn a_tables_possible_error_is_no_noise_except_for_a_fiftieth() {
    // The belief of 5 % of 3.5 steps is 0.175 steps.
    for (error, noise) in [(0.3, 0.09 - 0.175 * 0.175), (0.1, 0.02 * 0.01)] {
        let mut learned = evidence();
        let sample = CurveSample { error: error + 2e-3 * 8.0, ..SAMPLE };
        let variance = CURVE.add_residual(&state(), &mut learned, &sample);
        near("windows", learned.windows, 0.875 * 6.0 + 1.0);
        near("squares", learned.squares, 0.875 * 0.3 + noise);
        near("variance", variance, CURVE.variance(&learned));
    }
}

#[test]
fn the_sensors_offset_is_a_mean_of_the_readings() {
    let mut learned = evidence();
    CURVE.learn(&mut state(), &mut learned, &SAMPLE, 1.1, 0.9);
    near("windows", learned.readings, 0.875 * 4.0 + 1.0);
    near("offset", learned.sensor, 7e-3 + (0.03 - 7e-3) / 4.5);
}

#[test]
fn a_window_moves_the_two_nodes_beside_its_instrument() {
    let (mut now, mut learned) = (state(), evidence());
    let disturbance = 1e-4;
    now.disturbance = disturbance;
    CURVE.learn(&mut now, &mut learned, &SAMPLE, 1.1, 0.9);
    let noise = CURVE.variance(&learned) + 500.0 * 64.0 * disturbance;
    let (mut nodes, mut departures) = (state().nodes, evidence().departures);
    let measured = [SAMPLE.instrument, 0.2 - 2e-3 * 8.0];
    // The instrument is between the third and the fourth node after the one at zero.
    for node in [11, 12] {
        nodes.correct(&mut departures, node, measured, [noise, CURVE.drift]);
    }
    for (node, (found, expected)) in learned.departures.iter().zip(departures).enumerate() {
        near("departure", *found, expected);
        assert_eq!(*found > 0.0, node == 11 || node == 12, "node {node}");
    }
    nodes.visit(11);
    assert_eq!(now.nodes, nodes);
}

#[test]
fn the_sums_of_a_direction_forget_a_share_of_the_flow_gains_forgetting() {
    let (mut now, mut learned) = (state(), evidence());
    CURVE.learn(&mut now, &mut learned, &SAMPLE, 1.1, 0.6);
    let mut expected = evidence();
    FlowCurve::add_direction(&mut expected, &SAMPLE, 1.1, 1.0 - 0.25 * 0.4);
    assert_eq!(learned.directions, expected.directions);
}

#[test]
fn a_direction_sums_products_of_slope_instrument_flow_and_error() {
    for (direction, sign) in [(0, -1.0), (1, 1.0)] {
        let mut learned = evidence();
        let [demand, instrument, passed] = [3.4, 3.5, 3.7].map(|flow| sign * flow);
        let sample = CurveSample { demand, instrument, passed, ..SAMPLE };
        FlowCurve::add_direction(&mut learned, &sample, 1.1, 0.9);
        let (before, after) = (evidence().directions, learned.directions);
        assert_eq!(after[1 - direction], before[1 - direction], "the other direction");
        let (before, after) = (before[direction], after[direction]);
        // Flow and instrument before the division by the flow gain.
        let (flow, instrument) = (1.1 * demand, 1.1 * instrument);
        // Without the null offset in use and half of the departures.
        let error = passed + 3e-3 * 8.0 - 0.5 * 0.06 - flow;
        near("slopes", after.slopes, 0.9 * before.slopes + 64.0);
        near(
            "slopes × instruments",
            after.slope_instruments,
            0.9 * before.slope_instruments + 8.0 * instrument,
        );
        near("slopes × errors", after.slope_errors, 0.9 * before.slope_errors + 8.0 * error);
        near("instruments × flows", after.flows, 0.9 * before.flows + instrument * flow);
        near("instruments × errors", after.flow_errors, 0.9 * before.flow_errors + instrument * error);
    }
}

#[test]
fn a_window_without_flow_counts_forwards() {
    let mut learned = evidence();
    FlowCurve::add_direction(&mut learned, &CurveSample { instrument: 0.0, ..SAMPLE }, 1.1, 0.9);
    assert_eq!(learned.directions[0], evidence().directions[0]);
}

#[test]
fn the_common_departure_is_a_share_of_the_flow_with_a_weak_prior() {
    let mut learned = CurveEvidence { instrument_departures: 0.9, ..CurveEvidence::default() };
    let small = CurveSample { demand: 0.03, instrument: 0.04, ..SAMPLE };
    FlowCurve::add_direction(&mut learned, &small, 1.1, 0.9);
    let departures = 0.9 * 0.9 + 1.1 * 0.04 * 0.06;
    near("sum", learned.instrument_departures, departures);
    // One hundredth of a squared step is the prior's weight.
    near("common", learned.common, 1.1 * departures / (1.21 * 0.04 * 0.03 + 0.01));
    // Both directions count.
    let mut both = evidence();
    FlowCurve::add_direction(&mut both, &SAMPLE, 1.1, 0.9);
    let flows = both.directions.iter().map(|direction| direction.flows).sum::<f64>() + 0.01;
    near("common", both.common, 1.1 * both.instrument_departures / flows);
}

#[test]
fn the_flow_gains_memory_has_the_departures_and_the_squared_instrument() {
    let mut learned = evidence();
    CURVE.learn(&mut state(), &mut learned, &SAMPLE, 1.1, 0.6);
    // Three tenths of the common departure belong to the flow gain.
    near("departures", learned.recent_departures, 0.6 * 0.7 + 3.5 * (0.06 - 0.3 * 0.02 * 3.5));
    near("flows", learned.recent_flows, 0.6 * 9.0 + 3.5 * 3.5);
    near("share", FlowCurve::share(&evidence()), 0.7 / 9.0);
    near("nothing", FlowCurve::share(&CurveEvidence::<f64>::default()), 0.0);
    near("bound", FlowCurve::share(&CurveEvidence { recent_departures: -3.0, ..evidence() }), -0.2);
}

/// The solution of three linear equations, by Cramer's rule.
fn solution(rows: [[f64; 3]; 3], right: [f64; 3]) -> [f64; 3] {
    let determinant = |m: [[f64; 3]; 3]| {
        (0..3)
            .map(|n| {
                m[0][n] * (m[1][(n + 1) % 3] * m[2][(n + 2) % 3] - m[1][(n + 2) % 3] * m[2][(n + 1) % 3])
            })
            .sum::<f64>()
    };
    core::array::from_fn(|column| {
        let mut with = rows;
        for (row, value) in with.iter_mut().zip(right) {
            row[column] = value;
        }
        determinant(with) / determinant(rows)
    })
}

/// The errors of both gains and the offset (1) that fulfil the normal equations with these priors, and the variance of
/// the offset.
fn normal_equations(learned: &CurveEvidence<f64>, variance: f64) -> ([f64; 3], f64) {
    let [back, forth] = &learned.directions;
    let (of_gain, of_offset) = (variance / 9e-4, variance / 1e-4);
    let rows = [
        [back.flows + of_gain, 0.0, back.slope_instruments],
        [0.0, forth.flows + of_gain, forth.slope_instruments],
        [back.slope_instruments, forth.slope_instruments, back.slopes + forth.slopes + of_offset],
    ];
    let errors = [back.flow_errors, forth.flow_errors, back.slope_errors + forth.slope_errors];
    let [_, _, per_variance] = solution(rows, [0.0, 0.0, 1.0]);
    (solution(rows, errors), variance * per_variance)
}

#[test]
fn gains_and_offset_fulfil_the_normal_equations() {
    let (mut now, mut learned) = (state(), evidence());
    CURVE.solve(&mut now, &mut learned, 0.02);
    let ([back, forth, offset], variance) = normal_equations(&evidence(), 0.02);
    assert!(back < -0.01 && forth > 0.01 && offset > 1e-3, "{back} {forth} {offset}");
    near("asymmetry", learned.asymmetry, (forth - back) / (2.0 + forth + back));
    near("offset", now.offset, offset);
    near("variance of the offset", now.variance, variance);
    near("null offset in use", learned.null, offset);
    near("distance beyond the bounds", now.beyond, 0.0);
}

#[test]
fn asymmetry_and_null_offset_stop_at_their_bounds() {
    for sign in [-1.0, 1.0] {
        let (mut now, mut learned) = (state(), evidence());
        let [back, forth] = &mut learned.directions;
        (back.flow_errors, forth.flow_errors) = (-sign * 36.0, sign * 48.0);
        (back.slope_errors, forth.slope_errors) = (sign * 150.0, sign * 170.0);
        let ([back, forth, offset], _) = normal_equations(&learned, 0.02);
        let asymmetry = (forth - back) / (2.0 + forth + back);
        assert!(sign * asymmetry > 0.31 && sign * offset > 0.051, "{asymmetry} {offset}");
        CURVE.solve(&mut now, &mut learned, 0.02);
        near("asymmetry", learned.asymmetry, sign * 0.3);
        near("null offset", learned.null, sign * 0.05);
        near("distance beyond", now.beyond, sign * asymmetry - 0.3 + sign * offset - 0.05);
        near("offset that was found", now.offset, offset);
    }
}

#[test]
fn asymmetry_and_null_offset_follow_at_limited_rates() {
    let slow = FlowCurve { change: 1e-3, null_change: 2e-4, ..CURVE };
    for (asymmetry, null, signs) in [(-0.2, -0.04, 1.0), (0.2, 0.04, -1.0)] {
        let mut learned = CurveEvidence { asymmetry, null, ..evidence() };
        slow.solve(&mut state(), &mut learned, 0.02);
        near("asymmetry", learned.asymmetry, asymmetry + signs * 1e-3);
        near("null offset", learned.null, null + signs * 2e-4);
    }
}

#[test]
fn an_update_solves_with_the_variance_of_the_residuals_and_a_refresh_updates_one_node() {
    let (mut now, mut learned) = (state(), evidence());
    CURVE.update(&mut now, &mut learned);
    CURVE.refresh(&mut now, &learned);
    let (mut expected, mut other) = (state(), evidence());
    CURVE.solve(&mut expected, &mut other, CURVE.variance(&evidence()));
    expected.nodes.refresh_next(&other.departures, other.asymmetry, CURVE.grid.step);
    assert_eq!((now, learned), (expected, other));
}

#[test]
fn at_rest_the_null_offset_has_the_deviation_of_its_prior() {
    let rest = CurveState::<f64>::default();
    let [variance, late] = CURVE.null_errors(&rest, &CurveEvidence::default(), 8.0);
    near("variance", variance, 1e-4);
    near("late", late, 0.0);
}
