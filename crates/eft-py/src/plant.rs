//! `eft.Plant`: the plant alone, sample by sample.

use eft_sim::SimulateOptions;
use eft_sim::closed_loop::{BuildingStepper, PlantReading, PlantStepper};
use numpy::PyArray1;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::arrays;
use crate::errors::to_python;
use crate::rig::Rig;
use crate::run::is_building;

/// Valve, actuator and structure of a rig, carried on sample by sample under a held valve command.
///
/// For a shear building every number below is an array with one value an actuator.
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
///
/// Notes
/// -----
/// It can be neither pickled nor copied: what is inside valve, oil and structure is more than `state` tells. Make another
/// one of the same rig, and repeat the valve commands where it has to be as far.
#[pyclass(module = "eft")]
pub(crate) struct Plant {
    inner: Stepper,
    period: f64,
    structure: Option<Py<PyAny>>,
}

// One of a kind, and on the heap already: their sizes do not matter.
#[allow(clippy::large_enum_variant, reason = "one at a time, and on the heap already")]
enum Stepper {
    One(PlantStepper),
    Building(BuildingStepper),
}

impl Stepper {
    fn state(&self) -> PlantState {
        match self {
            Self::One(plant) => PlantState { readings: vec![plant.reading()], stacked: false },
            Self::Building(plant) => PlantState { readings: plant.readings(), stacked: true },
        }
    }
}

#[pymethods]
impl Plant {
    #[new]
    #[pyo3(signature = (rig, sample_rate=None, structure=None))]
    fn new(rig: &Rig, sample_rate: Option<f64>, structure: Option<Py<PyAny>>) -> PyResult<Self> {
        let rate = sample_rate.unwrap_or(rig.config.controller.sample_rate);
        let options = SimulateOptions::default();
        let inner = if is_building(&rig.config) {
            BuildingStepper::new(&rig.config, rate, &options).map(Stepper::Building)
        } else {
            PlantStepper::new(&rig.config, rate, &options).map(Stepper::One)
        };
        Ok(Self { inner: inner.map_err(to_python)?, period: 1.0 / rate, structure })
    }

    /// Carry the plant on by one sample under `valve_command` (V); what is true after it.
    fn step(&mut self, py: Python<'_>, valve_command: &Bound<'_, PyAny>) -> PyResult<PlantState> {
        match (&mut self.inner, &self.structure) {
            (Stepper::One(plant), None) => {
                plant.step(valve_command.extract()?).map_err(to_python)?;
            }
            (Stepper::One(plant), Some(structure)) => {
                let force = plant.push(valve_command.extract()?).map_err(to_python)?;
                let (displacement, velocity) =
                    structure.call1(py, (force, self.period))?.extract::<(f64, f64)>(py)?;
                plant.follow(displacement, velocity).map_err(to_python)?;
            }
            (Stepper::Building(plant), None) => {
                plant.step(&arrays::vector("valve_command", valve_command)?).map_err(to_python)?;
            }
            (Stepper::Building(plant), Some(structure)) => {
                let commands = arrays::vector("valve_command", valve_command)?;
                let forces = PyArray1::from_vec(py, plant.push(&commands).map_err(to_python)?);
                let answer = structure.call1(py, (forces, self.period))?;
                let (displacements, velocities) =
                    answer.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>(py)?;
                let displacements = arrays::vector("displacement", &displacements)?;
                let velocities = arrays::vector("velocity", &velocities)?;
                plant.follow(&displacements, &velocities).map_err(to_python)?;
            }
        }
        Ok(self.inner.state())
    }

    /// Put the plant back to rest; a structure of one's own is not told.
    fn reset(&mut self) {
        match &mut self.inner {
            Stepper::One(plant) => plant.reset(),
            Stepper::Building(plant) => plant.reset(),
        }
    }

    fn __reduce__(&self) -> PyResult<()> {
        let reason =
            "eft.Plant cannot be pickled or copied: make another one of the same rig and sample rate";
        Err(PyTypeError::new_err(reason))
    }

    /// What is true now.
    #[getter]
    fn state(&self) -> PlantState {
        self.inner.state()
    }
}

/// What is true of a plant at one tick; for a shear building arrays with one value an actuator.
#[pyclass(frozen, module = "eft")]
pub(crate) struct PlantState {
    /// One an actuator.
    readings: Vec<PlantReading>,
    stacked: bool,
}

type Numbers<'py> = PyResult<Bound<'py, PyAny>>;

impl PlantState {
    fn of<'py>(&self, py: Python<'py>, value: fn(&PlantReading) -> f64) -> Numbers<'py> {
        let values: Vec<f64> = self.readings.iter().map(value).collect();
        match (values.as_slice(), self.stacked) {
            ([one], false) => Ok(one.into_pyobject(py)?.into_any()),
            _ => arrays::stacked(py, vec![values], false),
        }
    }
}

#[pymethods]
impl PlantState {
    /// Time since the start in s.
    #[getter]
    fn time(&self) -> f64 {
        self.readings.first().map_or(0.0, |reading| reading.time)
    }

    /// Force on the structure in N.
    #[getter]
    fn force<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        self.of(py, |reading| reading.force)
    }

    /// Displacement in m.
    #[getter]
    fn displacement<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        self.of(py, |reading| reading.displacement)
    }

    /// Velocity in m/s.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        self.of(py, |reading| reading.velocity)
    }

    /// Spool opening.
    #[getter]
    fn spool<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        self.of(py, |reading| reading.spool)
    }

    /// Load pressure in Pa.
    #[getter]
    fn load_pressure<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        self.of(py, |reading| reading.load_pressure)
    }

    /// Supply pressure in Pa.
    #[getter]
    fn supply_pressure<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        self.of(py, |reading| reading.supply_pressure)
    }

    /// Acceleration in m/s²; of a structure of one's own the mean of the sample that ends now.
    #[getter]
    fn acceleration<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        self.of(py, |reading| reading.acceleration)
    }

    /// Bits of `Status`.
    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        let values: Vec<u32> = self.readings.iter().map(|reading| reading.status).collect();
        match (values.as_slice(), self.stacked) {
            ([one], false) => Ok(one.into_pyobject(py)?.into_any()),
            _ => arrays::stacked(py, vec![values], false),
        }
    }

    fn __repr__(&self) -> String {
        let actuator = |reading: &PlantReading| {
            let PlantReading { force, displacement, velocity, spool, .. } = reading;
            format!(
                "force {force:.6} N, displacement {displacement:.6} m, velocity {velocity:.6} m/s, spool {spool:.6}"
            )
        };
        let all: Vec<_> = self.readings.iter().map(actuator).collect();
        format!("<eft.PlantState at {:.6} s: {}>", self.time(), all.join("; "))
    }
}
