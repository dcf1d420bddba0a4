//! The integration of the plant, as Python names it.

use eft_sim::SimulateOptions;
use eft_sim::closed_loop::{DEFAULT_STEP, Method};
use pyo3::prelude::*;

use crate::errors::refuse;

/// The integration by the name of its method and the largest step in s, with a default step.
pub(crate) fn options(method: &str, largest_step: Option<f64>) -> PyResult<SimulateOptions> {
    let method = match method {
        "exponential" => Method::Exponential,
        "runge-kutta" => Method::RungeKutta,
        _ => {
            let allowed = "must be \"exponential\" or \"runge-kutta\"";
            return Err(refuse("method", format!("{method:?}"), allowed));
        }
    };
    Ok(SimulateOptions { method, largest_step: largest_step.unwrap_or(DEFAULT_STEP) })
}
