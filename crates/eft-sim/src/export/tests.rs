//! What is exported, and what is refused.

use crate::config::{KEYS, Key, Kind};

use super::*;

/// Keys, or what they begin with, of the plant alone: no export may depend on them.
const OF_THE_PLANT: [&str; 16] = [
    "actuator.stroke",
    "actuator.dead_length",
    "actuator.friction",
    "actuator.stop_",
    "supply.droop",
    "supply.accumulator",
    "supply.pump_flow",
    "supply.schedule.",
    "servovalve.pilot_",
    "servovalve.spool_",
    "servovalve.flow_gain_scale",
    "servovalve.true_flow_table.",
    "servovalve.overlap",
    "servovalve.leakage.",
    "structure.",
    "sensors.",
];
/// The converter is hardware behind the controller; the name is an argument of its own.
const OF_NEITHER: [&str; 3] = ["dac.range", "dac.bits", "name"];

/// Rigs in which every key of the controller counts at least once.
fn rigs() -> Vec<RigConfig> {
    let all = RigConfig::from_toml(
        &std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../firmware/rigs/guarded.toml"))
            .unwrap(),
    )
    .unwrap()
    .replace(&[
        ("compensation.look_ahead", toml::Value::from(true)),
        ("protection.velocity_warning", 0.9.into()),
        ("protection.velocity_trip", 1.0.into()),
        ("protection.spool_warning", 0.8.into()),
        ("protection.soft_end", true.into()),
    ])
    .unwrap();
    let mut rigs = vec![RigConfig::zhao2005(), all.clone()];
    for source in ["sensor", "derivative", "accelerometer"] {
        rigs.push(all.replace(&[("controller.velocity_source", source.into())]).unwrap());
    }
    rigs
}

/// The rig with another value of a key, where that is a rig.
fn with_another(rig: &RigConfig, row: &Key) -> Option<RigConfig> {
    let now = rig.get(row.key).unwrap();
    let nudged = |value: f64| if value == 0.0 { 1e-3 } else { 0.99 * value };
    let value: toml::Value = match row.kind {
        Kind::Float(low, high) => match now.and_then(|value| value.as_float()) {
            Some(value) => nudged(value).into(),
            None => (low.max(1e-6) * high).sqrt().into(),
        },
        Kind::Int(low, _) => now.and_then(|value| value.as_integer()).map_or(low, |value| value + 1).into(),
        Kind::Bool => (!now?.as_bool()?).into(),
        Kind::Choice(words) => {
            let now = now?;
            (*words.iter().find(|word| Some(**word) != now.as_str())?).into()
        }
        Kind::Floats(..) => {
            let values = now?;
            values.as_array()?.iter().map(|value| 0.99 * value.as_float().unwrap()).collect::<Vec<_>>().into()
        }
        Kind::Text => return None,
    };
    rig.replace(&[(row.key, value)]).ok()
}

#[test]
fn every_key_of_the_controller_is_in_the_text_or_refused_and_none_of_the_plant() {
    let rigs = rigs();
    for row in KEYS.iter().filter(|row| !OF_NEITHER.contains(&row.key)) {
        for target in [Target::Rust, Target::C] {
            let tells =
                rigs.iter().filter_map(|rig| Some((rig, with_another(rig, row)?))).any(|(rig, other)| {
                    match export(&other, "rig", target) {
                        Ok(text) => text != export(rig, "rig", target).unwrap(),
                        Err(refusal) => refusal.to_string().starts_with(row.key),
                    }
                });
            let of_the_plant = OF_THE_PLANT.iter().any(|start| row.key.starts_with(start));
            assert_eq!(tells, !of_the_plant, "{} for {target:?}", row.key);
        }
    }
}

#[test]
fn a_name_stays_in_its_comment() {
    let rig = RigConfig::zhao2005();
    let name = "a\nb */ c /* d\r\u{202e} é";
    let rust = export(&rig, name, Target::Rust).unwrap();
    assert!(rust.starts_with("//! The controller of `a\\nb * / c / * d\\r\\u{202e} é` at 4096 Hz"), "{rust}");
    let c = export(&rig, name, Target::C).unwrap();
    assert!(c.starts_with("/* The controller of a\\nb * / c / * d\\r\\u{202e} é at 4096 Hz"), "{c}");
}

