use std::f64::consts::TAU;

use super::*;
use crate::RigConfig;
use crate::design::force_loop::LEAST_DAMPING;
use crate::design::force_loop::tests::{near_sizes, sizes, zhao2005};

#[test]
fn a_known_latency_of_the_load_cell_keeps_every_deviating_rig_damped() {
    // The loop without a latency allows for more deviation of oil and pilot.
    let (widest, laboratory) = ([(0.6, 1.5), (0.5, 2.0)], [(0.75, 1.5), (0.6, 1.7)]);
    for plant in sizes() {
        for (milliseconds, [oil, pilot], least) in [
            (0.3, widest, LEAST_DAMPING),
            (0.9, widest, LEAST_DAMPING),
            (1.5, laboratory, 0.01),
            (2.0, laboratory, 0.01),
        ] {
            let late = HeldPiston { latency: 1e-3 * milliseconds, ..plant.clone() };
            let designed = search(&late).unwrap();
            let margins = designed.margins().unwrap();
            assert!(margins.damping >= 0.2 && margins.gain >= 2.0 && margins.e_max >= 0.2, "{margins:?}");
            for oil in [oil.0, 1.0, oil.1] {
                for pilot in [pilot.0, 1.0, pilot.1] {
                    for gain in [0.9, 1.1] {
                        let other = HeldPiston {
                            compressibility: late.compressibility / oil,
                            pilot_time_constant: late.pilot_time_constant * pilot,
                            flow_gain: late.flow_gain * gain,
                            ..late.clone()
                        };
                        let damping = other.sampled().damping(designed.gains()).unwrap();
                        let case = format!("{milliseconds} {oil} {pilot} {gain}");
                        assert!(damping > 0.99 * least, "{case}: {damping}");
                    }
                }
            }
        }
    }
}

#[test]
fn a_piston_without_leakage_gets_gains_of_use() {
    for (sample_rate, latency) in [(2048.0, 4e-3), (2048.0, 7e-3), (4096.0, 4e-3)] {
        let tight = HeldPiston { sample_rate, latency, leakage: 0.0, ..zhao2005() };
        let found = search(&tight).unwrap();
        let most = search(&HeldPiston { latency: 0.0, ..tight }).unwrap().proportional_gain;
        let case = format!("{sample_rate} {latency}: {} of {most}", found.proportional_gain);
        assert!((0.3..1.0).contains(&(found.proportional_gain / most)), "{case}");
        let margins = found.margins().unwrap();
        assert!(margins.damping >= 0.2 && margins.gain >= 2.0 && margins.e_max >= 0.2, "{case} {margins:?}");
    }
}

#[test]
fn a_known_latency_up_to_half_a_millisecond_changes_no_gain() {
    let known = search(&HeldPiston { latency: 5e-4, ..zhao2005() }).unwrap();
    assert_eq!(known.gains(), search(&zhao2005()).unwrap().gains());
}

#[test]
fn a_rig_with_stiff_oil_a_slow_pilot_and_a_late_load_cell_is_damped_when_the_latency_is_known() {
    // Rig 605 of seed 70225 of the laboratory rigs, with a wider flow curve.
    let rig = HeldPiston {
        compressibility: zhao2005().compressibility / 1.458,
        pilot_time_constant: 1.654 * zhao2005().pilot_time_constant,
        cell_bandwidth: Some(350.0),
        flow_gain: 1.1 * zhao2005().flow_gain,
        delay: 6,
        ..zhao2005()
    };
    let damping = |latency: f64| {
        let designed = search(&HeldPiston { latency, ..zhao2005() }).unwrap();
        rig.sampled().damping(designed.gains()).unwrap()
    };
    let [unknown, known] = [0.0, 1.887e-3].map(damping);
    assert!(unknown < 0.0 && known > LEAST_DAMPING, "{unknown} {known}");
}

#[test]
fn a_latency_counts_once_with_delay_and_bandwidth() {
    let design = |changes: &[(&str, toml::Value)]| {
        RigConfig::zhao2005().replace(changes).unwrap().designed_force_loop(4096.0).unwrap().gains()
    };
    let cell = [("sensors.force.delay", 4.into()), ("sensors.force.bandwidth", 400.0.into())];
    let (samples, filter) = (4.0 / 4096.0, 1.0 / (TAU * 400.0));
    let [delay, bandwidth] = cell;
    let told = [delay.clone(), bandwidth.clone(), ("controller.force_delay", (samples + filter).into())];
    assert_eq!(design(&told), design(&[delay, bandwidth]));
}

#[test]
fn a_latency_without_a_damped_loop_is_refused() {
    let error = search(&HeldPiston { latency: 6e-3, ..zhao2005() }).unwrap_err().to_string();
    assert!(error.starts_with("controller.force_delay = 0.006: no robust force loop"), "{error}");
    let error = search(&HeldPiston { latency: 9e-3, ..zhao2005() }).unwrap_err().to_string();
    assert!(error.starts_with("controller.force_delay + dac.delay = 37: "), "{error}");
}

#[test]
fn an_identified_rig_gets_larger_gains_that_damp_every_error_of_the_identification() {
    for plant in sizes() {
        for milliseconds in [0.0, 0.5, 1.0, 1.5, 1.9] {
            let known = HeldPiston { latency: 1e-3 * milliseconds, identified: true, ..plant.clone() };
            let data_sheet = search(&HeldPiston { identified: false, ..known.clone() }).unwrap();
            let designed = search(&known).unwrap();
            let share = designed.proportional_gain / data_sheet.proportional_gain;
            assert!((1.2..2.2).contains(&share), "{milliseconds}: {share}");
            let margins = designed.margins().unwrap();
            let (gain, e_max) = if milliseconds == 0.0 { (5.0, 0.3) } else { (1.6, 0.2) };
            assert!(margins.damping >= 0.2 && margins.gain >= gain && margins.e_max >= e_max, "{margins:?}");
            let least = if milliseconds > 1.0 { LATENCY_DAMPING } else { LEAST_DAMPING };
            for oil in [0.8, 1.0, 1.2] {
                for pilot in [0.8, 1.0, 1.25] {
                    for gain in [0.9, 1.1] {
                        let other = HeldPiston {
                            compressibility: known.compressibility / oil,
                            pilot_time_constant: known.pilot_time_constant * pilot,
                            flow_gain: known.flow_gain * gain,
                            ..known.clone()
                        };
                        let damping = other.sampled().damping(designed.gains()).unwrap();
                        let case = format!("{milliseconds} {oil} {pilot} {gain}");
                        assert!(damping > 0.99 * least, "{case}: {damping}");
                    }
                }
            }
        }
    }
}

#[test]
fn identified_rigs_near_three_sizes_get_a_loop_with_margins() {
    for near in near_sizes() {
        let designed = search(&HeldPiston { identified: true, ..near }).unwrap();
        let margins = designed.margins().unwrap();
        assert!(margins.damping >= 0.2 && margins.gain >= 3.0, "{margins:?}");
    }
}
