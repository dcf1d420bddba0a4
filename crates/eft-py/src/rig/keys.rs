//! The schema of the configuration, and values with their units.

use eft_sim::config::{KEYS, Key, Kind, Need, Preset};
use eft_sim::units;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Return the schema of the configuration, one dictionary per key, in the order of files.
///
/// The keys of the plant are listed a second time, under ``truth``.
///
/// Returns
/// -------
/// list of dict
///     Each has `key`, `unit`, `type` ("float", "int", "bool", "str" or "list"), `allowed`, `doc`, `required` (bool),
///     `required_where` (a condition such as ``structure.kind = "bilinear"`` or ``structure.kind is not "shear_building"``, or None) and `default` (None if
///     the key has none).
///
/// Examples
/// --------
/// >>> import eft
/// >>> next(row["unit"] for row in eft.rig_keys() if row["key"] == "structure.mass")
/// 'kg'
#[pyfunction]
pub(crate) fn rig_keys(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    let row = |row: &Key, key: &str, truth: bool| {
        let entry = PyDict::new(py);
        entry.set_item("key", key)?;
        entry.set_item("unit", row.unit)?;
        let kind = match row.kind {
            Kind::Float(..) => "float",
            Kind::Int(..) => "int",
            Kind::Bool => "bool",
            Kind::Choice(_) | Kind::Text => "str",
            Kind::Floats(..) => "list",
        };
        entry.set_item("type", kind)?;
        entry.set_item("allowed", row.allowed())?;
        entry.set_item("doc", row.doc)?;
        let need = if truth { Need::Optional } else { row.need };
        entry.set_item("required", matches!(need, Need::Required))?;
        let condition = match need {
            Need::When(other, value) => Some(format!("{other} = \"{value}\"")),
            Need::Unless(other, value) => Some(format!("{other} is not \"{value}\"")),
            _ => None,
        };
        entry.set_item("required_where", condition)?;
        match need {
            Need::Default(Preset::Float(value)) => entry.set_item("default", value)?,
            Need::Default(Preset::Int(value)) => entry.set_item("default", value)?,
            Need::Default(Preset::Bool(value)) => entry.set_item("default", value)?,
            Need::Default(Preset::Text(value)) => entry.set_item("default", value)?,
            _ => entry.set_item("default", py.None())?,
        }
        Ok(entry)
    };
    let believed = KEYS.iter().map(|key| row(key, key.key, false));
    let of_the_plant = KEYS.iter().filter(|key| key.is_of_the_plant());
    believed.chain(of_the_plant.map(|key| row(key, &format!("truth.{}", key.key), true))).collect()
}

/// Return one of a unit that a column of measurements names, in the SI unit of the quantity.
#[pyfunction]
pub(crate) fn unit_factor(unit: &str, si: &str) -> Option<f64> {
    units::factor_of_column(unit, si)
}

/// Return the units of the dimension of an SI unit, for messages.
#[pyfunction]
pub(crate) fn units_of(si: &str) -> String {
    units::units_of(si)
}

/// Return a value in SI units from a number or a text such as ``"12 t"``.
#[pyfunction]
pub(crate) fn quantity(name: &str, value: &Bound<'_, PyAny>, unit: &str) -> PyResult<f64> {
    let found = match value.extract::<String>() {
        Ok(text) => units::quantity(&text, unit),
        Err(_) => value.extract::<f64>().ok(),
    };
    let of = if unit.is_empty() {
        String::new()
    } else {
        format!(" in {unit}, or a text with a number and a unit such as {}", units::units_of(unit))
    };
    found.filter(|number| number.is_finite()).ok_or_else(|| {
        crate::errors::refuse(
            name,
            value.repr().map_or_else(|_| "?".into(), |text| text.to_string()),
            format!("must be a finite number{of}"),
        )
    })
}
