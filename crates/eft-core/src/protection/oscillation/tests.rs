//! The oscillation check with errors of known frequency, and its equations.

use super::*;

const RATE: f64 = 4096.0;

/// Time (s) until a force error (N) of time (s) trips; at most 4 s.
fn trips(limit: f64, error: impl Fn(f64) -> f64) -> Option<f64> {
    let watch = OscillationWatch::<f64>::new(limit, RATE).unwrap().unwrap();
    let mut state = OscillationWatchState::default();
    let times = (0..(4.0 * RATE) as u32).map(|n| f64::from(n) / RATE);
    let mut tripped = times.filter(|t| watch.step(&mut state, error(*t)));
    tripped.next()
}

fn wave(frequency: f64, time: f64) -> f64 {
    libm::sin(TAU * frequency * time)
}

#[test]
fn errors_that_persist_or_grow_in_the_band_trip() {
    // The band passes 0.36 to 0.7 of a steady amplitude of 1000 N; the root mean square is smaller by √2.
    for frequency in [35.0, 65.0, 120.0] {
        let after = trips(200.0, |t| 1000.0 * wave(frequency, t)).unwrap();
        assert!((0.2..0.3).contains(&after), "{frequency} Hz: {after} s");
    }
    // A newton that grows at 30 1/s exceeds 400 N after 0.2 s.
    let after = trips(200.0, |t| libm::exp(30.0 * t) * wave(65.0, t)).unwrap();
    assert!((0.2..0.27).contains(&after), "{after} s");
}

#[test]
fn slow_small_and_decaying_errors_do_not_trip() {
    assert_eq!(trips(200.0, |t| 3000.0 * wave(10.0, t)), None);
    assert_eq!(trips(200.0, |t| 200.0 * wave(65.0, t)), None);
    // An impulse, and another one a second later.
    let kick = |t: f64| 20e3 * libm::exp(-25.0 * libm::fmod(t, 1.0)) * wave(65.0, t);
    assert_eq!(trips(200.0, kick), None);
    assert_eq!(trips(200.0, |_| f64::NAN), None);
}

#[test]
fn a_lost_sample_changes_nothing() {
    let watch = OscillationWatch::<f32>::new(200.0, RATE).unwrap().unwrap();
    let mut state = OscillationWatchState::default();
    watch.step(&mut state, 5e3);
    let before = state;
    for lost in [f32::NAN, f32::INFINITY, -1e30] {
        assert!(!watch.step(&mut state, lost));
    }
    assert_eq!(state, before);
    assert!(OscillationWatch::<f32>::new(f64::MAX, RATE).unwrap().is_none());
    for (limit, rate) in [(0.0, RATE), (-1.0, RATE), (f64::NAN, RATE), (1e13, RATE)] {
        assert!(OscillationWatch::<f32>::new(limit, rate).is_err());
    }
}

const WATCH: OscillationWatch<f64> =
    OscillationWatch { high_pass: 0.25, low_pass: 0.5, limit: 100.0, ticks: 4 };

fn near(what: &str, found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{what}: {found:e}, not {expected:e}");
}

#[test]
fn an_error_passes_two_high_passes_and_a_low_pass() {
    let mut state = OscillationWatchState {
        high_pass_states: [2.0, 0.5],
        filtered_error: 0.75,
        sum_of_squares: 3.0,
        last_sum: 9.0,
        ..Default::default()
    };
    assert!(!WATCH.step(&mut state, 6.0));
    let first = 2.0 + 0.25 * (6.0 - 2.0);
    let second = 0.5 + 0.25 * ((6.0 - first) - 0.5);
    let filtered_error = 0.75 + 0.5 * ((6.0 - first - second) - 0.75);
    near("first", state.high_pass_states[0], first);
    near("second", state.high_pass_states[1], second);
    near("band", state.filtered_error, filtered_error);
    near("sum of squares", state.sum_of_squares, 3.0 + filtered_error * filtered_error);
    assert_eq!(state.ticks, 1);
}

#[test]
fn a_window_closes_after_its_ticks() {
    let mut state = OscillationWatchState::default();
    for ticks in [1, 2, 3, 0, 1] {
        WATCH.step(&mut state, 6.0);
        assert_eq!(state.ticks, ticks);
    }
    assert!(state.last_sum > 0.0);
}

/// After the end of a window with this sum, and whether it trips.
fn closed(sum: f64, last: f64, [over_limit, growing]: [u32; 2]) -> (OscillationWatchState<f64>, bool) {
    let mut state = OscillationWatchState {
        sum_of_squares: sum,
        last_sum: last,
        windows_over_limit: over_limit,
        windows_growing: growing,
        ticks: 4,
        ..Default::default()
    };
    let trips = WATCH.close(&mut state);
    near("last", state.last_sum, sum);
    assert_eq!((state.sum_of_squares.to_bits(), state.ticks), (0, 0));
    (state, trips)
}

#[test]
fn windows_beyond_the_limit_and_growing_ones_are_counted() {
    for (sum, last, counts) in [
        (99.0, 99.0, [0, 0]),
        (100.0, 99.0, [0, 0]),
        (101.0, 99.0, [3, 0]),
        (131.0, 100.0, [3, 6]),
        (130.0, 100.0, [3, 0]),
        (13.1, 10.0, [0, 6]),
    ] {
        let (state, _) = closed(sum, last, [2, 5]);
        assert_eq!([state.windows_over_limit, state.windows_growing], counts, "{sum} {last}");
    }
}

#[test]
fn fifteen_windows_beyond_the_limit_or_three_growing_ones_trip() {
    for (sum, last, before, trips) in [
        (101.0, 101.0, [13, 0], false),
        (101.0, 101.0, [14, 0], true),
        (101.0, 10.0, [0, 1], false),
        (101.0, 10.0, [0, 2], true),
        // Below the limit growth alone does not count.
        (99.0, 10.0, [0, 9], false),
    ] {
        assert_eq!(closed(sum, last, before).1, trips, "{sum} {before:?}");
    }
}

#[test]
fn a_window_is_a_sixtieth_of_a_second_and_its_limit_the_sum_of_squares() {
    for (rate, ticks) in [(6000.0, 100), (60.0, 1), (30.0, 1), (4096.0, 68)] {
        let watch = OscillationWatch::<f64>::new(3.0, rate).unwrap().unwrap();
        assert_eq!(watch.ticks, ticks, "{rate} Hz");
        near("limit", watch.limit, 9.0 * f64::from(ticks));
        for (share, corner) in [(watch.high_pass, 40.0), (watch.low_pass, 150.0)] {
            // Time constant of the backward difference.
            let time = (1.0 / share - 1.0) / rate;
            assert!((time * TAU * corner - 1.0).abs() < 1e-9, "{corner} Hz: {time} s");
        }
    }
}

#[test]
fn the_largest_error_counts() {
    for (error, counts) in [(LARGEST, 1), (-LARGEST, 1), (1.001 * LARGEST, 0)] {
        let mut state = OscillationWatchState::default();
        WATCH.step(&mut state, error);
        assert_eq!(state.ticks, counts, "{error}");
    }
}
