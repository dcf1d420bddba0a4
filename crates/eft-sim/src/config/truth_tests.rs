use toml::{Table, Value};

use super::tests::everything;
use super::*;

fn zhao2005(changes: &[(&str, Value)]) -> Result<RigConfig> {
    RigConfig::zhao2005().replace(changes)
}

fn message(changes: &[(&str, Value)]) -> String {
    zhao2005(changes).unwrap_err().to_string()
}

/// A value other than the default that is valid with any other values.
fn another(row: &Key, whole: &Table) -> Value {
    match row.kind {
        Kind::Float(low, high) => (0.7 * low + 0.3 * high).into(),
        Kind::Int(low, _) => (low + 1).into(),
        Kind::Bool => true.into(),
        Kind::Choice(words) => words[0].into(),
        Kind::Text => "text".into(),
        Kind::Floats(..) => tree::get(whole, row.key).unwrap().clone(),
    }
}

#[test]
fn only_keys_of_the_plant_have_a_truth() {
    let whole = everything();
    let believed = RigConfig::from_tree(whole.clone()).unwrap();
    for row in KEYS.iter().filter(|row| !row.key.starts_with("servovalve.flow_table")) {
        let key = format!("{}.{}", tree::TRUTH, row.key);
        let value = another(row, &whole);
        let rig = believed.replace(&[(&key, value.clone())]);
        if !row.is_of_the_plant() {
            let said = rig.unwrap_err().to_string();
            assert!(
                said.starts_with(&format!("{key} = ")) && said.contains("must be a key of the plant"),
                "{said}"
            );
            continue;
        }
        let rig = rig.unwrap();
        assert_eq!(*rig, *believed, "{key}");
        assert_eq!(rig.plant(), &believed.replace(&[(row.key, value.clone())]).unwrap(), "{key}");
        assert_eq!(rig.get(&key).unwrap(), Some(value));
        for text in [rig.to_toml(), rig.to_commented_toml()] {
            assert_eq!(RigConfig::from_toml(&text).unwrap(), rig, "{text}");
        }
        assert_eq!(RigConfig::from_tree(rig.to_tree()).unwrap(), rig);
        assert_eq!(rig.without(&[key]).unwrap(), believed);
    }
}

#[test]
fn without_truth_the_plant_has_the_controllers_values() {
    let rig = RigConfig::zhao2005();
    assert_eq!(rig.plant(), &rig);
    assert!(!rig.to_toml().contains("truth") && !rig.to_tree().contains_key("truth"));
    assert_eq!(zhao2005(&[("truth", Table::new().into())]).unwrap(), rig);
    let heavy = zhao2005(&[("truth.structure.mass", 9e3.into()), ("truth.dac.range", 5.into())]).unwrap();
    assert!(
        heavy.to_toml().ends_with("\n[truth]\nstructure.mass = 9000.0\ndac.range = 5.0\n"),
        "{}",
        heavy.to_toml()
    );
    assert_eq!(heavy.plant().plant(), heavy.plant());
    assert_eq!(heavy.without(&["truth"]).unwrap(), rig);
}

#[test]
fn a_change_of_the_controllers_values_keeps_the_truth() {
    let rig = zhao2005(&[("truth.structure.mass", 9e3.into())]).unwrap();
    let changed =
        rig.replace(&[("structure.damping", 5e3.into()), ("compensation.level", 0.9.into())]).unwrap();
    assert_eq!((changed.structure.mass, changed.plant().structure.mass), (7040.0, 9e3));
    assert_eq!((changed.plant().structure.damping, changed.plant().compensation.level), (5e3, 0.9));
    assert_eq!(rig.with(|values| values.structure.damping = 5e3).unwrap().plant().structure.damping, 5e3);
    let varied = rig.varied(|values| values.structure.mass *= 2.0);
    assert_eq!((varied.structure.mass, varied.plant().structure.mass), (14_080.0, 18e3));
}

