//! Self-calibration with a tone on a sensor: hum of the mains, and a tone within the band of the motion.

use std::f64::consts::TAU;

use eft::core::Input;
use eft::sim::SimulateOptions;
use eft::sim::closed_loop::{PlantStepper, RigChannel, parameters};
use eft::sim::metrics::fft_ratio;

use crate::results::keep;
use crate::rigs::*;

/// Least and largest force over command of a sweep, with a tone of a frequency (Hz) on the readings of velocity (m/s)
/// and spool (1).
fn with_a_tone(curve: bool, amplitude: f64, frequency: f64, [velocity, spool]: [f64; 2]) -> (f64, f64) {
    let digital = vec![set("controller.realization", "digital")];
    let (rig, sweep) = (correcting(curve, &[digital, noise(1)].concat()), sweep(amplitude));
    let mut plant = PlantStepper::new(&rig, RATE, &SimulateOptions::default()).unwrap();
    let mut controller = RigChannel::<f64>::new(&parameters(&rig, RATE).unwrap(), None).unwrap();
    let step = |(n, command): (usize, &f64)| {
        let (now, tone) = (plant.readings()[0], (TAU * frequency * n as f64 / RATE).sin());
        let (velocity, spool) = (now.velocity + velocity * tone, now.spool + spool * tone);
        let input = Input { command: *command, velocity, force: now.force, spool, ..Input::default() };
        plant.step(&[controller.step(&input).voltage]).unwrap();
        now.force
    };
    let force: Vec<f64> = sweep.values.iter().enumerate().map(step).collect();
    let ratio = fft_ratio(&sweep.values, &force, RATE, 0.5, 9.5).unwrap();
    (ratio.min().0, ratio.max().0)
}

#[test]
fn a_tone_on_the_spools_sensor_hardly_changes_the_curve() {
    for (amplitude, lowest, highest) in [(2200.0, 0.93, 1.07), (8900.0, 0.96, 1.04)] {
        let (least, largest) = with_a_tone(true, amplitude, 6.0, [0.0, 5e-3]);
        keep(format_args!("tone on the spool, {amplitude} N"), &[("least", least), ("largest", largest)]);
        assert_within(&format!("{amplitude} N"), (least, largest), lowest, highest);
    }
}

// Hum of 0.3 % of the velocity's range. It moves the true force as well, so the fixed scheme has 0.98 to 1.10.
#[test]
fn hum_of_the_mains_hardly_changes_the_estimates() {
    for curve in EITHER {
        for (hertz, amplitude) in [(50.0, 2200.0), (50.0, 8900.0), (60.0, 2200.0), (60.0, 8900.0)] {
            let (least, largest) = with_a_tone(curve, amplitude, hertz, [3e-3 * 1.05, 0.0]);
            let what = format!("hum of {hertz} Hz, {amplitude} N, {}", flow(curve));
            keep(&what, &[("least", least), ("largest", largest)]);
            assert_within(&what, (least, largest), 0.95, 1.05);
        }
    }
}
