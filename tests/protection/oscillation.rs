//! The oscillation check of the oil column: it opens a force loop that oscillates, and raises no false alarm.

use eft::core::Cause;
use eft::sim::RigConfig;
use eft::sim::excitation::sine_sweep;
use toml::Value;

use crate::matrix::{Seen, rig, runs, seen};

const RATE: f64 = 4096.0;
/// 0.25 % of the capacity, N.
const LIMIT: f64 = 400.0;
/// Schemes: realization, self-calibration, force loop.
const SCHEMES: [(&str, bool, &str); 5] = [
    ("analog", false, "pd"),
    ("analog", true, "pd"),
    ("digital", false, "pd"),
    ("digital", false, "robust"),
    ("digital", true, "robust"),
];

fn changed(
    scheme: (&str, bool, &str),
    limit: Option<f64>,
    noisy: bool,
    truth: &[(&str, Value)],
) -> RigConfig {
    let (realization, adaptive, force_loop) = scheme;
    let mut changes: Vec<(&str, Value)> = vec![("controller.force_loop", force_loop.into())];
    changes.extend(limit.map(|limit| ("protection.oscillation_limit", limit.into())));
    changes.extend(truth.iter().cloned());
    rig(realization, adaptive, noisy, &changes)
}

/// The tests under the first seconds of a sweep by 1 Hz in each second, past the specimen's resonance at 1.6 Hz.
fn shaken(rigs: &[RigConfig], duration: f64) -> Vec<Seen> {
    let sweep = sine_sweep(6000.0, 0.0, duration, duration, RATE).unwrap();
    runs(rigs, &sweep).iter().map(|run| seen(run, 0.0)).collect()
}

#[test]
fn tests_without_a_fault_raise_no_alarm() {
    let cases: Vec<_> = SCHEMES.into_iter().flat_map(|scheme| [(scheme, false), (scheme, true)]).collect();
    let rigs: Vec<_> =
        cases.iter().map(|(scheme, noisy)| changed(*scheme, Some(LIMIT), *noisy, &[])).collect();
    for ((scheme, noisy), seen) in cases.into_iter().zip(shaken(&rigs, 10.0)) {
        assert_eq!(seen.cause, Cause::None, "{scheme:?}, noise {noisy}: {:?} s", seen.noticed);
    }
}

#[test]
fn an_unstable_oil_column_opens_the_loop_before_any_level() {
    let cases: [&[(&str, Value)]; 4] = [
        &[("truth.servovalve.torque_motor_frequency", Value::Float(150.0))],
        &[("truth.servovalve.pilot_time_constant", Value::Float(2.8e-3))],
        &[("truth.sensors.force.bandwidth", Value::Float(200.0))],
        &[("truth.actuator.attachment_stiffness", Value::Float(2e8))],
    ];
    let schemes = SCHEMES[..3].iter().flat_map(|scheme| [(*scheme, false), (*scheme, true)]);
    let tests: Vec<_> = schemes.flat_map(|scheme| cases.map(|truth| (scheme, truth))).collect();
    let rigs = |limit| -> Vec<_> {
        tests.iter().map(|((scheme, noisy), truth)| changed(*scheme, limit, *noisy, truth)).collect()
    };
    let all = [rigs(Some(LIMIT)), rigs(None)].concat();
    let seen = shaken(&all, 4.0);
    let (watched, unwatched) = seen.split_at(tests.len());
    for ((what, watched), unwatched) in tests.iter().zip(watched).zip(unwatched) {
        assert_eq!(watched.cause, Cause::ForceOscillation, "{what:?}");
        // The trip level is 20 kN. The check must open the loop well before it.
        assert!(
            watched.force < 16e3 && watched.force < 0.7 * unwatched.force,
            "{what:?}: {} N, without the watch {} N",
            watched.force,
            unwatched.force
        );
    }
}
