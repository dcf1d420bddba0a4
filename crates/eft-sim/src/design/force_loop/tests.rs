use super::*;
use crate::RigConfig;
use crate::analysis::linear::{FlowGain, Time, linearize, stability_margins};

const CUBIC_INCH: f64 = 1.6387064e-5;

/// The paper's rig at 4096 Hz, from numbers and not from a configuration.
pub(in crate::design) fn zhao2005() -> HeldPiston {
    HeldPiston {
        pilot_time_constant: 1.4e-3,
        torque_motor: None,
        pilot_flow_gain: 1.06e-5,
        spool_voltage: 3579.13 * 2.79e-3,
        spool_volume: 1.964e-4 * 2.79e-3,
        flow_gain: 1022.0 * CUBIC_INCH,
        flow_gain_beyond: None,
        compressibility: 7.56e-13,
        leakage: 1.3e-11,
        piston_area: 8.212e-3,
        force_sensitivity: 5.6e-5,
        cell_bandwidth: None,
        delay: 0,
        latency: 0.0,
        identified: false,
        sample_rate: 4096.0,
    }
}

/// Larger and smaller: 250 kN with a three-stage valve, 25 kN with a fast one.
pub(in crate::design) fn sizes() -> [HeldPiston; 3] {
    let zhao = zhao2005();
    let large = HeldPiston {
        pilot_time_constant: 2.0e-3,
        flow_gain: 2.5 * zhao.flow_gain,
        compressibility: 1.8e-12,
        piston_area: 1.32e-2,
        force_sensitivity: 4.0e-5,
        ..zhao.clone()
    };
    let small = HeldPiston {
        pilot_time_constant: 0.8e-3,
        pilot_flow_gain: 2.0 * zhao.pilot_flow_gain,
        flow_gain: 0.12 * zhao.flow_gain,
        compressibility: 9.0e-14,
        leakage: 1.5e-12,
        piston_area: 1.32e-3,
        force_sensitivity: 4.0e-4,
        ..zhao.clone()
    };
    [zhao, large, small]
}

#[test]
fn the_papers_rig_has_the_margins_of_an_independent_model() {
    // Margins of G_p 0.36 and G_d 1.0 ms from NumPy and SciPy's root and minimum finders.
    let chosen = ForceLoop {
        proportional_gain: 0.36,
        derivative_gain: 1e-3,
        integral_gain: 0.0,
        plants: vec![zhao2005().sampled()],
    };
    let margins = chosen.margins().unwrap();
    assert!((margins.damping - 0.45924480).abs() < 1e-6, "{margins:?}");
    assert!((margins.gain - 11.1672373).abs() < 1e-6, "{margins:?}");
    assert!((margins.delay / 3.002_381_323_8e-3 - 1.0).abs() < 1e-7, "{margins:?}");
    assert!((margins.e_max - 0.391_924_034_56).abs() < 1e-8, "{margins:?}");
}

#[test]
fn rigs_of_three_sizes_stay_damped_under_every_deviation() {
    for plant in sizes() {
        let designed = search(&plant).unwrap();
        let margins = designed.margins().unwrap();
        assert!(margins.damping >= 0.3 && margins.gain >= 5.0 && margins.e_max >= 0.3, "{margins:?}");
        for oil in [0.6, 0.8, 1.0, 1.25, 1.5] {
            for pilot in [0.5, 0.8, 1.25, 2.0] {
                for (gain, delay) in [(0.9, 0), (0.9, 4), (1.0, 1), (1.1, 0), (1.1, 4)] {
                    let other = HeldPiston {
                        compressibility: plant.compressibility / oil,
                        pilot_time_constant: plant.pilot_time_constant * pilot,
                        flow_gain: plant.flow_gain * gain,
                        delay,
                        ..plant.clone()
                    };
                    let damping = other.sampled().damping(designed.gains()).unwrap();
                    assert!(damping > 0.99 * LEAST_DAMPING, "{oil} {pilot} {gain} {delay}: {damping}");
                }
            }
        }
    }
}

