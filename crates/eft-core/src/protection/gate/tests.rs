//! The gate with readings of known noise, and its equations.

use super::*;

fn gate() -> SensorGate<f64> {
    SensorGate {
        tolerance: [1.0; 4],
        displacement_tolerance: 0.0,
        tolerance_growth: 0.0,
        friction_jump: 0.0,
        reversal_velocity: 0.0,
        still_change: [0.1; 4],
        liveliness_gain: 1e-2,
        still_probability: 1e-10,
        slope_gain: 0.1,
        confirmations: 6,
    }
}

#[test]
fn a_spike_is_lost_and_a_step_stays_lost() {
    let gate = gate();
    let mut signal = Signal::default();
    let mut pass = |reading: f64| gate.accept(&mut signal, 1.0, 0.0, reading);
    // The first reading may be anything.
    assert!((pass(50.0) - 50.0).abs() < 1e-12);
    for n in 1..200 {
        let reading = 50.0 + 0.5 * f64::from(n);
        assert!((pass(reading) - reading).abs() < 1e-12, "{n}");
    }
    assert!(pass(-50.0).is_nan() && pass(f64::NAN).is_nan());
    // After two lost readings the slope is still known.
    assert!((pass(151.0) - 151.0).abs() < 1e-12);
    for _ in 0..20 {
        assert!(pass(-150.0).is_nan());
    }
    assert_eq!((signal.lost, signal.jumped), (20, true));
}

#[test]
fn a_reading_stands_at_the_third_repetition_of_a_lively_sensor_that_moved() {
    let gate = gate();
    let moving = Signal {
        last: 2.0,
        slope: 0.51,
        liveliness: 0.8,
        repeats: 2,
        has_reading: true,
        ..Signal::default()
    };
    let is_stuck = |signal: Signal<f64>, reading: f64| gate.is_stuck(&signal, 0.01, reading);
    assert!(is_stuck(moving, 2.0) && is_stuck(Signal { slope: -0.51, ..moving }, 2.0));
    assert!(!is_stuck(moving, 2.001) && !is_stuck(moving, f64::NAN));
    // For the second time, slow, or without noise.
    for other in [
        Signal { repeats: 1, ..moving },
        Signal { slope: 0.49, ..moving },
        Signal { liveliness: 0.7, ..moving },
    ] {
        assert!(!is_stuck(other, 2.0), "{other:?}");
    }
}

/// Of a ramp that crosses zero at reading 100, with other readings within some: the first refused reading, the number
/// of refused ones, and of those in a row at the end.
fn refused(slope: f64, other: impl Fn(i32, f64) -> f64) -> (Option<i32>, usize, u32) {
    let (gate, mut signal) = (gate(), Signal::default());
    let mut refuses =
        |n: i32| gate.accept(&mut signal, 1.0, 0.0, other(n, slope * f64::from(n - 100))).is_nan();
    let first = (0..120).find(|&n| refuses(n));
    let further = first.map_or(0, |first| (first + 1..120).filter(|&n| refuses(n)).count());
    (first, usize::from(first.is_some()) + further, signal.lost)
}

#[test]
fn several_readings_that_jumped_must_return_for_longer_than_a_quick_reversal_lasts() {
    let wrong = |range: core::ops::Range<i32>| {
        move |n: i32, reading: f64| if range.contains(&n) { -reading } else { reading }
    };
    // Two outliers are only held. Three are followed by as many held readings as must return.
    assert_eq!(refused(0.2, wrong(50..52)), (Some(50), 2, 0));
    assert_eq!(refused(0.2, wrong(50..53)), (Some(50), 9, 0));
    // The wrong sign agrees with the prediction near the reversal only.
    assert_eq!(refused(0.2, wrong(92..120)), (Some(92), 28, 28));
    // It agrees for longer near a slower one, and is then small.
    assert_eq!(refused(0.05, wrong(86..120)), (Some(86), 11, 0));
}

#[test]
fn a_lost_reading_is_no_jump_and_does_not_end_several() {
    let lost = |lost: core::ops::Range<i32>, jumped: core::ops::Range<i32>| {
        move |n: i32, reading: f64| {
            if lost.contains(&n) {
                f64::NAN
            } else if jumped.contains(&n) {
                -reading
            } else {
                reading
            }
        }
    };
    // A connection that comes back with one outlier.
    assert_eq!(refused(0.2, lost(50..54, 54..55)), (Some(50), 5, 0));
    assert_eq!(refused(0.2, lost(55..56, 50..55)), (Some(50), 12, 0));
}

