//! What is refused, and the words of the refusal.

use super::*;
use crate::Error;

#[test]
fn a_section_that_is_given_in_part_is_refused_by_the_key_that_is_missing() {
    for section in check::WHOLE_SECTIONS {
        let rows: Vec<_> = KEYS.iter().filter(|row| row.key.starts_with(&format!("{section}."))).collect();
        assert!(rows.len() > 1, "{section}");
        for row in rows {
            let mut tree = everything();
            tree::remove(&mut tree, row.key).unwrap();
            match RigConfig::from_tree(tree) {
                Err(Error::MissingKey { key, .. }) => assert_eq!(key, row.key),
                other => panic!("{}: {other:?}", row.key),
            }
        }
    }
}

#[test]
fn physical_keys_have_no_default() {
    assert_eq!(
        message(RigConfig::from_tree(Table::new())),
        "missing key `actuator.piston_area` (effective piston area A, m²)"
    );
    for row in KEYS.iter() {
        let mut whole = RigConfig::zhao2005().to_tree();
        match row.need {
            Need::Required | Need::Unless(..) => {}
            Need::When(key, word) => tree::set(&mut whole, key, word.into()).unwrap(),
            Need::Default(_) | Need::Optional => continue,
        }
        tree::remove(&mut whole, row.key).unwrap();
        match RigConfig::from_tree(whole) {
            // For a missing section the error names its first key.
            Err(Error::MissingKey { key, .. }) => {
                assert_eq!(key.rsplit_once('.').map(|k| k.0), row.key.rsplit_once('.').map(|k| k.0));
            }
            other => panic!("{}: {other:?}", row.key),
        }
    }
}

#[test]
fn unknown_keys_name_the_nearest() {
    let cases = [
        ("actuator.piston_arae", Some("actuator.piston_area")),
        ("actuater.piston_area", Some("actuator.piston_area")),
        ("piston_area", Some("actuator.piston_area")),
        ("compensation.kv", None),
        ("compensation.tuning", None),
        ("compensation.levle", Some("compensation.level")),
        ("structure.softening.displacment", Some("structure.softening.displacement")),
        ("sensors.force.nosie", Some("sensors.force.noise")),
        ("zzz", None),
        ("", None),
        ("actuator.", None),
        ("structure.mass.value", None),
    ];
    for (given, expected) in cases {
        match replaced(given, 1.0) {
            Err(Error::UnknownKey { key, nearest }) => {
                assert_eq!((key.as_str(), nearest.as_deref()), (given, expected));
            }
            other => panic!("{given}: {other:?}"),
        }
    }
    let text = format!("{}\n[limits.extra]\n", RigConfig::zhao2005().to_toml());
    assert!(
        matches!(RigConfig::from_toml(&text), Err(Error::UnknownKey { key, .. }) if key == "limits.extra")
    );
}

#[test]
fn messages_name_the_wrong_value_and_the_allowed_ones() {
    let cases: Vec<(&str, Value, &str)> = vec![
        (
            "controller.sample_rate",
            0.0.into(),
            "controller.sample_rate = 0: must be a number between 1 and 1000000 Hz",
        ),
        (
            "structure.mass",
            f64::NAN.into(),
            "structure.mass = NaN: must be a number between 0.001 and 1e12 kg",
        ),
        ("structure.mass", f64::INFINITY.into(), "structure.mass = inf: must be"),
        ("structure.mass", true.into(), "structure.mass = true: must be a number"),
        ("structure.mass", "heavy".into(), "structure.mass = \"heavy\": must be a number"),
        ("structure.mass", Table::new().into(), "structure.mass = a section: must be a number"),
        ("structure", 3.into(), "structure = 3: must be a section"),
        (
            "compensation.lead_alpha",
            1.0.into(),
            "compensation.lead_alpha = 1: must be a number between 0.001 and 0.99",
        ),
        (
            "compensation.mode",
            "cubic".into(),
            "compensation.mode = \"cubic\": must be one of \"off\", \"linear\", \"nonlinear\"",
        ),
        (
            "compensation.computation_delay",
            1.5.into(),
            "compensation.computation_delay = 1.5: must be a whole number between 0 and 1000 samples",
        ),
        (
            "compensation.computation_delay",
            (-1).into(),
            "compensation.computation_delay = -1: must be a whole number",
        ),
        ("compensation.feedforward", 1.into(), "compensation.feedforward = 1: must be true or false"),
        ("sensors.seed", (-1).into(), "sensors.seed = -1: must be a whole number of at least 0"),
        ("name", 1.into(), "name = 1: must be a string"),
        (
            "calibration.version",
            3.into(),
            "calibration.version = 3: must be 4: repeat the test to save its calibration again, or leave out the",
        ),
        (
            "sensors.force.bits",
            16.into(),
            "missing key `sensors.force.range` (load cell: range to either side, N; needed with `sensors.force.bits`)",
        ),
    ];
    for (key, value, expected) in cases {
        let said = message(replaced(key, value));
        assert!(said.starts_with(expected), "{said}");
    }
}

