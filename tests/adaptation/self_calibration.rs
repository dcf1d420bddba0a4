//! Self-calibration on rigs that differ from the configuration: a few points of each row of the table in `docs/`, whose
//! study runs the whole grid.

use eft::sim::excitation::{effective_force, sine_sweep};
use eft::sim::metrics::nrmse;
use eft::sim::records::read_record;
use eft::sim::{SimulateOptions, ideal_response, simulate};

use crate::results::keep;
use crate::rigs::*;

#[test]
fn sweep_is_followed_within_one_percent() {
    let quiet = run(&adaptive(&[]), &sweep(8900.0));
    assert!(error(&quiet) <= 0.010, "{}", error(&quiet));
    assert_quiet(&quiet);
    let noisy = run(&adaptive(&noise(1)), &sweep(8900.0));
    assert!(error(&noisy) <= 0.020, "{}", error(&noisy));
    assert_quiet(&noisy);
}

#[test]
fn a_wrong_flow_gain_does_not_increase_the_error() {
    for amplitude in [2200.0, 8900.0] {
        for scale in [0.90, 1.10] {
            let quiet = run(&adaptive(&[flow_gain(scale)]), &sweep(amplitude));
            assert_within(&format!("{amplitude} N, {scale}"), ratio(&quiet, 0.5, 9.5), 0.97, 1.03);
            let changes = [vec![flow_gain(scale)], noise(2)].concat();
            let noisy = run(&adaptive(&changes), &sweep(amplitude));
            assert_within(&format!("{amplitude} N, {scale}, noise"), ratio(&noisy, 0.5, 9.5), 0.95, 1.05);
            let estimate = noisy.flow_gain_estimate().at(noisy.flow_gain_estimate().len() / 2);
            assert!((estimate / scale - 1.0).abs() < 2e-3, "{estimate} of {scale}");
        }
    }
}

#[test]
fn a_wrong_valve_delay_does_not_increase_the_error() {
    for amplitude in [2200.0, 8900.0] {
        for delay in [3e-3, 8e-3] {
            for sensors in [vec![], noise(3)] {
                let changes = [vec![valve_delay(delay)], sensors].concat();
                let run = run(&adaptive(&changes), &sweep(amplitude));
                assert_within(&format!("{amplitude} N, {delay} s"), ratio(&run, 1.2, 2.0), 0.95, 1.05);
                // The valve's delay and half a sample of hold.
                let estimate = run.response_delay_estimate().at(5 * 4096);
                assert!((estimate - delay - 0.5 / RATE).abs() < 1e-4, "{estimate} of {delay}");
            }
        }
    }
}

#[test]
fn any_structure_is_followed_without_retuning() {
    let linear = || set("structure.kind", "linear");
    let halved = || set("structure.stiffness", 693.8e3 / 2.0);
    for amplitude in [2200.0, 8900.0] {
        for structure in [vec![damping_ratio(0.01)], vec![damping_ratio(0.2)], vec![linear(), halved()]] {
            let run = run(&adaptive(&structure), &sweep(amplitude));
            assert_within(&format!("{amplitude} N, {structure:?}"), ratio(&run, 0.5, 9.5), 0.95, 1.05);
        }
    }
}

#[test]
fn single_precision_is_as_good() {
    let rig = adaptive(&[vec![flow_gain(1.1), valve_delay(4e-3)], noise(4)].concat());
    let run = simulate::<f32>(&rig, &sweep(2200.0), &SimulateOptions::default(), |_, _| true).unwrap();
    assert_within("f32", ratio(&run, 0.5, 9.5), 0.95, 1.05);
}

#[test]
fn digital_realization_and_computation_delay_too() {
    for samples in [0, 4] {
        let changes = [
            set("controller.realization", "digital"),
            set("compensation.computation_delay", samples),
            flow_gain(1.08),
        ];
        let run = run(&adaptive(&changes), &sweep(2200.0));
        assert_within(&format!("digital, {samples} samples"), ratio(&run, 0.5, 9.5), 0.95, 1.05);
    }
}

