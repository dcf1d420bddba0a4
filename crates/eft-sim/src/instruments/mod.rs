//! The sensors between the plant and the digital side.

mod command_delay;
mod dac;
mod delay_line;
mod low_pass;
mod noise;
mod quantizer;
mod sensor;

pub(crate) use command_delay::CommandDelay;
pub(crate) use dac::Dac;
pub(crate) use delay_line::DelayLines;
pub(crate) use low_pass::Lag;
pub(crate) use noise::Noise;
pub(crate) use sensor::AnalogOutput;

use crate::config::{self, FaultKind, FaultSignal, RigConfig, SensorFault, VelocitySource};
use crate::lanes::Num;
use crate::plant::Signals;
use sensor::{Fault, Sensor, is_ideal};

/// The sensors of one actuator, of one rig or of several side by side.
#[derive(Debug, Clone)]
pub(crate) struct Sensors<S: Num> {
    displacement: Sensor<S>,
    velocity: Sensor<S>,
    force: Sensor<S>,
    spool: Sensor<S>,
    supply_pressure: Sensor<S>,
    acceleration: Sensor<S>,
    load_pressure: Sensor<S>,
    tick: u64,
}

/// Number of noise streams of an actuator's sensors, and the one of their fault.
const STREAMS: u64 = 16;
const OF_FAULT: u64 = 14;

impl<S: Num> Sensors<S> {
    /// The true sensors of actuator number `actuator` of `rig(0)`, `rig(1)`, …, one per lane; `None` if all
    /// of them are ideal.
    pub(crate) fn new<'a>(
        rig: &dyn Fn(usize) -> &'a RigConfig,
        sample_rate: f64,
        actuator: u64,
    ) -> Option<Self> {
        if (0..S::LANES).all(|i| are_ideal(rig(i))) {
            return None;
        }
        // The load cell's bandwidth acts in continuous time, before the input of an analog controller, so it
        // is part of the plant.
        let cells: Vec<_> = (0..S::LANES)
            .map(|i| config::Sensor { bandwidth: None, ..rig(i).plant().sensors.force.clone() })
            .collect();
        let fault = |i: usize, signal| {
            let sensors = &rig(i).plant().sensors;
            let fault = sensors.fault.as_ref().filter(|fault| fault.signal == signal);
            let noise = Noise::new(sensors.seed, STREAMS * actuator + OF_FAULT);
            fault.map(|fault| fault_in_ticks(fault, sample_rate, noise))
        };
        let lanes = |of: fn(&config::Sensors) -> &config::Sensor, signal, stream| {
            let described = |i: usize| {
                let sensors = &rig(i).plant().sensors;
                (of(sensors), fault(i, signal), sensors.seed)
            };
            Sensor::new(&described, sample_rate, STREAMS * actuator + stream)
        };
        let cell = |i: usize| (&cells[i], fault(i, FaultSignal::Force), rig(i).plant().sensors.seed);
        Some(Self {
            displacement: lanes(|sensors| &sensors.displacement, FaultSignal::Displacement, 0),
            velocity: lanes(|sensors| &sensors.velocity, FaultSignal::Velocity, 2),
            force: Sensor::new(&cell, sample_rate, STREAMS * actuator + 4),
            spool: lanes(|sensors| &sensors.spool, FaultSignal::Spool, 6),
            supply_pressure: lanes(|sensors| &sensors.supply_pressure, FaultSignal::SupplyPressure, 8),
            acceleration: lanes(|sensors| &sensors.acceleration, FaultSignal::Acceleration, 10),
            load_pressure: lanes(|sensors| &sensors.load_pressure, FaultSignal::LoadPressure, 12),
            tick: 0,
        })
    }

    /// The readings at the next tick, and the load cell's analog output to the controller until the tick
    /// after that.
    #[inline(always)]
    pub(crate) fn read(&mut self, truth: &Signals<S>) -> (Signals<S>, AnalogOutput<S>) {
        let tick = self.tick;
        self.tick += 1;
        let (force, analog) = self.force.read(tick, truth.force);
        let readings = Signals {
            displacement: self.displacement.read(tick, truth.displacement).0,
            velocity: self.velocity.read(tick, truth.velocity).0,
            force,
            spool: self.spool.read(tick, truth.spool).0,
            supply_pressure: self.supply_pressure.read(tick, truth.supply_pressure).0,
            acceleration: self.acceleration.read(tick, truth.acceleration).0,
            load_pressure: self.load_pressure.read(tick, truth.load_pressure).0,
        };
        (readings, analog)
    }

    /// Visits every number of the state after the first reading, to store or to replace it.
    pub(crate) fn numbers(&mut self, visit: &mut dyn FnMut(&mut f64)) {
        let Self { displacement, velocity, force, spool, supply_pressure, acceleration, load_pressure, tick } =
            self;
        let mut number = *tick as f64;
        visit(&mut number);
        *tick = number as u64;
        for sensor in [displacement, velocity, force, spool, supply_pressure, acceleration, load_pressure] {
            sensor.numbers(visit);
            sensor.go_to(*tick);
        }
    }
}

/// Whether every sensor is ideal and measures at the structure.
pub(crate) fn are_ideal(rig: &RigConfig) -> bool {
    let config::Sensors {
        seed: _,
        motion_at: _,
        cell_mass: _,
        force,
        velocity,
        displacement,
        spool,
        supply_pressure,
        acceleration,
        load_pressure,
        fault,
    } = &rig.plant().sensors;
    let all = [force, velocity, displacement, spool, supply_pressure, acceleration, load_pressure];
    all.into_iter().all(is_ideal) && fault.is_none() && !rig.plant().piston_moves_alone()
}

/// Whether a rig has an accelerometer: the observer reads it, or the configuration describes it.
pub(crate) fn has_accelerometer(rig: &RigConfig) -> bool {
    let sensors = &rig.plant().sensors;
    rig.controller.velocity_source == VelocitySource::Accelerometer
        || !is_ideal(&sensors.acceleration)
        || sensors.fault.as_ref().is_some_and(|fault| fault.signal == FaultSignal::Acceleration)
}

/// Whether a rig measures its load pressure: the protection reads it, or the configuration describes its sensor.
pub(crate) fn has_load_pressure(rig: &RigConfig) -> bool {
    let sensors = &rig.plant().sensors;
    rig.protection.load_pressure_tolerance.is_some()
        || !is_ideal(&sensors.load_pressure)
        || sensors.fault.as_ref().is_some_and(|fault| fault.signal == FaultSignal::LoadPressure)
}

fn fault_in_ticks(fault: &SensorFault, sample_rate: f64, noise: Noise) -> Fault {
    // The conversion saturates, because a fault after the end of any run never occurs.
    let tick = |time: f64| (time * sample_rate - 1e-9).ceil().max(0.0) as u64;
    let end = fault.duration.map_or(u64::MAX, |duration| tick(fault.start + duration));
    let size = match fault.kind {
        FaultKind::Gain => fault.gain,
        FaultKind::Offset => fault.offset,
        FaultKind::Drift => fault.drift.map(|drift| drift / sample_rate),
        FaultKind::Noise => fault.noise,
        _ => None,
    };
    Fault { kind: fault.kind, first: tick(fault.start), end, size: size.unwrap_or(0.0), noise }
}

#[cfg(test)]
mod tests;
