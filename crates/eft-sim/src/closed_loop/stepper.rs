//! The plant alone, one sample at a time, for external controllers and structures.

use std::ops::Deref;

use eft_core::status;

use crate::closed_loop::specimen::StructureExchange;
use crate::closed_loop::{Method, SimulateOptions, check_each};
use crate::plant::{ActuatorState, AnyDrive, Exponential, FastState, Plant, Signals, TimeGrid, needs_detail};
use crate::{Error, Result, RigConfig};

/// The true state of the plant at one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlantReading {
    /// Time since the start (s).
    pub time: f64,
    /// The signals at the structure; their fields are also fields of the reading. With an external structure the
    /// acceleration is the mean over the sample that ends now.
    pub signals: Signals<f64>,
    /// [`status::SPOOL_STOP`], [`status::STROKE_EXCEEDED`] and [`status::DIVERGED`].
    pub status: u32,
}

impl Deref for PlantReading {
    type Target = Signals<f64>;

    fn deref(&self) -> &Signals<f64> {
        &self.signals
    }
}

/// A plant that advances by one sample per call under one held valve command per actuator, the ground floor's
/// first. It has the bits of a whole test with the same options.
///
/// An external structure may replace the rig's own. [`push`](Self::push) advances the hydraulics by one
/// sample and returns the mean forces of that sample. [`follow`](Self::follow) then sets the motion of the
/// external structure. Within a sample the velocity of the pistons is extrapolated from the last two answers.
/// The exchange is of second order: half the sample period gives a quarter of the error.
#[derive(Debug, Clone)]
pub struct PlantStepper {
    plant: IntegratedPlant,
    grid: TimeGrid,
    ticks: u64,
}

/// The plant and its integration, chosen as for a whole test.
#[derive(Debug, Clone)]
enum IntegratedPlant {
    Fast(Box<Exponential<f64>>, FastState<f64>),
    General(Box<Plant<f64>>, StructureExchange),
}

impl PlantStepper {
    /// The plant of a rig at rest, for steps at a sample rate (Hz). [`push`](Self::push) needs
    /// [`Method::RungeKutta`] if the rig has no effect beyond the paper's model.
    ///
    /// # Errors
    /// An invalid sample rate or step, or a flow curve that the core refuses.
    pub fn new(rig: &RigConfig, sample_rate: f64, options: &SimulateOptions) -> Result<Self> {
        crate::checks::sample_rate("sample_rate", sample_rate)?;
        let grid = options.grid(rig, sample_rate)?;
        let detailed = needs_detail(rig) || rig.structure.floors() > 1;
        let plant = if detailed || options.method == Method::RungeKutta {
            let plant = Plant::pack(&|_| rig)?;
            let exchange = StructureExchange::new(plant.actuators());
            IntegratedPlant::General(Box::new(plant), exchange)
        } else {
            // The valve command is held, as from a digital force loop.
            let digital = rig.replace(&[("controller.realization", "digital".into())])?;
            let plant = Exponential::pack(&|_| &digital, grid)?;
            let at_rest = plant.at_rest();
            IntegratedPlant::Fast(Box::new(plant), at_rest)
        };
        Ok(Self { plant, grid, ticks: 0 })
    }

    /// Back to rest.
    pub fn reset(&mut self) {
        self.ticks = 0;
        match &mut self.plant {
            IntegratedPlant::Fast(plant, state) => *state = plant.at_rest(),
            IntegratedPlant::General(plant, exchange) => {
                plant.reset();
                exchange.reset();
            }
        }
    }

    /// Number of actuators.
    pub(crate) fn actuators(&self) -> usize {
        match &self.plant {
            IntegratedPlant::Fast(..) => 1,
            IntegratedPlant::General(plant, _) => plant.actuators(),
        }
    }

    /// The true signals of an actuator's sensors.
    pub(crate) fn signals(&self, i: usize) -> Signals<f64> {
        self.observe(i).2
    }

    /// State, force (N) on the structure, true signals, and whether the spool is at a stop and the piston
    /// beyond its stroke.
    fn observe(&self, i: usize) -> (ActuatorState<f64>, f64, Signals<f64>, (bool, bool)) {
        match &self.plant {
            IntegratedPlant::Fast(plant, state) => {
                let (blocks, state) = (&plant.plant, &state.plant);
                (*state, blocks.force(state), blocks.signals(state), blocks.at_limits(state))
            }
            IntegratedPlant::General(plant, exchange) => {
                let mut signals = plant.signals(i);
                signals.acceleration = exchange.acceleration(i).unwrap_or(signals.acceleration);
                (plant.actuator(i), plant.force(i), signals, plant.at_limits(i))
            }
        }
    }