#[test]
fn northridge_gives_the_ideal_displacement() {
    let Some(folder) = std::env::var_os("EFT_RECORDS") else {
        eprintln!("skipped: EFT_RECORDS is not set");
        return;
    };
    let path = std::path::Path::new(&folder).join("northridge1994_sylmar_county_360.csv");
    let record = read_record(path).unwrap();
    let command = effective_force(&record, 7040.0, RATE, 0.6).unwrap();
    let ideal = ideal_response(&rig(&[]), &command, &SimulateOptions::default()).unwrap();
    let missed = |run: &eft::sim::TestRun| nrmse(&ideal.displacement, &run.displacement).unwrap();
    let quiet = missed(&run(&adaptive(&[]), &command));
    assert!(quiet <= 0.02, "{quiet}");
    let mut noisy: Vec<_> = (1..6).map(|seed| missed(&run(&adaptive(&noise(seed)), &command))).collect();
    noisy.sort_by(f64::total_cmp);
    assert!(noisy[2] <= 0.05, "{noisy:?}");
}

// Level 1.1 is unstable: without the guard the rig of 2.2 kN ends at its stops. With it the estimators are not needed.
#[test]
fn the_guard_ends_overcompensation_before_the_structure_swings_up() {
    for (estimators, curve) in [(true, false), (true, true), (false, false)] {
        for (amplitude, level) in [(2200.0, 1.05), (2200.0, 1.1), (8900.0, 1.1)] {
            for sensors in [vec![], noise(5)] {
                let asked = vec![
                    set("compensation.level", level),
                    set("compensation.guard", true),
                    set("compensation.curve_correction", curve),
                ];
                let changes = [asked, sensors.clone()];
                let rig =
                    adaptive(&changes.concat()).replace(&[set("compensation.adaptive", estimators)]).unwrap();
                let command = sweep(amplitude);
                let ideal = ideal_response(&rig, &command, &SimulateOptions::default()).unwrap();
                let run = run(&rig, &command);
                let worst = overshoot(&run, &ideal.displacement);
                assert!(worst < 1.2, "{amplitude} N, level {level}: {worst}");
                assert_ne!(run.status_union() & eft::core::status::LEVEL_REDUCED, 0);
                // Two periods after its first action the level is within 2 % of full compensation.
                let moved = run.level().samples().iter().position(|factor| *factor < 1.0).unwrap();
                let sound = run.level().samples().iter().position(|factor| factor * level < 1.02).unwrap();
                let periods = (sound - moved) as f64 / RATE * 1.58;
                let noise = if sensors.is_empty() { "" } else { ", noise" };
                keep(
                    format_args!(
                        "guard, {amplitude} N, level {level}, estimators {estimators}, {}{noise}",
                        flow(curve)
                    ),
                    &[("overshoot", worst), ("periods", periods)],
                );
                assert!(periods < 2.0, "{amplitude} N, level {level}: {periods} periods");
                let level_at_end = run.level().last().unwrap() * level;
                assert!((0.9..1.01).contains(&level_at_end), "{level_at_end}");
            }
        }
    }
}

// On a rig that matches its configuration, self-calibration must not increase the error.
#[test]
fn a_correct_calibration_is_kept() {
    for amplitude in [2200.0, 8900.0] {
        let fixed = run(&rig(&[set("compensation.feedforward", true)]), &sweep(amplitude));
        let adapting = run(&adaptive(&[]), &sweep(amplitude));
        assert!(error(&adapting) < error(&fixed), "{amplitude} N");
        let noisy = noise(6).into_iter().chain([set("compensation.feedforward", true)]).collect::<Vec<_>>();
        let (fixed, adapting) =
            (run(&rig(&noisy), &sweep(amplitude)), run(&adaptive(&noisy), &sweep(amplitude)));
        assert!(error(&adapting) < 1.05 * error(&fixed), "{amplitude} N, noise");
    }
}

// The true spool's gain is 0.1001 per V. Near 10 Hz the valve of second order passes some percent more than a model
// with gain and delay.
#[test]
fn a_wrong_valve_gain_is_found() {
    for configured in [0.082, 0.09, 0.11, 0.12] {
        let run = run(&adaptive(&[set("compensation.valve_gain", configured)]), &sweep(8900.0));
        let found = |seconds: usize| run.valve_gain_estimate().at(seconds * 4096 - 1) * configured / 0.1001;
        keep(
            format_args!("valve gain {configured}"),
            &[("found at 8 s", found(8)), ("at 32 s", found(32)), ("NRMSE", error(&run))],
        );
        assert!((found(8) - 1.0).abs() < 0.01 && (found(32) - 1.0).abs() < 0.04, "{configured}");
        assert!(error(&run) < 0.02, "{configured}");
    }
}

