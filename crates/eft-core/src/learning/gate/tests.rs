//! What the gate lets through, and with which weight.

use super::*;

const GATE: Gate<f64> = Gate {
    linear_range: 0.9,
    excitation: 1e-6,
    change_weight: 0.0,
    per_square_flow: 1.0,
    average: 0.1,
    threshold: 0.03,
    period: 0.004,
    kept: 1e-5,
    half: 1e-3,
    forgotten: 0.016,
    hold_off: 20,
    settling: 4,
};

#[derive(Default)]
struct Fixture {
    state: GateState<f64>,
    amount: f64,
    forgetting: f64,
}

impl Fixture {
    /// Whether a window counts.
    fn window(&mut self, commanded: f64, spool: f64) -> bool {
        GATE.wait(&mut self.state, 0);
        let flow = FlowSample { measured: commanded, predicted: commanded, ..FlowSample::default() };
        let s = Signals { flow, spool, commanded, commanded_change: 0.0 };
        if GATE.judge(&mut self.state, &s, true) != Verdict::Accepted {
            return false;
        }
        let Weight { time, forgetting } =
            GATE.weight(&mut self.state, &mut self.amount, [spool, commanded], &s);
        self.forgetting = forgetting;
        time > 0.0
    }
}

#[test]
fn only_motion_that_the_models_explain_counts() {
    let mut gate = Fixture::default();
    assert!(gate.state.test_ratio(&GATE) < 1e-12, "without a signal");
    assert!(gate.window(0.1, 0.1));
    assert!(!gate.window(5e-4, 5e-4), "too small");
    assert!(!gate.window(0.95, 0.95), "saturated");
    assert!(gate.window(0.1, 0.1));
}

#[test]
fn a_saturated_command_or_spool_does_not_count() {
    let s = Signals { flow: FlowSample::default(), spool: 0.1, commanded: 0.1, commanded_change: 0.0 };
    for (openings, counts) in [([0.1, 0.1], true), ([0.95, 0.1], false), ([0.1, 0.95], false)] {
        let (mut state, mut amount) = (GateState::default(), 0.0);
        let weight = GATE.weight(&mut state, &mut amount, openings, &s);
        assert_eq!(weight.time > 0.0 && amount > 0.0, counts, "{openings:?}");
    }
}

#[test]
fn a_rejection_is_followed_by_a_hold_off() {
    let mut gate = Fixture::default();
    assert!((0..1000).any(|_| !gate.window(0.1, -0.1)));
    assert!(gate.state.test_ratio(&GATE) > 1.0 && gate.state.is_held_off());
    let waited = (0..200).position(|_| gate.window(0.1, 0.1));
    // Until the average of the errors has decayed, and for the hold-off after that.
    assert!(waited.is_some_and(|n| (19..120).contains(&n)), "{waited:?}");
}

#[test]
fn old_evidence_is_forgotten_only_with_new() {
    let mut gate = Fixture::default();
    for _ in 0..1000 {
        gate.window(0.3, 0.3);
    }
    assert!((gate.forgetting - (1.0 - 0.016)).abs() < 0.01, "{}", gate.forgetting);
    let before = gate.amount;
    for _ in 0..1000 {
        gate.window(0.0, 0.0);
    }
    assert!((gate.amount - before).abs() < 1e-15);
}

#[test]
fn the_first_evidence_is_kept_and_half_of_the_forgetting_is_reached_at_the_stated_amount() {
    let s = Signals { flow: FlowSample::default(), spool: 0.1, commanded: 0.1, commanded_change: 0.0 };
    let forgetting = |amount: f64| {
        let (mut state, mut amount) = (GateState::default(), amount);
        GATE.weight(&mut state, &mut amount, [0.1; 2], &s).forgetting
    };
    assert!((forgetting(0.9 * GATE.kept) - 1.0).abs() < 1e-15);
    // The evidence that is kept is 1 % of this amount.
    assert!((forgetting(GATE.half) - (1.0 - 0.008)).abs() < 1e-4, "{}", forgetting(GATE.half));
    assert!((forgetting(1e3 * GATE.half) - (1.0 - 0.016)).abs() < 1e-4, "{}", forgetting(1e3 * GATE.half));
}

/// A gate whose averages are those of the last window.
const PROMPT: Gate<f64> = Gate {
    excitation: 0.25,
    change_weight: 4.0,
    per_square_flow: 3.0,
    average: 1.0,
    threshold: 0.25,
    hold_off: 7,
    ..GATE
};

fn near(what: &str, found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{what}: {found:e}, not {expected:e}");
}

/// Signals of an unexplained flow and a measured flow, without an opening.
fn flows(residual: f64, measured: f64) -> Signals<f64> {
    let flow = FlowSample { residual, measured, ..FlowSample::default() };
    Signals { flow, spool: 0.0, commanded: 0.0, commanded_change: 0.0 }
}

#[test]
fn a_hold_off_ends_a_window_earlier_but_not_before_the_least() {
    for (before, least, after) in
        [(5, 0, 4), (1, 0, 0), (0, 0, 0), (5, 3, 4), (5, 4, 4), (5, 9, 9), (0, 2, 2)]
    {
        let mut state = GateState::<f64> { hold_off: before, ..GateState::default() };
        GATE.wait(&mut state, least);
        assert_eq!(state.hold_off, after, "{before}, at least {least}");
        assert_eq!(state.is_held_off(), after > 0);
    }
}

