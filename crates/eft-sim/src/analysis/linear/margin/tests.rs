use super::*;

type Change<'a> = &'a dyn Fn(&mut RigValues);

fn level(rig: &RigConfig) -> f64 {
    stability_margin(rig, FlowGain::Nominal, Time::Continuous).unwrap()
}

#[test]
fn margin_of_the_reference_model() {
    let rig = RigConfig::zhao2005();
    assert!((level(&rig) - 1.0374).abs() < 5e-5, "{}", level(&rig));
}

#[test]
fn a_search_that_may_end_early_has_the_margin_or_finds_enough() {
    let rig = RigConfig::zhao2005();
    let (mut early, mut whole) = (0, 0);
    for rate in [1024.0, 4096.0, 12_800.0] {
        for level in [0.3, 0.9, 1.0] {
            let time = Time::Sampled(rate);
            let rig = rig.with(|rig| rig.compensation.level = level).unwrap();
            let margin = stability_margin(&rig, FlowGain::Steeper, time).unwrap();
            for enough in [level, 1.02 * level, 1.1 * level, 3.0 * level] {
                let found = stability_margin_up_to(&rig, FlowGain::Steeper, time, enough).unwrap();
                assert!(found == margin || found == f64::INFINITY && margin >= enough, "{found} {margin}");
                *(if found == margin { &mut whole } else { &mut early }) += 1;
            }
        }
    }
    assert!(early > 9 && whole > 3, "{early} {whole}");
}

#[test]
fn margin_grows_with_damping_as_to_first_order() {
    // The level's margin grows by c/c_add, c_add = A²/(C_l + C_F·G_p·K_s·K_v·A); the rest without damping
    // is the phase error of the lead network.
    let rig = RigConfig::zhao2005();
    let (a, c) = (&rig.actuator, &rig.controller);
    let yielding = a.leakage + c.force_sensitivity * c.proportional_gain * 0.1 * 1.64e-2 * a.piston_area;
    let added = a.piston_area * a.piston_area / yielding;
    let full = level(&rig);
    let less = rig.with(|rig| rig.structure.damping = 433.0).unwrap();
    let slope = (full - level(&less)) / (4330.0 - 433.0);
    assert!((slope * added - 1.0).abs() < 0.01, "{slope} and {}", 1.0 / added);
}

#[test]
fn without_compensation_no_level_matters() {
    let rig = RigConfig::zhao2005().with(|rig| rig.compensation.mode = Mode::Off).unwrap();
    assert_eq!(level(&rig), f64::INFINITY);
}

#[test]
fn a_loop_that_no_level_makes_stable_is_reported() {
    let rig = RigConfig::zhao2005().with(|rig| rig.controller.force_sensitivity *= 20.0).unwrap();
    let error = stability_margin(&rig, FlowGain::Nominal, Time::Continuous).unwrap_err();
    assert!(error.to_string().starts_with("growth rate = "), "{error}");
}

#[test]
fn the_margin_is_the_same_from_above_from_below_and_from_an_unstable_start() {
    let digital = |level: f64| {
        let set = |rig: &mut RigValues| {
            (rig.controller.realization, rig.compensation.level) = (Realization::Digital, level);
        };
        RigConfig::zhao2005().with(set).unwrap()
    };
    let time = Time::Sampled(4096.0);
    // At this rate the sampled force loop alone is unstable; compensation damps its fast mode.
    let at = |level: f64| stability_margin(&digital(level), FlowGain::Nominal, time).unwrap();
    let margins = [0.0, 0.9, 1.0, 1.5].map(at);
    assert!(margins.iter().all(|margin| (margin / 1.0373 - 1.0).abs() < 1e-3), "{margins:?}");
    assert!(margins.iter().all(|margin| (margin - margins[0]).abs() < 1e-9), "{margins:?}");
    assert!(linearize(&digital(0.0), FlowGain::Nominal, time).unwrap().growth_rate().unwrap() > 0.0);
}

#[test]
fn every_margin_lies_between_stable_and_unstable() {
    let rig = RigConfig::zhao2005();
    let time = Time::Sampled(4096.0);
    let margins = stability_margins(&rig, FlowGain::Nominal, time).unwrap();
    let around = margins.around.unwrap();
    assert!(margins.growth_rate < 0.0);
    let growth =
        |change: &dyn Fn(&mut RigValues)| growth_with(&rig, FlowGain::Nominal, time, change).unwrap();
    for side in [-1.0, 1.0] {
        let by = 1.0 + side * 1e-4;
        let more: [(f64, Change); 4] = [
            (side, &|rig| rig.compensation.level = by * margins.level),
            (side, &|rig| rig.controller.force_sensitivity *= by * around.loop_gain),
            (side, &|rig| rig.servovalve.flow_gain_scale *= by * around.flow_gain.1),
            (side, &|rig| rig.compensation.response_delay = by * around.response_delay.1),
        ];
        for (number, (sign, change)) in more.iter().enumerate() {
            assert!(growth(change) * sign > 0.0, "margin {number}, {by}: {}, {around:?}", growth(change));
        }
    }
    let samples = (around.dead_time * 4096.0).round() as u32;
    assert!(growth(&|rig| rig.compensation.computation_delay = samples) > 0.0);
    assert!(growth(&|rig| rig.compensation.computation_delay = samples - 1) < 0.0);
    // A large enough reach gives the same margins, a smaller one none.
    let within = |reach| margins_within(&rig, FlowGain::Nominal, time, reach).unwrap();
    let far = Reach { level: 1.1, dead_time: 0.1, loop_gain: 2.0 };
    let (growth_rate, found) = within(far);
    let found = found.unwrap();
    assert_eq!((growth_rate, found.dead_time), (margins.growth_rate, around.dead_time));
    assert!((found.loop_gain - around.loop_gain).abs() < 1e-9);
    assert!((found.level - margins.level).abs() < 1e-9);
    let near = within(Reach { level: 1.02, dead_time: 1e-3, loop_gain: 1.2 }).1.unwrap();
    assert!([near.level, near.dead_time, near.loop_gain].iter().all(|margin| margin.is_infinite()));
}

#[test]
fn one_more_sample_of_delay_makes_a_digital_loop_unstable() {
    let rig = RigConfig::zhao2005().with(|rig| rig.controller.realization = Realization::Digital).unwrap();
    let time = Time::Sampled(4096.0);
    let margins = stability_margins(&rig, FlowGain::Nominal, time).unwrap();
    assert_eq!(margins.around.unwrap().dead_time, 1.0 / 4096.0);
    let later = rig.with(|rig| rig.dac.delay = 1).unwrap();
    assert!(linearize(&later, FlowGain::Nominal, time).unwrap().growth_rate().unwrap() > 0.0);
    let reach = Reach { level: 1.02, dead_time: 1e-3, loop_gain: 1.2 };
    let (growth, around) = margins_within(&later, FlowGain::Nominal, time, reach).unwrap();
    assert!(growth > 0.0 && around.is_none());
}
