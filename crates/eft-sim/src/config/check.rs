//! From a tree of given values to a complete and valid one.

use std::sync::LazyLock;

use eft_core::Short;
use toml::{Table, Value};

use super::calibrations::{CALIBRATION, VERSION};
use super::schema::{Key, Kind, Need, PLANT};
use super::{KEYS, tree};
use crate::units::{quantity, units_of};
use crate::{Error, Result, checks};

/// Sections that are given whole or not at all.
pub(super) const WHOLE_SECTIONS: [&str; 7] = [
    "servovalve.true_flow_table",
    "supply.schedule",
    "structure.power_damper",
    "structure.bouc_wen",
    "structure.stories",
    "calibration",
    "structure.softening",
];

/// Further keys that need another key.
const FURTHER_NEEDS: [(&str, &str); 12] = [
    ("supply.droop", "supply.accumulator"),
    ("supply.accumulator", "supply.droop"),
    ("supply.pump_flow", "supply.droop"),
    ("sensors.cell_mass", "sensors.force.bandwidth"),
    ("sensors.fault.signal", "sensors.fault.kind"),
    ("sensors.fault.kind", "sensors.fault.start"),
    ("sensors.fault.start", "sensors.fault.signal"),
    ("sensors.fault.duration", "sensors.fault.signal"),
    ("sensors.fault.gain", "sensors.fault.signal"),
    ("sensors.fault.offset", "sensors.fault.signal"),
    ("sensors.fault.drift", "sensors.fault.signal"),
    ("sensors.fault.noise", "sensors.fault.signal"),
];

/// Every key that needs another key, and that key. In a whole section a key needs the next one, and the last the first.
static NEEDS: LazyLock<Vec<(&str, &str)>> = LazyLock::new(|| {
    let keys = || KEYS.iter().map(|row| row.key);
    let resolution = keys().filter(|key| key.ends_with(".bits"));
    let range = |bits: &str| keys().find(|key| key.strip_suffix("range") == bits.strip_suffix("bits"));
    let mut needs: Vec<_> = resolution.filter_map(|bits| Some((bits, range(bits)?))).collect();
    needs.extend(FURTHER_NEEDS);
    for section in WHOLE_SECTIONS {
        let inside = |key: &&str| key.strip_prefix(section).is_some_and(|rest| rest.starts_with('.'));
        needs.extend(keys().filter(inside).zip(keys().filter(inside).cycle().skip(1)));
    }
    needs
});

/// Checks every name and value against the schema, those under `truth` as well.
pub(super) fn accepted(given: &Table) -> Result<Table> {
    check_version(given)?;
    let mut accepted = Table::new();
    for (key, value) in tree::leaves(given) {
        match tree::row(&key) {
            Some(row) => tree::set(&mut accepted, &key, check_value(&key, row, value)?)?,
            None if key == CALIBRATION
                && let Some(each) = value.as_array() =>
            {
                tree::set(&mut accepted, &key, calibrations(each)?)?;
            }
            None if tree::is_section(&key) => {
                checks::require(value.is_table(), &key, display(value), "must be a section")?;
            }
            None => return Err(unknown_key_error(&key, value)),
        }
    }
    Ok(accepted)
}

/// Fills in the defaults of accepted values, and checks the relations between them.
pub(super) fn complete(mut whole: Table) -> Result<Table> {
    for row in KEYS.iter() {
        if tree::get(&whole, row.key).is_none() {
            match row.need {
                Need::Default(preset) => tree::set(&mut whole, row.key, preset.value())?,
                Need::Required => return Err(missing_key_error(row)),
                Need::When(key, word) if tree::get(&whole, key).and_then(Value::as_str) == Some(word) => {
                    return Err(missing_key_error(row));
                }
                Need::Unless(key, word) => {
                    if tree::get(&whole, key).and_then(Value::as_str) != Some(word) {
                        return Err(missing_key_error(row));
                    }
                    if let Some(value) = ground_floor_value(&whole, row.key) {
                        tree::set(&mut whole, row.key, value)?;
                    }
                }
                Need::When(..) | Need::Optional => {}
            }
        }
    }
    check_needs(&whole)?;
    flow_table(&whole, "servovalve.flow_table")?;
    if tree::get(&whole, "servovalve.true_flow_table").is_some() {
        flow_table(&whole, "servovalve.true_flow_table")?;
    }
    supply_schedule(&whole)?;
    stories(&whole)?;
    check_calibration_count(&whole, if is_building(&whole) { list(&whole, MASSES).len() } else { 1 })?;
    Ok(whole)
}

/// The value of a building's ground floor for a key of a single floor, if the stories are given.
fn ground_floor_value(whole: &Table, key: &str) -> Option<Value> {
    let list = match key {
        "structure.mass" => MASSES,
        "structure.damping" => "structure.stories.dampings",
        _ => "structure.stories.stiffnesses",
    };
    tree::get(whole, list)?.as_array()?.first().cloned()
}

