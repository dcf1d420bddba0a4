//! Tests of exported and refused rigs.

use crate::config::{KEYS, Key, Kind};

use super::*;

/// Keys, or prefixes of keys, of the plant only; no export may depend on them.
const OF_THE_PLANT: [&str; 17] = [
    // The limits of the verdict do not affect the controller either.
    "verdict.",
    "actuator.dead_length",
    "actuator.bypass_",
    "actuator.stop_",
    "supply.droop",
    "supply.accumulator",
    "supply.pump_flow",
    "supply.schedule.",
    "servovalve.pilot_",
    "servovalve.spool_",
    "servovalve.flow_gain_scale",
    "servovalve.true_flow_table.",
    "servovalve.torque_motor_",
    // Its share of the compressibility affects the controller only if `sensors.motion_at` is "structure".
    "actuator.attachment_",
    "servovalve.leakage.",
    "structure.",
    "sensors.",
];
/// The converter is hardware after the controller, the name is a separate argument, and an identification changes only
/// the gains of a designed loop, as the plant's keys do.
const OF_NEITHER: [&str; 4] = ["dac.range", "dac.bits", "name", "controller.identified_plant"];

/// Rigs in which every key of the controller has an effect at least once.
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
        ("protection.plausibility", true.into()),
    ])
    .unwrap();
    let mut rigs = vec![RigConfig::zhao2005(), all.clone()];
    // With an analog controller the delay of the converter acts on the compensation.
    rigs.push(all.replace(&[("controller.realization", "analog".into())]).unwrap());
    for source in ["sensor", "derivative", "accelerometer"] {
        rigs.push(all.replace(&[("controller.velocity_source", source.into())]).unwrap());
    }
    rigs
}

/// The rig with another value of a key, itself or under `truth`, if that is valid.
fn with_another(rig: &RigConfig, row: &Key, truth: &str) -> Option<RigConfig> {
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
    rig.replace(&[(format!("{truth}{}", row.key), value)]).ok()
}

#[test]
fn every_key_of_the_controller_is_in_the_text_or_refused_and_none_of_the_plant() {
    let rigs = rigs();
    // A calibration is refused as a whole.
    let told = |row: &&Key| !OF_NEITHER.contains(&row.key) && !row.key.starts_with("calibration.");
    for row in KEYS.iter().filter(told) {
        for target in [Target::Rust, Target::C] {
            let tells =
                rigs.iter().filter_map(|rig| Some((rig, with_another(rig, row, "")?))).any(|(rig, other)| {
                    match export(&other, Some("rig"), target) {
                        Ok(text) => text != export(rig, Some("rig"), target).unwrap(),
                        Err(refusal) => refusal.to_string().starts_with(row.key),
                    }
                });
            let of_the_plant = OF_THE_PLANT.iter().any(|start| row.key.starts_with(start));
            assert_eq!(tells, !of_the_plant, "{} for {target:?}", row.key);
        }
    }
}

#[test]
fn a_saved_calibration_is_refused() {
    let rig = RigConfig::zhao2005().replace(&[("compensation.adaptive", true.into())]).unwrap();
    let learner =
        <f32 as Precision>::learner(&parameters(&rig, rig.controller.sample_rate).unwrap()).unwrap();
    let calibration = learner.saved(&learner.at_rest());
    let saved = rig.with(|rig| rig.calibration = calibration.into()).unwrap();
    for target in [Target::Rust, Target::C] {
        let refusal = export(&saved, Some("rig"), target).unwrap_err().to_string();
        assert!(refusal.starts_with("calibration.version"), "{refusal}");
    }
}

#[test]
fn no_export_sees_the_truth() {
    let rigs = rigs();
    let mut seen = 0;
    for row in KEYS.iter().filter(|row| row.is_of_the_plant()) {
        let changed: Vec<_> =
            rigs.iter().filter_map(|rig| Some((rig, with_another(rig, row, "truth.")?))).collect();
        seen += usize::from(!changed.is_empty());
        for (rig, other) in changed {
            for target in [Target::Rust, Target::C] {
                assert_eq!(
                    export(&other, Some("rig"), target).unwrap(),
                    export(rig, Some("rig"), target).unwrap()
                );
            }
        }
    }
    // Some keys are valid only together with others.
    assert!(seen > 50, "{seen} keys");
}

