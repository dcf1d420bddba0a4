//! Parts of the learner compared with closed forms.

use crate::channel::Channel;
use crate::compensation::{CurveGrid, LeadNetwork, PIECES};
use crate::learning::Learner;
use crate::learning::flow_curve::{CurveEvidence, CurveState, FlowCurve};
use crate::learning::least_squares::LeastSquares;
use crate::parameters::{Learning, Parameters, Realization};
use crate::signals::Input;
use crate::table::FlowTable;

const RIG: Parameters =
    Parameters { learning: Learning { guard: false, ..Learning::ADAPTIVE }, ..Parameters::ZHAO2005 };

fn learner() -> Learner<f64, 21> {
    Learner::<f64, 21>::new(&RIG).unwrap()
}

/// A correction with steps of 1 m³/s, without forgetting and without a limited rate.
const CURVE: FlowCurve<f64> = FlowCurve {
    grid: CurveGrid::over((PIECES / 2 - 1) as f64),
    known_null: 0.0,
    forgotten: 0.0,
    average: 1e-3,
    correlation: 30.0,
    disturbance: 500.0,
    change: 1.0,
    null_change: 1.0,
    drift: 0.0,
};
/// A flow (steps) so small that no node moves.
const FLOW: f64 = 0.02;
/// Number of windows in each direction.
const WINDOWS: u32 = 2000;

/// Windows with `flow` (steps) backwards and forwards in turn. The table's flow for it is `back` and `forth` times as
/// large. The null is at `offset` (1), and the table has a slope of `slope` steps there.
fn learn(
    (state, evidence): &mut (CurveState<f64>, CurveEvidence<f64>),
    flow: f64,
    [back, forth]: [f64; 2],
    [slope, offset]: [f64; 2],
) {
    let untouched = CurveEvidence::default();
    for _ in 0..WINDOWS {
        for demand in [-back * flow, forth * flow] {
            let measured = demand.signum() * flow;
            let left = offset - evidence.null;
            let passed = [demand + left * slope, slope];
            let sample = CURVE.sample(&untouched, measured, passed, [-left, 0.0]);
            CURVE.learn(state, evidence, &sample, 1.0, 1.0);
            CURVE.update(state, evidence);
            CURVE.refresh(state, evidence);
        }
    }
}

/// The null offset in use, and its error per relative error of the spool's gain. The spool follows its command with a
/// gain of 1, the estimate of this gain rises by `change` (1), and the null is at 0.02.
fn null_by_gain(change: f64) -> [f64; 2] {
    let (windows, bias) = (10_000_u32, 0.02);
    let (mut state, mut evidence) = (CurveState::default(), CurveEvidence::default());
    for n in 0..windows {
        let flow = 0.3 * libm::sin(0.05 * f64::from(n));
        let gain = 1.0 + change * f64::from(n) / f64::from(windows);
        let measured = flow + bias - evidence.sensor - gain * evidence.null;
        // The instrument is the flow.
        let readings = [(flow - measured) / gain, (1.0 - gain) * (flow + bias)];
        let sample = CURVE.sample(&evidence, flow, [measured, gain], readings);
        CURVE.learn(&mut state, &mut evidence, &sample, 1.0, 1.0);
        CURVE.update(&mut state, &mut evidence);
        CURVE.refresh(&mut state, &evidence);
    }
    let [_, per_gain] = CURVE.null_errors(&state, &evidence, 1.0);
    [evidence.null, per_gain]
}

#[test]
fn null_offset_has_the_stated_error_of_a_gain_that_changes() {
    let ([sound, _], [null, per_gain], change) = (null_by_gain(0.0), null_by_gain(0.02), 0.02);
    // The error is less than the stated one, because the first windows are averaged over a shorter time.
    let share = (sound - null) / (per_gain * change);
    assert!((0.6..1.0).contains(&share), "{share}");
}

/// Weight of the prior that a quantity with this standard deviation is zero.
fn weight(evidence: &CurveEvidence<f64>, belief: f64) -> f64 {
    CURVE.mean_square(evidence) * CURVE.correlation / (belief * belief)
}

