//! The correction learns a valve whose curve is known.

#![allow(clippy::indexing_slicing, reason = "tests")]

mod equations;
mod known;
mod start;

use super::*;
use crate::learning::curve_nodes::inverse_at;

const CURVE: FlowCurve<f64> = FlowCurve {
    grid: CurveGrid::over(8.0),
    known_null: 0.0,
    forgotten: 0.05,
    average: 1e-3,
    correlation: 30.0,
    disturbance: 500.0,
    change: 0.01,
    null_change: 0.01,
    drift: 1e-6,
};

#[derive(Default)]
struct Learned {
    state: CurveState<f64>,
    evidence: CurveEvidence<f64>,
}

impl Learned {
    fn apply(&self, demand: f64) -> f64 {
        CURVE.grid.apply(&self.state.nodes.pieces, demand)
    }
}

/// The state after swings of this size (m³/s) through a valve that passes `true_flow` where its table has a flow,
/// with its null at `offset`. The table's slope is 1 everywhere.
fn learned(swing: f64, offset: f64, true_flow: impl Fn(f64) -> f64) -> Learned {
    let mut l = Learned::default();
    for n in 0..8000_u32 {
        let table = swing * (0.05 * f64::from(n)).sin();
        let passed = [table + offset - l.evidence.null, 1.0];
        let sample = CURVE.sample(&l.evidence, true_flow(table), passed, [0.0; 2]);
        CURVE.learn(&mut l.state, &mut l.evidence, &sample, 1.0, 0.984);
        CURVE.update(&mut l.state, &mut l.evidence);
        CURVE.refresh(&mut l.state, &l.evidence);
    }
    l
}

fn sided(flow: f64) -> f64 {
    let soft = if flow.abs() > 4.0 { 0.9 } else { 1.0 };
    (if flow < 0.0 { 0.95 } else { 1.05 })
        * (soft * (flow.abs() - 4.0).max(0.0) + flow.abs().min(4.0))
        * flow.signum()
}

#[test]
fn nothing_is_corrected_at_rest_and_by_a_sound_table() {
    for state in [Learned::default(), learned(6.0, 0.0, |flow| flow), learned(6.0, 0.01, |flow| flow)] {
        for n in -100..=100 {
            let flow = 0.1 * f64::from(n);
            let found = state.apply(flow);
            assert!((found - flow).abs() < 2e-3, "{flow}: {found}");
        }
    }
}

#[test]
fn straightened_flow_is_the_tables_at_the_same_opening() {
    // A step is 8/7 m³/s. Forwards the table has 10 % more flow, and at two steps half a step more again. There are
    // no nodes beyond eight steps.
    let step = 8.0 / 7.0;
    let mut evidence = CurveEvidence { asymmetry: 0.1, ..CurveEvidence::default() };
    evidence.departures[10] = 0.5;
    for (flow, table) in
        [(2.0, 2.7), (1.5, 1.9), (3.0, 3.3), (-2.0, -1.8), (0.0, 0.0), (20.0, 22.0), (-20.0, -18.0)]
    {
        let found = CURVE.straightened(&evidence, flow * step);
        assert!((found - table * step).abs() < 1e-12, "{flow}: {found}");
    }
    // Three tenths of the common departure belong to the flow gain.
    evidence.common = 0.2;
    let found = CURVE.straightened(&evidence, 3.0 * step);
    assert!((found - 3.12 * step).abs() < 1e-12, "{found}");
}

#[test]
fn directions_and_bands_are_found_beside_an_offset() {
    let state = learned(6.5, -0.02, sided);
    for n in -60..=60 {
        let table = 0.1 * f64::from(n);
        let found = inverse_at(&state.state.nodes.pieces, CURVE.grid.step, table);
        assert!((found - sided(table)).abs() < 0.03, "{table}: {found} of {}", sided(table));
        assert!((state.apply(found) - table).abs() < 1e-12);
    }
    // A band that was never visited follows its direction, which shares the neighbours' departures for long.
    let state = learned(2.0, 0.0, sided);
    for (flow, ratio) in [(6.0, 1.05), (-6.0, 0.95)] {
        let found = inverse_at(&state.state.nodes.pieces, CURVE.grid.step, flow) / flow;
        assert!((found - ratio).abs() < 0.015, "{flow}: {found}");
    }
}

#[test]
fn a_window_without_an_error_displaces_its_share_of_the_mean_square() {
    // A thousandth, less for the ten windows of the start.
    let mut l = Learned::default();
    (l.evidence.windows, l.evidence.squares) = (1000.0, 2.0);
    let square = CURVE.mean_square(&l.evidence);
    let sample = CurveSample { error: 0.0, slope: 0.0, ..CURVE.sample(&l.evidence, 1.0, [1.0; 2], [0.0; 2]) };
    CURVE.learn(&mut l.state, &mut l.evidence, &sample, 1.1, 1.0);
    let left = CURVE.mean_square(&l.evidence) / square;
    assert!((1.0 - left - 1e-3).abs() < 2e-5, "{left}");
}

#[test]
fn a_null_offset_is_no_asymmetry_where_the_instrument_leads_the_flow() {
    let (mut l, null) = (Learned::default(), 0.02);
    for n in 0..8000_u32 {
        let [flow, ahead] = [0.0, 0.2].map(|lead| 0.05 * (0.05 * f64::from(n) + lead).sin());
        let passed = flow + null - l.evidence.null;
        // A linear valve, so the commanded opening is the flow that the instrument leads by.
        let sample = CURVE.sample(&l.evidence, flow, [passed, 1.0], [ahead - passed, 0.0]);
        CURVE.learn(&mut l.state, &mut l.evidence, &sample, 1.0, 1.0);
        CURVE.update(&mut l.state, &mut l.evidence);
        CURVE.refresh(&mut l.state, &l.evidence);
    }
    let (asymmetry, offset) = (l.evidence.asymmetry, l.state.offset);
    assert!(asymmetry.abs() < 3e-3 && (offset - null).abs() < 1e-2 * null, "{asymmetry} {offset}");
}

#[test]
fn map_increases_whatever_was_learned() {
    // A decreasing curve, which a table cannot have.
    let state = learned(7.0, 0.0, |flow| if flow.abs() < 3.0 { 2.0 * flow } else { 0.3 * flow });
    let mut before = f64::NEG_INFINITY;
    for n in -1200..=1200 {
        let value = state.apply(0.01 * f64::from(n));
        assert!(value > before, "{n}: {value}, {before}");
        before = value;
    }
    assert!(state.apply(f64::NAN).is_nan());
    assert!(state.state.beyond > 0.0 || state.evidence.asymmetry.abs() < LARGEST_ASYMMETRY);
}

/// Noise of the velocity is larger than a small flow, so that the first sums can have the wrong sign.
#[test]
fn the_mean_departure_is_a_share_of_the_flow_whatever_its_sign() {
    for flow in [-1.0, -0.5, -0.1, -0.05] {
        let mut l = Learned::default();
        l.evidence.departures[7] = 0.2;
        // With an instrument of 0.1 the sum of their products is near the weight of the prior, or beyond.
        let sample = CURVE.sample(&l.evidence, flow, [0.1, 1.0], [0.0; 2]);
        CURVE.learn(&mut l.state, &mut l.evidence, &CurveSample { instrument: 0.1, ..sample }, 1.0, 0.984);
        assert!(l.evidence.common.abs() <= CURVE_DEPARTURE, "{flow}: {:?}", l.evidence);
    }
}