    /// The true state, one reading per actuator.
    pub fn readings(&self) -> Vec<PlantReading> {
        (0..self.actuators()).map(|i| self.reading(i)).collect()
    }

    fn reading(&self, i: usize) -> PlantReading {
        let (state, force, sensed, (at_stop, beyond_stroke)) = self.observe(i);
        let flags = [
            (at_stop, status::SPOOL_STOP),
            (beyond_stroke, status::STROKE_EXCEEDED),
            (!state.is_bounded(), status::DIVERGED),
        ];
        let ActuatorState { spool, load_pressure, displacement, velocity, .. } = state;
        PlantReading {
            time: self.ticks as f64 / self.grid.sample_rate,
            signals: Signals { force, displacement, velocity, spool, load_pressure, ..sensed },
            status: flags.iter().filter(|flag| flag.0).fold(0, |all, flag| all | flag.1),
        }
    }

    /// Advances by one sample with the rig's structure under one valve command (V) per actuator, and returns
    /// the true state after it.
    ///
    /// # Errors
    /// A wrong number of commands, or one that is not finite.
    pub fn step(&mut self, valve_commands: &[f64]) -> Result<Vec<PlantReading>> {
        let drivers = self.held_drivers(valve_commands)?;
        match &mut self.plant {
            IntegratedPlant::Fast(plant, state) => {
                *state = plant.advance(state, &plant.predict(state), &drivers[0].held, self.grid);
            }
            IntegratedPlant::General(plant, exchange) => {
                plant.advance(&drivers, self.grid);
                exchange.clear_accelerations();
            }
        }
        self.ticks += 1;
        Ok(self.readings())
    }

    /// Advances the hydraulics by one sample under one valve command (V) per actuator, with the pistons moved
    /// by the external structure. It returns the mean forces (N) on that structure over the sample.
    /// [`follow`](Self::follow) must come next.
    ///
    /// # Errors
    /// As [`step`](Self::step), or the exponential method, whose linear part contains the rig's structure.
    pub fn push(&mut self, valve_commands: &[f64]) -> Result<Vec<f64>> {
        let drivers = self.held_drivers(valve_commands)?;
        let grid = self.grid;
        let (plant, exchange) = self.external_exchange()?;
        let forces = exchange.advance_hydraulics(plant, &drivers, grid);
        self.ticks += 1;
        Ok(forces)
    }

    /// Sets the motions (m, m/s) of the external structure at the end of the sample, one per actuator.
    ///
    /// # Errors
    /// A wrong number of motions, or one that is not finite. As [`push`](Self::push).
    pub fn follow(&mut self, displacements: &[f64], velocities: &[f64]) -> Result<()> {
        let (actuators, grid) = (self.actuators(), self.grid);
        check_each("displacement", "m", displacements, actuators)?;
        check_each("velocity", "m/s", velocities, actuators)?;
        let (plant, exchange) = self.external_exchange()?;
        exchange.set_motions(plant, displacements, velocities, grid);
        Ok(())
    }

    fn external_exchange(&mut self) -> Result<(&mut Plant<f64>, &mut StructureExchange)> {
        match &mut self.plant {
            IntegratedPlant::General(plant, exchange) => Ok((plant, exchange)),
            IntegratedPlant::Fast(..) => {
                let allowed = "must be RungeKutta for an external structure";
                Err(Error::value("method", "Exponential", allowed))
            }
        }
    }

    fn held_drivers(&self, valve_commands: &[f64]) -> Result<Vec<AnyDrive<f64>>> {
        check_each("valve_command", "V", valve_commands, self.actuators())?;
        Ok(valve_commands.iter().map(|command| AnyDrive::held(*command)).collect())
    }

    /// Opens the bypass valves further for a sample, as after a trip.
    pub(crate) fn open_bypass(&mut self) {
        if let IntegratedPlant::General(plant, _) = &mut self.plant {
            plant.open_bypass(self.grid, true);
        }
    }

    /// Visits every number of the state with the rig's structure, to store or to replace it.
    pub(crate) fn numbers(&mut self, visit: &mut dyn FnMut(&mut f64)) {
        let mut ticks = self.ticks as f64;
        visit(&mut ticks);
        self.ticks = ticks as u64;
        match &mut self.plant {
            IntegratedPlant::Fast(_, state) => state.numbers().for_each(visit),
            IntegratedPlant::General(plant, _) => plant.numbers(visit),
        }
    }
}
