//! The plant alone, one sample at a time, for external controllers and structures.

use eft_core::status;

use crate::closed_loop::simulate::{SimulateOptions, check_each};
use crate::closed_loop::specimen::Exchange;
use crate::config::RigConfig;
use crate::error::Result;
use crate::plant::{ActuatorState, Driver, Plant, Signals, TimeGrid};

/// The true state of the plant at one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlantReading {
    /// Time since the start (s).
    pub time: f64,
    /// Force on the structure (N).
    pub force: f64,
    /// Displacement (m).
    pub displacement: f64,
    /// Velocity (m/s).
    pub velocity: f64,
    /// Spool opening (1).
    pub spool: f64,
    /// Load pressure (Pa).
    pub load_pressure: f64,
    /// Supply pressure (Pa).
    pub supply_pressure: f64,
    /// Acceleration (m/s²); with an external structure the mean over the sample that ends now.
    pub acceleration: f64,
    /// [`status::SPOOL_STOP`], [`status::STROKE_EXCEEDED`] and [`status::DIVERGED`].
    pub status: u32,
}

impl PlantReading {
    /// The reading at a time (s) from state, force (N), supply pressure (Pa) and acceleration (m/s²). The
    /// last argument tells whether the spool is at a stop and the piston beyond its stroke.
    pub(crate) fn new(
        time: f64,
        core: &ActuatorState<f64>,
        force: f64,
        [supply_pressure, acceleration]: [f64; 2],
        (at_stop, beyond_stroke): (bool, bool),
    ) -> Self {
        let ActuatorState { spool, load_pressure, displacement, velocity, .. } = *core;
        let flags = [
            (at_stop, status::SPOOL_STOP),
            (beyond_stroke, status::STROKE_EXCEEDED),
            (!core.is_bounded(), status::DIVERGED),
        ];
        let status = flags.iter().filter(|flag| flag.0).fold(0, |all, flag| all | flag.1);
        Self {
            time,
            force,
            displacement,
            velocity,
            spool,
            load_pressure,
            supply_pressure,
            acceleration,
            status,
        }
    }
}

/// A plant that advances by one sample per call under one held valve command per actuator, the ground floor's
/// first.
///
/// An external structure may replace the rig's own. [`push`](Self::push) advances the hydraulics by one
/// sample and returns the mean forces of that sample. [`follow`](Self::follow) then sets the motion of the
/// external structure. Within a sample the velocity of the pistons is extrapolated from the last two answers.
/// The exchange is of second order: half the sample period gives a quarter of the error.
#[derive(Debug, Clone)]
pub struct PlantStepper {
    plant: Plant<f64>,
    grid: TimeGrid,
    ticks: u64,
    exchange: Exchange,
}

impl PlantStepper {
    /// The plant of a rig at rest, for steps at a sample rate (Hz).
    ///
    /// # Errors
    /// An invalid sample rate.
    pub fn new(rig: &RigConfig, sample_rate: f64, options: &SimulateOptions) -> Result<Self> {
        crate::checks::sample_rate("sample_rate", sample_rate)?;
        let (plant, grid) = (Plant::pack(|_| rig)?, options.grid(rig, sample_rate)?);
        let exchange = Exchange::new(plant.actuators());
        Ok(Self { plant, grid, ticks: 0, exchange })
    }

    /// Back to rest.
    pub fn reset(&mut self) {
        self.plant.reset();
        self.ticks = 0;
        self.exchange.reset();
    }

    /// The true state, one reading per actuator.
    pub fn readings(&self) -> Vec<PlantReading> {
        let time = self.ticks as f64 / self.grid.sample_rate;
        let reading = |i| {
            let Signals { supply_pressure, acceleration, .. } = self.plant.signals(i);
            let further = [supply_pressure, self.exchange.acceleration(i).unwrap_or(acceleration)];
            let limits = self.plant.at_limits(i);
            PlantReading::new(time, &self.plant.actuator(i), self.plant.force(i), further, limits)
        };
        (0..self.plant.actuators()).map(reading).collect()
    }

    /// Advances by one sample with the rig's structure under one valve command (V) per actuator, and returns
    /// the true state after it.
    ///
    /// # Errors
    /// A wrong number of commands, or one that is not finite.
    pub fn step(&mut self, valve_commands: &[f64]) -> Result<Vec<PlantReading>> {
        let drivers = self.held(valve_commands)?;
        self.plant.advance(&drivers, self.grid);
        self.exchange.passed();
        self.ticks += 1;
        Ok(self.readings())
    }

    /// Advances the hydraulics by one sample under one valve command (V) per actuator, with the pistons moved
    /// by the external structure. It returns the mean forces (N) on that structure over the sample.
    /// [`follow`](Self::follow) must come next.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub fn push(&mut self, valve_commands: &[f64]) -> Result<Vec<f64>> {
        let drivers = self.held(valve_commands)?;
        self.ticks += 1;
        Ok(self.exchange.push(&mut self.plant, &drivers, self.grid))
    }

    /// Sets the motions (m, m/s) of the external structure at the end of the sample, one per actuator.
    ///
    /// # Errors
    /// A wrong number of motions, or one that is not finite.
    pub fn follow(&mut self, displacements: &[f64], velocities: &[f64]) -> Result<()> {
        let actuators = self.plant.actuators();
        check_each("displacement", "m", displacements, actuators)?;
        check_each("velocity", "m/s", velocities, actuators)?;
        self.exchange.follow(&mut self.plant, displacements, velocities, self.grid);
        Ok(())
    }

    fn held(&self, valve_commands: &[f64]) -> Result<Vec<Driver<f64>>> {
        check_each("valve_command", "V", valve_commands, self.plant.actuators())?;
        Ok(valve_commands.iter().map(|command| Driver::held(*command)).collect())
    }
}
