//! Plant and digital sides tied together for a rig with any effect and any number of actuators.

use eft_core::{ControllerState, status};

use crate::closed_loop::controller::Precision;
use crate::closed_loop::digital_side::{DigitalSide, Feedback};
use crate::closed_loop::specimen::{Follower, Specimen};
use crate::closed_loop::tick::{Recorder, Tick};
use crate::config::RigConfig;
use crate::error::Result;
use crate::lanes::{Work, dispatch};
use crate::plant::{Driver, EnergyBalance, Plant, TimeGrid};

/// The sampled closed loop of one rig.
pub(crate) struct GeneralLoop<P: Precision> {
    plant: Plant<f64>,
    /// One an actuator.
    digital: Vec<DigitalSide<f64, P>>,
    states: Vec<ControllerState<P>>,
    drivers: Vec<Driver<f64>>,
    /// A structure outside, where the rig's own does not follow.
    follower: Option<Follower>,
    grid: TimeGrid,
    tripped: bool,
}

/// The force and pressure of one actuator, as its driver gets them.
struct ActuatorFeedback<'a> {
    plant: &'a Plant<f64>,
    number: usize,
}

impl Feedback<f64> for ActuatorFeedback<'_> {
    #[inline(always)]
    fn command(&self, driver: &Driver<f64>) -> f64 {
        self.plant.valve_command(self.number, driver)
    }
}

impl<P: Precision> GeneralLoop<P> {
    /// At rest.
    pub(crate) fn new(rig: &RigConfig, grid: TimeGrid) -> Result<Self> {
        let plant = Plant::pack(|_| rig)?;
        let actuators = 0..plant.actuators();
        let side = |actuator| DigitalSide::new(|_| rig, grid.sample_rate, actuator as u64);
        Ok(Self {
            digital: actuators.clone().map(side).collect::<Result<_>>()?,
            states: vec![ControllerState::default(); actuators.len()],
            drivers: Vec::with_capacity(actuators.len()),
            plant,
            follower: None,
            grid,
            tripped: false,
        })
    }

    /// Runs up to `ticks` ticks, and gives how many began with states to go on from. The commands (N), one slice an
    /// actuator, may go on beyond them; where one ends with them, its last value is held.
    pub(crate) fn run(
        &mut self,
        commands: &[&[f64]],
        ticks: usize,
        recorder: &mut [impl Recorder<f64>],
    ) -> usize {
        dispatch::<f64, _>(Ticks { test: self, commands, ticks, recorder })
    }

    /// Lets a structure outside follow instead of the rig's own.
    pub(crate) fn followed_by(&mut self, specimen: Specimen) {
        self.follower = Some(Follower::new(specimen, self.plant.actuators()));
    }

    /// Why a structure outside could not go on.
    pub(crate) fn failure(&self) -> Option<&str> {
        self.follower.as_ref().and_then(Follower::failure)
    }

    /// Whether the plant's state is one to go on from.
    #[inline(always)]
    fn is_bounded(&self) -> bool {
        self.failure().is_none() && (0..self.digital.len()).all(|i| self.plant.actuator(i).is_bounded())
    }

    /// Tick `i` of these commands.
    #[inline(always)]
    fn tick(&mut self, i: usize, commands: &[&[f64]], recorder: &mut [impl Recorder<f64>]) {
        let Self { plant, digital, states, drivers, follower, grid, tripped } = self;
        if *tripped {
            // One floor let down alone would twist the others off it.
            digital.iter_mut().for_each(DigitalSide::trip);
        }
        drivers.clear();
        let actuators = digital.iter_mut().zip(states).zip(commands.iter().zip(recorder)).enumerate();
        for (number, ((digital, state), (commands, recorder))) in actuators {
            let (now, mut truth) = (commands[i], plant.signals(number));
            if let Some(acceleration) = follower.as_ref().and_then(|outside| outside.acceleration(number)) {
                truth.acceleration = acceleration;
            }
            let next = commands.get(i + 1).copied().unwrap_or(now);
            let decision =
                digital.sample::<false>(state, now, next, truth, &ActuatorFeedback { plant, number });
            *tripped |= decision.status & status::TRIPPED != 0;
            drivers.push(decision.driver);
            let (actuator, limits) = (plant.actuator(number), plant.at_limits(number));
            recorder.record(i, &Tick::new(now, actuator, plant.force(number), &truth, limits, decision));
        }
        match follower {
            None => plant.advance(drivers, *grid),
            Some(follower) => follower.advance(plant, drivers, *grid),
        }
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
    test: &'a mut GeneralLoop<P>,
    commands: &'a [&'a [f64]],
    ticks: usize,
    recorder: &'a mut [K],
}

impl<P: Precision, K: Recorder<f64>> Work for Ticks<'_, P, K> {
    type Output = usize;

    #[inline(always)]
    fn run(self) -> usize {
        for i in 0..self.ticks {
            if !self.test.is_bounded() {
                return i;
            }
            self.test.tick(i, self.commands, self.recorder);
        }
        self.ticks
    }
}
