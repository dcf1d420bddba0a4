//! What an update decides: restarts, hold-offs, means, checkpoints, and the calibration's flags.

use super::*;
use crate::compensation::Calibration;
use crate::learning::checkpoint::Checkpoints;
use crate::status;

/// Alternating motions, and a third one.
const HIGH: Means = Means { velocity: 0.5, force: 0.0, spool: 0.5, valve_command: 0.5, command: 0.0 };
const LOW: Means = Means { spool: 0.25, ..HIGH };

/// A learner with slow filters, which a restart sets at once.
fn slow() -> Learner<f64, 3> {
    let mut learner = learner(false);
    learner.filter.low_pass = 0.25;
    learner
}

/// Whether a window restarts the filters after two windows, of which the second may lack samples.
fn restarts(number: u32, lost_before: u32, lost: u32) -> bool {
    let (learner, mut state) = (slow(), slow().at_rest());
    learner.update(&mut state, &window(4, LOW));
    learner.update(&mut state, &Window { lost: lost_before, ..window(5, HIGH) });
    learner.update(&mut state, &Window { lost, ..window(number, Means { spool: 0.75, ..HIGH }) });
    // In a steady state both low-passes are equal.
    let [first, second, _] = state.filters.spool.parts();
    (first - second).abs() < 1e-12
}

#[test]
fn filters_continue_only_from_the_last_window_to_the_next() {
    for (number, lost_before, lost, restart) in [
        (6, 0, 0, false),
        (7, 0, 0, true),
        (5, 0, 0, true),
        (6, 1, 0, true),
        (6, 0, 1, true),
        (7, 1, 2, true),
    ] {
        assert_eq!(restarts(number, lost_before, lost), restart, "{number} {lost_before} {lost}");
    }
}

#[test]
fn at_rest_nothing_was_seen() {
    let rest = learner(true).at_rest();
    assert_eq!((rest.filters, rest.means), Default::default());
    assert_eq!(rest.flows.map(f64::to_bits), [0; 2]);
    assert_eq!([rest.number, rest.since_checkpoint, rest.since_start], [0; 3]);
    assert_eq!((rest.evidence, rest.checkpoints), Default::default());
    // The first window is the whole mean.
    assert_eq!([rest.share, rest.mean_share].map(f64::to_bits), [1.0_f64.to_bits(); 2]);
}

#[test]
fn the_number_of_the_next_window_wraps() {
    let (learner, mut state) = (slow(), slow().at_rest());
    for number in [u32::MAX, 0] {
        learner.update(&mut state, &window(number, HIGH));
    }
    near("share of the second window", state.share, 0.5);
}

#[test]
fn the_first_window_is_a_steady_state_and_the_mean() {
    let state = after(&slow(), &[HIGH]);
    for (filter, expected) in [
        (state.filters.spool, HIGH.spool),
        (state.filters.asked, 0.5 * HIGH.valve_command),
        (state.filters.predicted, HIGH.spool * GREATEST),
        (state.filters.flow, 2.0 * HIGH.velocity),
    ] {
        assert_eq!(filter.parts().map(f64::to_bits), [expected.to_bits(); 3]);
    }
}

#[test]
fn means_are_those_of_all_windows() {
    for windows in 1..=5_u8 {
        let state = after(&slow(), &[HIGH; 5][..windows.into()]);
        near("share", state.share, 1.0 / f64::from(windows));
    }
}

/// After a window with losses, of a rig that starts with whole windows.
fn hold_off(whole: usize, lost: u32, lost_commands: u32, learner: &Learner<f64, 3>) -> LearnerState<f64> {
    let mut state = after(learner, &[HIGH; 8][..whole]);
    assert!(!state.gate.is_held_off());
    learner.update(&mut state, &Window { lost, lost_commands, ..window(whole as u32, HIGH) });
    state
}

#[test]
fn lost_samples_hold_off_after_the_first_three_windows() {
    let learner = slow();
    for (whole, held) in [(0, false), (1, false), (2, false), (3, true), (4, true)] {
        let state = hold_off(whole, 1, 0, &learner);
        assert_eq!(state.gate.is_held_off(), held, "after {whole} windows");
        // Distrusted measurements do not enter the means.
        assert_eq!(state.share.to_bits() == 0, held, "after {whole} windows");
    }
    assert!(!hold_off(4, 0, 0, &learner).gate.is_held_off());
}

#[test]
fn lost_valve_commands_hold_off_at_once_if_the_valve_is_estimated() {
    assert!(hold_off(1, 0, 1, &slow()).gate.is_held_off());
    let learning = Learning { guard: true, ..Learning::OFF };
    let guard = Learner::<f64, 3>::new(&Parameters { learning, ..RIG }).unwrap();
    assert!(!hold_off(1, 0, 1, &guard).gate.is_held_off());
}

