//! A shear building with a servovalve and an actuator on every floor, fed by one supply.

use crate::config::RigConfig;
use crate::error::Result;
use crate::rig::PlantState;
use crate::rig::drive::{Drive, Driver, DriverKind};
use crate::rig::energy::{Energy, EnergyBalance};
use crate::rig::runge_kutta::Vector;
use crate::rig::servo_actuator::ServoActuator;
use crate::rig::shear_building::ShearBuilding;
use crate::rig::spool::Spool;
use crate::rig::supply::Supply;
use crate::sensors::Signals;

/// One floor: its actuator's state, which has the floor's motion, and its load cell's.
#[derive(Debug, Clone, Copy, Default)]
struct Floor {
    core: PlantState<f64>,
    cell: f64,
}

/// Everything that the building's plant remembers.
#[derive(Debug, Clone, Default)]
struct State {
    floors: Vec<Floor>,
    accumulator: f64,
    time: f64,
    energy: Energy<f64>,
}

/// The plant, with every effect of the actuators.
#[derive(Debug, Clone)]
pub(crate) struct BuildingPlant {
    servo_actuator: ServoActuator<f64>,
    supply: Supply<f64>,
    building: ShearBuilding,
    state: State,
    scratch: Scratch,
}

/// Room for the stages of a step, so that none allocates.
#[derive(Debug, Clone)]
struct Scratch {
    stage: State,
    rates: [State; 4],
    /// Of the last state that was looked at.
    accelerations: Vec<f64>,
}

impl BuildingPlant {
    /// At rest; every floor has the actuator of the rig.
    pub(crate) fn new(rig: &RigConfig) -> Result<Self> {
        let rig = rig.plant();
        let building = ShearBuilding::new(rig)?;
        let supply = Supply::pack(|_| rig);
        let state = State {
            floors: vec![Floor::default(); building.len()],
            accumulator: supply.setting(0.0),
            ..State::default()
        };
        Ok(Self {
            servo_actuator: ServoActuator::pack(|_| rig)?,
            supply,
            scratch: Scratch {
                stage: state.clone(),
                rates: [state.clone(), state.clone(), state.clone(), state.clone()],
                accelerations: vec![0.0; building.len()],
            },
            building,
            state,
        })
    }

    /// Number of stories, and of actuators.
    pub(crate) fn stories(&self) -> usize {
        self.building.len()
    }

    /// Back to rest.
    pub(crate) fn reset(&mut self) {
        let floors = vec![Floor::default(); self.building.len()];
        self.state = State { floors, accumulator: self.supply.setting(0.0), ..State::default() };
        self.scratch.accelerations.fill(0.0);
    }

    /// Puts a floor to a displacement (m) and velocity (m/s).
    pub(crate) fn set_motion(&mut self, floor: usize, displacement: f64, velocity: f64) {
        if let Some(Floor { core, .. }) = self.state.floors.get_mut(floor) {
            (core.displacement, core.velocity) = (displacement, velocity);
        }
    }

    /// Where the energy went since rest.
    pub(crate) fn balance(&self) -> EnergyBalance {
        let oil: f64 = self.state.floors.iter().map(|floor| self.servo_actuator.stored(&floor.core)).sum();
        let structure = self.building.stored(|i| (self.core(i).displacement, self.core(i).velocity));
        let supply =
            self.supply.stored(self.state.accumulator) - self.supply.stored(self.supply.setting(0.0));
        EnergyBalance::new(&self.state.energy, oil + structure + supply)
    }

    /// Valve, pressure and motion of a floor.
    pub(crate) fn core(&self, floor: usize) -> PlantState<f64> {
        self.state.floors.get(floor).copied().unwrap_or_default().core
    }

    /// Force (N) on a floor.
    pub(crate) fn force(&self, floor: usize) -> f64 {
        self.servo_actuator.force(&self.core(floor))
    }