#[test]
fn error_and_signal_are_sums_of_the_squares_of_flows_and_openings() {
    let gate = Gate { average: 0.25, ..PROMPT };
    let mut state = GateState { error: 2.0, signal: 5.0, ..GateState::default() };
    let flow = FlowSample { measured: 0.7, predicted: 0.4, residual: 0.6, delay_regressor: 9.0 };
    let s = Signals { flow, spool: 0.5, commanded: 0.8, commanded_change: 9.0 };
    gate.judge(&mut state, &s, true);
    // Flows count as the openings that pass them.
    near("error", state.error, 0.75 * 2.0 + 0.25 * (3.0 * 0.36 + 0.09));
    near("signal", state.signal, 0.75 * 5.0 + 0.25 * (3.0 * (0.49 + 0.16) + 0.25 + 0.64));
    near("test ratio", state.test_ratio(&gate), state.error / (0.25 * state.signal));
}

#[test]
fn a_test_ratio_of_one_is_accepted() {
    let verdict = |residual: f64| PROMPT.judge(&mut GateState::default(), &flows(residual, 2.0), true);
    assert_eq!(verdict(1.0), Verdict::Accepted);
    assert_eq!(verdict(1.001), Verdict::Rejected { learned: false });
}

#[test]
fn after_a_rejection_a_test_ratio_of_one_half_is_rejected_until_something_is_learned() {
    let verdict = |residual: f64, cautious: bool| {
        let mut state = GateState { cautious, ..GateState::default() };
        PROMPT.judge(&mut state, &flows(residual, 2.0), true)
    };
    for (residual, cautious, accepted) in [(0.7, true, true), (0.72, true, false), (0.72, false, true)] {
        assert_eq!(verdict(residual, cautious) == Verdict::Accepted, accepted, "{residual} {cautious}");
    }
    let (mut state, s) = (GateState { cautious: true, ..GateState::default() }, flows(0.0, 2.0));
    PROMPT.weight(&mut state, &mut 0.0, [0.1; 2], &Signals { commanded: 0.6, ..s });
    assert!(state.learned && !state.cautious);
}

#[test]
fn a_rejection_holds_off_and_reports_once_that_something_was_learned() {
    for learned in [true, false] {
        let mut state = GateState { learned, ..GateState::default() };
        assert_eq!(PROMPT.judge(&mut state, &flows(2.0, 2.0), true), Verdict::Rejected { learned });
        assert_eq!((state.hold_off, state.learned, state.cautious), (7, false, true));
    }
}

#[test]
fn nothing_is_judged_while_held_off_or_unusable() {
    for (hold_off, usable) in [(1, true), (0, false), (1, false)] {
        for residual in [0.0, 2.0] {
            let mut state = GateState { hold_off, ..GateState::default() };
            assert_eq!(PROMPT.judge(&mut state, &flows(residual, 2.0), usable), Verdict::Passed);
            assert_eq!(state.hold_off, hold_off);
        }
    }
}

#[test]
fn a_signal_of_three_times_the_excitation_may_be_noise() {
    let gate = Gate { per_square_flow: 1.0, ..PROMPT };
    // The square of 1.5 is nine times the excitation.
    for (measured, expected) in [(1.5, Verdict::Passed), (1.51, Verdict::Rejected { learned: false })] {
        let mut state = GateState::default();
        assert_eq!(gate.judge(&mut state, &flows(3.0, measured), true), expected, "{measured}");
        assert_eq!(state.is_held_off(), expected != Verdict::Passed);
    }
}

#[test]
fn without_a_signal_the_test_ratio_is_zero() {
    let silent = GateState { error: 1.0, ..GateState::<f64>::default() };
    assert_eq!(silent.test_ratio(&PROMPT).to_bits(), 0);
    let faint = GateState { error: 1.0, signal: 0.1, ..silent };
    near("test ratio", faint.test_ratio(&PROMPT), 40.0);
}

/// The weight (s) of a window with this opening, its change, and the openings before the filters.
fn weight([commanded, commanded_change]: [f64; 2], openings: [f64; 2]) -> f64 {
    let s = Signals { commanded, commanded_change, ..flows(0.0, 0.0) };
    let Weight { time, forgetting } = PROMPT.weight(&mut GateState::default(), &mut 0.0, openings, &s);
    near("share of no evidence", forgetting, 1.0);
    time
}

#[test]
fn an_opening_or_its_rate_must_exceed_the_excitation() {
    // The change counts twice as much as the opening.
    for (commanded, counts) in [
        ([0.5, 0.0], false),
        ([0.51, 0.0], true),
        ([0.0, 0.25], false),
        ([0.0, -0.26], true),
        ([0.3, 0.2], false),
        ([0.3, 0.21], true),
    ] {
        near("weight", weight(commanded, [0.1; 2]), if counts { 0.004 } else { 0.0 });
    }
}

#[test]
fn either_opening_at_the_end_of_the_linear_range_does_not_count() {
    for (openings, counts) in [
        ([0.89, -0.89], true),
        ([0.9, 0.1], false),
        ([0.1, 0.9], false),
        ([-0.9, 0.1], false),
        ([0.1, -0.9], false),
    ] {
        near("weight", weight([0.6, 0.0], openings), if counts { 0.004 } else { 0.0 });
    }
}

#[test]
fn evidence_above_the_kept_one_is_forgotten_in_proportion() {
    let gate = Gate { kept: 0.5, half: 2.0, forgotten: 0.1, ..PROMPT };
    let s = Signals { commanded: 0.6, ..flows(0.0, 0.0) };
    for (before, forgetting) in
        [(0.4, 1.0), (0.5, 1.0), (1.5, 1.0 - 0.1 * 1.0 / 3.5), (4.0, 1.0 - 0.1 * 3.5 / 6.0)]
    {
        let mut amount = before;
        let weight = gate.weight(&mut GateState::default(), &mut amount, [0.1; 2], &s);
        near("weight", weight.time, 0.004);
        near("share", weight.forgetting, forgetting);
        near("evidence", amount, forgetting * before + 0.36 * 0.004);
    }
}
