//! `eft.Plant`: the plant alone, sample by sample.

use eft_sim::SimulateOptions;
use eft_sim::closed_loop::{Method, PlantReading, PlantStepper, Signals};
use numpy::Element;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::arrays;
use crate::errors::{refuse, to_python};
use crate::one_caller::OneCaller;
use crate::rig::{GivenRig, is_building, name, word};
use crate::specimen::motions;
use crate::values::{optional_number, real_number};

/// Valve, actuator and structure of a rig, stepped sample by sample under a held valve command.
///
/// For a shear building every number below is an array with one value per actuator.
///
/// Parameters
/// ----------
/// rig : Rig
///     The rig; its controller and sensors are not used.
/// sample_rate : float, optional
///     Sample rate in Hz; ``controller.sample_rate`` of the rig by default.
/// structure : callable, optional
///     Replaces the rig's structure. It is called once per sample as ``structure(force, dt)`` with the mean
///     force over the sample in N and its length in s. It returns displacement (m) and velocity (m/s) at the
///     end of the sample. Within a sample the velocity of the piston is extrapolated from the last two
///     answers. Half the sample period therefore gives a quarter of the error of the exchange.
///
/// Notes
/// -----
/// A plant cannot be pickled or copied, because `state` does not contain all of its inner state. To repeat a test, make
/// another plant of the same rig and apply the same valve commands. A call while another one is under way raises
/// ``RuntimeError``: make one object for each thread.
#[pyclass(frozen, module = "eft")]
pub(crate) struct Plant {
    plant: OneCaller<PlantStepper>,
    /// Whether numbers are arrays with one value per actuator.
    stacked: bool,
    period: f64,
    structure: Option<Py<PyAny>>,
    /// Rig, structure, precision and sample rate.
    shown: String,
}

impl Plant {
    /// One value per actuator.
    fn vector(&self, name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
        if self.stacked { arrays::vector(name, value) } else { Ok(vec![real_number(value)?]) }
    }

    fn state_of(&self, plant: &PlantStepper) -> PlantState {
        PlantState { readings: plant.readings(), stacked: self.stacked }
    }
}

#[pymethods]
impl Plant {
    #[new]
    #[pyo3(signature = (rig, sample_rate=None, structure=None))]
    fn new(
        rig: GivenRig,
        #[pyo3(from_py_with = optional_number)] sample_rate: Option<f64>,
        structure: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        if let Some(given) = structure.as_ref().filter(|given| !given.is_callable()) {
            let kind = format!("an object of type {}", given.get_type().name()?);
            return Err(refuse("structure", kind, "must be callable as structure(force, dt)"));
        }
        let rate = sample_rate.unwrap_or(rig.config.controller.sample_rate);
        // One method with any structure; the exponential one has no place for an external structure.
        let options = SimulateOptions { method: Method::RungeKutta, ..SimulateOptions::default() };
        let plant = PlantStepper::new(&rig.config, rate, &options).map_err(to_python)?;
        let plant = OneCaller::new("eft.Plant", plant);
        let kind = if structure.is_some() { "external".into() } else { word(&rig.config, "structure.kind") };
        let shown = format!("{}: {kind} structure, f64 at {rate} Hz", name(&rig.config));
        Ok(Self {
            plant,
            stacked: is_building(&rig.config),
            period: 1.0 / rate,
            structure: structure.map(Bound::unbind),
            shown,
        })
    }

    fn __repr__(&self) -> String {
        format!("<eft.Plant of {}>", self.shown)
    }

    /// Step the plant by one sample under `valve_command` (V) and return its state.
    ///
    /// Parameters
    /// ----------
    /// valve_command : float or array_like
    ///     Valve command in V, held over the sample; one for each actuator of a shear building.
    ///
    /// Returns
    /// -------
    /// PlantState
    ///     The true state at the end of the sample.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If a valve command, or the motion of an external structure, is not finite, or not one for each actuator.
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> plant = eft.Plant(eft.Rig.zhao2005(), sample_rate=4096.0)
    /// >>> state = [plant.step(0.1) for _ in range(410)][-1]
    /// >>> state.displacement > 0.0, round(state.time, 4)
    /// (True, 0.1001)
    fn step(&self, py: Python<'_>, valve_command: &Bound<'_, PyAny>) -> PyResult<PlantState> {
        let mut plant = self.plant.lock()?;
        let commands = self.vector("valve_command", valve_command)?;
        match &self.structure {
            None => {
                plant.step(&commands).map_err(to_python)?;
            }
            Some(structure) => {
                let forces = plant.push(&commands).map_err(to_python)?;
                let answer = structure.call1(py, (arrays::each(py, &forces, self.stacked)?, self.period))?;
                let (displacements, velocities) = motions(answer.bind(py), self.stacked)?;
                plant.follow(&displacements, &velocities).map_err(to_python)?;
            }
        }
        Ok(self.state_of(&plant))
    }

