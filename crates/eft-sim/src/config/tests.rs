use std::collections::BTreeSet;

use proptest::prelude::*;
use toml::{Table, Value};

use super::*;
use crate::Error;

/// A value inside the range of every row, so that every optional part is present.
pub(super) fn everything() -> Table {
    let known = RigConfig::zhao2005().to_tree();
    let mut whole = known.clone();
    for row in KEYS.iter().filter(|row| tree::get(&known, row.key).is_none()) {
        let value = match row.kind {
            Kind::Float(low, high) => Value::Float((low + high) / 2.0),
            Kind::Int(low, high) => Value::Integer((low + high) / 2),
            Kind::Bool => Value::Boolean(true),
            Kind::Choice(words) => Value::String(words[0].into()),
            Kind::Text => Value::String("some text".into()),
            // A curve has further rules, so the known one is used.
            Kind::Floats(..) if row.key.contains("true_flow_table") => {
                tree::get(&whole, &row.key.replace("true_", "")).unwrap().clone()
            }
            Kind::Floats(least, ..) => {
                Value::Array((0..least).map(|i| Value::Float(1.0 + i as f64)).collect())
            }
        };
        tree::set(&mut whole, row.key, value).unwrap();
    }
    whole
}

fn replaced(key: &str, value: impl Into<Value>) -> Result<RigConfig> {
    RigConfig::zhao2005().replace(&[(key, value.into())])
}

fn message(result: Result<RigConfig>) -> String {
    result.unwrap_err().to_string()
}

#[test]
fn the_schema_and_the_structs_have_the_same_keys() {
    let fields: BTreeSet<_> = RigValues::keys("").into_iter().collect();
    let rows: BTreeSet<_> = KEYS.iter().map(|row| row.key.to_owned()).collect();
    assert_eq!(rows.len(), KEYS.len(), "a key stands twice");
    assert_eq!(fields, rows);
}