#[test]
fn a_name_stays_in_its_comment() {
    let name = "a\nb */ c /* d\r\u{202e} é";
    let rig = RigConfig::zhao2005().replace(&[("name", name.into())]).unwrap();
    let rust = export(&rig, None, Target::Rust).unwrap();
    assert!(rust.starts_with("//! The controller of `a\\nb * / c / * d\\r\\u{202e} é` at 4096 Hz"), "{rust}");
    let c = export(&rig, None, Target::C).unwrap();
    assert!(c.starts_with("/* The controller of a\\nb * / c / * d\\r\\u{202e} é at 4096 Hz"), "{c}");
}

#[test]
fn the_comment_lists_the_duties_of_the_firmware() {
    let comment = |changes: &[(&str, toml::Value)], target| {
        let text = export(&RigConfig::zhao2005().replace(changes).unwrap(), Some("rig"), target).unwrap();
        let comment: Vec<_> =
            text.lines().take_while(|line| !line.starts_with("use") && *line != " */").collect();
        assert!(comment.iter().all(|line| line.chars().count() <= 100), "{text}");
        let words = comment.iter().flat_map(|line| line[3.min(line.len())..].split_whitespace());
        words.collect::<Vec<_>>().join(" ")
    };
    let digital = ("controller.realization", toml::Value::from("digital"));
    let late = ("controller.force_delay", toml::Value::from(5e-4));
    let ahead = [("compensation.feedforward", true.into()), ("compensation.look_ahead", true.into())];
    for (changes, expected) in [
        (vec![], "gives the compensation signal"),
        (vec![digital.clone()], "gives the valve command"),
        (ahead.to_vec(), "next tick's command"),
        (vec![("compensation.adaptive", true.into())], "is sampled with the rest"),
        (vec![("compensation.supply_correction", true.into())], "measured supply pressure"),
        (vec![("controller.velocity_source", "derivative".into())], "measured displacement"),
        (vec![("controller.velocity_source", "accelerometer".into())], "measured acceleration"),
        (vec![("protection.enabled", true.into())], "measured displacement"),
        (
            vec![("protection.enabled", true.into()), ("protection.load_pressure_tolerance", 500.0.into())],
            "measured load pressure",
        ),
        (
            vec![late.clone()],
            "played 0.500 ms (2.048 samples) later, which is the load cell's latency. It is interpolated linearly \
             between its samples, and 0 N before the first. The protection",
        ),
        ([&ahead[..], std::slice::from_ref(&late)].concat(), "The next tick's command has the same delay."),
        ([&ahead[..], &[late, digital]].concat(), "The next tick's command is given without this delay."),
    ] {
        for (target, step) in [(Target::Rust, "`CHANNEL.step`"), (Target::C, "eft_step")] {
            let said = comment(&changes, target);
            assert!(said.contains(expected) && said.contains(step), "{said}");
        }
    }
    // A level without the switch has no effect.
    let level = ("protection.force_trip", toml::Value::from(2e4));
    for target in [Target::Rust, Target::C] {
        let says_off = |changes: &[_]| {
            comment(changes, target).contains("The protection is off: no level, fault or request trips.")
        };
        assert!(says_off(&[]) && says_off(std::slice::from_ref(&level)));
        assert!(!says_off(&[level.clone(), ("protection.enabled", true.into())]));
    }
}