#[test]
fn a_known_or_measured_converter_delay_is_compensated() {
    let late = |realization: &str, key: &str| {
        let changes = [
            set("controller.realization", realization),
            // With the paper's gains two samples of delay make the loop unstable.
            set("controller.proportional_gain", 0.5),
            set(key, 4),
        ];
        let run = run(&adaptive(&changes), &sweep(2200.0));
        (ratio(&run, 0.5, 9.5), run.response_delay_estimate().at(10 * 4096))
    };
    // Half a sample of hold, and four of the converter.
    let expected = 5.18e-3 + 4.5 / RATE;
    for (realization, key) in
        [("analog", "dac.delay"), ("digital", "dac.delay"), ("digital", "truth.dac.delay")]
    {
        let (ratio, estimate) = late(realization, key);
        assert_within(&format!("{realization}, {key}"), ratio, 0.98, 1.02);
        assert!((estimate - expected).abs() < 1e-4, "{estimate}");
    }
    // A delay between an analog controller's compensation and its valve command is not measured.
    let ((least, most), estimate) = late("analog", "truth.dac.delay");
    assert!(
        least < 0.95 && most > 1.05 && (estimate - 5.18e-3 - 0.5 / RATE).abs() < 1e-4,
        "{least} {most} {estimate}"
    );
}

// A late velocity transducer: the fixed scheme compensates for the configured delay, the learning one also finds it.
#[test]
fn a_configured_or_found_velocity_delay_is_compensated() {
    for (samples, told) in [(4, 4.0 / RATE), (8, 8.0 / RATE)] {
        let late = vec![set("sensors.velocity.delay", samples)];
        let known = [late.clone(), vec![set("compensation.velocity_delay", told)]].concat();
        let fixed = vec![set("compensation.adaptive", false)];
        for amplitude in [2200.0, 8900.0] {
            for (scheme, changes) in [("fixed", fixed.clone()), ("adaptive", vec![])] {
                let judged = |sensors: &[Change]| {
                    let rig = adaptive(sensors).replace(&changes).unwrap();
                    ratio(&run(&rig, &sweep(amplitude)), 0.5, 9.5)
                };
                let what = format!("velocity {samples} samples late, {amplitude} N, {scheme}");
                let ((least, largest), (unknown_least, unknown_largest)) = (judged(&known), judged(&late));
                keep(
                    &what,
                    &[
                        ("least", least),
                        ("largest", largest),
                        ("delay unknown: least", unknown_least),
                        ("delay unknown: largest", unknown_largest),
                    ],
                );
                if scheme == "adaptive" {
                    assert_within(&what, (least, largest), 0.97, 1.03);
                    assert_within(&what, (unknown_least, unknown_largest), 0.97, 1.03);
                } else {
                    // The fixed scheme also has the errors of its own tuning.
                    assert_within(&what, (least, largest), 0.9, 1.15);
                    assert!(
                        unknown_least < least && unknown_largest > largest,
                        "{what}: the configured delay does not help"
                    );
                }
            }
        }
    }
}