    /// What a floor's sensors look at.
    pub(crate) fn signals(&self, floor: usize) -> Signals<f64> {
        let Floor { core, cell } = self.state.floors.get(floor).copied().unwrap_or_default();
        Signals {
            displacement: core.displacement,
            velocity: core.velocity,
            force: self.servo_actuator.shown(&core, cell),
            spool: core.spool,
            supply_pressure: self
                .supply
                .pressure(self.supply.setting(self.state.time), self.state.accumulator),
            acceleration: self.acceleration(floor),
        }
    }

    /// Acceleration (m/s²) of a floor.
    fn acceleration(&self, floor: usize) -> f64 {
        self.scratch.accelerations.get(floor).copied().unwrap_or_default()
    }

    /// Whether a floor's spool stands at a stop, and whether its piston is beyond its stroke.
    pub(crate) fn at_limits(&self, floor: usize) -> (bool, bool) {
        self.servo_actuator.at_limits(&self.core(floor))
    }

    /// The valve command (V) that a floor's `driver` gives now.
    pub(crate) fn driven_command(&self, floor: usize, driver: &Driver<f64>) -> f64 {
        let pressure = self.signals(floor).supply_pressure;
        let Floor { core, cell } = self.state.floors.get(floor).copied().unwrap_or_default();
        let acceleration = self.acceleration(floor);
        let hydraulics = self.servo_actuator.hydraulics(&core, pressure);
        self.servo_actuator.driven_command(&core, cell, &hydraulics, acceleration, driver, 0.0)
    }

    /// Carries the plant on by `period` (s) in `steps` classical Runge–Kutta steps; where accelerations (m/s²) are
    /// given the pistons are led by them, and not by the building.
    pub(crate) fn advance(&mut self, drivers: &[Driver<f64>], period: f64, steps: u32, led: Option<&[f64]>) {
        let step = period / f64::from(steps);
        let Self { servo_actuator, supply, building, state, scratch } = self;
        let Scratch { stage, rates, accelerations } = scratch;
        for n in 0..steps {
            let start = f64::from(n) * step;
            let stages = [(0.0, 0.0), (0.5, 0.5), (0.5, 0.5), (1.0, 1.0)];
            for (i, (weight, at)) in stages.into_iter().enumerate() {
                let (done, open) = rates.split_at_mut(i);
                let Some(rate) = open.first_mut() else { continue };
                match done.last() {
                    None => stage.clone_from(state),
                    Some(last) => stage.set_after(state, last, weight * step),
                }
                let time = start + at * step;
                match led {
                    None => accelerate(building, servo_actuator, stage, accelerations),
                    Some(led) => accelerations.copy_from_slice(led),
                }
                let blocks = Blocks { servo_actuator, supply, building };
                set_rates(rate, stage, &blocks, drivers, accelerations, time);
            }
            let [k1, k2, k3, k4] = &*rates;
            for (rate, weight) in [(k1, 1.0), (k2, 2.0), (k3, 2.0), (k4, 1.0)] {
                state.add(rate, weight * step / 6.0);
            }
            for floor in &mut state.floors {
                floor.core.spool = Spool::stop(floor.core.spool);
            }
        }
        accelerate(building, servo_actuator, state, accelerations);
    }
}

fn accelerate(
    building: &ShearBuilding,
    servo_actuator: &ServoActuator<f64>,
    state: &State,
    accelerations: &mut [f64],
) {
    let core = |i: usize| state.floors.get(i).copied().unwrap_or_default().core;
    building.accelerations(
        |i| servo_actuator.force(&core(i)),
        |i| (core(i).displacement, core(i).velocity),
        |i, acceleration| {
            if let Some(slot) = accelerations.get_mut(i) {
                *slot = acceleration;
            }
        },
    );
}

/// What has an equation of its own.
struct Blocks<'a> {
    servo_actuator: &'a ServoActuator<f64>,
    supply: &'a Supply<f64>,
    building: &'a ShearBuilding,
}