#[test]
fn flow_tables_name_the_offending_index() {
    let list = |values: &[f64]| Value::Array(values.iter().copied().map(Value::Float).collect());
    let with = |openings: &[f64], flows: &[f64]| {
        message(RigConfig::zhao2005().replace(&[
            ("servovalve.flow_table.openings", list(openings)),
            ("servovalve.flow_table.flows", list(flows)),
        ]))
    };
    let table = "servovalve.flow_table.";
    let cases: [(&[f64], &[f64], &str); 11] = [
        (&[-1.0, 0.0, 1.0], &[-1e300, 0.0, 1e300], "flows[0] = -1e300: must be a number between"),
        (&[-1.0, 0.0, 1.0], &[-1.0, 0.0], "flows = 2 values: must have as many values as"),
        (&[0.0], &[0.0], "flows = 1 values: must be a list of 2 to 64 numbers"),
        (
            &[-1.0, 0.0, 0.5, 0.5],
            &[-1.0, 0.0, 1.0, 2.0],
            "openings[3] = 0.5: must increase strictly: [2] is 0.5",
        ),
        (&[-1.0, 0.0, 1.0], &[-1.0, 0.0, -2.0], "flows[2] = -2: must increase strictly: [1] is 0"),
        (&[-1.0, 0.0, f64::NAN], &[-1.0, 0.0, 1.0], "openings[2] = NaN: must be a number between -1 and 1"),
        (
            &[-1.0, 0.0, 1.0],
            &[-1.0, 0.0, f64::INFINITY],
            "flows[2] = inf: must be a number between -1000 and 1000",
        ),
        (&[-1.0, 0.1, 1.0], &[-1.0, 0.0, 1.0], "openings = no point at 0: must contain the point (0, 0)"),
        (&[-1.0, 0.0, 1.0], &[-1.0, 0.5, 1.0], "flows[1] = 0.5: must be 0, the flow at opening 0"),
        (&[-1.0, 0.0, 1.5], &[-1.0, 0.0, 1.0], "openings[2] = 1.5: must be a number between -1 and 1"),
        (&[0.0, 1.0], &[0.0, 1.0], "openings = nothing below opening 0: must have points on both sides"),
    ];
    for (openings, flows, expected) in cases {
        let said = with(openings, flows);
        assert!(said.starts_with(&format!("{table}{expected}")), "{said}");
    }
    let many: Vec<f64> = (-32..=32).map(|i| f64::from(i) / 32.0).collect();
    assert!(with(&many, &many).contains("65 values: must be a list of 2 to 64"));
}

#[test]
fn the_message_on_malformed_toml_has_its_place() {
    let said = message(RigConfig::from_toml("[actuator]\npiston_area = 1.0.0\n"));
    assert!(said.starts_with("line 2, column 1"), "{said}");
    assert!(!said.contains('\n'), "{said}");
    let said = message(RigConfig::from_toml("[actuator]\nstroke = 1.0\nstroke = 2.0\n"));
    assert!(said.starts_with("line 3, column 1: duplicate key"), "{said}");
}