/// A complete tree whose plant has other accepted values, checked in the same way.
pub(super) fn plant(configured: &Table, truth: &Table) -> Result<Table> {
    let mut plant = configured.clone();
    for (key, value) in tree::leaves(truth) {
        tree::set(&mut plant, &key, value.clone())?;
    }
    let plant = complete(plant).map_err(|error| error.within(tree::TRUTH))?;
    let curve = "servovalve.flow_table";
    if tree::get(truth, curve).is_some() && tree::get(&plant, "servovalve.true_flow_table").is_some() {
        let allowed = "must be absent: `servovalve.true_flow_table` is the valve's own curve already";
        return Err(Error::value(curve, "a section", allowed).within(tree::TRUTH));
    }
    check_actuator_count(configured, &plant).map_err(|error| error.within(tree::TRUTH))?;
    Ok(plant)
}

const KIND: &str = "structure.kind";
const MASSES: &str = "structure.stories.masses";

/// The kind of a rig's structure.
fn kind(rig: &Table) -> &str {
    tree::get(rig, KIND).and_then(Value::as_str).unwrap_or_default()
}

fn is_building(rig: &Table) -> bool {
    kind(rig) == "shear_building"
}

/// The true plant must have as many actuators as there are controllers.
fn check_actuator_count(configured: &Table, plant: &Table) -> Result<()> {
    let allowed = format!("must leave the number of actuators: `{KIND}` is \"{}\"", kind(configured));
    let same = is_building(configured) == is_building(plant);
    checks::require(same, KIND, format!("\"{}\"", kind(plant)), allowed)?;
    let [stories, true_stories] = [configured, plant].map(|rig| list(rig, MASSES));
    if is_building(plant) { check_same_length((MASSES, &true_stories), (MASSES, &stories)) } else { Ok(()) }
}

/// The error for a name outside the schema.
fn unknown_key_error(key: &str, value: &Value) -> Error {
    match tree::under_truth(key) {
        Some(configured) if tree::check_known(configured).is_ok() => {
            let sections = PLANT.map(|section| format!("`{section}`")).join(", ");
            let allowed = format!("must be a key of the plant, in one of the sections {sections}");
            Error::value(key, display(value), allowed)
        }
        _ => tree::unknown(key),
    }
}

/// A value of the right type and range; whole numbers become floats where floats are wanted.
fn check_value(key: &str, row: &Key, value: &Value) -> Result<Value> {
    let refuse = || Error::value(key, display(value), allowed(row, value));
    match (row.kind, value) {
        (Kind::Float(low, high), _) => {
            let number = number(value, row.unit).ok_or_else(refuse)?;
            // Also refuses NaN, which is in no range.
            if (low..=high).contains(&number) { Ok(Value::Float(number)) } else { Err(refuse()) }
        }
        (Kind::Int(low, high), Value::Integer(number)) if (low..=high).contains(number) => Ok(value.clone()),
        (Kind::Bool, Value::Boolean(_)) | (Kind::Text, Value::String(_)) => Ok(value.clone()),
        (Kind::Choice(words), Value::String(word)) if words.contains(&word.as_str()) => Ok(value.clone()),
        (Kind::Floats(least, most, low, high), Value::Array(items)) => {
            if !(least..=most).contains(&items.len()) {
                return Err(Error::value(key, format!("{} values", items.len()), row.allowed()));
            }
            let each = Key { kind: Kind::Float(low, high), ..*row };
            let accepted = items.iter().enumerate().map(|(index, item)| {
                let inside = number(item, row.unit).filter(|number| (low..=high).contains(number));
                let refuse = || Error::value(&format!("{key}[{index}]"), display(item), allowed(&each, item));
                inside.map(Value::Float).ok_or_else(refuse)
            });
            accepted.collect::<Result<Vec<_>>>().map(Value::Array)
        }
        _ => Err(refuse()),
    }
}

/// Checks keys that depend on each other.
fn check_needs(whole: &Table) -> Result<()> {
    for &(given, needed) in NEEDS.iter() {
        if tree::get(whole, given).is_some() && tree::get(whole, needed).is_none() {
            let meaning = tree::row(needed).map(Key::meaning).unwrap_or_default();
            return Err(Error::MissingKey {
                key: needed.to_owned(),
                meaning: format!("{meaning}; needed with `{given}`"),
            });
        }
    }
    Ok(())
}

/// Checks a flow curve: as many flows as openings, both strictly increasing, through (0, 0), with both
/// directions of flow.
fn flow_table(whole: &Table, section: &str) -> Result<()> {
    let openings_key = &*format!("{section}.openings");
    let flows_key = &*format!("{section}.flows");
    let (openings, flows) = (list(whole, openings_key), list(whole, flows_key));
    check_same_length((flows_key, &flows), (openings_key, &openings))?;
    increasing(openings_key, &openings)?;
    increasing(flows_key, &flows)?;
    let Some(zero) = openings.iter().position(|opening| *opening == 0.0) else {
        return Err(Error::value(openings_key, "no point at 0", "must contain the point (0, 0)"));
    };
    let (key, flow) = (format!("{flows_key}[{zero}]"), flows[zero]);
    checks::require(flow == 0.0, &key, Short(flow), "must be 0, the flow at opening 0")?;
    let side = if zero == 0 { "nothing below opening 0" } else { "nothing above opening 0" };
    let allowed = "must have points on both sides of 0, one for each direction of flow";
    checks::require(zero > 0 && zero + 1 < openings.len(), openings_key, side, allowed)
}

