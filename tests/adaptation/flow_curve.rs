//! A flow table of wrong shape, by direction and by band of opening, which one flow gain cannot correct.

use eft::core::status;
use eft::sim::TestRun;
use eft::sim::excitation::Command;
use toml::Value;

use crate::results::keep;
use crate::rigs::*;

/// A true valve whose flow is the table's times this factor at every opening; the controller keeps the table.
fn valve(factor: impl Fn(f64) -> f64) -> Vec<Change> {
    let known = &rig(&[]).servovalve.flow_table;
    let flows: Vec<_> = known.openings.iter().zip(&known.flows).map(|(x, q)| q * factor(*x)).collect();
    let list = |values: Vec<f64>| values.into_iter().map(Value::from).collect::<Vec<_>>();
    vec![
        set("servovalve.true_flow_table.openings", list(known.openings.clone())),
        set("servovalve.true_flow_table.flows", list(flows)),
    ]
}

/// 5 % more in one direction, 5 % less in the other.
fn sided(x: f64) -> f64 {
    if x > 0.0 { 1.05 } else { 0.95 }
}

/// Softer at large openings: 3 % less at 55 %.
fn soft(x: f64) -> f64 {
    1.0 - 0.2 * (x.abs() - 0.4).max(0.0)
}

fn sided_and_soft(x: f64) -> f64 {
    sided(x) * soft(x)
}

/// The test with one flow gain, and with the curve corrected.
fn both(changes: &[Vec<Change>], amplitude: f64) -> (TestRun, TestRun) {
    let with = |on: bool| {
        let all = [changes.concat(), vec![set("compensation.curve_correction", on)]].concat();
        run(&adaptive(&all), &sweep(amplitude))
    };
    (with(false), with(true))
}

#[test]
fn the_curve_correction_finds_directions_and_bands() {
    for (name, factor, amplitudes) in [
        ("sided", sided as fn(f64) -> f64, &[2200.0, 8900.0][..]),
        // 2.2 kN does not open the valve so far.
        ("soft", soft, &[8900.0][..]),
        ("sided and soft", sided_and_soft, &[8900.0][..]),
    ] {
        for amplitude in amplitudes {
            for sensors in [vec![], noise(1)] {
                let (lowest, highest, noise) =
                    if sensors.is_empty() { (0.97, 1.03, "") } else { (0.95, 1.05, ", noise") };
                let (one_gain, corrected) = both(&[valve(factor), sensors], *amplitude);
                let what = format!("{name}, {amplitude} N{noise}");
                for (run, curve) in [(&one_gain, false), (&corrected, true)] {
                    let (least, largest) = ratio(run, 0.5, 9.5);
                    keep(
                        format_args!("{what}, {}", flow(curve)),
                        &[("least", least), ("largest", largest), ("NRMSE", error(run))],
                    );
                }
                assert_within(&what, ratio(&corrected, 0.5, 9.5), lowest, highest);
                let (least, largest) = ratio(&one_gain, 0.5, 9.5);
                assert!(least < 0.97 && largest > 1.03, "{what}: one gain is as good");
                assert!(error(&corrected) < 0.7 * error(&one_gain), "{what}");
            }
        }
    }
}

/// Only `compensation.adaptive` is set.
#[test]
fn an_adaptive_rig_learns_the_directions_by_default() {
    let uneven = valve(|x| if x > 0.0 { 1.08 } else { 0.92 });
    let adaptive = rig(&[vec![set("compensation.adaptive", true)], uneven].concat());
    let one_gain = adaptive.replace(&[set("compensation.curve_correction", false)]).unwrap();
    for amplitude in [2200.0, 8900.0] {
        let found = [&adaptive, &one_gain].map(|rig| ratio(&run(rig, &sweep(amplitude)), 0.5, 9.5));
        for (curve, (least, largest)) in [true, false].into_iter().zip(found) {
            keep(
                format_args!("directions ±8 %, defaults, {amplitude} N, {}", flow(curve)),
                &[("least", least), ("largest", largest)],
            );
        }
        let [corrected, (least, largest)] = found;
        assert_within(&format!("{amplitude} N"), corrected, 0.95, 1.02);
        assert!(least < 0.75 && largest > 1.3, "{amplitude} N: one gain is as good: {least} {largest}");
    }
}

#[test]
fn a_correct_table_is_not_changed() {
    for amplitude in [2200.0, 8900.0] {
        let (one_gain, corrected) = both(&[], amplitude);
        assert!(error(&corrected) < 1.02 * error(&one_gain), "{amplitude} N");
        assert_quiet(&corrected);
        for seed in [1, 2, 3] {
            let (one_gain, corrected) = both(&[noise(seed)], amplitude);
            assert!(error(&corrected) < 1.03 * error(&one_gain), "{amplitude} N, noise {seed}");
            assert_within("noise", ratio(&corrected, 0.5, 9.5), 0.97, 1.03);
        }
        // An offset of a sensor is no error of the table.
        for (sensor, bias) in [("spool", 2e-3), ("spool", -5e-3), ("velocity", 1e-3), ("force", 500.0)] {
            let (one_gain, corrected) =
                both(&[vec![set(&format!("sensors.{sensor}.bias"), bias)]], amplitude);
            keep(
                format_args!("bias {bias} of {sensor}, {amplitude} N"),
                &[("NRMSE one gain", error(&one_gain)), ("NRMSE corrected", error(&corrected))],
            );
            assert!(error(&corrected) < 1.1 * error(&one_gain) + 0.002, "{amplitude} N, {sensor}");
        }
    }
}

