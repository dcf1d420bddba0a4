//! The comparison of velocity and displacement in one tick, against its equations.

use super::equations::{
    DISPLACEMENT, PERIOD, VELOCITY, added, before, flows, input, known, near, round, summed,
};
use super::*;
use crate::protection::plausibility::comparisons::Motion;

/// Velocity (m/s) by its sensor and by the displacement, low-passed.
fn motions() -> [f64; 2] {
    [0.2 + 0.5 * (0.5 * (VELOCITY + 0.26) - 0.2), 4096.0 * 0.5 * (DISPLACEMENT - 0.009)]
}

#[test]
fn velocity_and_displacement_may_differ_by_a_twentieth() {
    let state = summed(&round(), before());
    let [moved, travelled] = motions();
    let seen = f64::max(f64::max(moved, travelled), 0.9 * 0.25);
    added("motion", &state.motion.travel, moved - travelled, 0.05 * seen + 0.017);
}

#[test]
fn a_sum_remembers_the_velocity_at_which_it_was_zero() {
    let [moved, _] = motions();
    let [forwards, backwards] = [0.21, -2.0].map(|speed| speed + 0.375 * (moved - speed));
    let began = |motion: Motion<f64>| [motion.travel_began, motion.ratio_began];
    assert_eq!(began(summed(&round(), before()).motion), began(before().motion));
    // The displacement is faster, so the lower side of the sum grows. Backwards it is the upper one of the ratio.
    for (speed, above, below) in [(0.21, forwards, 0.6), (-2.0, 0.5, -backwards)] {
        let mut state = before();
        (state.motion.travel, state.motion.ratio) = (Sum::default(), Sum::default());
        state.motion.fine_velocity = speed;
        let [motion, ratio] = began(summed(&round(), state).motion);
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
    let off = 0.04 + 0.375 * (moved - travelled - 0.04);
    // Below 1/0.7 m/s the direction has a smaller weight.
    let state = summed(&round(), before());
    added("slow", &state.motion.ratio, off * 0.7 * speed, 0.04 * speed + 0.007);
    let state = summed(&Plausibility { per_reversal: 1e3, ..round() }, before());
    added("fast", &state.motion.ratio, off, 0.04 * speed + 0.007);
    let mut turned = before();
    turned.motion.fine_velocity = -2.0;
    let back = -2.0 + 0.375 * (moved + 2.0);
    let state = summed(&Plausibility { per_reversal: 1e3, ..round() }, turned);
    added("backwards", &state.motion.ratio, -off, f64::max(0.05 * -back, 0.04 * -back + 0.007));
}

#[test]
fn the_residual_with_either_motion_tells_which_one_is_wrong() {
    let state = summed(&round(), before());
    let ([moved, travelled], [passed, taken, oil]) = (motions(), flows());
    let off = 0.04 + 0.375 * (moved - travelled - 0.04);
    // Without what the null bias leaves.
    let model = round().valve_flow(&input(), &known());
    let biased = 1.2 * model.root * model.slope * before().missing.null_bias();
    let residual = 0.05 + 0.375 * (taken + oil - passed - biased - 0.05);
    // The residual's square with the velocity minus that with the displacement, over twice the area.
    let difference = (residual * residual - (residual - 2.0 * off) * (residual - 2.0 * off)) / (2.0 * 2.0);
    near("worse", state.motion.worse, 0.002 + 0.125 * (difference - 0.002));
    let speed = 0.21 + 0.375 * (moved - 0.21);
    let faster = f64::max(speed.abs(), (speed - off).abs());
    near("swept", state.motion.swept, 0.5 + 0.125 * (faster * faster - 0.5));
}

#[test]
fn after_lost_samples_the_displacement_continues_with_the_velocity() {
    let mut state = before();
    state.motion.goes_on = false;
    let travelled = DISPLACEMENT - 0.0098 - PERIOD * 0.5 * (VELOCITY + 0.26);
    let low = 0.009 + travelled;
    let [moved, _] = motions();
    let seen = f64::max(f64::max(moved, 4096.0 * 0.5 * (DISPLACEMENT - low)), 0.9 * 0.25);
    let found = summed(&round(), state);
    let residual = moved - 4096.0 * 0.5 * (DISPLACEMENT - low);
    added("motion", &found.motion.travel, residual, 0.05 * seen + 0.017);
    assert!(found.motion.goes_on);
    near("last displacement", found.motion.last_displacement, DISPLACEMENT);
}