#[test]
fn a_key_of_any_length_gets_a_short_message_at_once() {
    let long = "a".repeat(100_000);
    let parts = "a.".repeat(100_000);
    let began = std::time::Instant::now();
    for (text, says) in [
        (format!("{long} = 1\n"), "unknown key"),
        (format!("[structure]\n{long} = 1\n"), "unknown key"),
        (format!("{parts}a = 1\n"), "too many parts"),
        (format!("[{parts}a]\nb = 1\n"), "too many parts"),
    ] {
        let said = message(RigConfig::from_toml(&text));
        assert!(said.contains(says) && said.len() < 200, "{} characters: {said:.200}", said.len());
    }
    assert!(began.elapsed().as_secs_f64() < 2.0, "{:?}", began.elapsed());
}

#[test]
fn a_robust_loop_for_a_rig_without_poles_in_double_precision_is_refused() {
    let mut whole = everything();
    let values = [("spool_area", 1e-9), ("pilot_flow_gain", 0.3788425339360195)];
    tree::set(&mut whole, "controller.force_loop", "robust".into()).unwrap();
    for (key, value) in values {
        tree::set(&mut whole, &format!("servovalve.{key}"), value.into()).unwrap();
    }
    let error = message(RigConfig::from_tree(whole));
    assert!(error.starts_with("controller.force_loop = \"robust\": the poles of this rig"), "{error}");
}

#[test]
fn messages_name_keys_without_effect_and_what_they_need() {
    let rig = RigConfig::zhao2005();
    assert_eq!(rig.idle_keys(), [""; 0]);
    fn on(keys: &[&'static str]) -> Vec<(&'static str, Value)> {
        keys.iter().map(|&key| (key, Value::from(true))).collect()
    }
    let set = rig.replace(&on(&["compensation.look_ahead"])).unwrap();
    let set = set.replace(&[("protection.fault_time", Value::from(1.0))]).unwrap();
    let expected = [
        "compensation.look_ahead needs compensation.feedforward = true",
        "protection.fault_time needs protection.enabled = true",
        "protection.fault_time needs compensation.adaptive = true",
    ];
    assert_eq!(set.idle_keys(), expected);
    let woken = set
        .replace(&on(&["compensation.feedforward", "compensation.adaptive", "protection.enabled"]))
        .unwrap();
    assert_eq!(woken.idle_keys(), [""; 0]);
    let levels = KEYS.iter().map(|row| row.key).filter(|key| {
        key.starts_with("protection.") && (key.ends_with("_warning") || key.ends_with("_trip"))
    });
    for key in levels.chain(["protection.start_time"]) {
        let off = rig.replace(&[(key, Value::from(0.25))]).unwrap();
        assert_eq!(off.idle_keys(), [format!("{key} needs protection.enabled = true")]);
        assert_eq!(off.replace(&on(&["protection.enabled"])).unwrap().idle_keys(), [""; 0]);
    }
    let soft = rig.replace(&on(&["protection.soft_end"])).unwrap();
    assert_eq!(soft.idle_keys(), ["protection.soft_end needs protection.enabled = true"]);
}

#[test]
fn a_building_needs_no_values_of_a_single_floor() {
    let mut whole = RigConfig::zhao2005().to_tree();
    let single = ["structure.mass", "structure.damping", "structure.stiffness"];
    for key in single {
        tree::remove(&mut whole, key).unwrap();
    }
    assert!(message(RigConfig::from_tree(whole.clone())).starts_with("missing key `structure.mass` (mass m"));
    tree::set(&mut whole, "structure.kind", "shear_building".into()).unwrap();
    let lists = ["masses", "dampings", "stiffnesses"].map(|name| format!("structure.stories.{name}"));
    assert!(
        message(RigConfig::from_tree(whole.clone())).starts_with("missing key `structure.stories.masses`")
    );
    for (key, size) in lists.iter().zip([7000.0, 5000.0, 2e6]) {
        tree::set(&mut whole, key, vec![size, 0.9 * size].into()).unwrap();
    }
    let rig = RigConfig::from_tree(whole).unwrap();
    assert_eq!((rig.structure.mass, rig.structure.stiffness), (7000.0, 2e6));
    assert_eq!(rig.idle_keys(), [""; 0]);
}