    /// Return the plant to rest; an external structure is not reset.
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> plant = eft.Plant(eft.Rig.zhao2005())
    /// >>> _ = plant.step(0.1)
    /// >>> plant.reset()
    /// >>> plant.state.time
    /// 0.0
    fn reset(&self) -> PyResult<()> {
        self.plant.lock()?.reset();
        Ok(())
    }

    fn __reduce__(&self) -> PyResult<()> {
        let reason =
            "eft.Plant cannot be pickled or copied: make another one of the same rig and sample rate";
        Err(PyTypeError::new_err(reason))
    }

    /// The present state of the plant.
    #[getter]
    fn state(&self) -> PyResult<PlantState> {
        Ok(self.state_of(&*self.plant.lock()?))
    }
}

/// The true state of a plant at one tick; for a shear building arrays with one value per actuator.
#[pyclass(frozen, module = "eft")]
pub(crate) struct PlantState {
    /// One per actuator.
    readings: Vec<PlantReading>,
    stacked: bool,
}

type Answer<'py> = PyResult<Bound<'py, PyAny>>;

/// Time, signals and status of one actuator, for `pickle`.
type Numbers = (f64, [f64; 7], u32);
type Pickled = (Vec<Numbers>, bool);

impl PlantState {
    fn of<'py, T: Element + Copy + IntoPyObject<'py>>(
        &self,
        py: Python<'py>,
        value: fn(&PlantReading) -> T,
    ) -> Answer<'py> {
        arrays::each(py, &self.readings.iter().map(value).collect::<Vec<_>>(), self.stacked)
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
    fn force<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.of(py, |reading| reading.force)
    }

    /// Displacement in m.
    #[getter]
    fn displacement<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.of(py, |reading| reading.displacement)
    }

    /// Velocity in m/s.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.of(py, |reading| reading.velocity)
    }

    /// Spool opening.
    #[getter]
    fn spool<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.of(py, |reading| reading.spool)
    }

    /// Load pressure in Pa.
    #[getter]
    fn load_pressure<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.of(py, |reading| reading.load_pressure)
    }

    /// Supply pressure in Pa.
    #[getter]
    fn supply_pressure<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.of(py, |reading| reading.supply_pressure)
    }

    /// Acceleration in m/s²; with an external structure the mean over the sample that ends now.
    #[getter]
    fn acceleration<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.of(py, |reading| reading.acceleration)
    }

    /// Bits of `Status`.
    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.of(py, |reading| reading.status)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Pickled)> {
        let numbers = |reading: &PlantReading| (reading.time, reading.signals.to_array(), reading.status);
        let state = slf.get();
        Ok((slf.get_type().getattr("_made")?, (state.readings.iter().map(numbers).collect(), state.stacked)))
    }

    #[staticmethod]
    fn _made(actuators: Vec<Numbers>, stacked: bool) -> Self {
        let reading = |(time, signals, status): Numbers| {
            let signals = Signals::from_array(signals);
            PlantReading { time, signals, status }
        };
        Self { readings: actuators.into_iter().map(reading).collect(), stacked }
    }

    fn __repr__(&self) -> String {
        let actuator = |reading: &PlantReading| {
            let Signals { force, displacement, velocity, spool, .. } = reading.signals;
            format!(
                "force {force:.6} N, displacement {displacement:.6} m, velocity {velocity:.6} m/s, spool {spool:.6}"
            )
        };
        let all: Vec<_> = self.readings.iter().map(actuator).collect();
        format!("<eft.PlantState at {:.6} s: {}>", self.time(), all.join("; "))
    }
}
