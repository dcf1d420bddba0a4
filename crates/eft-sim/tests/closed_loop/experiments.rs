//! Identification from experiments on the virtual rig, compared with its true values.

use std::f64::consts::TAU;

use eft_sim::RigConfig;
use eft_sim::identification::{
    FlowTest, Recording, flow_curve_by_differences, flow_test, free_vibration, identify_damping,
    identify_delay, identify_flow_curve, identify_flow_gain, valve_test,
};
use eft_sim::linear::{phase_delay, valve_response};

#[test]
fn the_delay_of_valves_from_2_to_10_ms_is_their_phase_slope() {
    for delay in [2e-3, 4e-3, 5.18e-3, 10e-3] {
        // The delay of the inner loop is 1/(K_3·K_vp/A_v); the pilot's time constant is scaled in
        // proportion.
        let ratio = 5.18e-3 / delay;
        let rig = RigConfig::zhao2005().with(|rig| {
            rig.servovalve.pilot_flow_gain *= ratio;
            rig.servovalve.pilot_time_constant /= ratio;
        });
        let rig = rig.unwrap();
        let test = valve_test(&rig, 0.0254, 2000.0).unwrap();
        let band = (0.25, 10.0);
        let found = identify_delay(&test.valve_command, &test.spool, 2000.0, band).unwrap();
        // The virtual rig holds the command for a sample.
        let true_delay = phase_delay(|f| valve_response(&rig, f), band).unwrap() + 0.5 / 2000.0;
        assert!((found.delay / true_delay - 1.0).abs() < 0.02, "{delay}: {} and {true_delay}", found.delay);
    }
}

fn flow_tests() -> Vec<FlowTest> {
    let rig = RigConfig::zhao2005();
    let run = |share: f64| flow_test(&rig, share * rig.actuator.stroke, 3.0, 4.0, 20.0, 2048.0).unwrap();
    [0.9, 0.8, 0.6, 0.4, 0.2].map(run).to_vec()
}

fn worst(tests: &[FlowTest]) -> (f64, usize) {
    let rig = RigConfig::zhao2005();
    let recordings: Vec<_> =
        tests.iter().map(|t| Recording { spool: &t.spool, displacement: &t.displacement }).collect();
    let found = identify_flow_curve(&recordings, 2048.0, rig.actuator.piston_area, 21).unwrap();
    let truth = &rig.servovalve.flow_table.flows;
    let error = |i: usize| (found.flows[i] - truth[i]).abs() / truth[20];
    let reached = (0..21).filter(|i| found.measured[*i]);
    (reached.clone().map(error).fold(0.0, f64::max), reached.count())
}

#[test]
fn the_flow_curve_of_the_virtual_rig_is_table_2() {
    let mut tests = flow_tests();
    let (error, reached) = worst(&tests);
    assert!(error < 0.01 && reached >= 15, "{error} at {reached} points");
    // 1 % of each sensor's range, uniform noise of that standard deviation.
    let mut state = 7_u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) * 12.0_f64.sqrt()
    };
    for test in &mut tests {
        test.spool.iter_mut().for_each(|v| *v += 0.01 * noise());
        test.displacement.iter_mut().for_each(|v| *v += 0.01 * 0.127 * noise() + 0.003);
        test.displacement[3000..3200].fill(f64::NAN);
    }
    let (error, reached) = worst(&tests);
    assert!(error < 0.02 && reached >= 15, "{error} at {reached} points with noise");
}

#[test]
fn mean_flows_by_differences_are_table_2() {
    let rig = RigConfig::zhao2005();
    let tests = flow_tests();
    let recordings: Vec<_> =
        tests.iter().map(|t| Recording { spool: &t.spool, displacement: &t.displacement }).collect();
    let found = flow_curve_by_differences(&recordings, 2048.0, rig.actuator.piston_area, 21).unwrap();
    let truth = &rig.servovalve.flow_table.flows;
    for i in (0..21).filter(|i| found.measured[*i]) {
        let error = (found.flows[i] - truth[i]).abs() / truth[20];
        assert!(error < 0.01, "{error} at {}", found.openings[i]);
    }
    // Beyond the data the points are on the line through the last two.
    let last = found.measured.iter().rposition(|m| *m).unwrap();
    assert!(last < 20);
    let step = |i: usize| found.flows[i] - found.flows[i - 1];
    assert!((step(20) / step(last) - 1.0).abs() < 1e-9);
}

#[test]
fn the_flow_gain_at_the_origin_is_the_slope_there() {
    let tests = flow_tests();
    let recordings: Vec<_> =
        tests.iter().map(|t| Recording { spool: &t.spool, displacement: &t.displacement }).collect();
    let found = identify_flow_gain(&recordings, 2048.0, 8.212e-3, 0.1).unwrap();
    let mean = 1016.0 * 1.6387064e-5;
    assert!((found.value / mean - 1.0).abs() < 0.01, "{found:?}, {mean}");
}

#[test]
fn free_vibration_gives_the_structure_s_damping() {
    let rig = RigConfig::zhao2005();
    let found = identify_damping(&free_vibration(&rig, 0.02, 10.0, 500.0).unwrap(), 500.0).unwrap();
    let s = &rig.structure;
    let omega = (s.stiffness / s.mass).sqrt();
    let ratio = s.damping / (2.0 * s.mass * omega);
    assert!((found.ratio.value / ratio - 1.0).abs() < 1e-4, "{found:?}, {ratio}");
    assert!((found.frequency.value / (omega / TAU) - 1.0).abs() < 1e-6);
}

#[test]
fn a_free_vibration_is_the_same_at_every_sample_rate() {
    let rig = RigConfig::zhao2005();
    let fine = free_vibration(&rig, 0.02, 10.0, 512.0).unwrap();
    let coarse = free_vibration(&rig, 0.02, 10.0, 1.0).unwrap();
    assert_eq!(coarse, fine.iter().step_by(512).copied().collect::<Vec<_>>());
}

#[test]
fn a_wrong_argument_of_an_experiment_is_named() {
    let rig = RigConfig::zhao2005();
    for (from, duration, rate, named) in [
        (f64::NAN, 1.0, 512.0, "displacement"),
        (f64::INFINITY, 1.0, 512.0, "displacement"),
        (1e308, 1.0, 512.0, "displacement"),
        (0.02, f64::NAN, 512.0, "duration"),
        (0.02, f64::INFINITY, 512.0, "duration"),
        (0.02, 0.0, 512.0, "duration"),
        (0.02, 1e12, 512.0, "number of samples"),
        (0.02, 1.0, f64::INFINITY, "sample_rate"),
    ] {
        let error = free_vibration(&rig, from, duration, rate).unwrap_err().to_string();
        assert!(error.starts_with(&format!("{named} = ")), "{error}");
    }
    let error = flow_test(&rig, 0.01, f64::NAN, 1.0, 20.0, 2048.0).unwrap_err().to_string();
    assert!(error.starts_with("frequency = NaN"), "{error}");
    let error = flow_test(&rig, 0.2, 3.0, 1.0, 20.0, 2048.0).unwrap_err().to_string();
    assert_eq!(error, "amplitude = 0.2: must be at most the stroke, 0.127 m");
    let error = flow_test(&rig, 0.01, 3.0, 1.0, -1.0, 2048.0).unwrap_err().to_string();
    assert!(error.starts_with("piston_mass = -1"), "{error}");
}