/// Readings with noise of one, by the sum of twelve uniform numbers.
fn noisy(seed: &mut u64) -> f64 {
    let mut uniform = || {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 40) as f64 / f64::from(1_u32 << 24)
    };
    (0..12).map(|_| uniform()).sum::<f64>() - 6.0
}

// SR-04
#[test]
fn noise_that_stops_is_noticed_in_twenty_readings() {
    let gate = SensorGate { tolerance: [1e3; 4], ..gate() };
    let (mut signal, mut seed) = (Signal::default(), 1);
    let mut still = |reading: f64| {
        gate.accept(&mut signal, 1e3, 0.1, reading);
        gate.is_still(&signal)
    };
    for n in 0..200_000 {
        assert!(!still(50.0 * libm::sin(2e-3 * f64::from(n)) + noisy(&mut seed)), "{n}");
    }
    // An open input, whose noise is small.
    let readings = (1..1000).find(|n| still(0.02 * f64::from(n % 2)));
    assert!(readings.is_some_and(|n| (8..20).contains(&n)), "{readings:?}");
}

#[test]
fn noise_that_stops_soon_after_the_start_is_noticed() {
    // At 1,024 Hz the liveliness is forgotten within 163 readings.
    let gate = SensorGate { tolerance: [1e3; 4], liveliness_gain: 6.1e-3, ..gate() };
    for mut seed in 1..20 {
        let mut signal = Signal::default();
        for _ in 0..128 {
            gate.accept(&mut signal, 1e3, 0.1, noisy(&mut seed));
            assert!(!gate.is_still(&signal));
        }
        let still = (1..100).find(|_| {
            gate.accept(&mut signal, 1e3, 0.1, 0.5);
            gate.is_still(&signal)
        });
        assert!(still.is_some_and(|n| n < 25), "{still:?}");
    }
}

#[test]
fn neither_a_coarse_converter_nor_a_sensor_without_noise_is_still_soon_after_the_start() {
    let gate = SensorGate { tolerance: [1e3; 4], liveliness_gain: 6.1e-3, ..gate() };
    for step in [0.5, 1.0, 1.5, 2.0, 3.0, 4.0] {
        for mut seed in 1..500 {
            let mut signal = Signal::default();
            for n in 0..300 {
                gate.accept(&mut signal, 1e3, 0.1, step * libm::round(noisy(&mut seed) / step));
                assert!(!gate.is_still(&signal), "{step} {n}");
            }
        }
    }
    let mut signal = Signal::default();
    for n in 0..300 {
        gate.accept(&mut signal, 1e3, 0.1, 7.0);
        assert!(!gate.is_still(&signal), "{n}");
    }
}

#[test]
fn the_liveliness_is_a_mean_at_first_and_forgets_later() {
    // It begins with three readings on a line, and at last forgets a hundredth.
    for (readings, gain) in [(0.0, 1.0 / 3.0), (9.0, 1.0 / 12.0), (1e9, 1e-2)] {
        let mut after = Signal { readings, ..signal() };
        gate().update_liveliness(&mut after, 0.1, 9.0);
        near("liveliness", after.liveliness, 0.8 + gain * 0.2);
        near("readings", after.readings, if readings < 1e3 { readings + 1.0 } else { readings });
    }
}

#[test]
fn a_reading_that_rests_without_noise_or_on_a_coarse_converter_is_sound() {
    for step in [0.0, 1.0, 4.0] {
        let gate = SensorGate { tolerance: [1e3; 4], ..gate() };
        let (mut signal, mut seed) = (Signal::default(), 1);
        for n in 0..100_000 {
            let swing = 100.0 * libm::sin(3e-3 * f64::from(n));
            let reading =
                if step > 0.0 { step * libm::round((swing + noisy(&mut seed)) / step) } else { swing };
            gate.accept(&mut signal, 1e3, 0.1, if n < 50_000 || step > 0.0 { reading } else { 7.0 });
            assert!(!gate.is_still(&signal), "{step} {n}");
        }
    }
}