#[test]
fn gain_and_delay_are_found_as_without_the_correction() {
    let correcting = || set("compensation.curve_correction", true);
    for (what, change) in [
        ("gain 0.9", flow_gain(0.9)),
        ("gain 1.1", flow_gain(1.1)),
        ("delay 3 ms", valve_delay(3e-3)),
        ("delay 8 ms", valve_delay(8e-3)),
        ("damping 1 %", damping_ratio(0.01)),
    ] {
        for amplitude in [2200.0, 8900.0] {
            for (sensors, lowest, highest) in [(vec![], 0.97, 1.03), (noise(3), 0.95, 1.05)] {
                let run = run(
                    &adaptive(&[vec![change.clone(), correcting()], sensors].concat()),
                    &sweep(amplitude),
                );
                // Cases with a wrong delay or a sharp resonance have bounds of their own.
                let (from, to) = if what.starts_with("delay") { (1.2, 2.0) } else { (0.5, 9.5) };
                let wide = !what.starts_with("gain");
                let bounds = if wide { (0.95, 1.05) } else { (lowest, highest) };
                assert_within(&format!("{what}, {amplitude} N"), ratio(&run, from, to), bounds.0, bounds.1);
            }
        }
    }
}

/// The largest relative error of the found curve, for openings from 4 % to `widest`.
fn worst(run: &TestRun, factor: fn(f64) -> f64, widest: f64) -> f64 {
    let known = &run.rig.servovalve.flow_table;
    let truth = known.openings.iter().zip(&known.flows).map(|(x, q)| (x, q * factor(*x)));
    let visited = truth.zip(&run.found_flows).filter(|((x, _), _)| (0.04..widest).contains(&x.abs()));
    visited.fold(0.0, |most: f64, ((_, q), found)| most.max((found / q - 1.0).abs()))
}

#[test]
fn the_found_curve_is_the_true_one_at_the_visited_openings() {
    for (name, sensors, allowed) in [("", vec![], 0.01), (", noise", noise(2), 0.012)] {
        let (_, run_) = both(&[valve(sided_and_soft), sensors], 8900.0);
        let found = worst(&run_, sided_and_soft, 0.55);
        assert!(found < allowed, "{found}");
        // The next test starts from it, with the paper's scheme and feedforward.
        let fixed = run_.corrected_rig().unwrap().replace(&[set("compensation.adaptive", false)]).unwrap();
        let next = run(&fixed, &sweep(8900.0));
        keep(format_args!("found curve{name}"), &[("curve", found), ("NRMSE next test", error(&next))]);
        assert_eq!(next.status_union() & status::DIVERGED, 0);
        assert_within("next test", ratio(&next, 0.5, 1.2), 0.97, 1.03);
    }
}

#[test]
fn nothing_is_learned_without_motion_or_with_the_key_off() {
    let (off, on) = both(&[], 2200.0);
    let table = &off.rig.servovalve.flow_table.flows;
    // One gain only scales the whole table.
    let scale = off.flow_gain_estimate().last().unwrap();
    for (found, known) in off.found_flows.iter().zip(table) {
        assert!((found - scale * known).abs() < 1e-12);
    }
    // Beyond the openings at 2.2 kN, up to the next node, the gain of the direction applies.
    assert!(
        on.found_flows.iter().zip(table).all(|(found, known)| (found - known).abs() <= 0.01 * known.abs())
    );
}

#[test]
fn a_null_bias_is_found_and_is_no_asymmetry() {
    for bias in [-0.015, 0.015] {
        let changes = [set("compensation.curve_correction", true), set("truth.servovalve.null_bias", bias)];
        let run = run(&adaptive(&changes), &sweep(8900.0));
        let found = run.calibration.as_ref().unwrap();
        keep(
            format_args!("null bias {bias}"),
            &[("null offset", found.null_offset), ("asymmetry", found.curve.asymmetry)],
        );
        assert!((found.null_offset / bias - 1.0).abs() < 0.01, "{bias}: {}", found.null_offset);
        assert!(found.curve.asymmetry.abs() < 1e-3, "{bias}: {}", found.curve.asymmetry);
    }
}

// In the linear scheme the flow gain is that of a straight line, so the table must not change.
#[test]
fn the_linear_scheme_finds_no_table() {
    let linear = set("compensation.mode", "linear");
    let command = Command { values: vec![1e3; 400], sample_rate: RATE };
    let refused =
        run(&adaptive(std::slice::from_ref(&linear)), &command).corrected_rig().unwrap_err().to_string();
    assert!(refused.starts_with("compensation.mode = \"linear\": must be \"nonlinear\""), "{refused}");
    let fixed = run(&rig(&[linear]), &command);
    assert_eq!(fixed.corrected_rig().unwrap().servovalve.flow_table, fixed.rig.servovalve.flow_table);
}
