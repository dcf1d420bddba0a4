//! Plant and digital sides tied together for a rig with any effect and any number of actuators.

use eft_core::{ControllerState, status};

use crate::closed_loop::chunk::Keep;
use crate::closed_loop::controller::Precision;
use crate::closed_loop::digital_side::{DigitalSide, Driven};
use crate::closed_loop::single::Tick;
use crate::config::RigConfig;
use crate::dispatch::{Work, dispatch};
use crate::error::Result;
use crate::rig::{Driver, EnergyBalance, Pace, Plant};

/// The sampled closed loop of one rig.
pub(crate) struct SeveralActuators<P: Precision> {
    plant: Plant<f64>,
    /// One an actuator.
    digital: Vec<DigitalSide<f64, P>>,
    states: Vec<ControllerState<P>>,
    drivers: Vec<Driver<f64>>,
    pace: Pace,
    tripped: bool,
}

/// One actuator of a plant.
struct Actuator<'a> {
    plant: &'a Plant<f64>,
    number: usize,
}

impl Driven<f64> for Actuator<'_> {
    #[inline(always)]
    fn command(&self, driver: &Driver<f64>) -> f64 {
        self.plant.valve_command(self.number, driver)
    }
}

impl<P: Precision> SeveralActuators<P> {
    /// At rest.
    pub(crate) fn new(rig: &RigConfig, pace: Pace) -> Result<Self> {
        let plant = Plant::pack(|_| rig)?;
        let actuators = 0..plant.actuators();
        let side = |actuator| DigitalSide::new(|_| rig, pace.sample_rate, actuator as u64);
        Ok(Self {
            digital: actuators.clone().map(side).collect::<Result<_>>()?,
            states: vec![ControllerState::default(); actuators.len()],
            drivers: Vec::with_capacity(actuators.len()),
            plant,
            pace,
            tripped: false,
        })
    }

    /// Runs up to `ticks` ticks, and gives how many began with states to go on from. The commands (N), one slice an
    /// actuator, may go on beyond them; where one ends with them, its last value is held.
    pub(crate) fn run(&mut self, commands: &[&[f64]], ticks: usize, keep: &mut [impl Keep<f64>]) -> usize {
        dispatch::<f64, _>(Ticks { test: self, commands, ticks, keep })
    }

    /// Whether the plant's state is one to go on from.
    #[inline(always)]
    fn is_bounded(&self) -> bool {
        (0..self.digital.len()).all(|i| self.plant.actuator(i).is_bounded())
    }

    /// Tick `i` of these commands.
    #[inline(always)]
    fn tick(&mut self, i: usize, commands: &[&[f64]], keep: &mut [impl Keep<f64>]) {
        let Self { plant, digital, states, drivers, pace, tripped } = self;
        if *tripped {
            // One floor let down alone would twist the others off it.
            digital.iter_mut().for_each(DigitalSide::trip);
        }
        drivers.clear();
        let actuators = digital.iter_mut().zip(states).zip(commands.iter().zip(keep)).enumerate();
        for (number, ((digital, state), (commands, keep))) in actuators {
            let (now, truth) = (commands[i], plant.signals(number));
            let next = commands.get(i + 1).copied().unwrap_or(now);
            let decision = digital.sample::<false>(state, now, next, truth, &Actuator { plant, number });
            *tripped |= decision.status & status::TRIPPED != 0;
            drivers.push(decision.driver);
            let (actuator, limits) = (plant.actuator(number), plant.at_limits(number));
            keep.keep(i, &Tick::new(actuator, plant.force(number), &truth, limits, decision));
        }
        plant.advance(drivers, *pace);
    }

    /// Sensors and controllers.
    pub(crate) fn sides(&mut self) -> impl Iterator<Item = &mut DigitalSide<f64, P>> {
        self.digital.iter_mut()
    }

    /// Those of an actuator.
    pub(crate) fn digital(&mut self, actuator: usize) -> &mut DigitalSide<f64, P> {
        &mut self.digital[actuator]
    }

    /// Where the energy went so far.
    pub(crate) fn balance(&self) -> EnergyBalance {
        self.plant.balance(0)
    }
}

/// Some ticks of a test.
struct Ticks<'a, P: Precision, K> {
    test: &'a mut SeveralActuators<P>,
    commands: &'a [&'a [f64]],
    ticks: usize,
    keep: &'a mut [K],
}

impl<P: Precision, K: Keep<f64>> Work for Ticks<'_, P, K> {
    type Output = usize;

    #[inline(always)]
    fn run(self) -> usize {
        for i in 0..self.ticks {
            if !self.test.is_bounded() {
                return i;
            }
            self.test.tick(i, self.commands, self.keep);
        }
        self.ticks
    }
}
