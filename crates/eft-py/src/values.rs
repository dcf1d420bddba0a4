//! Configuration values between Python objects and TOML trees, and numbers.

use pyo3::exceptions::{PyOverflowError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyMapping, PyString};
use toml::{Table, Value};

use crate::errors::refuse;
use crate::flow_table::FlowTable;

/// Largest depth, more than the schema has, to stop at a dictionary that contains itself.
const DEEPEST: usize = 16;

/// A number, which a truth value of Python or NumPy is not.
pub(crate) fn real_number(given: &Bound<'_, PyAny>) -> PyResult<f64> {
    if let Ok(number) = given.cast::<PyFloat>() {
        return Ok(number.value());
    }
    no_truth_value(given, "real")?;
    given.extract()
}

/// Refuses a truth value of Python or NumPy, also an array of NumPy without dimensions, for this kind of number.
fn no_truth_value(given: &Bound<'_, PyAny>, number: &str) -> PyResult<()> {
    let kind = given.getattr("dtype").and_then(|dtype| dtype.getattr("kind"));
    if given.is_instance_of::<PyBool>() || kind.is_ok_and(|kind| kind.eq("b").unwrap_or(false)) {
        let kind = given.get_type().name()?;
        return Err(PyTypeError::new_err(format!(
            "must be {number} number, not a truth value of type {kind}"
        )));
    }
    Ok(())
}

/// A number, or `None`.
pub(crate) fn optional_number(given: &Bound<'_, PyAny>) -> PyResult<Option<f64>> {
    if given.is_none() { Ok(None) } else { real_number(given).map(Some) }
}

/// A whole number of at least 0, which a truth value is not.
pub(crate) fn whole_number<T: for<'a, 'py> FromPyObject<'a, 'py, Error = PyErr>>(
    given: &Bound<'_, PyAny>,
) -> PyResult<T> {
    no_truth_value(given, "whole")?;
    given.extract().map_err(|error: PyErr| {
        if !error.is_instance_of::<PyOverflowError>(given.py()) {
            return error;
        }
        let most = u64::MAX >> (64 - 8 * size_of::<T>());
        PyValueError::new_err(format!("{given}: must be a whole number between 0 and {most}"))
    })
}

/// A whole number, or `None`.
pub(crate) fn optional_whole<T: for<'a, 'py> FromPyObject<'a, 'py, Error = PyErr>>(
    given: &Bound<'_, PyAny>,
) -> PyResult<Option<T>> {
    if given.is_none() { Ok(None) } else { whole_number(given).map(Some) }
}

/// Two numbers.
pub(crate) fn real_pair(given: &Bound<'_, PyAny>) -> PyResult<(f64, f64)> {
    let (first, second) = given.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>()?;
    Ok((real_number(&first)?, real_number(&second)?))
}

/// A Python value as a configuration value; `None` for Python's `None`.
pub(crate) fn from_python(key: &str, given: &Bound<'_, PyAny>) -> PyResult<Option<Value>> {
    convert(key, given, 0)
}

/// A mapping as a tree of sections; entries that are `None` are left out.
pub(crate) fn tree_from_python(given: &Bound<'_, PyMapping>) -> PyResult<Table> {
    section("", given, 0)
}

fn convert(key: &str, given: &Bound<'_, PyAny>, depth: usize) -> PyResult<Option<Value>> {
    if depth > DEEPEST {
        return Err(refuse(key, "nested too deeply", format!("must have at most {DEEPEST} levels")));
    }
    // `tolist` converts NumPy's numbers and arrays to Python's.
    if !given.is_instance_of::<PyFloat>() && given.hasattr("tolist")? {
        return convert(key, &given.call_method0("tolist")?, depth + 1);
    }
    let value = if given.is_none() {
        return Ok(None);
    } else if let Ok(flag) = given.cast::<PyBool>() {
        Value::Boolean(flag.is_true())
    } else if given.is_instance_of::<PyInt>() {
        match given.extract::<i64>() {
            Ok(number) => Value::Integer(number),
            Err(_) => return Err(refuse(key, given.str()?, "must fit 64 bits with its sign")),
        }
    } else if let Ok(number) = given.cast::<PyFloat>() {
        Value::Float(number.value())
    } else if let Ok(text) = given.cast::<PyString>() {
        match text.to_str() {
            Ok(text) => Value::String(text.to_owned()),
            Err(_) => return Err(refuse(key, text.repr()?, "must be valid Unicode")),
        }
    } else if let Ok(table) = given.cast::<FlowTable>() {
        Value::Table(table.get().tree())
    } else if let Ok(mapping) = given.cast::<PyMapping>() {
        Value::Table(section(key, mapping, depth)?)
    } else if given.hasattr("__len__")? {
        let mut items = Vec::new();
        for (index, item) in given.try_iter()?.enumerate() {
            let place = format!("{key}[{index}]");
            match convert(&place, &item?, depth + 1)? {
                Some(item) => items.push(item),
                None => return Err(refuse(&place, "None", "must be a number")),
            }
        }
        Value::Array(items)
    } else {
        let kind = given.get_type().name()?;
        return Err(refuse(
            key,
            format!("an object of type {kind}"),
            "must be a number, string, list or mapping",
        ));
    };
    Ok(Some(value))
}

fn section(key: &str, given: &Bound<'_, PyMapping>, depth: usize) -> PyResult<Table> {
    let mut table = Table::new();
    for item in given.items()?.iter() {
        let (name, value) = item.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>()?;
        let name = match name.cast::<PyString>().map(|text| text.to_str().map(str::to_owned)) {
            Ok(Ok(name)) => name,
            _ => return Err(PyValueError::new_err(format!("key {}: must be a string", name.repr()?))),
        };
        let place = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
        if let Some(value) = convert(&place, &value, depth + 1)? {
            table.insert(name, value);
        }
    }
    Ok(table)
}

/// A configuration value as plain Python objects.
pub(crate) fn to_python<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Boolean(flag) => flag.into_pyobject(py)?.to_owned().into_any(),
        Value::Integer(number) => number.into_pyobject(py)?.into_any(),
        Value::Float(number) => number.into_pyobject(py)?.into_any(),
        Value::String(text) => text.into_pyobject(py)?.into_any(),
        Value::Array(items) => {
            let items: Vec<_> = items.iter().map(|item| to_python(py, item)).collect::<PyResult<_>>()?;
            PyList::new(py, items)?.into_any()
        }
        Value::Table(table) => {
            let mapping = PyDict::new(py);
            for (key, value) in table {
                mapping.set_item(key, to_python(py, value)?)?;
            }
            mapping.into_any()
        }
        // The schema has no dates.
        Value::Datetime(date) => date.to_string().into_pyobject(py)?.into_any(),
    })
}
