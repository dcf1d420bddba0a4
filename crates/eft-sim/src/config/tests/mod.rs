mod messages;
mod texts;

use std::collections::BTreeSet;

use toml::{Table, Value};

use super::*;

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
    for row in KEYS.iter() {
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
    for row in KEYS.iter() {
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