#[test]
fn friction_changes_the_force_at_a_reversal() {
    let gate = SensorGate { friction_jump: 5.0, reversal_velocity: 0.1, ..gate() };
    let at = |velocity: f64| gate.force_tolerance(1.0, velocity);
    assert!((at(0.05) - 6.0).abs() < 1e-12 && (at(-0.2) - 1.0).abs() < 1e-12);
}

fn near(what: &str, found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{what}: {found:e}, not {expected:e}");
}

/// A signal without a zero.
fn signal() -> Signal<f64> {
    Signal {
        last: 5.0,
        slope: 0.25,
        lost: 0,
        jumps: 0,
        confirmed: 0,
        repeats: 3,
        liveliness: 0.8,
        readings: 1e9,
        likelihood: 0.5,
        last_change: 0.3,
        jumped: false,
        has_reading: true,
    }
}

#[test]
fn a_reading_may_be_a_jump_away_from_the_line_of_the_earlier_ones() {
    for (lost, predicted) in [(0, 5.25), (3, 6.0)] {
        for (away, accepted) in [(2.0, true), (-2.0, true), (2.001, false), (-2.001, false)] {
            let mut signal = Signal { lost, ..signal() };
            let found = gate().accept(&mut signal, 2.0, 0.1, predicted + away);
            assert_eq!(!found.is_nan(), accepted, "{lost} {away}");
            assert_eq!(signal.lost, if accepted { 0 } else { lost + 1 });
            assert_eq!(signal.jumped, !accepted);
        }
    }
}

#[test]
fn a_reading_beyond_single_precision_is_no_number() {
    let largest = f64::from(f32::MAX);
    for (reading, number) in
        [(largest, true), (1.001 * largest, false), (f64::INFINITY, false), (f64::NAN, false)]
    {
        let mut signal = Signal::default();
        let found = gate().accept(&mut signal, 1.0, 0.1, reading);
        assert_eq!((!found.is_nan(), signal.lost), (number, u32::from(!number)), "{reading}");
    }
}

#[test]
fn the_slope_follows_the_changes_of_consecutive_readings() {
    let mut now = signal();
    gate().accept(&mut now, 2.0, 0.1, 6.0);
    near("slope", now.slope, 0.25 + 0.1 * (1.0 - 0.25));
    near("last", now.last, 6.0);
    // A change after lost readings belongs to several samples.
    let mut gap = Signal { lost: 2, ..signal() };
    gate().accept(&mut gap, 2.0, 0.1, 6.0);
    near("slope", gap.slope, 0.25);
    // The first reading changes nothing.
    let mut first = Signal { has_reading: false, ..signal() };
    gate().accept(&mut first, 2.0, 0.1, 90.0);
    near("slope", first.slope, 0.25);
    near("last", first.last, 90.0);
}

#[test]
fn repetitions_to_the_last_bit_are_counted() {
    for (reading, repeats) in [(5.0, 4), (5.0 + 1e-12, 0)] {
        let mut now = signal();
        gate().accept(&mut now, 2.0, 0.1, reading);
        assert_eq!(now.repeats, repeats);
    }
    let mut first = Signal { has_reading: false, ..signal() };
    gate().accept(&mut first, 2.0, 0.1, 5.0);
    assert_eq!(first.repeats, 0);
    // Both counts end at a limit.
    let mut most = Signal { repeats: LARGEST_COUNT, lost: LARGEST_COUNT - 1, ..signal() };
    for lost in [LARGEST_COUNT, LARGEST_COUNT] {
        gate().accept(&mut most, 2.0, 0.1, f64::NAN);
        assert_eq!(most.lost, lost);
    }
    most.lost = 0;
    gate().accept(&mut most, 2.0, 0.1, 5.0);
    assert_eq!(most.repeats, LARGEST_COUNT);
}

/// A signal after a change of its reading, with a gate that forgets a quarter in a reading.
fn listened(signal: Signal<f64>, step: f64) -> Signal<f64> {
    let gate = SensorGate { liveliness_gain: 0.25, still_probability: 1e-3, ..gate() };
    let mut after = signal;
    gate.update_liveliness(&mut after, 0.1, step);
    after
}

