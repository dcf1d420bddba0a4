//! Conversion of arrays from and to NumPy.

use numpy::{Element, PyArray1, PyArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::PyList;

use crate::errors::refuse;

/// Anything numpy can read as a one-dimensional array of real numbers, as `f64`; NaN for what is masked.
pub(crate) fn vector(parameter: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let array = real(parameter, given)?;
    let dimensions = array.getattr("ndim")?.extract::<usize>()?;
    if dimensions != 1 {
        return Err(refuse(
            parameter,
            format!("an array of {dimensions} dimensions"),
            "must have one dimension",
        ));
    }
    flat(&array)
}

/// Anything numpy can read as an array of real numbers, as one of `float64` with its shape; NaN for what is masked.
pub(crate) fn real<'py>(parameter: &str, given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let numpy = given.py().import("numpy")?;
    let given = &unmasked(&numpy, given)?;
    let array = numpy.call_method1("asarray", (given,)).map_err(|error| {
        // Ragged lists; NumPy's message names the place.
        refuse(parameter, error.value(given.py()).to_string(), "must be an array of numbers")
    })?;
    let kind = array.getattr("dtype")?.getattr("kind")?.extract::<String>()?;
    // An empty list becomes an array of floats; the caller decides whether that is allowed.
    if !matches!(kind.as_str(), "f" | "i" | "u") {
        let found = format!("an array of {}", array.getattr("dtype")?.str()?);
        return Err(refuse(parameter, found, "must be an array of real numbers"));
    }
    // Also aligned, because an array from a network buffer may start at any byte.
    numpy.call_method1("require", (array, "float64", ["C", "A"]))
}

/// A masked array of real numbers, or a list with some, with NaN for what is masked; anything else as given.
fn unmasked<'py>(numpy: &Bound<'py, PyModule>, given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let masked = numpy.getattr("ma")?.getattr("MaskedArray")?;
    let filled = |array: &Bound<'py, PyAny>| {
        let real = "fiu".contains(array.getattr("dtype")?.getattr("kind")?.extract::<String>()?.as_str());
        if !real {
            return Ok(array.clone());
        }
        array.call_method1("astype", ("float64",))?.call_method1("filled", (f64::NAN,))
    };
    if given.is_instance(&masked)? {
        return filled(given);
    }
    let Ok(list) = given.cast::<PyList>() else { return Ok(given.clone()) };
    let items = list.iter().map(|item| if item.is_instance(&masked)? { filled(&item) } else { Ok(item) });
    Ok(PyList::new(given.py(), items.collect::<PyResult<Vec<_>>>()?)?.into_any())
}

/// The elements of a contiguous `float64` array in C order.
pub(crate) fn flat(array: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let line = array.call_method0("ravel")?;
    Ok(line.cast::<PyArray1<f64>>()?.try_readonly()?.as_slice()?.to_vec())
}

/// The rows of a contiguous `float64` array of two dimensions.
pub(crate) fn rows(parameter: &str, array: &Bound<'_, PyAny>) -> PyResult<Vec<Vec<f64>>> {
    let shape = array.getattr("shape")?.extract::<Vec<usize>>()?;
    let [rows, columns] = shape.as_slice() else {
        let found = format!("an array of {} dimensions", shape.len());
        return Err(refuse(parameter, found, "must have one dimension, or two: (actuators, samples)"));
    };
    let values = flat(array)?;
    Ok((0..*rows).map(|row| values[row * columns..(row + 1) * columns].to_vec()).collect())
}

/// A value for each actuator: an array, or one value alone without a leading axis.
pub(crate) fn each<'py, T: Element + Copy + IntoPyObject<'py>>(
    py: Python<'py>,
    values: &[T],
    leading_axis: bool,
) -> PyResult<Bound<'py, PyAny>> {
    match values {
        [one] if !leading_axis => one.into_bound_py_any(py),
        _ => Ok(PyArray1::from_slice(py, values).into_any()),
    }
}

/// Channels of equal length as an array: of one dimension, or with a leading axis.
pub(crate) fn stacked<T: Element + Clone>(
    py: Python<'_>,
    mut channels: Vec<Vec<T>>,
    leading_axis: bool,
) -> PyResult<Bound<'_, PyAny>> {
    if !leading_axis {
        return Ok(PyArray1::from_vec(py, channels.pop().unwrap_or_default()).into_any());
    }
    let shape = (channels.len(), channels.first().map_or(0, Vec::len));
    PyArray1::from_vec(py, channels.concat()).call_method1("reshape", (shape,))
}

/// A read-only array, because its values are validated.
pub(crate) fn frozen(py: Python<'_>, values: &[f64]) -> PyResult<Py<PyArray1<f64>>> {
    let array = PyArray1::from_slice(py, values);
    array.call_method1("setflags", (false,))?;
    Ok(array.unbind())
}

/// Applies `f` to every element, keeping the shape; a number gives a number.
pub(crate) fn map<'py>(
    parameter: &str,
    given: &Bound<'py, PyAny>,
    f: impl Fn(f64) -> f64,
) -> PyResult<Bound<'py, PyAny>> {
    let array = real(parameter, given)?;
    let mut values = flat(&array)?;
    if let Some(index) = values.iter().position(|value| !value.is_finite()) {
        let place = if values.len() == 1 { String::new() } else { format!(" at element {index}") };
        return Err(refuse(parameter, format!("{}{place}", values[index]), "must be finite"));
    }
    values.iter_mut().for_each(|value| *value = f(*value));
    let answer =
        PyArray1::from_vec(given.py(), values).call_method1("reshape", (array.getattr("shape")?,))?;
    if answer.getattr("ndim")?.extract::<usize>()? == 0 { answer.call_method0("item") } else { Ok(answer) }
}