#[test]
fn a_hold_off_is_flagged_as_frozen_adaptation() {
    let learner = slow();
    let calibration = |state: &LearnerState<f64>| learner.calibration(state, 0, 0.0);
    let flagged = |state: &LearnerState<f64>| calibration(state).status & status::ADAPTATION_FROZEN != 0;
    assert!(flagged(&hold_off(4, 1, 0, &learner)));
    assert!(!flagged(&hold_off(4, 0, 0, &learner)));
    // A guard alone has nothing to freeze.
    let learning = Learning { guard: true, ..Learning::OFF };
    let guard = Learner::<f64, 3>::new(&Parameters { learning, ..RIG }).unwrap();
    let held = hold_off(4, 1, 0, &guard);
    assert!(held.gate.is_held_off());
    assert_eq!(guard.calibration(&held, 0, 0.0).status, 0);
}

#[test]
fn only_whole_windows_of_a_learner_that_adapts_are_rejected() {
    // A spool that does not follow, whose error the gate's averages remember.
    let wrong = [Means::default(), Means { spool: -0.5, ..HIGH }];
    let with = |adapts: bool, threshold: f64| {
        let mut learner = slow();
        (learner.adapts, learner.gate.threshold) = (adapts, threshold);
        learner
    };
    for (adapts, lost, rejected) in [(true, 0, true), (true, 1, false), (false, 0, false), (false, 1, false)]
    {
        let mut state = after(&with(adapts, 1e9), &wrong);
        with(adapts, 0.0).update(&mut state, &Window { lost, ..window(2, wrong[1]) });
        assert_eq!(state.gate.is_held_off(), rejected, "{adapts} {lost}");
    }
}

/// After a rejection that follows windows of a sound motion, or nothing.
fn rejected(learned: bool) -> LearnerState<f64> {
    let mut accepting = slow();
    (accepting.gate.threshold, accepting.gate.excitation) = (1e9, if learned { -1.0 } else { 1e9 });
    let mut state = after(&accepting, &[Means::default(), HIGH, LOW]);
    let mut rejecting = slow();
    rejecting.gate.threshold = 0.0;
    rejecting.update(&mut state, &window(3, HIGH));
    assert!(state.gate.is_held_off());
    state
}

#[test]
fn the_means_go_on_after_a_second_rejection_without_learning() {
    let state = rejected(true);
    assert_eq!(state.share.to_bits(), 0);
    let state = rejected(false);
    near("share", state.share, 0.25);
}

#[test]
fn a_checkpoint_is_made_at_its_interval() {
    let (learner, mut state) = (learner(false), learner(false).at_rest());
    state.evidence.amount = 5.0;
    // 0.2 s are 51.2 windows.
    for windows in 1..=104_u32 {
        learner.save_checkpoint(&mut state);
        let none = state.checkpoints == Checkpoints::default();
        let both = state.checkpoints == Checkpoints::of(&state.evidence);
        assert_eq!([none, both], [windows < 52, windows >= 104], "{windows}");
    }
}

#[test]
fn flags_report_a_lower_level_and_estimates_at_their_bounds() {
    let learner = learner(true);
    let rest = learner.at_rest();
    let status = |state: &LearnerState<f64>| learner.calibration(state, 0, 0.0).status;
    assert_eq!(status(&rest), 0);
    let mut lower = rest;
    lower.guard.level = 0.999;
    assert_eq!(status(&lower), status::LEVEL_REDUCED);
    for n in 0..5 {
        let mut state = rest;
        let beyond = match n {
            0 => &mut state.flow.gain.beyond,
            1 => &mut state.flow.delay.beyond,
            2 => &mut state.valve.found.gain.beyond,
            3 => &mut state.valve.found.delay.beyond,
            _ => &mut state.curve.beyond,
        };
        *beyond = 1e-3;
        assert_eq!(status(&state), status::ESTIMATE_BOUNDED, "{n}");
    }
}

#[test]
fn a_calibration_has_the_estimates() {
    let (learner, mut state) = (learner(true), learner(true).at_rest());
    (state.flow.gain.value, state.flow.delay.value) = (1.25, 3e-3);
    (state.valve.found.gain.value, state.valve.found.delay.value) = (0.8, 7e-3);
    (state.evidence.curve.null, state.guard.level) = (0.03, 0.9);
    let c = learner.calibration(&state, 77, 0.0);
    assert_eq!(c.window, 77);
    near("flow gain", c.flow_gain, 1.25);
    near("its reciprocal", c.per_flow_gain, 0.8);
    near("velocity delay", c.velocity_delay, 3e-3);
    near("valve gain", c.valve_gain, 0.8);
    near("response delay", c.response_delay, 7e-3);
    near("null offset", c.null_offset, 0.03);
    // The force loop turns 1 V of compensation into G_p·K_s of opening.
    let opening_per_volt = RIG.proportional_gain * RIG.valve_gain;
    near("null signal", c.null_signal, 0.03 / opening_per_volt);
    near("level", c.level, 0.9);
    near("gain of the lead network", c.lead.gain(), 0.9 / opening_per_volt / 0.8);
}