#[test]
fn messages_name_the_wrong_truth_and_the_allowed_values() {
    let one = || Value::Array(vec![1e3.into()]);
    let building = |stories: usize| -> Vec<(&str, Value)> {
        let keys =
            ["masses", "dampings", "stiffnesses"].map(|name| format!("structure.stories.{name}").leak());
        let lists = keys.map(|key| (&*key, Value::Array(vec![1e3.into(); stories])));
        [("structure.kind", "shear_building".into())].into_iter().chain(lists).collect()
    };
    let curve = RigConfig::zhao2005().get("servovalve.flow_table").unwrap().unwrap();
    let cases: Vec<(Vec<(&str, Value)>, &str)> = vec![
        (
            vec![("truth.structure.mass", (-1).into())],
            "truth.structure.mass = -1: must be a number between 0.001",
        ),
        (
            vec![("truth.structure.mass", "heavy".into())],
            "truth.structure.mass = \"heavy\": must be a number",
        ),
        (vec![("truth", 3.into())], "truth = 3: must be a section"),
        (vec![("truth.structure", 3.into())], "truth.structure = 3: must be a section"),
        (
            vec![("truth.structure.mas", 1.into())],
            "unknown key `truth.structure.mas`; the nearest known key is `truth.structure.mass`",
        ),
        (
            vec![("truth.piston_area", 1.into())],
            "unknown key `truth.piston_area`; the nearest known key is `truth.actuator.piston_area`",
        ),
        (
            vec![("thruth.structure.mass", 1.into())],
            "unknown key `thruth.structure.mass`; the nearest known key is `truth.structure.mass`",
        ),
        (
            vec![("truth.truth.structure.mass", 1.into())],
            "truth.truth.structure.mass = 1: must be a key of the plant",
        ),
        (
            vec![("truth.compensation.level", 1.1.into())],
            "truth.compensation.level = 1.1: must be a key of the plant, in one of the sections `actuator`, `supply`",
        ),
        (vec![("truth.limits", Table::new().into())], "truth.limits = a section: must be a key of the plant"),
        (vec![("truth.name", "other".into())], "truth.name = \"other\": must be a key of the plant"),
        (
            vec![("truth.sensors.force.bits", 16.into())],
            "missing key `truth.sensors.force.range` (load cell: range to either side, N; needed with",
        ),
        (vec![("truth.structure.kind", "bouc_wen".into())], "missing key `truth.structure.bouc_wen."),
        (
            vec![("truth.servovalve.flow_table.flows", one())],
            "truth.servovalve.flow_table.flows = 1 values: must be a list of 2",
        ),
        (
            vec![("truth.servovalve.flow_table", curve.clone()), ("servovalve.true_flow_table", curve)],
            "truth.servovalve.flow_table = a section: must be absent: `servovalve.true_flow_table` is",
        ),
        (
            building(2).into_iter().chain([("truth.structure.kind", "linear".into())]).collect(),
            "truth.structure.kind = \"linear\": must leave the number of actuators: `structure.kind` is \"shear_building\"",
        ),
        (
            ["masses", "dampings", "stiffnesses"]
                .map(|name| (&*format!("truth.structure.stories.{name}").leak(), one()))
                .into_iter()
                .chain(building(2))
                .collect(),
            "truth.structure.stories.masses = 1 values: must have as many values as `structure.stories.masses`, which has 2",
        ),
        (
            vec![("truth.structure.mass", 9e3.into()), ("structure.mass", (-1).into())],
            "structure.mass = -1: must be a number",
        ),
    ];
    for (changes, expected) in cases {
        let said = message(&changes);
        assert!(said.starts_with(expected), "{said}\n{expected}");
    }
    let unknown = RigConfig::zhao2005().get("truth.compensation.level").unwrap_err().to_string();
    assert!(unknown.starts_with("unknown key `truth.compensation.level`"), "{unknown}");
}