#[test]
fn asymmetry_is_that_of_least_squares_with_a_prior_of_three_hundredths() {
    let mut learned = Default::default();
    learn(&mut learned, FLOW, [0.9, 1.2], [0.0, 0.0]);
    let (_, evidence) = learned;
    let gain = |gain: f64| {
        let flows = f64::from(WINDOWS) * gain * FLOW * FLOW;
        1.0 + flows * (gain - 1.0) / (flows + weight(&evidence, 0.03))
    };
    let (back, forth) = (gain(0.9), gain(1.2));
    let expected = (forth - back) / (forth + back);
    assert!((0.02..0.1).contains(&expected), "the belief does not count: {expected}");
    assert!((evidence.asymmetry - expected).abs() < 1e-9, "{} {expected}", evidence.asymmetry);
}

#[test]
fn offset_is_that_of_least_squares_with_a_prior_of_a_hundredth() {
    let (slope, offset) = (0.02, 0.05);
    let mut learned = Default::default();
    learn(&mut learned, FLOW, [1.0; 2], [slope, offset]);
    let (_, evidence) = learned;
    let windows = f64::from(WINDOWS);
    let share = windows * FLOW * slope / (windows * FLOW * FLOW + weight(&evidence, 0.03));
    let slopes = 2.0 * windows * slope * (slope - share * FLOW);
    let left = offset * (1.0 - slopes / (slopes + weight(&evidence, 0.01)));
    assert!((0.1..0.9).contains(&(left / offset)), "the belief does not count: {left}");
    assert!((evidence.asymmetry - share * left).abs() < 1e-9, "{} {}", evidence.asymmetry, share * left);
}

#[test]
fn a_known_offset_is_no_error_and_moves_no_node() {
    let offset = 0.05;
    let mut learned = Default::default();
    learn(&mut learned, FLOW, [1.0; 2], [1.0, offset]);
    assert!(CURVE.mean_square(&learned.1) < 0.01 * offset * offset, "{}", CURVE.mean_square(&learned.1));
    let before = learned.1.departures;
    learn(&mut learned, 1.0, [1.0; 2], [1.0, offset]);
    for (after, before) in learned.1.departures.iter().zip(before) {
        assert!((after - before).abs() < 0.1 * offset, "{after} {before}");
    }
}

#[test]
fn without_evidence_the_variances_are_those_of_the_priors() {
    let mut priors = learner().valve.priors;
    priors.spread = [0.02, 0.3];
    let squares = [[4.0, 0.0], [0.0, 9.0]];
    let sums = LeastSquares { matrix: [[0.5, 0.0], [0.0, 0.25]], ..LeastSquares::default() };
    priors.weights = [0.5, 0.75];
    // The priors have a half and three quarters of the weight.
    let [gain, delay] = priors.variances(&sums, &squares, 0.1);
    let square = priors.period * priors.period;
    assert!((gain - (0.4 + 0.25 * 0.02)).abs() < 1e-12, "{gain}");
    assert!((delay / square - (0.9 + 0.5625 * 0.3)).abs() < 1e-12, "{delay}");
    for weights in [[0.0; 2], [1e-7, 1e-6]] {
        priors.weights = weights;
        let [gain, delay] = priors.variances(&LeastSquares::default(), &[[0.0; 2]; 2], 0.1);
        assert!((gain - 0.02).abs() < 1e-12 && (delay / square - 0.3).abs() < 1e-12, "{gain} {delay}");
    }
}