/// The same motion of valves whose nulls are known and apart: what is learned and added is the same beyond the null.
#[test]
fn a_known_null_bias_is_where_learning_starts() {
    let rig = Parameters { learning: Learning { curve_correction: true, ..Learning::ADAPTIVE }, ..RIG };
    for null_bias in [-0.3, 0.02] {
        let plain = Learner::<f64, 3>::new(&rig).unwrap();
        let known = Learner::<f64, 3>::new(&Parameters { null_bias, ..rig }).unwrap();
        let (mut before, mut state) = (plain.at_rest(), known.at_rest());
        let first = known.calibration(&state, 0, 0.0);
        let nominal = Calibration::<f64>::nominal(&Parameters { null_bias, ..rig }).unwrap();
        assert_eq!((first.null_offset, first.null_signal), (nominal.null_offset, nominal.null_signal));
        let mut learned = 0.0_f64;
        for number in 0..4000_u32 {
            let opening = 0.2 * libm::sin(0.1 * f64::from(number));
            // Its true null is another 0.01 away.
            let velocity = plain.model.at_no_load(opening - 0.01) / rig.piston_area;
            let window = |null: f64| {
                let (spool, valve_command) = (opening + null, (opening + null) / rig.valve_gain);
                window(number, Means { velocity, spool, valve_command, ..Means::default() })
            };
            let like = plain.update(&mut before, &window(0.0));
            let found = known.update(&mut state, &window(null_bias));
            near("null offset", found.null_offset, like.null_offset + null_bias);
            near("null signal", found.null_signal, like.null_signal + nominal.null_signal);
            near("flow gain", found.flow_gain, like.flow_gain);
            learned = like.null_offset;
        }
        assert!(learned > 0.002, "{learned}");
    }
}

/// A spool near its stop is far from the stop as seen from a null that is on the same side.
#[test]
fn nothing_is_learned_near_a_stop_whatever_the_null() {
    let rig = Parameters { learning: Learning::ADAPTIVE, ..RIG };
    for (null_bias, middle, learns) in [
        (0.0, 0.7, true),
        (0.0, 0.95, false),
        (0.2, 0.6, true),
        (0.2, 0.95, false),
        (-0.2, -0.6, true),
        (-0.2, -0.95, false),
    ] {
        let learner = Learner::<f64, 3>::new(&Parameters { null_bias, ..rig }).unwrap();
        let mut state = learner.at_rest();
        let mut deviation = f64::INFINITY;
        for number in 0..2000_u32 {
            let spool = middle + 0.03 * libm::sin(0.1 * f64::from(number));
            let velocity = learner.model.at_no_load(spool - null_bias) / rig.piston_area;
            let valve_command = spool / rig.valve_gain;
            let means = Means { velocity, spool, valve_command, ..Means::default() };
            deviation = learner.update(&mut state, &window(number, means)).deviations.valve_gain;
        }
        assert_eq!(deviation.is_finite(), learns, "{null_bias} {middle}: {deviation}");
    }
}

#[test]
fn a_guard_alone_keeps_the_configured_network() {
    let learning = Learning { guard: true, ..Learning::OFF };
    let guard = Learner::<f64, 3>::new(&Parameters { learning, ..RIG }).unwrap();
    let mut state = guard.at_rest();
    (state.guard.level, state.flow.delay.value) = (0.9, 3e-3);
    let c = guard.calibration(&state, 0, 0.0);
    near("gain", c.lead.gain(), 0.9 * guard.lead.gain());
    near("pole", c.lead.pole(), guard.lead.pole());
    near("rate", c.lead.rate(), guard.lead.rate());
    near("velocity delay", c.velocity_delay, 0.0);
}

#[test]
fn without_a_correction_the_null_offset_is_unknown() {
    let mut learner = learner(false);
    learner.gate.threshold = 1e9;
    let state = after(&learner, &[Means::default(), HIGH, LOW, HIGH, LOW]);
    assert!(state.deviations.flow_gain.is_finite() && state.deviations.valve_gain.is_finite());
    assert!(state.deviations.null_offset.is_infinite());
}