#[test]
fn a_section_that_is_given_in_part_is_refused_by_the_key_that_is_missing() {
    for section in check::WHOLE {
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
fn each_floor_may_have_a_calibration() {
    let mut tree = everything();
    let one = tree.remove("calibration").unwrap();
    let mut other = one.clone();
    other.as_table_mut().unwrap().insert("null_offset".into(), 0.25.into());
    tree::set(&mut tree, "structure.kind", "shear_building".into()).unwrap();
    for key in ["masses", "dampings", "stiffnesses"] {
        tree::set(&mut tree, &format!("structure.stories.{key}"), vec![1e4, 2e4].into()).unwrap();
    }
    let given = |each: Vec<Value>| {
        let mut tree = tree.clone();
        tree.insert("calibration".into(), each.into());
        RigConfig::from_tree(tree)
    };
    let rig = given(vec![one.clone(), other.clone()]).unwrap();
    assert_eq!(rig.calibration.of(1).unwrap().null_offset, 0.25);
    assert!(rig.calibration.of(0).unwrap().null_offset != 0.25 && rig.calibration.of(2).is_none());
    assert_eq!(RigConfig::from_toml(&rig.to_toml()).unwrap(), rig);
    assert_eq!(RigConfig::from_toml(&rig.to_commented_toml()).unwrap(), rig);
    assert_eq!(rig.get("calibration").unwrap().unwrap().as_array().unwrap().len(), 2);
    let single = rig.replace(&[("calibration", one.clone())]).unwrap();
    assert_eq!(single.calibration.of(1), rig.calibration.of(0));
    assert!(single.calibration.only().is_ok());
    assert!(rig.calibration.only().unwrap_err().to_string().starts_with("calibration = 2 calibrations"));

    let said = |each| message(given(each));
    assert!(said(vec![one.clone()]).starts_with("calibration = a list of 1: must be one section"));
    other.as_table_mut().unwrap().insert("null_offset".into(), 2.0.into());
    assert!(said(vec![one.clone(), other.clone()]).starts_with("calibration[1].null_offset = 2: must be"));
    other.as_table_mut().unwrap().remove("null_offset");
    assert!(said(vec![one.clone(), other]).starts_with("missing key `calibration[1].null_offset`"));
    for wrong in [3.into(), Value::Table(Table::new())] {
        let said = said(vec![one.clone(), wrong]);
        assert!(said.starts_with("calibration[1] = ") && said.ends_with("must be a whole section"), "{said}");
    }
}

#[test]
fn the_structs_accept_every_word_of_a_choice() {
    for row in KEYS {
        if let Kind::Choice(words) = row.kind {
            for word in words {
                let mut whole = everything();
                tree::set(&mut whole, row.key, (*word).into()).unwrap();
                let config = RigConfig::from_tree(whole).unwrap();
                assert_eq!(tree::get(&config.to_tree(), row.key).and_then(Value::as_str), Some(*word));
            }
        }
    }
}

#[test]
fn the_largest_values_of_every_row_fit_their_fields() {
    for row in KEYS {
        let ends: [Value; 2] = match row.kind {
            Kind::Float(low, high) => [low.into(), high.into()],
            Kind::Int(low, high) => [low.into(), high.into()],
            _ => continue,
        };
        for end in ends {
            let mut whole = everything();
            tree::set(&mut whole, row.key, end.clone()).unwrap();
            let config = RigConfig::from_tree(whole).unwrap();
            assert_eq!(tree::get(&config.to_tree(), row.key), Some(&end), "{}", row.key);
        }
    }
}

#[test]
fn table_2_in_si() {
    let table = &RigConfig::zhao2005().servovalve.flow_table;
    assert_eq!((table.openings.len(), table.flows.len()), (21, 21));
    assert_eq!((table.openings[10], table.flows[10]), (0.0, 0.0));
    // 523.0 and -536.2 in³/s; an inch is 25.4 mm exactly.
    let inch = 25.4e-3_f64;
    assert!((table.flows[20] / (523.0 * inch.powi(3)) - 1.0).abs() < 1e-12);
    assert!((table.flows[0] / (-536.2 * inch.powi(3)) - 1.0).abs() < 1e-12);
    assert_eq!(table.openings[13], 0.3);
}

#[test]
fn consistent_with_the_paper() {
    let rig = RigConfig::zhao2005();
    // 3.1 % of critical damping, 1.58 Hz, a pump velocity below 1.05 m/s.
    let (m, c, k) = (rig.structure.mass, rig.structure.damping, rig.structure.stiffness);
    assert!((c / (2.0 * (k * m).sqrt()) - 0.031).abs() < 2e-4);
    assert!(((k / m).sqrt() / (2.0 * std::f64::consts::PI) - 1.58).abs() < 1e-2);
    assert!((rig.actuator.piston_area * rig.supply.pressure / 1e3 - 156.0).abs() < 0.1);
    // Valve gain 1/(K_3·x_vmax), 5.18 ms delay of the second-order valve.
    let valve = &rig.servovalve;
    let gain = 1.0 / (valve.spool_sensitivity * valve.spool_stroke);
    assert!((gain / rig.compensation.valve_gain - 1.0014).abs() < 1e-4);
    let delay = valve.spool_area / (valve.spool_sensitivity * valve.pilot_flow_gain);
    assert!((delay - 5.18e-3).abs() < 1e-5);
}

#[test]
fn toml_keeps_every_optional_part() {
    let config = RigConfig::from_tree(everything()).unwrap();
    assert_eq!(RigConfig::from_toml(&config.to_toml()).unwrap(), config);
    assert_eq!(RigConfig::from_toml(&config.to_commented_toml()).unwrap(), config);
}

#[test]
fn commented_toml_names_every_key() {
    let text = RigConfig::zhao2005().to_commented_toml();
    assert_eq!(RigConfig::from_toml(&text).unwrap(), RigConfig::zhao2005());
    for row in KEYS {
        assert!(text.contains(row.doc), "{}", row.key);
    }
}

#[test]
fn physical_keys_have_no_default() {
    assert_eq!(
        message(RigConfig::from_tree(Table::new())),
        "missing key `actuator.piston_area` (effective piston area A, m²)"
    );
    for row in KEYS {
        let mut whole = RigConfig::zhao2005().to_tree();
        match row.need {
            Need::Required => {}
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
        ("calibration.version", 2.into(), "calibration.version = 2: must be 3"),
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
fn whole_numbers_serve_as_floats() {
    assert_eq!(replaced("structure.mass", 7000).unwrap().structure.mass, 7000.0);
    let text = RigConfig::zhao2005().to_toml().replace("mass = 7040.0", "mass = 7040");
    assert_eq!(RigConfig::from_toml(&text).unwrap(), RigConfig::zhao2005());
}

#[test]
fn a_replacement_is_complete_and_independent_of_the_order() {
    let rig = RigConfig::zhao2005();
    let linear = rig
        .replace(&[("structure.kind", "linear".into())])
        .unwrap()
        .without(&["structure.softening"])
        .unwrap();
    assert_eq!(linear.structure.softening, None);
    let softening: Table = "displacement = 0.03\nstiffness = 0".parse().unwrap();
    let changes = [("structure.kind", Value::from("bilinear")), ("structure.softening", softening.into())];
    let back = linear.replace(&changes).unwrap();
    assert_eq!(back.structure.softening, Some(Softening { displacement: 0.03, stiffness: 0.0 }));
    assert!(message(linear.replace(&changes[..1])).contains("structure.softening.displacement"));
    assert_eq!(rig, RigConfig::zhao2005());
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
fn changed_fields_are_checked() {
    let rig = RigConfig::zhao2005();
    assert_eq!(rig.with(|_| ()).unwrap(), rig);
    assert_eq!(rig.with(|values| values.structure.mass = 9e3).unwrap().structure.mass, 9e3);
    let said = message(rig.with(|values| values.structure.damping = -1.0));
    assert!(said.starts_with("structure.damping = -1: must be"), "{said}");
    assert!(rig.with(|values| values.sensors.seed = u64::MAX).is_err());
    assert!(rig.with(|values| values.structure.softening = None).is_err());
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
fn files_that_cannot_be_read() {
    let folder = std::env::temp_dir().join(format!("eft-config-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("rig.toml");
    assert!(matches!(RigConfig::read(&path), Err(Error::Io { path: named, .. }) if named == path));
    std::fs::write(&path, [b'a', 0xff]).unwrap();
    assert!(message(RigConfig::read(&path)).ends_with("rig.toml: not UTF-8 text at byte 1"));
    std::fs::write(&path, "a = [").unwrap();
    assert!(message(RigConfig::read(&path)).contains("rig.toml: line 1, column 6"));
    std::fs::write(&path, vec![b'#'; 2 << 20]).unwrap();
    assert!(message(RigConfig::read(&path)).contains("larger than 1 MiB"));
    std::fs::write(&path, RigConfig::zhao2005().to_toml()).unwrap();
    assert_eq!(RigConfig::read(&path).unwrap(), RigConfig::zhao2005());
    std::fs::remove_dir_all(&folder).unwrap();
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

/// A key with a value; half of the keys of the plant are under `truth`.
fn any_row() -> impl Strategy<Value = (String, Value)> {
    (0..KEYS.len(), 0.0..=1.0_f64, any::<u64>(), ".*", any::<bool>()).prop_map(
        |(row, share, bits, text, truth)| {
            let row = &KEYS[row];
            let value = match row.kind {
                // Distributed evenly over the decades of the range.
                Kind::Float(low, high) if low > 0.0 => {
                    Value::Float((low * (high / low).powf(share)).clamp(low, high))
                }
                Kind::Float(low, high) => Value::Float((low + share * (high - low)).clamp(low, high)),
                Kind::Int(low, high) => {
                    Value::Integer(low + (bits % (high - low).unsigned_abs().max(1)) as i64)
                }
                Kind::Bool => Value::Boolean(bits % 2 == 0),
                Kind::Choice(words) => Value::String(words[bits as usize % words.len()].into()),
                Kind::Text => Value::String(text),
                Kind::Floats(..) => tree::get(&everything(), row.key).unwrap().clone(),
            };
            // Two values that must agree with others.
            let bound = row.key == "structure.kind" || row.key.starts_with("servovalve.flow_table");
            let truth = if truth && row.is_of_the_plant() && !bound { "truth." } else { "" };
            (format!("{truth}{}", row.key), value)
        },
    )
}

proptest! {
    #[test]
    fn to_toml_then_from_toml_is_the_identity(changes in prop::collection::vec(any_row(), 0..60)) {
        let mut whole = everything();
        for (key, value) in changes {
            tree::set(&mut whole, &key, value).unwrap();
        }
        let config = match RigConfig::from_tree(whole) {
            // For some rigs no robust force loop exists.
            Err(error) if error.to_string().contains("robust") => return Ok(()),
            made => made.unwrap(),
        };
        prop_assert_eq!(&RigConfig::from_toml(&config.to_toml()).unwrap(), &config);
        prop_assert_eq!(&RigConfig::from_toml(&config.to_commented_toml()).unwrap(), &config);
        prop_assert_eq!(&RigConfig::from_tree(config.to_tree()).unwrap(), &config);
    }

    #[test]
    fn no_text_panics(text in ".{0,200}") {
        let _ = RigConfig::from_toml(&text);
    }

    #[test]
    fn no_damaged_file_panics(start in 0usize..3000, length in 0usize..40, insert in ".{0,10}") {
        let text = RigConfig::zhao2005().to_toml();
        let cut = |at: usize| (0..=at.min(text.len())).rev().find(|at| text.is_char_boundary(*at)).unwrap();
        let (from, to) = (cut(start), cut(start + length));
        let _ = RigConfig::from_toml(&format!("{}{insert}{}", &text[..from], &text[to..]));
    }
}

#[test]
fn messages_name_keys_without_effect_and_what_they_need() {
    let rig = RigConfig::zhao2005();
    assert_eq!(rig.idle_keys(), []);
    fn on(keys: &[&'static str]) -> Vec<(&'static str, Value)> {
        keys.iter().map(|&key| (key, Value::from(true))).collect()
    }
    let idle = |rig: &RigConfig| rig.idle_keys().into_iter().map(|idle| idle.to_string()).collect::<Vec<_>>();
    let set = rig.replace(&on(&["compensation.look_ahead"])).unwrap();
    let set = set.replace(&[("protection.fault_time", Value::from(1.0))]).unwrap();
    let expected = [
        "compensation.look_ahead needs compensation.feedforward = true",
        "protection.fault_time needs protection.enabled = true",
        "protection.fault_time needs compensation.adaptive = true",
    ];
    assert_eq!(idle(&set), expected);
    let woken = set
        .replace(&on(&["compensation.feedforward", "compensation.adaptive", "protection.enabled"]))
        .unwrap();
    assert_eq!(idle(&woken), [""; 0]);
    let levels = KEYS.iter().map(|row| row.key).filter(|key| {
        key.starts_with("protection.") && (key.ends_with("_warning") || key.ends_with("_trip"))
    });
    for key in levels.chain(["protection.start_time"]) {
        let off = rig.replace(&[(key, Value::from(0.25))]).unwrap();
        assert_eq!(idle(&off), [format!("{key} needs protection.enabled = true")]);
        assert_eq!(idle(&off.replace(&on(&["protection.enabled"])).unwrap()), [""; 0]);
    }
    let soft = rig.replace(&on(&["protection.soft_end"])).unwrap();
    assert_eq!(idle(&soft), ["protection.soft_end needs protection.enabled = true"]);
}

#[test]
fn values_may_have_units_of_their_own() {
    let rig = replaced("structure.mass", "12 t").unwrap();
    assert_eq!(rig.structure.mass, 12_000.0);
    assert_eq!(RigConfig::from_toml(&rig.to_toml()).unwrap(), rig);
    let flows = Value::Array(["-10 gpm", "0 gpm", "10 gpm"].map(Value::from).to_vec());
    let openings = Value::Array(["-100 %", "0 %", "100 %"].map(Value::from).to_vec());
    let table = [("servovalve.flow_table.openings", openings), ("servovalve.flow_table.flows", flows)];
    assert_eq!(
        RigConfig::zhao2005().replace(&table).unwrap().servovalve.flow_table.openings,
        [-1.0, 0.0, 1.0]
    );
    for wrong in ["12 bar", "12", "1e30 kg"] {
        let message = message(replaced("structure.mass", wrong));
        assert!(message.starts_with("structure.mass = ") && message.contains(wrong), "{message}");
        assert!(message.contains("between") && message.contains("kg"), "{message}");
    }
}