/// Rigs near the three sizes: oil, pilot time constant and flow gain are 0.7 or 1.3 times as large.
pub(in crate::design) fn near_sizes() -> impl Iterator<Item = HeldPiston> {
    sizes().into_iter().flat_map(|plant| {
        (0..8).map(move |bits| {
            let factor = |bit: u32| if bits >> bit & 1 == 1 { 1.3 } else { 0.7 };
            HeldPiston {
                compressibility: factor(0) * plant.compressibility,
                pilot_time_constant: factor(1) * plant.pilot_time_constant,
                flow_gain: factor(2) * plant.flow_gain,
                ..plant.clone()
            }
        })
    })
}

#[test]
fn rigs_near_three_sizes_get_a_loop_with_margins() {
    for near in near_sizes() {
        let margins = search(&near).unwrap().margins().unwrap();
        assert!(margins.damping >= 0.2 && margins.gain >= 3.0 && margins.e_max >= 0.3, "{margins:?}");
    }
}

#[test]
fn a_loop_is_designed_for_an_actuator_with_little_leakage() {
    let leaking = search(&zhao2005()).unwrap();
    let tight = search(&HeldPiston { leakage: 1e-16, ..zhao2005() }).unwrap();
    assert!((tight.proportional_gain / leaking.proportional_gain - 1.0).abs() < 0.2, "{tight:?}");
    assert!(tight.margins().unwrap().damping > 0.3);
}

#[test]
fn a_high_sample_rate_takes_no_longer() {
    // Each sample of delay is a state, and the poles of hundreds of states take minutes.
    let fast = HeldPiston { sample_rate: 1e6, ..zhao2005() };
    let corner = fast.deviating(DEVIATIONS.oil_stiffness[0], DEVIATIONS.pilot_time_constant[0]);
    assert_eq!(corner.samples(), FURTHER_SAMPLES + 14);
    let usual = zhao2005().deviating(DEVIATIONS.oil_stiffness[0], DEVIATIONS.pilot_time_constant[0]);
    assert_eq!(usual.samples(), FURTHER_SAMPLES + 2);
}

#[test]
fn a_soft_spring_gets_a_longer_integral_time() {
    let soft = HeldPiston { compressibility: 4.9e-11, ..zhao2005() };
    let designed = search(&soft).unwrap();
    let margins = designed.margins().unwrap();
    assert!(margins.damping >= 0.2 && margins.gain >= 3.0 && margins.e_max >= 0.3, "{margins:?}");
    assert!(designed.proportional_gain / designed.integral_gain > 0.015, "{designed:?}");
}

#[test]
fn another_ratio_is_taken_where_that_of_the_lowest_peak_lacks_a_margin() {
    // A valve half as fast and stiffer oil at 1,024 Hz: the ratio of the lowest peak leaves too small a static gain.
    let zhao = zhao2005();
    let slow = HeldPiston {
        pilot_flow_gain: 0.5 * zhao.pilot_flow_gain,
        pilot_time_constant: 2.0 * zhao.pilot_time_constant,
        compressibility: 0.7 * zhao.compressibility,
        sample_rate: 1024.0,
        ..zhao
    };
    let designed = search(&slow).unwrap();
    let margins = designed.margins().unwrap();
    assert!(margins.damping >= NOMINAL_DAMPING && margins.gain >= NOMINAL_GAIN_MARGIN, "{margins:?}");
    assert!(designed.proportional_gain * slow.static_gain() >= LEAST_STATIC_GAIN);
    assert!(damped(&corners(&slow, &DEVIATIONS), designed.gains(), LEAST_DAMPING).unwrap());
}

#[test]
fn a_refusal_says_what_is_missing() {
    let refused = |plant: HeldPiston| search(&plant).unwrap_err().to_string();
    let leaking = refused(HeldPiston { leakage: 20.0 * 1.3e-11, ..zhao2005() });
    assert!(leaking.contains("a static loop gain of 3.8") && leaking.contains("5 is needed"), "{leaking}");
    let slow = refused(HeldPiston { torque_motor: Some((60.0, 0.7)), ..zhao2005() });
    assert!(slow.contains("none leave the rig itself"), "{slow}");
}

