//! Plant and digital sides of rigs with any effect and any number of actuators.

use eft_core::{ControllerState, Flags, Mask, Scalar, status};

use crate::closed_loop::specimen::{ExternalStructure, PistonMotion, Specimen};
use crate::closed_loop::{ClosedLoop, DigitalSide, Feedback, Precision, Recorder, Tick};
use crate::lanes::{Num, Work};
use crate::plant::{AnyDrive, EnergyBalance, Plant, TimeGrid};
use crate::{Result, RigConfig};

/// The sampled closed loop of one rig, or of several side by side; `C` is the controller's number.
pub(crate) struct GeneralLoop<S: Num, C: Scalar<Element: Precision>> {
    plant: Plant<S>,
    /// One per actuator.
    pub(super) digital: Vec<DigitalSide<S, C>>,
    states: Vec<ControllerState<C>>,
    drivers: Vec<AnyDrive<S>>,
    /// An external structure that replaces the rig's own.
    structure: Option<Box<dyn PistonMotion<S>>>,
    grid: TimeGrid,
    /// Whether any lane has a protection. `tripped` marks the lanes in which one has tripped.
    has_protection: bool,
    tripped: S::Mask,
}

/// Force and pressure of one actuator, as inputs of its driver.
struct ActuatorFeedback<'a, S: Num> {
    plant: &'a Plant<S>,
    number: usize,
}

impl<S: Num> Feedback<S> for ActuatorFeedback<'_, S> {
    #[inline(always)]
    fn command(&self, driver: &AnyDrive<S>) -> S {
        self.plant.valve_command(self.number, driver)
    }
}

impl<S: Num, C: Scalar<Element: Precision>> GeneralLoop<S, C> {
    /// The loops of `rig(0)`, `rig(1)`, … at rest, one per lane, all with the same realization and number of
    /// stories.
    pub(crate) fn new<'a>(rig: &dyn Fn(usize) -> &'a RigConfig, grid: TimeGrid) -> Result<Self> {
        let plant = Plant::pack(rig)?;
        let actuators = 0..plant.actuators();
        let side = |actuator| DigitalSide::new(&rig, grid.sample_rate, actuator);
        let digital: Vec<DigitalSide<S, C>> = actuators.map(side).collect::<Result<_>>()?;
        Ok(Self {
            states: digital.iter().map(DigitalSide::at_rest).collect(),
            drivers: Vec::with_capacity(digital.len()),
            digital,
            plant,
            structure: None,
            grid,
            has_protection: (0..S::LANES).any(|i| rig(i).protection.enabled),
            tripped: S::Mask::splat(false),
        })
    }

    /// The same loop for metrics alone, without an energy balance.
    pub(crate) fn without_traces(self) -> Self {
        let digital = self.digital.into_iter().map(DigitalSide::without_traces).collect();
        Self { plant: self.plant.without_energy(), digital, ..self }
    }

    /// Runs tick `i` of these commands.
    #[inline(always)]
    fn tick(&mut self, i: usize, commands: &[&[S]], recorder: &mut [impl Recorder<S>]) {
        let Self { plant, digital, states, drivers, structure, grid, has_protection, tripped } = self;
        if *has_protection && tripped.any() {
            // Removing the force of one floor alone would overload the others.
            digital.iter_mut().for_each(|side| side.trip(*tripped));
            plant.open_bypass(*grid, *tripped);
        }
        drivers.clear();
        let actuators = digital.iter_mut().zip(states).zip(commands.iter().zip(recorder)).enumerate();
        for (number, ((digital, state), (commands, recorder))) in actuators {
            let (now, mut truth) = (commands[i], plant.signals(number));
            if let Some(acceleration) = structure.as_ref().and_then(|one| one.acceleration(number)) {
                truth.acceleration = acceleration;
            }
            let next = commands.get(i + 1).copied().unwrap_or(now);
            let feedback = ActuatorFeedback { plant, number };
            let output = digital.sample::<false, false>(state, now, next, &truth, &feedback);
            if *has_protection {
                let trips = |lane| output.status.lane(lane) & status::TRIPPED != 0;
                *tripped = *tripped | S::Mask::from_lanes(trips);
            }
            drivers.push(output.driver);
            let (actuator, limits) = (plant.actuator(number), plant.at_limits(number));
            let tick = Tick::new(now, actuator, plant.force(number), &truth, limits, &output);
            recorder.record(i, &tick, digital.estimates());
        }
        match structure {
            None => plant.advance(drivers, *grid),
            Some(structure) => structure.advance(plant, drivers, *grid),
        }
    }
}

impl<S: Num, C: Scalar<Element: Precision>> ClosedLoop<S, C> for GeneralLoop<S, C> {
    fn run(&mut self, commands: &[&[S]], ticks: usize, recorder: &mut [impl Recorder<S>]) -> usize {
        S::dispatch(GeneralTicks { test: self, commands, ticks, recorder })
    }
    #[inline(always)]
    fn is_bounded(&self) -> S::Mask {
        let mut bounded = S::Mask::splat(self.failure().is_none());
        for i in 0..self.digital.len() {
            bounded = bounded & self.plant.actuator(i).is_bounded();
        }
        bounded
    }
    fn restart(&mut self, at: S::Mask) {
        self.plant.restart(at);
    }
    fn digital_sides(&mut self) -> &mut [DigitalSide<S, C>] {
        &mut self.digital
    }
    // The energy of an external structure is unknown.
    fn balance(&self, lane: usize) -> Option<EnergyBalance> {
        self.structure.is_none().then(|| self.plant.balance(lane))
    }
    fn failure(&self) -> Option<&str> {
        self.structure.as_ref().and_then(|one| one.failure())
    }
}

impl<C: Scalar<Element: Precision>> GeneralLoop<f64, C> {
    /// Replaces the rig's structure by an external one.
    pub(crate) fn set_external_structure(&mut self, specimen: Specimen) {
        self.structure = Some(Box::new(ExternalStructure::new(specimen, self.plant.actuators())));
    }
}

/// Some ticks of a test.
struct GeneralTicks<'a, S: Num, C: Scalar<Element: Precision>, K> {
    test: &'a mut GeneralLoop<S, C>,
    commands: &'a [&'a [S]],
    ticks: usize,
    recorder: &'a mut [K],
}

impl<S: Num, C: Scalar<Element: Precision>, K: Recorder<S>> Work for GeneralTicks<'_, S, C, K> {
    type Output = usize;

    #[inline(always)]
    fn run(self) -> usize {
        for i in 0..self.ticks {
            if !self.test.is_bounded().all() {
                return i;
            }
            self.test.tick(i, self.commands, self.recorder);
        }
        self.ticks
    }
}