#[test]
fn the_comment_names_the_functions_of_the_rig() {
    let digital = ("controller.realization", toml::Value::from("digital"));
    let ahead = [("compensation.feedforward", true.into()), ("compensation.look_ahead", true.into())];
    let adaptive = [("compensation.adaptive", true.into())];
    let step = |changes: &[(&str, toml::Value)], target| {
        let text = export(&RigConfig::zhao2005().replace(changes).unwrap(), "rig", target).unwrap();
        let comment: Vec<_> =
            text.lines().take_while(|line| !line.starts_with("use") && *line != " */").collect();
        assert!(comment.iter().all(|line| line.chars().count() <= 100), "{text}");
        let words = comment.iter().map(|line| &line[3.min(line.len())..]).collect::<Vec<_>>().join(" ");
        let before = words.split(" gives the ").next().unwrap();
        before.split_whitespace().next_back().unwrap().to_owned()
    };
    for (changes, rust, c) in [
        (vec![], "`CONTROLLER.compensation.step`", "eft_compensation_step"),
        (vec![digital.clone()], "`CONTROLLER.step`", "eft_step"),
        (adaptive.to_vec(), "`CONTROLLER.compensation.step`", "eft_adaptive_compensation_step"),
        (ahead.to_vec(), "`CONTROLLER.compensation.step_ahead`", "eft_adaptive_compensation_step_ahead"),
        ([ahead.to_vec(), vec![digital]].concat(), "`CONTROLLER.step_ahead`", "eft_adaptive_step_ahead"),
    ] {
        assert_eq!(step(&changes, Target::Rust), rust);
        assert_eq!(step(&changes, Target::C), c);
    }
}

/// To take over a change: `EFT_WRITE_EXPORTS=1 cargo test -p eft-sim firmware_holds`.
#[test]
fn firmware_holds_what_its_rigs_export() {
    let firmware = concat!(env!("CARGO_MANIFEST_DIR"), "/../../firmware/rigs");
    let read = |name: &str| {
        let text = std::fs::read_to_string(format!("{firmware}/{name}.toml")).unwrap();
        RigConfig::from_toml(&text).unwrap()
    };
    for name in ["zhao2005", "uneven", "adaptive", "guarded"] {
        let rig = if name == "zhao2005" { RigConfig::zhao2005() } else { read(name) };
        for (target, path) in [(Target::Rust, format!("src/{name}.rs")), (Target::C, format!("{name}.h"))] {
            let (path, fresh) = (format!("{firmware}/{path}"), export(&rig, name, target).unwrap());
            if std::env::var_os("EFT_WRITE_EXPORTS").is_some() {
                std::fs::write(&path, &fresh).unwrap();
            }
            assert_eq!(std::fs::read_to_string(&path).unwrap(), fresh, "{path}");
        }
    }
}

#[test]
fn numbers_read_back_as_themselves() {
    for value in [0.0, -1.0, 8.212e-3, 1.9e7, 1.0 / 3.0, f64::MAX, 5.0e-324] {
        assert_eq!(number(value).parse::<f64>().unwrap().to_bits(), value.to_bits());
    }
}

#[test]
fn what_stands_around_the_controller_is_written_in_either_language() {
    let on: [(&str, toml::Value); 5] = [
        ("compensation.feedforward", true.into()),
        ("compensation.look_ahead", true.into()),
        ("controller.velocity_source", "accelerometer".into()),
        ("protection.enabled", true.into()),
        ("protection.force_trip", 5.0e4.into()),
    ];
    let rig = RigConfig::zhao2005().replace(&on).unwrap();
    let rust = export(&rig, "rig", Target::Rust).unwrap();
    let c = export(&rig, "rig", Target::C).unwrap();
    for expected in
        ["compensation.step_ahead`", "VelocityObserver::<f32>::new([", "warning: 50000.0, trip: 50000.0"]
    {
        assert!(rust.contains(expected), "{expected}");
    }
    for expected in
        ["eft_adaptive_compensation_step_ahead", "eft_observer_parameters", ".force_trip = 50000.0, /* N */"]
    {
        assert!(c.contains(expected), "{expected}");
    }
    // An accelerometer's reading needs no mass.
    assert!(!rust.contains("PER_MASS") && !c.contains("EFT_PER_MASS"));
    let rig = rig.replace::<&str>(&[("controller.velocity_source", "derivative".into())]).unwrap();
    assert!(export(&rig, "rig", Target::Rust).unwrap().contains("FilteredDerivative::<f32>::new(80.0"));
    assert!(export(&rig, "rig", Target::C).unwrap().contains(".corner = 80.0, /* Hz */"));
}

#[test]
fn what_firmware_must_build_itself_is_refused() {
    let mut rig = RigConfig::zhao2005();
    rig.compensation.computation_delay = 2;
    let refusal = export(&rig, "rig", Target::C).unwrap_err().to_string();
    assert_eq!(refusal, "compensation.computation_delay = 2: must be 0 for firmware");
    rig = RigConfig::zhao2005();
    rig.compensation.level = -1.0;
    assert!(export(&rig, "rig", Target::Rust).is_err());
}