#[test]
fn a_loop_that_is_sampled_too_slowly_is_refused() {
    let error = search(&HeldPiston { sample_rate: 40.0, ..zhao2005() }).unwrap_err().to_string();
    assert!(error.starts_with("controller.force_loop = \"robust\": no gains of use"), "{error}");
}

#[test]
fn a_sample_rate_beyond_all_samplers_is_named() {
    for rate in [f64::NAN, f64::INFINITY, -4096.0, 0.0, 5e-324, 2e9] {
        let error = RigConfig::zhao2005().designed_force_loop(rate).unwrap_err().to_string();
        assert!(error.starts_with("sample_rate = ") && error.ends_with("within 1e-6 and 1e9 Hz"), "{error}");
    }
}

#[test]
fn a_rig_uses_the_designed_gains_and_keeps_its_own() {
    let base = RigConfig::zhao2005();
    let robust = base.replace(&[("controller.force_loop", "robust".into())]).unwrap();
    let designed = search(&zhao2005()).unwrap();
    assert_eq!(robust.controller.proportional_gain, designed.proportional_gain);
    assert_eq!(robust.controller.derivative_gain, designed.derivative_gain);
    assert_eq!(robust.controller.integral_gain, designed.integral_gain);
    assert!(robust.to_toml().contains("proportional_gain = 0.8059"));
    assert_eq!(RigConfig::from_toml(&robust.to_toml()).unwrap(), robust);
    let back = robust.replace(&[("controller.force_loop", "pd".into())]).unwrap();
    assert_eq!(back, base);
    // `truth` does not change the design.
    let stiffer = robust.replace(&[("truth.actuator.compressibility", 5e-13.into())]).unwrap();
    assert_eq!(stiffer.plant().controller, robust.controller);
}

#[test]
fn the_designed_rig_is_stable_where_the_papers_gains_are_not() {
    let truth = [
        ("truth.actuator.compressibility", (7.56e-13 / 1.4).into()),
        ("truth.servovalve.pilot_time_constant", 2.4e-3.into()),
        ("truth.dac.delay", 1.into()),
        ("controller.realization", "digital".into()),
    ];
    let paper = RigConfig::zhao2005().replace(&truth).unwrap();
    let robust = paper.replace(&[("controller.force_loop", "robust".into())]).unwrap();
    let growth = |rig: &RigConfig, rate: f64| {
        linearize(rig, FlowGain::Nominal, Time::Sampled(rate)).unwrap().growth_rate().unwrap()
    };
    assert!(growth(&paper, 4096.0) > 10.0);
    // Another sample rate gives another design.
    for rate in [2048.0, 4096.0, 10_000.0] {
        assert!(growth(&robust, rate) < 0.0, "{rate}");
    }
    let sound = robust.without(&["truth"]).unwrap();
    let margins = stability_margins(&sound, FlowGain::Nominal, Time::Sampled(4096.0)).unwrap();
    assert!(margins.level > 1.4 && margins.around.as_ref().unwrap().loop_gain > 3.0, "{margins:?}");
}

#[test]
fn a_least_gain_margin_is_there_up_to_the_gain_margin() {
    for plant in sizes() {
        let (designed, plant) = (search(&plant).unwrap(), plant.sampled());
        let margin = plant.gain_margin(designed.gains()).unwrap();
        for (least, expected) in
            [(0.5, true), (0.999 * margin, true), (1.001 * margin, false), (2.0 * margin, false)]
        {
            assert_eq!(
                plant.has_gain_margin(designed.gains(), least).unwrap(),
                expected,
                "{least} of {margin}"
            );
        }
    }
}

#[test]
fn the_first_undamped_step_is_exact_for_curves_and_jumps() {
    let (from, end) = (1000, 1000 + (1 << 15));
    for edge in [from + 1, from + 2, 12_345, end - 1, end] {
        let steep = |step: u32| Ok((f64::from(edge) - 0.5 - f64::from(step)).powi(3));
        let jump = |step: u32| Ok(if step < edge { 0.9 } else { -1e-9 });
        assert_eq!(first_undamped(steep, from, end).unwrap(), edge);
        assert_eq!(first_undamped(jump, from, end).unwrap(), edge);
    }
}
