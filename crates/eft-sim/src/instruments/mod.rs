//! What the controller gets to see: the sensors between the plant and the digital side.

mod channel;
mod dac;
mod delay_line;
mod low_pass;
mod noise;
mod quantizer;

pub(crate) use channel::AnalogOutput;
pub(crate) use dac::Dac;
pub(crate) use delay_line::DelayLines;
pub(crate) use noise::Noise;

use channel::{Channel, Fault};

use crate::config::{self, FaultSignal, RigConfig, Sensor, SensorFault, VelocitySource};

/// One value of each signal that has a sensor, true or measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Signals<S> {
    /// Displacement (m).
    pub(crate) displacement: S,
    /// Velocity (m/s).
    pub(crate) velocity: S,
    /// Force (N).
    pub(crate) force: S,
    /// Spool opening (1).
    pub(crate) spool: S,
    /// Supply pressure (Pa).
    pub(crate) supply_pressure: S,
    /// Acceleration (m/s²).
    pub(crate) acceleration: S,
}

/// The sensors of one actuator.
#[derive(Debug, Clone)]
pub(crate) struct Sensors {
    displacement: Channel,
    velocity: Channel,
    force: Channel,
    spool: Channel,
    supply_pressure: Channel,
    acceleration: Channel,
    tick: u64,
}

/// Streams of noise that an actuator's sensors may draw from.
const STREAMS: u64 = 16;

impl Sensors {
    /// The true sensors of a rig's actuator number `actuator`, or none where each of them is ideal.
    pub(crate) fn new(rig: &RigConfig, sample_rate: f64, actuator: u64) -> Option<Self> {
        if are_ideal(rig) {
            return None;
        }
        let sensors = &rig.plant().sensors;
        let channel = |sensor: &Sensor, signal, stream| {
            let fault = sensors.fault.as_ref().filter(|fault| fault.signal == signal);
            let fault = fault.map(|fault| in_ticks(fault, sample_rate));
            Channel::new(sensor, fault, sample_rate, sensors.seed, STREAMS * actuator + stream)
        };
        Some(Self {
            displacement: channel(&sensors.displacement, FaultSignal::Displacement, 0),
            velocity: channel(&sensors.velocity, FaultSignal::Velocity, 2),
            // The load cell's bandwidth acts in continuous time, before an analog controller sees the force: the
            // plant has it.
            force: channel(&Sensor { bandwidth: None, ..sensors.force.clone() }, FaultSignal::Force, 4),
            spool: channel(&sensors.spool, FaultSignal::Spool, 6),
            supply_pressure: channel(&sensors.supply_pressure, FaultSignal::SupplyPressure, 8),
            acceleration: channel(&sensors.acceleration, FaultSignal::Acceleration, 10),
            tick: 0,
        })
    }

    /// The readings at the next tick, and the wire from the load cell to an analog controller until the one after.
    pub(crate) fn read(&mut self, truth: &Signals<f64>) -> (Signals<f64>, AnalogOutput) {
        let tick = self.tick;
        self.tick += 1;
        let (force, wire) = self.force.read(tick, truth.force);
        let readings = Signals {
            displacement: self.displacement.read(tick, truth.displacement).0,
            velocity: self.velocity.read(tick, truth.velocity).0,
            force,
            spool: self.spool.read(tick, truth.spool).0,
            supply_pressure: self.supply_pressure.read(tick, truth.supply_pressure).0,
            acceleration: self.acceleration.read(tick, truth.acceleration).0,
        };
        (readings, wire)
    }
}

/// Whether every sensor reports the truth.
pub(crate) fn are_ideal(rig: &RigConfig) -> bool {
    let config::Sensors {
        seed: _,
        cell_mass: _,
        force,
        velocity,
        displacement,
        spool,
        supply_pressure,
        acceleration,
        fault,
    } = &rig.plant().sensors;
    let all = [force, velocity, displacement, spool, supply_pressure, acceleration];
    all.into_iter().all(is_ideal) && fault.is_none()
}

/// Whether a rig has an accelerometer: one that the observer reads, or one that is described.
pub(crate) fn has_accelerometer(rig: &RigConfig) -> bool {
    let sensors = &rig.plant().sensors;
    rig.controller.velocity_source == VelocitySource::Accelerometer
        || !is_ideal(&sensors.acceleration)
        || sensors.fault.as_ref().is_some_and(|fault| fault.signal == FaultSignal::Acceleration)
}

fn is_ideal(sensor: &Sensor) -> bool {
    let Sensor { gain, noise, bandwidth, bits, range, delay, bias, dropout } = sensor;
    let exact = *gain == 1.0 && *noise == 0.0 && *bias == 0.0 && *dropout == 0.0;
    exact && *delay == 0 && bandwidth.is_none() && bits.is_none() && range.is_none()
}

fn in_ticks(fault: &SensorFault, sample_rate: f64) -> Fault {
    // Saturating: later than any run is never.
    let tick = |time: f64| (time * sample_rate - 1e-9).ceil().max(0.0) as u64;
    let end = fault.duration.map_or(u64::MAX, |duration| tick(fault.start + duration));
    Fault { kind: fault.kind, first: tick(fault.start), end }
}

#[cfg(test)]
mod tests;
