//! The equations of the standard deviations, with numbers of which none is another one or 1.

use crate::compensation::Deviations;
use crate::learning::checkpoint::Evidence;
use crate::learning::deviation::{Deviation, MEAN_CORRELATION, attenuation, gain_change};
use crate::learning::least_squares::{Estimate, GainAndDelay, LeastSquares, Priors, Range, Weight};

const DEVIATION: Deviation<f64> =
    Deviation { correlation: 0.03, per_square_flow: 3000.0, half_sample: 2e-3, leakage_corner: 300.0 };
const WEIGHT: Weight<f64> = Weight { time: 0.25, forgetting: 0.9 };
const RANGE: Range<f64> = Range { bounds: [0.0, 2.0], change: 1.0 };
const PRIORS: Priors<f64> = Priors {
    period: 0.004,
    per_period: 250.0,
    nominal_delay: 0.005,
    weights: [0.2, 0.3],
    spread: [0.005, 0.07],
    gain: RANGE,
    delay: RANGE,
};
/// Mean-square frequency (1/s²).
const SQUARE: f64 = 900.0;
/// Share of the flow gain that follows from the departures.
const SHARE: f64 = 0.03;

fn estimate(value: f64, away: f64) -> Estimate<f64> {
    Estimate { away, ..Estimate::at(value) }
}

/// The estimates of the flow and of the valve, each with its distance from the last result.
fn flow() -> GainAndDelay<f64> {
    GainAndDelay { gain: estimate(1.1, 0.02), delay: estimate(-3e-3, 4e-4) }
}

fn valve() -> GainAndDelay<f64> {
    GainAndDelay { gain: estimate(0.8, 0.01), delay: estimate(7e-3, 3e-4) }
}

fn evidence() -> Evidence<f64> {
    Evidence {
        flow: LeastSquares { matrix: [[0.6, 0.0], [0.0, 0.5]], ..LeastSquares::default() },
        valve: LeastSquares { matrix: [[0.4, 0.0], [0.0, 0.7]], ..LeastSquares::default() },
        amount: 0.4,
        newer_openings: 0.12,
        time: 2.5,
        flow_errors: 5e-6,
        spool_errors: 6e-4,
        compressed: 7e-7,
        ..Evidence::default()
    }
}

fn near(what: &str, found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{what}: {found:e}, not {expected:e}");
}

#[test]
fn sums_of_a_window_have_its_weight_and_the_share_of_the_older_ones() {
    let mut sums = evidence();
    DEVIATION.add(&mut sums, [0.3, 2e-3], [5e-3, 0.07], WEIGHT);
    near("time", sums.time, 2.25 + 0.25);
    // Squared weights of the older openings.
    near("openings", sums.newer_openings, 0.12 * 0.81 + 0.25 * 0.09);
    near("compressed flow", sums.compressed, 6.3e-7 + 0.25 * 4e-6);
    near("flow", sums.flow_errors, 4.5e-6 + 0.25 * 25e-6);
    near("spool", sums.spool_errors, 5.4e-4 + 0.25 * 49e-4);
    near("the learner's own sum", sums.amount, 0.4);
}

#[test]
fn systematic_errors_are_those_of_the_stated_equations() {
    let found = DEVIATION.systematic(0.12, SQUARE, &flow(), &valve(), PRIORS.period);
    // The network is sampled at a frequency that is higher by this share.
    let share = SQUARE * PRIORS.period * PRIORS.period / 12.0;
    near("response delay", found.response_delay, (7e-3 * share) * (7e-3 * share));
    // A third of the square of a bound, of which a quarter is the leakage's: in quadrature, so its share times ω.
    near("flow gain", found.flow_gain, 0.01 * (1.1 * 3e-3) * (1.1 * 3e-3) * SQUARE);
    // The oil's flow is late by half a sample, and the velocity is 3 ms early.
    near("velocity delay", found.velocity_delay, 0.03 * 5e-3 * 5e-3);
    let late = GainAndDelay { delay: estimate(3e-3, 0.0), ..flow() };
    near(
        "late velocity",
        DEVIATION.systematic(0.12, SQUARE, &late, &valve(), PRIORS.period).velocity_delay,
        0.03 * 1e-6,
    );
}

#[test]
fn a_disturbance_of_the_spools_sensor_is_what_exceeds_twice_the_increase_of_the_gain() {
    let (increase, explained) = (0.02, 0.04);
    let residual = |errors: f64| Evidence { spool_errors: errors, ..evidence() };
    let found = |errors: f64| Deviation::disturbance(&residual(errors), increase);
    // The squares of the openings are 0.4, and the time is 2.5 s.
    near("beyond", found(explained * explained * 0.4 + 6e-4), 6e-4 / 2.5);
    assert_eq!(found(0.99 * explained * explained * 0.4).to_bits(), 0);
}

