//! The comparison of velocity and displacement in one tick, against its equations.

use super::equations::{
    DISPLACEMENT, PERIOD, VELOCITY, added, before, control, flows, input, near, round, summed,
};
use super::*;
use crate::protection::plausibility::comparisons::MotionSums;

/// Velocity (m/s) by its sensor and by the displacement, low-passed.
fn motions() -> [f64; 2] {
    [0.2 + 0.5 * (0.5 * (VELOCITY + 0.26) - 0.2), 4096.0 * 0.5 * (DISPLACEMENT - 0.009)]
}

#[test]
fn velocity_and_displacement_may_differ_by_a_twentieth() {
    let state = summed(&round(), before());
    let [moved, travelled] = motions();
    let envelope = f64::max(f64::max(moved, travelled), 0.9 * 0.25);
    added("motion", &state.motion.travel, moved - travelled, 0.05 * envelope + 0.017);
}

#[test]
fn a_sum_remembers_the_velocity_at_which_it_was_zero() {
    let [moved, _] = motions();
    let [forwards, backwards] = [0.21, -2.0].map(|speed| speed + 0.375 * (moved - speed));
    let start = |motion: MotionSums<f64>| [motion.travel_start, motion.ratio_start];
    assert_eq!(start(summed(&round(), before()).motion), start(before().motion));
    // The displacement is faster, so the lower side of the sum grows. Backwards it is the upper one of the ratio.
    for (speed, above, below) in [(0.21, forwards, 0.6), (-2.0, 0.5, -backwards)] {
        let mut state = before();
        (state.motion.travel, state.motion.ratio) = (Cusum::default(), Cusum::default());
        state.motion.ratio_velocity = speed;
        let [motion, ratio] = start(summed(&round(), state).motion);
        near("motion", motion.above, moved);
        assert_eq!(motion.below.to_bits(), 0.15_f64.to_bits());
        near("ratio above", ratio.above, above);
        near("ratio below", ratio.below, below);
    }
}

#[test]
fn a_delay_between_velocity_and_displacement_widens_the_limits() {
    let (watch, mut state) = (round(), before());
    (state.motion.travel.above, state.motion.ratio.above) = (1e9, 1e9);
    let state = summed(&watch, state);
    let [moved, _] = motions();
    let speed = 0.21 + 0.375 * (moved - 0.21);
    // The larger change of the two sides.
    near("most", state.motion.travel.above, 2.0 * (92.0 + 0.003 * (moved - 0.1)));
    near("most of the ratio", state.motion.ratio.above, 2.0 * (95.0 + 0.003 * (0.6 - speed)));
}

#[test]
fn the_ratio_counts_the_difference_in_the_direction_of_motion() {
    let [moved, travelled] = motions();
    let speed = 0.21 + 0.375 * (moved - 0.21);
    let difference = 0.04 + 0.375 * (moved - travelled - 0.04);
    // Below 1/0.7 m/s the direction has a smaller weight.
    let state = summed(&round(), before());
    added("slow", &state.motion.ratio, difference * 0.7 * speed, 0.04 * speed + 0.007);
    let state = summed(&Plausibility { per_reversal: 1e3, ..round() }, before());
    added("fast", &state.motion.ratio, difference, 0.04 * speed + 0.007);
    let mut backwards = before();
    backwards.motion.ratio_velocity = -2.0;
    let back = -2.0 + 0.375 * (moved + 2.0);
    let state = summed(&Plausibility { per_reversal: 1e3, ..round() }, backwards);
    added("backwards", &state.motion.ratio, -difference, f64::max(0.05 * -back, 0.04 * -back + 0.007));
}

#[test]
fn the_residual_with_either_motion_tells_which_one_is_wrong() {
    let state = summed(&round(), before());
    let ([moved, travelled], [valve_flow, load_flow, oil]) = (motions(), flows());
    let difference = 0.04 + 0.375 * (moved - travelled - 0.04);
    // Without what the null bias leaves.
    let model = round().valve_flow(&input(), &control());
    let biased = 1.2 * model.root * model.slope * before().opening_offset.null_bias();
    let residual = 0.05 + 0.375 * (load_flow + oil - valve_flow - biased - 0.05);
    // The residual's square with the velocity minus that with the displacement, over twice the area.
    let squares =
        (residual * residual - (residual - 2.0 * difference) * (residual - 2.0 * difference)) / (2.0 * 2.0);
    near("misfit", state.motion.misfit, 0.002 + 0.125 * (squares - 0.002));
    let speed = 0.21 + 0.375 * (moved - 0.21);
    let faster = f64::max(speed.abs(), (speed - difference).abs());
    near("mean square speed", state.motion.mean_square_speed, 0.5 + 0.125 * (faster * faster - 0.5));
}

#[test]
fn after_lost_samples_the_displacement_continues_with_the_velocity() {
    let step = PERIOD * 0.5 * (VELOCITY + 0.26);
    let moved_by_displacement = DISPLACEMENT - 0.0098;
    // Before the first displacement, and after a long gap, the velocity of the motion is not known.
    for (ticks, travelled) in
        [(0, moved_by_displacement), (2, 2.0 * step), (10, 10.0 * step), (11, moved_by_displacement)]
    {
        let mut state = before();
        state.motion.ticks = ticks;
        let filtered = 0.009 + travelled - step;
        let [moved, _] = motions();
        let measured = 4096.0 * 0.5 * (DISPLACEMENT - filtered);
        let envelope = f64::max(f64::max(moved, measured.abs()), 0.9 * 0.25);
        let found = summed(&round(), state);
        added("motion", &found.motion.travel, moved - measured, 0.05 * envelope + 0.017);
        assert_eq!(found.motion.ticks, 1);
        near("last displacement", found.motion.last_displacement, DISPLACEMENT);
    }
}