/// To accept a change: `EFT_WRITE_EXPORTS=1 cargo test -p eft-sim firmware_holds`.
#[test]
fn firmware_holds_what_its_rigs_export() {
    let firmware = concat!(env!("CARGO_MANIFEST_DIR"), "/../../firmware/rigs");
    let read = |name: &str| {
        let text = std::fs::read_to_string(format!("{firmware}/{name}.toml")).unwrap();
        RigConfig::from_toml(&text).unwrap()
    };
    for name in ["zhao2005", "uneven", "adaptive", "guarded", "worn"] {
        let rig = if name == "zhao2005" { RigConfig::zhao2005() } else { read(name) };
        // The firmware closes the force loop itself.
        let rig = rig.replace(&[("controller.realization", "digital".into())]).unwrap();
        for (target, path) in [(Target::Rust, format!("src/{name}.rs")), (Target::C, format!("{name}.h"))] {
            let (path, fresh) = (format!("{firmware}/{path}"), export(&rig, Some(name), target).unwrap());
            if std::env::var_os("EFT_WRITE_EXPORTS").is_some() {
                std::fs::write(&path, &fresh).unwrap();
            }
            assert_eq!(std::fs::read_to_string(&path).unwrap(), fresh, "{path}");
        }
    }
}

#[test]
fn numbers_read_back_as_themselves() {
    for value in [0.0, -1.0, 8.212e-3, 1.9e7, 1.0 / 3.0, 5.0e-324] {
        assert_eq!(fields::number(value, "").parse::<f64>().unwrap().to_bits(), value.to_bits());
    }
}

#[test]
fn velocity_and_protection_are_written_in_either_language() {
    let on: [(&str, toml::Value); 3] = [
        ("controller.velocity_source", "accelerometer".into()),
        ("protection.enabled", true.into()),
        ("protection.force_trip", 5.0e4.into()),
    ];
    let rig = RigConfig::zhao2005().replace(&on).unwrap();
    let holds = |rig: &RigConfig, target, expected: &[&str]| {
        let text = export(rig, Some("rig"), target).unwrap();
        for expected in expected {
            assert!(text.contains(expected), "{expected} in {text}");
        }
    };
    holds(
        &rig,
        Target::Rust,
        &["VelocitySource::Accelerometer { gains: [", "warning: 50000.0, trip: 50000.0"],
    );
    holds(&rig, Target::C, &["EFT_VELOCITY_ACCELEROMETER", "50000.0, /* force_trip, N */"]);
    let rig = rig.replace::<&str>(&[("controller.velocity_source", "derivative".into())]).unwrap();
    holds(&rig, Target::Rust, &["VelocitySource::Derivative { corner: 80.0 }"]);
    holds(&rig, Target::C, &["80.0, /* corner, Hz */"]);
}

#[test]
fn a_name_that_is_not_an_identifier_is_refused() {
    let rig = RigConfig::zhao2005();
    for name in ["", "2nd", "my rig", "a-b", "é", "a\nb"] {
        let refusal = export(&rig, Some(name), Target::C).unwrap_err().to_string();
        assert!(refusal.starts_with("name = ") && refusal.contains("must be an identifier"), "{refusal}");
    }
    let text = export(&rig, Some("north_2"), Target::C).unwrap();
    assert!(text.contains("#ifndef EFT_RIG_NORTH_2_H") && text.contains("EFT_RIG_NORTH_2 = {"), "{text}");
    // Any rig name becomes a valid name in C.
    let named = rig.replace(&[("name", "my rig/2".into())]).unwrap();
    assert!(export(&named, None, Target::C).unwrap().contains("EFT_RIG_MY_RIG_2 = {"));
}