#[test]
fn a_reading_off_the_line_of_the_two_earlier_ones_shows_noise() {
    // √3 times a still change, to either side of the last one.
    for (step, off) in [(0.3 + 0.174, 1.0), (0.3 + 0.172, 0.0), (0.3 - 0.174, 1.0), (0.3 - 0.172, 0.0)] {
        let after = listened(signal(), step);
        near("liveliness", after.liveliness, 0.75 * 0.8 + 0.25 * off);
        near("step", after.last_change, step);
    }
}

#[test]
fn still_readings_of_a_lively_signal_multiply_their_probabilities() {
    let still = |liveliness: f64, likelihood: f64, step: f64| {
        // The last step was so different that this reading is off the line.
        listened(Signal { liveliness, likelihood, last_change: 9.0, ..signal() }, step)
    };
    let [lively, livelier] = [0.75 * 0.8 + 0.25, 0.75 * 0.95 + 0.25];
    near("probable", still(0.8, 0.5, 0.1).likelihood, 1.6 * (1.0 - lively) * 0.5);
    near("backwards", still(0.8, 0.5, -0.1).likelihood, 1.6 * (1.0 - lively) * 0.5);
    assert!(1.6 * (1.0 - livelier) < 0.13);
    near("at least", still(0.95, 0.5, 0.1).likelihood, 0.13 * 0.5);
    // From half of the chance on.
    near("least", still(0.95, 1e-9, 0.1).likelihood, 0.13 * 0.5e-3);
    near("a change", still(0.95, 0.5, 0.101).likelihood, 1.0);
    // A signal must be alive: three quarters of its readings off a line.
    near("quiet", still(0.66, 0.5, 0.1).likelihood, 1.0);
    assert!(still(0.67, 0.5, 0.1).likelihood < 1.0);
}

#[test]
fn a_signal_is_still_below_the_chance_and_after_its_first_reading() {
    let gate = gate();
    for (likelihood, still) in [(0.0, false), (9e-11, true), (1e-10, false), (0.5, false)] {
        assert_eq!(gate.is_still(&Signal { likelihood, ..signal() }), still, "{likelihood}");
    }
}

#[test]
fn a_quiet_signal_is_still_or_repeats() {
    for (repeats, likelihood, quiet) in [(0, 1.0, false), (1, 1.0, true), (0, 0.999, true)] {
        assert_eq!(Signal { repeats, likelihood, ..signal() }.is_quiet(), quiet, "{repeats} {likelihood}");
    }
}

#[test]
fn friction_counts_below_its_velocity() {
    let gate = SensorGate { friction_jump: 5.0, reversal_velocity: 0.5, ..gate() };
    for (last, jump) in [(0.499, 6.0), (-0.499, 6.0), (0.5, 1.0), (-0.5, 1.0)] {
        near("jump", gate.force_tolerance(1.0, last), jump);
    }
}

#[test]
fn a_slower_converter_repeats_a_displacement_and_then_jumps() {
    let gate = SensorGate { displacement_tolerance: 1.0, tolerance_growth: 0.1, ..gate() };
    let estimated_tolerance = |step: f64, repeats: u32, lost: u32, reading: f64| {
        let signal = Signal {
            last: 5.0,
            slope: -2.0,
            last_change: step,
            repeats,
            lost,
            has_reading: true,
            ..Signal::default()
        };
        gate.estimated_tolerance(&signal, reading)
    };
    // A repetition passes after a step of more than 1.5 slopes, or after another one.
    for (step, repeats, passes) in [(3.1, 0, true), (-3.1, 0, true), (2.9, 0, false), (0.0, 1, true)] {
        assert_eq!(estimated_tolerance(step, repeats, 0, 5.0) > 1e38, passes, "{step} {repeats}");
    }
    // Another reading may have moved by 1.5 slopes in each of the repetitions, and by a bend in each lost sample.
    for (repeats, lost, most) in [(0, 0, 1.0), (1, 0, 4.0), (4, 0, 13.0), (0, 3, 1.3), (2, 1, 7.1)] {
        let found = estimated_tolerance(9.0, repeats, lost, 4.0);
        assert!((found - most).abs() < 1e-12, "{repeats} {lost}: {found}");
    }
}