/// Checks the supply's schedule: as many pressures as times, the times strictly increasing.
fn supply_schedule(whole: &Table) -> Result<()> {
    const TIMES: &str = "supply.schedule.times";
    const PRESSURES: &str = "supply.schedule.pressures";
    let (times, pressures) = (list(whole, TIMES), list(whole, PRESSURES));
    check_same_length((PRESSURES, &pressures), (TIMES, &times))?;
    increasing(TIMES, &times)
}

/// Checks the stories: as many dampings and stiffnesses as masses.
fn stories(whole: &Table) -> Result<()> {
    let masses = list(whole, MASSES);
    ["structure.stories.dampings", "structure.stories.stiffnesses"]
        .into_iter()
        .try_for_each(|key| check_same_length((key, &list(whole, key)), (MASSES, &masses)))
}

/// Refuses a list with another number of values than a second one.
fn check_same_length((key, values): (&str, &[f64]), (other, others): (&str, &[f64])) -> Result<()> {
    let allowed = format!("must have as many values as `{other}`, which has {}", others.len());
    checks::require(values.len() == others.len(), key, format!("{} values", values.len()), allowed)
}

/// Refuses a list that does not increase strictly.
fn increasing(key: &str, values: &[f64]) -> Result<()> {
    let Some(index) = values.windows(2).position(|pair| pair[1] <= pair[0]) else { return Ok(()) };
    let allowed = format!("must increase strictly: [{index}] is {}", Short(values[index]));
    Err(Error::value(&format!("{key}[{}]", index + 1), Short(values[index + 1]), allowed))
}

/// The numbers of a list; empty if it is absent.
fn list(whole: &Table, key: &str) -> Vec<f64> {
    let items = tree::get(whole, key).and_then(Value::as_array);
    items.map(|items| items.iter().filter_map(Value::as_float).collect()).unwrap_or_default()
}

/// Refuses a calibration of another version before its keys, which differ.
fn check_version(given: &Table) -> Result<()> {
    const KEY: &str = "calibration.version";
    let version = tree::get(given, KEY).and_then(Value::as_integer).unwrap_or(VERSION);
    let allowed =
        format!("must be {VERSION}: repeat the test to save its calibration again, or leave out the section");
    checks::require(version == VERSION, KEY, version, allowed)
}

/// A list of whole sections, each checked as the only one.
fn calibrations(each: &[Value]) -> Result<Value> {
    let one = |(index, section): (usize, &Value)| {
        let named = |error: Error| error.renamed(CALIBRATION, &format!("{CALIBRATION}[{index}]"));
        let alone = Table::from_iter([(CALIBRATION.to_owned(), section.clone())]);
        if section.as_table().is_none_or(Table::is_empty) {
            return Err(named(Error::value(CALIBRATION, section, "must be a whole section")));
        }
        let mut alone = accepted(&alone).map_err(named)?;
        check_needs(&alone).map_err(named)?;
        Ok(alone.remove(CALIBRATION).unwrap_or_else(|| section.clone()))
    };
    Ok(Value::Array(each.iter().enumerate().map(one).collect::<Result<_>>()?))
}

/// Refuses a list with another number of calibrations than the rig has actuators.
fn check_calibration_count(whole: &Table, actuators: usize) -> Result<()> {
    let Some(each) = tree::get(whole, CALIBRATION).and_then(Value::as_array) else { return Ok(()) };
    let allowed = format!("must be one section for all actuators, or a list of one for each of {actuators}");
    checks::require(each.len() == actuators, CALIBRATION, format!("a list of {}", each.len()), allowed)
}

/// A number in SI units, from a number or a text with a unit.
fn number(value: &Value, unit: &str) -> Option<f64> {
    match value {
        Value::Float(number) => Some(*number),
        Value::Integer(number) => Some(*number as f64),
        Value::String(text) => quantity(text, unit),
        _ => None,
    }
}

/// The allowed values of a key; for a text in the place of a number also the form of such a text.
fn allowed(row: &Key, value: &Value) -> String {
    let number = matches!(row.kind, Kind::Float(..) | Kind::Floats(..));
    if number && value.is_str() && !row.unit.is_empty() {
        format!("{}, or a text with a number and a unit such as {}", row.allowed(), units_of(row.unit))
    } else {
        row.allowed()
    }
}

fn missing_key_error(row: &Key) -> Error {
    Error::MissingKey { key: row.key.to_owned(), meaning: row.meaning() }
}

/// A value as the user wrote it, shortened if it is long.
fn display(value: &Value) -> String {
    let text = match value {
        Value::Float(number) => Short(*number).to_string(),
        Value::Table(_) => "a section".to_owned(),
        other => other.to_string(),
    };
    tree::shortened(&text)
}