#[test]
fn two_rigs_of_one_name_are_an_error_of_the_compiler() {
    let folder = std::env::temp_dir().join(format!("eft-names-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let rig = RigConfig::zhao2005();
    let other = rig.replace(&[("actuator.piston_area", 9e-3.into())]).unwrap();
    for (file, rig) in [("a.h", &rig), ("again.h", &rig), ("other.h", &other)] {
        std::fs::write(folder.join(file), export(rig, None, Target::C).unwrap()).unwrap();
    }
    let compiled = |second: &str| {
        let text = format!("#include \"a.h\"\n#include \"{second}\"\n");
        std::fs::write(folder.join("all.c"), text).unwrap();
        let header = concat!("-I", env!("CARGO_MANIFEST_DIR"), "/../eft-ffi/include");
        let mut command = std::process::Command::new("cc");
        command.args(["-std=c99", "-fsyntax-only", header]).arg(folder.join("all.c"));
        let out = command.output().unwrap();
        (out.status.success(), String::from_utf8_lossy(&out.stderr).into_owned())
    };
    let (passes, said) = compiled("again.h");
    assert!(passes, "{said}");
    let (passes, said) = compiled("other.h");
    assert!(!passes && said.contains("two rigs are called EFT_RIG_ZHAO2005"), "{said}");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_rig_that_needs_code_of_the_firmware_is_refused() {
    let rig = RigConfig::zhao2005().with(|rig| rig.compensation.computation_delay = 2).unwrap();
    let refusal = export(&rig, Some("rig"), Target::C).unwrap_err().to_string();
    assert_eq!(refusal, "compensation.computation_delay = 2: must be 0 for firmware");
}

/// The fields of the structs in `eft.h` in their order, with nested ones expanded.
fn fields_of_the_header() -> Vec<String> {
    let header =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../eft-ffi/include/eft.h")).unwrap();
    let fields = |name: &str| -> Vec<String> {
        let (_, after) = header.split_once(&format!("typedef struct {name} {{\n")).unwrap();
        let (inside, _) = after.split_once("\n}").unwrap();
        let field = |line: &str| {
            let declared = line.split(';').next().unwrap();
            declared.split_whitespace().last().unwrap().split('[').next().unwrap().to_owned()
        };
        inside.lines().map(field).collect()
    };
    let mut all = fields("eft_parameters");
    for nested in ["learning", "protection", "plausibility"] {
        let at = all.iter().position(|name| name == nested).unwrap() + 1;
        all.splice(at..at, fields(&format!("eft_{nested}")));
    }
    all
}

#[test]
fn values_in_c_stand_in_the_order_of_the_header() {
    for rig in rigs() {
        let text = export(&rig, Some("rig"), Target::C).unwrap();
        let (_, values) = text.split_once("eft_parameters EFT_RIG = {\n").unwrap();
        let name = |line: &str| Some(line.split_once("/* ")?.1.split([',', ' ']).next()?.to_owned());
        assert_eq!(values.lines().filter_map(name).collect::<Vec<_>>(), fields_of_the_header());
    }
}

#[test]
fn exports_compile_as_c_and_cpp_side_by_side() {
    let folder = std::env::temp_dir().join(format!("eft-exports-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let mut program = "#include \"0.h\"\n".to_owned();
    for (n, rig) in rigs().iter().enumerate() {
        let name = if n == 0 { "rig".to_owned() } else { format!("my_rig_{n}") };
        std::fs::write(folder.join(format!("{n}.h")), export(rig, Some(&name), Target::C).unwrap()).unwrap();
        program += &format!("#include \"{n}.h\"\n");
    }
    program += "double first(void);\ndouble first(void) { return EFT_RIG.level + EFT_RIG_MY_RIG_1.level; }\n";
    std::fs::write(folder.join("all.c"), program).unwrap();
    let header = concat!("-I", env!("CARGO_MANIFEST_DIR"), "/../eft-ffi/include");
    let strict =
        ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", "-Wno-unused", "-fsyntax-only"];
    for (compiler, language, standard) in
        [("cc", "c", "-std=c99"), ("cc", "c", "-std=c11"), ("c++", "c++", "-std=c++17")]
    {
        let mut command = std::process::Command::new(compiler);
        command.args(strict).args([standard, header, "-x", language]).arg(folder.join("all.c"));
        let out = command.output().unwrap_or_else(|e| panic!("{compiler}: {e}"));
        assert!(out.status.success(), "{standard}: {}", String::from_utf8_lossy(&out.stderr));
    }
    std::fs::remove_dir_all(folder).unwrap();
}
