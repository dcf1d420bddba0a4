//! Flow feedforward: it removes the force error that the paper's scheme has because of the command's own flow.

use eft::sim::excitation::sine_sweep;
use eft::sim::metrics::{delay, fft_ratio, nrmse};
use eft::sim::{RigConfig, SimulateOptions, TestRun, simulate};

fn run(changes: &[(&str, toml::Value)], amplitude: f64) -> TestRun {
    let rig = RigConfig::zhao2005().replace(changes).unwrap();
    let command = sine_sweep(amplitude, 0.0, 10.0, 32.0, 4096.0).unwrap();
    simulate::<f64>(&rig, &command, &SimulateOptions::default(), |_, _| true).unwrap()
}

// An independent model gives 1.4 % instead of 5.8 % at this sample rate with the configured delay.
#[test]
fn sweep_error_falls_to_a_quarter() {
    let run = run(&[("compensation.feedforward", true.into())], 8900.0);
    let error = nrmse(&run.command, &run.force).unwrap();
    assert!((0.010..0.0145).contains(&error), "NRMSE {error}");
    let ratio = fft_ratio(&run.command, &run.force, 4096.0, 2.0, 9.5).unwrap();
    assert!(ratio.min().0 > 0.98 && ratio.max().0 < 1.02, "{:?} {:?}", ratio.min(), ratio.max());
}

// The command's own flow is late by half a sample of difference and half a sample of hold.
#[test]
fn look_ahead_compensates_for_a_sample() {
    let judged = |changes: &[(&str, toml::Value)], sample_rate: f64, ahead: bool| {
        let key = ("compensation.look_ahead", ahead.into());
        let rig = RigConfig::zhao2005().replace(&[changes, &[key]].concat()).unwrap();
        let command = sine_sweep(2200.0, 0.0, 10.0, 32.0, sample_rate).unwrap();
        let run = simulate::<f64>(&rig, &command, &SimulateOptions::default(), |_, _| true).unwrap();
        delay(&run.command, &run.force, sample_rate).unwrap()
    };
    let adaptive =
        [("compensation.feedforward", true.into()), ("compensation.adaptive", true.into())].to_vec();
    let digital = [adaptive.clone(), vec![("controller.realization", "digital".into())]].concat();
    // A digital controller at 512 Hz would not hold the oil column.
    for (changes, sample_rate, share) in [(adaptive, 512.0, 0.9), (digital, 2048.0, 0.97)] {
        let (without, with) = (judged(&changes, sample_rate, false), judged(&changes, sample_rate, true));
        assert!(with < share * without, "{without} {with}");
    }
    // Without a feedforward nothing changes.
    assert_eq!(judged(&[], 512.0, false).to_bits(), judged(&[], 512.0, true).to_bits());
}

#[test]
fn works_in_both_realizations_and_in_single_precision() {
    for realization in ["analog", "digital"] {
        let rig = RigConfig::zhao2005()
            .replace::<&str>(&[
                ("compensation.feedforward", true.into()),
                ("controller.realization", realization.into()),
            ])
            .unwrap();
        let command = sine_sweep(2200.0, 0.0, 10.0, 32.0, 4096.0).unwrap();
        let double = simulate::<f64>(&rig, &command, &SimulateOptions::default(), |_, _| true).unwrap();
        let single = simulate::<f32>(&rig, &command, &SimulateOptions::default(), |_, _| true).unwrap();
        let (double, single) =
            (nrmse(&double.command, &double.force).unwrap(), nrmse(&single.command, &single.force).unwrap());
        assert!(double < 0.02, "{realization}: {double}");
        assert!((double - single).abs() < 1e-4, "{realization}: {double} {single}");
    }
}

#[test]
fn known_friction_takes_no_force_and_hides_no_latency() {
    let friction = 1500.0;
    let tested = |changes: &[(&str, toml::Value)]| {
        let scheme = [
            ("controller.force_loop", "robust".into()),
            ("compensation.adaptive", true.into()),
            ("compensation.feedforward", true.into()),
            ("compensation.look_ahead", true.into()),
        ];
        let run = run(&[&scheme, changes].concat(), 2200.0);
        let ratio = fft_ratio(&run.command, &run.force, 4096.0, 0.5, 9.5).unwrap();
        let latency = run.velocity_delay_estimate();
        (ratio.max().0.max(2.0 - ratio.min().0) - 1.0, latency.at(latency.len() - 1).abs())
    };
    let (unknown, unknown_latency) = tested(&[("truth.actuator.friction", friction.into())]);
    let (known, latency) = tested(&[("actuator.friction", friction.into())]);
    assert!(known < 0.6 * unknown, "{known} {unknown}");
    assert!(latency < 0.3 * unknown_latency, "{latency} {unknown_latency}");
    // A wrong value is not worse than none.
    for share in [0.7, 1.3] {
        let believed = ("actuator.friction", (share * friction).into());
        let (wrong, _) = tested(&[believed, ("truth.actuator.friction", friction.into())]);
        assert!(wrong < 0.8 * unknown, "{share}: {wrong} {unknown}");
    }
}

// In phase with the velocity the lag of the integral part would look like overcompensation.
#[test]
fn without_a_feedforward_the_designed_loop_keeps_the_full_level() {
    let designed = [("controller.force_loop", "robust".into()), ("compensation.adaptive", true.into())];
    let run = run(&designed, 8900.0);
    let level = run.level();
    assert!((0..level.len()).all(|tick| level.at(tick) > 0.999));
    assert!(nrmse(&run.command, &run.force).unwrap() < 0.08);
}
