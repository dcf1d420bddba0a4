//! `eft.Plant`: the plant alone, sample by sample.

use eft_sim::SimulateOptions;
use eft_sim::closed_loop::{PlantReading, PlantStepper};
use pyo3::prelude::*;

use crate::errors::to_python;
use crate::rig::Rig;

/// Valve, actuator and structure of a rig, carried on sample by sample under a held valve command.
///
/// Parameters
/// ----------
/// rig : Rig
///     The rig; its controller and sensors have no part in this.
/// sample_rate : float, optional
///     Samples per second, in Hz; `controller.sample_rate` where it is left out.
/// structure : callable, optional
///     Replaces the rig's structure: called once a sample as ``structure(force, dt)`` with the mean force over the
///     sample in N and its length in s, it gives displacement (m) and velocity (m/s) at its end. In between the
///     piston moves with the velocity extrapolated from the last two answers, so that half the sample period leaves
///     a quarter of the error of the exchange.
#[pyclass(module = "eft")]
pub(crate) struct Plant {
    inner: PlantStepper,
    period: f64,
    structure: Option<Py<PyAny>>,
}

#[pymethods]
impl Plant {
    #[new]
    #[pyo3(signature = (rig, sample_rate=None, structure=None))]
    fn new(rig: &Rig, sample_rate: Option<f64>, structure: Option<Py<PyAny>>) -> PyResult<Self> {
        let rate = sample_rate.unwrap_or(rig.config.controller.sample_rate);
        let inner = PlantStepper::new(&rig.config, rate, &SimulateOptions::default()).map_err(to_python)?;
        Ok(Self { inner, period: 1.0 / rate, structure })
    }

    /// Carry the plant on by one sample under `valve_command` (V); what is true after it.
    fn step(&mut self, py: Python<'_>, valve_command: f64) -> PyResult<PlantState> {
        match &self.structure {
            None => self.inner.step(valve_command).map(PlantState).map_err(to_python),
            Some(structure) => {
                let force = self.inner.push(valve_command).map_err(to_python)?;
                let (displacement, velocity) =
                    structure.call1(py, (force, self.period))?.extract::<(f64, f64)>(py)?;
                self.inner.follow(displacement, velocity).map_err(to_python)?;
                Ok(PlantState(self.inner.reading()))
            }
        }
    }

    /// Put the plant back to rest; a structure of one's own is not told.
    fn reset(&mut self) {
        self.inner.reset();
    }

    /// What is true now.
    #[getter]
    fn state(&self) -> PlantState {
        PlantState(self.inner.reading())
    }
}

/// What is true of a plant at one tick.
#[pyclass(frozen, module = "eft")]
pub(crate) struct PlantState(PlantReading);

#[pymethods]
impl PlantState {
    /// Time since the start in s.
    #[getter]
    fn time(&self) -> f64 {
        self.0.time
    }

    /// Force on the structure in N.
    #[getter]
    fn force(&self) -> f64 {
        self.0.force
    }

    /// Displacement in m.
    #[getter]
    fn displacement(&self) -> f64 {
        self.0.displacement
    }

    /// Velocity in m/s.
    #[getter]
    fn velocity(&self) -> f64 {
        self.0.velocity
    }

    /// Spool opening.
    #[getter]
    fn spool(&self) -> f64 {
        self.0.spool
    }

    /// Load pressure in Pa.
    #[getter]
    fn load_pressure(&self) -> f64 {
        self.0.load_pressure
    }

    /// Supply pressure in Pa.
    #[getter]
    fn supply_pressure(&self) -> f64 {
        self.0.supply_pressure
    }

    /// Bits of `Status`.
    #[getter]
    fn status(&self) -> u32 {
        self.0.status
    }

    fn __repr__(&self) -> String {
        let PlantReading { time, force, displacement, velocity, spool, .. } = self.0;
        format!(
            "<eft.PlantState at {time:.6} s: force {force:.6} N, displacement {displacement:.6} m, velocity \
             {velocity:.6} m/s, spool {spool:.6}>"
        )
    }
}
