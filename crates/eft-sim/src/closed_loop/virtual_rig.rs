//! The virtual rig without its controller, sample by sample: plant, sensors and converter.

use eft_core::status;

use crate::closed_loop::simulate::{SimulateOptions, one_actuator};
use crate::closed_loop::stepper::PlantReading;
use crate::config::RigConfig;
use crate::error::{Error, Result};
use crate::instruments::{Dac, Sensors, Signals};
use crate::plant::{ActuatorState, Driver, Exponential, FastState, Plant, TimeGrid, needs_detail};

/// What is true of a virtual rig at one tick, and what its sensors report.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigReading {
    /// What is true; with [`status::COMMAND_LIMITED`] where the converter cut the last valve command.
    pub truth: PlantReading,
    /// Force as the load cell reports it (N).
    pub measured_force: f64,
    /// Displacement as its sensor reports it (m).
    pub measured_displacement: f64,
    /// Velocity as its sensor reports it (m/s).
    pub measured_velocity: f64,
    /// Spool opening as its sensor reports it (1).
    pub measured_spool: f64,
    /// Supply pressure as its sensor reports it (Pa).
    pub measured_supply_pressure: f64,
    /// Acceleration as the accelerometer reports it (m/s²).
    pub measured_acceleration: f64,
}

/// Plant, sensors and converter of a rig with one actuator, under the valve command of a controller from outside.
///
/// A controller that is stepped with the reading of a tick, and whose output is handed to [`step`](Self::step), gives the
/// traces of [`simulate`](crate::simulate) on the rig with `controller.realization = "digital"`, bit for bit.
#[derive(Debug, Clone)]
pub struct VirtualRig {
    plant: Integrated,
    /// None where they report the truth.
    sensors: Option<Sensors<f64>>,
    dac: Dac<f64>,
    grid: TimeGrid,
    ticks: u64,
    tripped: bool,
    clipped: u32,
    measured: Signals<f64>,
}

/// The plant and what carries it on, chosen as for a whole test.
#[derive(Debug, Clone)]
enum Integrated {
    Fast(Box<Exponential<f64>>, FastState<f64>),
    General(Box<Plant<f64>>),
}

impl Integrated {
    fn advance(&mut self, driver: Driver<f64>, grid: TimeGrid) {
        match self {
            Self::Fast(plant, state) => {
                *state = plant.advance(*state, plant.predict(state), &driver.held, grid);
            }
            Self::General(plant) => plant.advance(&[driver], grid),
        }
    }

    /// Valve, oil and piston, the force (N) on the structure, what sensors look at, and whether the spool is at a stop and
    /// the piston beyond its stroke.
    fn look(&self) -> (ActuatorState<f64>, f64, Signals<f64>, (bool, bool)) {
        match self {
            Self::Fast(plant, state) => {
                let (blocks, state) = (plant.plant(), state.plant());
                (*state, blocks.force(state), blocks.signals(state), blocks.at_limits(state))
            }
            Self::General(plant) => (plant.actuator(0), plant.force(0), plant.signals(0), plant.at_limits(0)),
        }
    }
}

impl VirtualRig {
    /// The plant of a rig at rest, with its sensors and its converter, at `controller.sample_rate`.
    ///
    /// # Errors
    /// A rig of several actuators, or a flow curve that the core refuses.
    pub fn new(rig: &RigConfig) -> Result<Self> {
        one_actuator(rig)?;
        // A controller from outside is sampled: the valve command is held.
        let rig = &rig.replace(&[("controller.realization", "digital".into())])?;
        let sample_rate = rig.controller.sample_rate;
        let grid = SimulateOptions::default().grid(rig, sample_rate)?;
        let plant = if needs_detail(rig) {
            Integrated::General(Box::new(Plant::pack(|_| rig)?))
        } else {
            Integrated::Fast(Box::new(Exponential::pack(|_| rig, grid)?), FastState::default())
        };
        let (sensors, (_, _, measured, _)) = (Sensors::new(|_| rig, sample_rate, 0), plant.look());
        let dac = Dac::new(|_| &rig.plant().dac);
        let mut whole = Self { plant, sensors, dac, grid, ticks: 0, tripped: false, clipped: 0, measured };
        whole.measure();
        Ok(whole)
    }