#[test]
fn correlated_regressors_share_their_noise() {
    let mut priors = learner().valve.priors;
    (priors.weights, priors.spread) = ([0.5, 0.75], [0.02, 0.3]);
    // With the priors the matrix is [[4, 1], [2, 3]], and its inverse [[0.3, -0.1], [-0.2, 0.4]].
    let sums = LeastSquares { matrix: [[3.5, 1.0], [2.0, 2.25]], ..LeastSquares::default() };
    // The covariance of the instruments' noise, between this inverse and its transpose: 0.36 - 0.12 + 0.09 and
    // 0.16 - 0.32 + 1.44 on the diagonal. The errors of the priors count by the inverse times their weights.
    let [gain, delay] = priors.variances(&sums, &[[4.0, 2.0], [2.0, 9.0]], 0.1);
    let prior = 0.15 * 0.15 * 0.02 + 0.075 * 0.075 * 0.3;
    assert!((gain - (0.033 + prior)).abs() < 1e-12, "{gain}");
    let prior = 0.1 * 0.1 * 0.02 + 0.3 * 0.3 * 0.3;
    assert!((delay / (priors.period * priors.period) - (0.128 + prior)).abs() < 1e-12, "{delay}");
}

/// Root mean square of a network's output for a sine (rad/s) of an opening.
fn amplitude(network: &LeadNetwork<f64>, frequency: f64) -> f64 {
    let (mut state, mut sum, mut count) = (LeadNetwork::at_rest(0.0), 0.0, 0);
    let end = 12.0 * core::f64::consts::TAU / frequency;
    for n in 0..(end * RIG.sample_rate) as u32 {
        let time = f64::from(n) / RIG.sample_rate;
        let output = network.step(&mut state, libm::sin(frequency * time));
        if time > end / 3.0 {
            (sum, count) = (sum + output * output, count + 1);
        }
    }
    libm::sqrt(sum / f64::from(count))
}

#[test]
fn a_late_velocity_adds_a_lead_without_an_amplitude_at_the_motions_frequency() {
    let (valve, frequency) = (learner().valve, 60.0);
    let found = valve.priors.at_rest();
    let change = frequency * valve.priors.period;
    let sums = LeastSquares { matrix: [[1e3, 0.0], [0.0, 1e3 * change * change]], ..LeastSquares::default() };
    let square = valve.mean_square_frequency(&sums);
    let [prompt, late] =
        [0.0, 10e-3].map(|delay| amplitude(&valve.lead(&found, square, delay, 1.0), frequency));
    assert!((late / prompt - 1.0).abs() < 1e-3, "{late} {prompt}");
}

#[test]
fn a_swing_at_a_tenth_of_a_second_counts_as_its_opening() {
    let gate = learner().gate;
    // The change over a window of an opening of amplitude 1 at 10 rad/s.
    let change = 10.0 * gate.period;
    assert!((gate.change_weight * change * change - 1.0).abs() < 1e-9, "{}", gate.change_weight);
}

#[test]
fn a_load_changes_no_estimate() {
    let p = Parameters { realization: Realization::Analog, ..RIG };
    let table = FlowTable::<f64, 21>::new(p.openings, p.flows).unwrap();
    let channel = Channel::<f64, 21>::new(&p).unwrap();
    let learner = Learner::<f64, 21>::new(&p).unwrap();
    let (mut state, mut memory) = (channel.at_rest(), learner.at_rest());
    let force = 0.3 * p.piston_area * p.supply_pressure;
    let wave = |time: f64| 0.3 * libm::sin(core::f64::consts::TAU * 0.8 * time);
    for tick in 0..20_000_u32 {
        let time = f64::from(tick) / p.sample_rate;
        let spool = wave(time - p.response_delay);
        let root = libm::sqrt(1.0 - 0.3 * spool.signum());
        let flow = table.flow(spool) * root - p.leakage * force / p.piston_area;
        let velocity = flow / p.piston_area;
        let valve_command = wave(time) / p.valve_gain;
        let input = Input { command: force, velocity, force, spool, valve_command, ..Input::default() };
        if let Some(window) = channel.step(&mut state, &input).window {
            channel.publish(&mut state, learner.update(&mut memory, &window));
        }
    }
    let found = state.calibration();
    assert!((found.flow_gain - 1.0).abs() < 0.01 && memory.evidence.amount > 0.0, "{found:?}");
}