fn set_rates(
    rate: &mut State,
    state: &State,
    blocks: &Blocks<'_>,
    drivers: &[Driver<f64>],
    accelerations: &[f64],
    time: f64,
) {
    let Blocks { servo_actuator, supply, building } = blocks;
    let setting = supply.setting(state.time);
    let pressure = supply.pressure(setting, state.accumulator);
    let mut drawn = 0.0;
    let velocity = |i: usize| state.floors.get(i).copied().unwrap_or_default().core.velocity;
    let mut energy = Energy { damping: building.damping_loss(velocity), ..Energy::default() };
    let floors = rate.floors.iter_mut().zip(&state.floors).zip(drivers.iter().zip(accelerations));
    for ((rate, floor), (driver, acceleration)) in floors {
        let hydraulics = servo_actuator.hydraulics(&floor.core, pressure);
        drawn += hydraulics.drawn();
        energy = energy.zip(servo_actuator.powers(&floor.core, &hydraulics, pressure), |a, b| a + b);
        let valve_command =
            servo_actuator.driven_command(&floor.core, floor.cell, &hydraulics, *acceleration, driver, time);
        rate.core = servo_actuator.rate(&floor.core, &hydraulics, *acceleration, valve_command);
        rate.cell = servo_actuator.cell_rate(&floor.core, *acceleration, floor.cell);
    }
    let pump_flow = supply.pump_flow(setting, pressure, drawn);
    rate.accumulator = supply.rate(pump_flow, drawn);
    rate.time = 1.0;
    rate.energy = Energy { supplied: setting * pump_flow, droop: (setting - pressure) * pump_flow, ..energy };
}

impl State {
    /// Becomes `from + rate·step`.
    fn set_after(&mut self, from: &Self, rate: &Self, step: f64) {
        self.clone_from(from);
        self.add(rate, step);
    }

    fn add(&mut self, rate: &Self, step: f64) {
        for (floor, rate) in self.floors.iter_mut().zip(&rate.floors) {
            floor.core = floor.core.after(rate.core, step);
            floor.cell += rate.cell * step;
        }
        self.accumulator += rate.accumulator * step;
        self.time += rate.time * step;
        self.energy = self.energy.zip(rate.energy, |sum, power| sum + power * step);
    }
}

impl Drive<f64> for Driver<f64> {
    #[inline]
    fn demand(&self, time: f64, force: f64, force_rate: f64) -> f64 {
        match self.kind {
            DriverKind::Held => self.held.demand(time, force, force_rate),
            DriverKind::Analog => self.cell.analog().demand(time, force, force_rate),
            DriverKind::ThroughCell => self.cell.demand(time, force, force_rate),
        }
    }
    #[inline]
    fn slope(&self) -> f64 {
        match self.kind {
            DriverKind::Held => self.held.slope(),
            DriverKind::Analog => self.cell.analog().slope(),
            DriverKind::ThroughCell => self.cell.slope(),
        }
    }
    #[inline]
    fn is_sound(&self, cell_gain: f64) -> bool {
        match self.kind {
            DriverKind::Held => self.held.is_sound(cell_gain),
            DriverKind::Analog => self.cell.analog().is_sound(cell_gain),
            DriverKind::ThroughCell => self.cell.is_sound(cell_gain),
        }
    }
    #[inline]
    fn limit(&self, demand: f64) -> f64 {
        match self.kind {
            DriverKind::Held => self.held.limit(demand),
            DriverKind::Analog => self.cell.analog().limit(demand),
            DriverKind::ThroughCell => self.cell.limit(demand),
        }
    }
    #[inline]
    fn passes(&self, demand: f64) -> bool {
        match self.kind {
            DriverKind::Held => self.held.passes(demand),
            DriverKind::Analog => self.cell.analog().passes(demand),
            DriverKind::ThroughCell => self.cell.passes(demand),
        }
    }
    #[inline]
    fn limits(&self) -> bool {
        match self.kind {
            DriverKind::Held => self.held.limits(),
            DriverKind::Analog => self.cell.analog().limits(),
            DriverKind::ThroughCell => self.cell.limits(),
        }
    }
}
