//! The virtual rig without its controller, sample by sample: sensors and converters around the plant.

use eft_core::status;

use crate::closed_loop::{PlantReading, PlantStepper, SimulateOptions, check_each};
use crate::instruments::{Dac, Sensors};
use crate::plant::Signals;
use crate::{Result, RigConfig, checks};

/// The true state of a virtual rig at one tick, and its sensors' readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigReading {
    /// The true state; with [`status::COMMAND_LIMITED`] if the converter limited the last valve command.
    pub truth: PlantReading,
    /// What the sensors report.
    pub measured: Signals<f64>,
}

/// Plant, sensors and converters of a rig under the valve commands of an external controller.
///
/// If a controller is stepped with the readings of each tick and its outputs are passed to [`step`](Self::step), the
/// traces are those of [`simulate_actuators`](crate::closed_loop::simulate_actuators) on the rig with
/// `controller.realization = "digital"`, bit for bit.
#[derive(Debug, Clone)]
pub struct VirtualRig {
    plant: PlantStepper,
    /// One an actuator.
    instruments: Vec<Instruments>,
    tripped: bool,
}

/// Sensors and converter of an actuator.
#[derive(Debug, Clone)]
struct Instruments {
    /// `None` if they are ideal.
    sensors: Option<Sensors<f64>>,
    dac: Dac,
    clipped: u32,
    measured: Signals<f64>,
}

impl VirtualRig {
    /// The plant of a rig at rest, with its sensors and converters, at `controller.sample_rate`.
    ///
    /// # Errors
    /// A flow curve that the core refuses.
    pub fn new(rig: &RigConfig) -> Result<Self> {
        let sample_rate = rig.controller.sample_rate;
        let plant = PlantStepper::new(rig, sample_rate, &SimulateOptions::default())?;
        let instruments = |i| Instruments {
            sensors: Sensors::new(&|_| rig, sample_rate, i as u64),
            dac: Dac::new(1, |_| &rig.plant().dac, |_| rig.null_command(0)),
            clipped: 0,
            measured: plant.signals(i),
        };
        let instruments = (0..plant.actuators()).map(instruments).collect();
        let mut whole = Self { plant, instruments, tripped: false };
        whole.measure();
        Ok(whole)
    }

    /// The true state of each actuator and its sensors' readings, the ground floor's first.
    pub fn readings(&self) -> impl Iterator<Item = RigReading> {
        let reading = |(mut truth, instruments): (PlantReading, &Instruments)| {
            truth.status |= instruments.clipped;
            RigReading { truth, measured: instruments.measured }
        };
        self.plant.readings().into_iter().zip(&self.instruments).map(reading)
    }

    /// Advances by one tick under one valve command (V) per actuator. `tripped` tells whether the
    /// controller's protection has tripped; the bypass valves then open.
    ///
    /// # Errors
    /// A wrong number of commands, or one that is not finite; the rig is then unchanged. A plant that has
    /// diverged.
    pub fn step(&mut self, valve_commands: &[f64], tripped: bool) -> Result<()> {
        check_each("valve_command", "V", valve_commands, self.instruments.len())?;
        let mut outputs = Vec::with_capacity(valve_commands.len());
        for (instruments, command) in self.instruments.iter_mut().zip(valve_commands) {
            let (output, clipped) = instruments.dac.convert(*command);
            instruments.clipped = clipped;
            outputs.push(output);
        }
        if self.tripped {
            self.plant.open_bypass();
        }
        let truth = self.plant.step(&outputs)?;
        self.tripped |= tripped;
        self.measure();
        let diverged = truth.iter().any(|reading| reading.status & status::DIVERGED != 0);
        let larger = |most: f64, one: &f64| if one.abs() > most.abs() { *one } else { most };
        let command = valve_commands.iter().fold(0.0, larger);
        let allowed = "must not make the rig diverge; its state has grown beyond 1e100";
        checks::require(!diverged, "valve_command", command, allowed)
    }

    fn measure(&mut self) {
        for (i, instruments) in self.instruments.iter_mut().enumerate() {
            let truth = self.plant.signals(i);
            instruments.measured = instruments.sensors.as_mut().map_or(truth, |one| one.read(&truth).0);
        }
    }

    /// Every number of the rig's state.
    pub fn state(&self) -> Vec<f64> {
        let (mut numbers, mut visited) = (Vec::new(), self.clone());
        visited.numbers(&mut |number| numbers.push(*number));
        numbers
    }

    /// Restores the state of a rig with the same configuration.
    ///
    /// # Errors
    /// A wrong number of values; the rig is then unchanged.
    pub fn go_to(&mut self, state: &[f64]) -> Result<()> {
        let count = self.state().len();
        let allowed = format!("must be a state of the same rig, with {count} numbers");
        checks::require(state.len() == count, "state", format!("{} numbers", state.len()), allowed)?;
        let mut numbers = state.iter();
        self.numbers(&mut |number| *number = numbers.next().copied().unwrap_or(*number));
        Ok(())
    }

    fn numbers(&mut self, visit: &mut dyn FnMut(&mut f64)) {
        let mut tripped = f64::from(u8::from(self.tripped));
        visit(&mut tripped);
        self.tripped = tripped > 0.0;
        self.plant.numbers(visit);
        self.instruments.iter_mut().for_each(|instruments| instruments.numbers(visit));
    }
}

impl Instruments {
    fn numbers(&mut self, visit: &mut dyn FnMut(&mut f64)) {
        let mut clipped = f64::from(self.clipped);
        visit(&mut clipped);
        self.clipped = clipped as u32;
        self.dac.numbers(visit);
        let mut measured = self.measured.to_array();
        measured.iter_mut().for_each(&mut *visit);
        self.measured = Signals::from_array(measured);
        if let Some(sensors) = &mut self.sensors {
            sensors.numbers(visit);
        }
    }
}