    /// Time of a tick (s).
    pub fn period(&self) -> f64 {
        1.0 / self.grid.sample_rate
    }

    /// What is true now, and what the sensors report.
    pub fn reading(&self) -> RigReading {
        let (actuator, force, truth, limits) = self.plant.look();
        let time = self.ticks as f64 / self.grid.sample_rate;
        let further = [truth.supply_pressure, truth.acceleration];
        let mut truth = PlantReading::new(time, &actuator, force, further, limits);
        truth.status |= self.clipped;
        RigReading {
            truth,
            measured_force: self.measured.force,
            measured_displacement: self.measured.displacement,
            measured_velocity: self.measured.velocity,
            measured_spool: self.measured.spool,
            measured_supply_pressure: self.measured.supply_pressure,
            measured_acceleration: self.measured.acceleration,
        }
    }

    /// One tick under a valve command (V); `tripped` says whether the controller's protection has tripped, behind which
    /// a bypass valve opens.
    ///
    /// # Errors
    /// A command that is not finite, which leaves the rig as it was; a plant that has diverged.
    pub fn step(&mut self, valve_command: f64, tripped: bool) -> Result<()> {
        crate::checks::finite("valve_command", valve_command, "V")?;
        let (output, clipped) = self.dac.convert(valve_command);
        if let (Integrated::General(plant), true) = (&mut self.plant, self.tripped) {
            plant.open_bypass(self.grid, true);
        }
        self.plant.advance(Driver::held(output), self.grid);
        self.tripped |= tripped;
        self.clipped = clipped;
        self.ticks += 1;
        self.measure();
        if self.reading().truth.status & status::DIVERGED != 0 {
            let allowed = "must be such that the rig does not diverge; its state has grown beyond 1e100";
            return Err(Error::value("valve_command", valve_command, allowed));
        }
        Ok(())
    }

    fn measure(&mut self) {
        let (_, _, truth, _) = self.plant.look();
        self.measured = self.sensors.as_mut().map_or(truth, |sensors| sensors.read(&truth).0);
    }

    /// Every number that the rig remembers.
    pub fn state(&self) -> Vec<f64> {
        let (mut numbers, mut visited) = (Vec::new(), self.clone());
        visited.numbers(&mut |number| numbers.push(*number));
        numbers
    }

    /// Goes on from what a rig of the same configuration remembered.
    ///
    /// # Errors
    /// Not as many numbers as it remembers; it stays as it was.
    pub fn go_to(&mut self, state: &[f64]) -> Result<()> {
        let count = self.state().len();
        if state.len() != count {
            let allowed = format!("must be of a rig like this one, of {count} numbers");
            return Err(Error::value("state", format!("{} numbers", state.len()), allowed));
        }
        let mut numbers = state.iter();
        self.numbers(&mut |number| *number = numbers.next().copied().unwrap_or(*number));
        Ok(())
    }

    fn numbers(&mut self, visit: &mut dyn FnMut(&mut f64)) {
        let mut counts = [self.ticks as f64, f64::from(u8::from(self.tripped)), f64::from(self.clipped)];
        counts.iter_mut().for_each(&mut *visit);
        (self.ticks, self.tripped, self.clipped) = (counts[0] as u64, counts[1] > 0.0, counts[2] as u32);
        match &mut self.plant {
            Integrated::Fast(_, state) => state.numbers().into_iter().for_each(&mut *visit),
            Integrated::General(plant) => plant.numbers(visit),
        }
        self.dac.numbers(visit);
        let m = &mut self.measured;
        let measured = [
            &mut m.displacement,
            &mut m.velocity,
            &mut m.force,
            &mut m.spool,
            &mut m.supply_pressure,
            &mut m.acceleration,
        ];
        measured.into_iter().for_each(&mut *visit);
        if let Some(sensors) = &mut self.sensors {
            sensors.numbers(visit);
        }
    }
}

#[cfg(test)]
mod tests;