// The delays of the spool's and the velocity's sensors go into the two estimates, and the lead network compensates for
// their sum.
#[test]
fn delays_of_spool_and_velocity_are_separated() {
    for (sensor, samples, spool, velocity, curve, least, largest) in [
        ("velocity", 4, 0.0, 4.0, false, 0.98, 1.02),
        ("velocity", 20, 0.0, 20.0, false, 0.95, 1.04),
        ("velocity", 8, 0.0, 8.0, true, 0.97, 1.03),
        ("spool", 8, 8.0, -8.0, false, 0.98, 1.02),
        ("spool", 8, 8.0, -8.0, true, 0.97, 1.03),
    ] {
        for amplitude in [2200.0, 8900.0] {
            let changes = [noise(1), vec![set(&format!("sensors.{sensor}.delay"), samples)]].concat();
            let run = run(&correcting(curve, &changes), &sweep(amplitude));
            let what = format!("{sensor} {samples} samples late, {amplitude} N, noise, {}", flow(curve));
            let (low, high) = ratio(&run, 0.5, 9.5);
            // At 2.5 Hz; near 10 Hz the force, which is not late, takes most of the flow.
            let n = 8 * 4096;
            let (found, late) = (run.response_delay_estimate().at(n), run.velocity_delay_estimate().at(n));
            keep(&what, &[("least", low), ("largest", high), ("spool", found), ("velocity", late)]);
            assert_within(&what, (low, high), least, largest);
            assert!((late - velocity / RATE).abs() < 1.5e-4, "{what}: velocity {late}");
            assert!((found - 5.3e-3 - spool / RATE).abs() < 1.5e-4, "{what}: spool {found}");
            let deviation = run.velocity_delay_deviation().at(n);
            assert!(deviation > 1e-6 && deviation < 3e-4, "{what}: {deviation}");
        }
    }
}

// The noise of a differentiated displacement is as large as the velocity in parts of the sweep.
#[test]
fn a_noisy_derivative_is_followed() {
    let cases: Vec<_> = (1..5).flat_map(|seed| EITHER.map(|curve| (seed, curve))).collect();
    let derived = |(seed, curve): &(i64, bool)| {
        let source = vec![set("controller.velocity_source", "derivative")];
        correcting(*curve, &[noise(*seed), source].concat())
    };
    let rigs: Vec<_> = cases.iter().map(derived).collect();
    for amplitude in [2200.0, 8900.0] {
        for ((seed, curve), run) in cases.iter().zip(runs(&rigs, &sweep(amplitude))) {
            let (least, largest) = ratio(&run, 0.5, 9.5);
            let what = format!("derivative, {amplitude} N, seed {seed}, {}", flow(*curve));
            keep(&what, &[("least", least), ("largest", largest)]);
            assert_within(&what, (least, largest), 0.93, 1.05);
        }
    }
}

#[test]
fn a_configured_latency_does_not_change_the_valve_delay() {
    let told = [set("sensors.velocity.delay", 8), set("compensation.velocity_delay", 8.0 / RATE)];
    let (sound, late) = (run(&adaptive(&[]), &sweep(2200.0)), run(&adaptive(&told), &sweep(2200.0)));
    let end = |run: &eft::sim::TestRun| run.response_delay_estimate().last().unwrap();
    assert!((end(&sound) - end(&late)).abs() < 1e-4, "{} {}", end(&sound), end(&late));
}

// The configured values are all that is known then, and they may be anywhere within their bounds.
#[test]
fn in_silence_the_deviations_stay_large() {
    let silence = sine_sweep(1e-3, 0.5, 4.0, 10.0, RATE).unwrap();
    for gain in [0.9, 1.05] {
        let changes = [noise(3), vec![flow_gain(gain), set("controller.force_loop", "robust")]].concat();
        for (command, known) in [(&silence, false), (&sweep(2200.0), true)] {
            let run = run(&adaptive(&changes), command);
            let (found, deviation) =
                (run.flow_gain_estimate().last().unwrap(), run.flow_gain_deviation().last().unwrap());
            let what = format!("flow gain {gain}, learned: {known}");
            assert!((found - gain).abs() < 2.0 * deviation.max(1e-3), "{what}: {found} ± {deviation}");
            assert_eq!(deviation < 0.01, known, "{what}: {deviation}");
        }
    }
}

// The spool is ahead of the command by the samples of the loop, times its gain.
#[test]
fn a_wrong_valve_gain_does_not_move_the_delay() {
    let found = |gain: f64| {
        let valve = [set("servovalve.spool_sensitivity", 3579.13 / gain), valve_delay(5e-3 / gain)];
        let run = run(&adaptive(&valve), &sweep(8900.0));
        (run.valve_gain_estimate().last().unwrap(), run.response_delay_estimate().last().unwrap())
    };
    let (right, delay) = found(1.0);
    for gain in [0.85, 1.15] {
        let (other, late) = found(gain);
        assert!((other / right / gain - 1.0).abs() < 0.005, "{other} {right}");
        assert!((late - delay).abs() < 1e-5, "{gain}: {late} {delay}");
    }
}