#[test]
fn the_leakage_has_half_of_the_square_at_its_corner() {
    near("corner", DEVIATION.leakage_share(300.0), 0.5);
    near("three times the corner's square", DEVIATION.leakage_share(900.0), 0.25);
    near("standstill", DEVIATION.leakage_share(0.0), 1.0);
}

#[test]
fn the_mean_opening_scatters_as_its_windows_together() {
    near("variance", Deviation::mean_variance(&evidence()), MEAN_CORRELATION * 6e-4 / 2.5);
}

#[test]
fn a_variance_has_a_part_of_the_noise_of_the_models_and_of_the_distance() {
    let found = DEVIATION.deviations(&evidence(), SQUARE, (&PRIORS, &flow()), (&PRIORS, &valve()), SHARE);
    // Mean squares of the residuals, for the number of independent windows. Older windows have less weight, and the filter passes
    // less of the noise at the motion's frequency than of that at low ones.
    let independent = 2.5 / 0.03 * 0.4 / 0.12 * attenuation(SQUARE) * attenuation(SQUARE);
    let (of_flow, of_spool) = (5e-6 / independent, 6e-4 / independent);
    // Diagonal information with the priors, and the squares of the instruments over its square.
    let scatter = |information: f64, squares: f64| squares / (information * information);
    let changes = 0.004 * 0.004;
    let share_of_oil = 3000.0 * 7e-7 / 0.4;
    let systematic = DEVIATION.systematic(share_of_oil, SQUARE, &flow(), &valve(), PRIORS.period);
    // The share of the priors in the information.
    let prior = |information: f64, weight: f64, spread: f64| spread * (weight / information).powi(2);
    let (of_gain, of_delay) = (|sum: f64| prior(sum, 0.2, 0.005), |sum: f64| changes * prior(sum, 0.3, 0.07));
    let root = |noise: f64, systematic: f64, away: f64| (noise + systematic + away * away).sqrt();
    // The estimate is this far from the last result, and the last result this far from that of the table itself.
    let away = 0.02 - SHARE * 1.1;
    near(
        "flow gain",
        found.flow_gain,
        root(of_flow * scatter(0.8, 0.4) + of_gain(0.8), systematic.flow_gain, away),
    );
    near(
        "velocity delay",
        found.velocity_delay,
        root(of_flow * scatter(0.8, 0.7) * changes + of_delay(0.8), systematic.velocity_delay, 4e-4),
    );
    let valve_gain = root(of_spool * scatter(0.6, 0.4) + of_gain(0.6), 0.0, 0.01);
    near("valve gain", found.valve_gain, valve_gain);
    near(
        "response delay",
        found.response_delay,
        root(of_spool * scatter(1.0, 0.7) * changes + of_delay(1.0), systematic.response_delay, 3e-4),
    );
    // The mean of the spool's readings, and the gain that the null offset follows late. The gain increases with the frequency.
    let change = gain_change(valve_gain, 0.02, &valve());
    near("change of the gain", change, valve_gain * valve_gain / 0.64 + 0.02 * 0.02);
    let null_offset = (2e-5 + Deviation::mean_variance(&evidence()) + 0.05 * 0.05 * change).sqrt();
    near("null offset", Deviation::null_offset(&evidence(), [2e-5, 0.05], change), null_offset);
    assert!(found.null_offset.is_infinite(), "not without its curve");
}

#[test]
fn distances_dominate_where_they_are_large() {
    let far = GainAndDelay { gain: estimate(1.1, 3.0), delay: estimate(-3e-3, -0.5) };
    let found = DEVIATION.deviations(&evidence(), SQUARE, (&PRIORS, &far), (&PRIORS, &far), 0.0);
    for (found, away) in [(found.flow_gain, 3.0), (found.response_delay, 0.5), (found.velocity_delay, 0.5)] {
        assert!((found / away - 1.0).abs() < 0.01, "{found}, not {away}");
    }
}

#[test]
fn nothing_is_known_without_time_or_without_motion() {
    let of = |evidence: &Evidence<f64>| {
        DEVIATION.deviations(evidence, SQUARE, (&PRIORS, &flow()), (&PRIORS, &valve()), SHARE)
    };
    let motionless = Evidence { valve: LeastSquares::default(), ..evidence() };
    for unknown in [Evidence { time: 0.0, ..evidence() }, motionless, Evidence::default()] {
        assert_eq!(of(&unknown), Deviations::unknown());
    }
    // Any time is enough.
    let short = Evidence { time: 1e-3, ..evidence() };
    assert!(of(&short).flow_gain.is_finite());
}
