//! What the guard measures, and when it changes the level.

use super::*;

const GUARD: Guard<f64> = Guard {
    per_added_damping: 1e-5,
    force_per_flow: 0.0,
    fed_forward: 1.0,
    integrated: 0.0,
    low_pass: 0.1,
    average: 0.02,
    slow_average: 0.005,
    quiet: 1e-6,
    tolerated: 0.01,
    correction: 0.01,
    lowest: 0.5,
};

#[test]
fn a_step_rises_through_two_low_passes() {
    let mut filter = LowPass::default();
    // Each goes half of the way to its input.
    for (first, second) in [(0.5, 0.25), (0.75, 0.5), (0.875, 0.6875)] {
        filter = filter.after(1.0_f64, 0.5);
        let off = (filter.first - first).abs() + (filter.second - second).abs();
        assert!(off < 1e-12, "{filter:?}");
    }
}

/// The level after a growing swing of 160 windows a period, with this error (N per m/s) in phase with the velocity or a
/// quarter of a period later.
fn level(in_phase: f64, behind: f64) -> f64 {
    let mut state = GuardState::default();
    for n in 0..640_u32 {
        let t = f64::from(n);
        let (sin, cos) = (t * core::f64::consts::TAU / 160.0).sin_cos();
        let size = 0.1 * (t / 200.0).exp();
        let error = size * (in_phase * sin - behind * cos);
        GUARD.observe(&mut state, error, 0.0, size * sin);
        GUARD.act(&mut state);
    }
    state.level
}

#[test]
fn only_overcompensation_lowers_the_level() {
    // An overcompensation of 5 %.
    assert!(level(5e3, 0.0) < 0.97);
    for (in_phase, behind) in [(0.0, 0.0), (-5e3, 0.0), (5e2, 0.0), (0.0, 5e3)] {
        assert!((level(in_phase, behind) - 1.0).abs() < 1e-12, "{in_phase} {behind}");
    }
    assert!((level(1e9, 0.0) - GUARD.lowest).abs() < 1e-12);
}

fn near(what: &str, found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{what}: {found:e}, not {expected:e}");
}

/// A state without a zero.
fn state() -> GuardState<f64> {
    GuardState {
        error: LowPass { first: 3.0, second: 4.0 },
        velocity: LowPass { first: 0.5, second: 0.3 },
        integral: 0.8,
        mean_error: 1.5,
        pumped: 2.0,
        squares: 0.7,
        slow_squares: 0.6,
        level: 0.9,
    }
}

#[test]
fn the_guard_averages_the_power_of_the_error_and_the_square_of_the_velocity() {
    let guard = Guard { force_per_flow: 8.0, low_pass: 0.5, average: 0.25, slow_average: 0.125, ..GUARD };
    let mut now = state();
    guard.observe(&mut now, 6.0, -0.25, 0.9);
    // The flow that was not demanded makes an error of 8 N per m³/s. Each low-pass goes half of the way.
    let error = 6.0 + tuning::KEPT * 0.8 - 2.0;
    near("error", now.error.first, 0.5 * (3.0 + error));
    near("error", now.error.second, 0.5 * (4.0 + 0.5 * (3.0 + error)));
    near("velocity", now.velocity.second, 0.5 * (0.3 + 0.7));
    let (error, velocity) = (now.error.second - 1.5, 0.5);
    near("power", now.pumped, 0.75 * 2.0 + 0.25 * error * velocity);
    near("square", now.squares, 0.75 * 0.7 + 0.25 * velocity * velocity);
    near("slow square", now.slow_squares, 0.875 * 0.6 + 0.125 * velocity * velocity);
    near("level", now.level, 0.9);
}

#[test]
fn an_error_that_the_integral_part_removed_counts_as_one_without_it() {
    let (corner, period) = (60.0, 0.01);
    let guard = Guard { low_pass: 1.0, integrated: corner * period, ..GUARD };
    let mut now = GuardState::default();
    // A swing of 0.1 rad in a step behind an integral part, whose high-pass is `1 - 1/(1 + corner/(jω))`.
    let (mut removed, mut rest) = (0.0, 0.0);
    for step in 0..1000 {
        let disturbance = f64::sin(0.1 * f64::from(step));
        rest = (disturbance - removed) / (1.0 + corner * period);
        removed += corner * period * rest;
        guard.observe(&mut now, rest, 0.0, 0.9);
        // Less what is forgotten.
        assert!((now.error.second - disturbance).abs() < 0.01, "{step}: {}", now.error.second);
    }
    assert!(rest.abs() < 0.2);
}

#[test]
fn the_mean_error_follows_the_filtered_one() {
    let mut now = state();
    GUARD.follow_offset(&mut now, 0.2);
    near("mean", now.mean_error, 1.5 + 0.2 * (4.0 - 1.5));
}

/// The level after one window with this overcompensation (1), from a level. The slow average of the squared velocity is
/// `slow` times the quick one.
fn after(over: f64, level: f64, slow: f64) -> f64 {
    let guard = Guard { per_added_damping: 0.5, quiet: 0.2, ..GUARD };
    let squares = 0.7;
    let pumped = over * (squares + 0.2) / 0.5;
    let mut now = GuardState { pumped, squares, slow_squares: slow * squares, level, ..state() };
    guard.act(&mut now);
    now.level
}

#[test]
fn a_window_removes_a_share_of_the_overcompensation() {
    near("growing", after(0.05, 1.0, 0.5), 1.0 - 0.01 * 0.05);
    near("once begun", after(0.05, 0.9, 2.0), 0.9 - 0.01 * 0.05);
    near("undercompensation", after(-0.05, 0.9, 2.0), 0.9 + 0.01 * 0.05);
    near("at most full", after(-3.0, 0.99, 0.5), 1.0);
    near("at least half", after(60.0, 0.9, 0.5), 0.5);
}

#[test]
fn the_guard_begins_above_the_tolerance_if_the_motion_grows() {
    for (over, slow, acts) in [
        (0.011, 0.5, true),
        (0.0099, 0.5, false),
        (0.011, 1.0, false),
        (0.011, 2.0, false),
        (-0.5, 0.5, false),
    ] {
        assert_eq!(after(over, 1.0, slow) < 1.0, acts, "{over} {slow}");
    }
}

#[test]
fn a_quiet_motion_changes_no_level() {
    for (squares, acts) in [(0.5, false), (0.499, false), (0.501, true)] {
        let guard = Guard { per_added_damping: 1.0, quiet: 0.5, ..GUARD };
        let mut now = GuardState { squares, ..state() };
        guard.act(&mut now);
        assert_eq!(now.level < 0.9, acts, "{squares}");
    }
}

#[test]
fn at_rest_the_guard_has_seen_nothing() {
    let GuardState { error, velocity, integral, mean_error, pumped, squares, slow_squares, level } =
        GuardState::<f64>::default();
    assert_eq!([integral, mean_error, pumped, squares, slow_squares].map(f64::to_bits), [0; 5]);
    assert_eq!([error, velocity], [LowPass::default(); 2]);
    near("level", level, 1.0);
}
