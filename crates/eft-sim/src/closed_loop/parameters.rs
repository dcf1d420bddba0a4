//! The controller of a rig: its parameters for `eft-core` from the configuration.
//!
//! The parameters contain only what a controller can know, and nothing of the true plant.

use serde::Serialize;
use serde::de::DeserializeOwned;

use eft_core::{
    Channel, Controller, Learner, Learning, Levels, Parameters, PlausibilityParameters, ProtectionParameters,
    Real, Realization, Scalar, VelocitySource,
};

use crate::Result;
use crate::config::TABLE_CAPACITY;
use crate::config::{self, RigConfig};
use crate::lanes::Num;

/// The controller of a simulated rig; its tables have the simulator's capacity.
pub type RigController<S> = Controller<S, TABLE_CAPACITY>;

/// A precision the controller can run in.
pub trait Precision: Real + Serialize + DeserializeOwned + 'static {
    /// The width of this precision.
    const WIDTH: Width;
    /// The number type of the controllers for a plant of several lanes. It has as many lanes, or one lane if
    /// each lane has its own channel.
    type Lanes<S: Num>: Scalar<Element = Self> + 'static;

    /// The controller alone.
    ///
    /// # Errors
    /// Parameters that `eft-core` refuses.
    fn controller(parameters: &Parameters) -> Result<RigController<Self>>;

    /// The whole tick.
    ///
    /// # Errors
    /// Parameters that `eft-core` refuses.
    fn channel(parameters: &Parameters) -> Result<Channel<Self, TABLE_CAPACITY>>;

    /// The learner of the channel.
    ///
    /// # Errors
    /// Parameters that `eft-core` refuses.
    fn learner(parameters: &Parameters) -> Result<Learner<Self, TABLE_CAPACITY>>;
}

/// The width of a precision's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Width {
    /// `f32`.
    Single,
    /// `f64`.
    Double,
}

/// Whether the controller learns during a test.
pub fn adapts(rig: &RigConfig) -> bool {
    rig.compensation.adaptive || rig.compensation.guard
}

/// All parameters of a rig's controller at a sample rate (Hz).
///
/// # Errors
/// An observer without its gains, or an invalid sample rate.
pub fn parameters(rig: &RigConfig, sample_rate: f64) -> Result<Parameters<'_>> {
    crate::checks::sample_rate("sample_rate", sample_rate)?;
    let designed = rig.at_rate(sample_rate)?;
    let (c, loop_, limits) = (&rig.compensation, &designed.controller, &rig.limits);
    // With an analog controller the delay is before the valve command. With a digital one it is after the
    // channel's valve command, so the valve estimator sees it.
    let converter = match loop_.realization {
        Realization::Analog => rig.dac.delay,
        Realization::Digital => 0,
    };
    Ok(Parameters {
        sample_rate,
        realization: loop_.realization,
        mode: c.mode,
        level: c.level,
        sign_from: c.sign_from,
        piston_area: rig.actuator.piston_area,
        supply_pressure: rig.supply.pressure,
        supply_correction: c.supply_correction,
        compressibility: rig.measured_compressibility(),
        friction: rig.actuator.friction,
        friction_velocity: rig.actuator.friction_velocity,
        overlap: rig.servovalve.overlap.max(0.0),
        null_bias: rig.servovalve.null_bias,
        leakage: rig.actuator.leakage,
        openings: &rig.controller_curve().openings,
        flows: &rig.controller_curve().flows,
        flow_gain: c.flow_gain,
        valve_gain: c.valve_gain,
        // A learning controller keeps the two delays separate, to estimate that of the valve.
        response_delay: if c.adaptive { c.response_delay } else { c.lead_delay() },
        lead_alpha: c.lead_alpha,
        velocity_source: velocity_source(rig, sample_rate)?,
        velocity_delay: rig.velocity_delay(sample_rate)? + c.velocity_delay,
        computation_delay: c.computation_delay + converter,
        feedforward: c.feedforward,
        look_ahead: c.look_ahead,
        force_sensitivity: loop_.force_sensitivity,
        proportional_gain: loop_.proportional_gain,
        derivative_gain: loop_.derivative_gain,
        integral_gain: loop_.integral_gain,
        valve_command: limits.valve_command.unwrap_or(f64::MAX),
        valve_command_rate: limits.valve_command_rate.unwrap_or(f64::MAX),
        spool_warning: limits.spool_warning,
        velocity_range: limits.velocity_range.unwrap_or(f64::MAX),
        force_range: limits.force_range.unwrap_or(f64::MAX),
        spool_range: limits.spool_range.unwrap_or(f64::MAX),
        gap_time: limits.gap_time,
        learning: Learning {
            adaptive: c.adaptive,
            curve_correction: c.corrects_curve(),
            guard: c.adaptive || c.guard,
            excitation: c.learning.excitation,
            flow_gain_bounds: [c.learning.lowest_flow_gain, c.learning.highest_flow_gain],
            valve_gain_bounds: [c.learning.lowest_valve_gain, c.learning.highest_valve_gain],
            response_delay_bounds: [c.learning.shortest_delay, c.learning.longest_delay],
            age_limit: c.learning.age_limit,
        },
        protection: protection(rig),
        stuck_samples: if rig.protection.enabled { rig.protection.stuck_samples } else { 0 },
    })
}

/// The velocity source of a rig's controller.
fn velocity_source(rig: &RigConfig, sample_rate: f64) -> Result<VelocitySource> {
    let c = &rig.controller;
    Ok(match c.velocity_source {
        config::VelocitySource::Sensor => VelocitySource::Sensor,
        config::VelocitySource::Derivative => VelocitySource::Derivative { corner: c.velocity_corner },
        config::VelocitySource::Observer => VelocitySource::Observer {
            gains: rig.observer_gains(sample_rate)?,
            mass: c.observer_mass.unwrap_or(rig.structure.mass),
        },
        config::VelocitySource::Accelerometer => {
            VelocitySource::Accelerometer { gains: rig.observer_gains(sample_rate)? }
        }
    })
}

/// The protection of a rig's specimen, if it is enabled.
fn protection(rig: &RigConfig) -> Option<ProtectionParameters> {
    let p = &rig.protection;
    let levels = |warning: Option<f64>, trip: Option<f64>| {
        let trip = trip.unwrap_or(f64::MAX);
        Levels { warning: warning.unwrap_or(trip), trip }
    };
    p.enabled.then(|| ProtectionParameters {
        force: levels(p.force_warning, p.force_trip),
        displacement: levels(p.displacement_warning, p.displacement_trip),
        velocity: levels(p.velocity_warning, p.velocity_trip),
        spool: levels(p.spool_warning, p.spool_trip),
        start_time: p.start_time,
        ramp_time: p.ramp_time,
        shutdown_time: p.shutdown_time,
        lost_samples: p.lost_samples,
        fault_time: p.fault_time.unwrap_or(f64::MAX),
        period_tolerance: p.period_tolerance,
        oscillation_limit: p.oscillation_limit.unwrap_or(f64::MAX),
        plausibility: p.plausibility.then(|| plausibility(rig)),
    })
}

/// Parameters of the plausibility check. The default noise is 0.05 % of the range that each sensor must have.
fn plausibility(rig: &RigConfig) -> PlausibilityParameters {
    const SHARE: f64 = 5.0e-4;
    let (p, a) = (&rig.protection, &rig.actuator);
    let greatest = rig.servovalve.flow_table.flows.iter().fold(0.0, |most: f64, flow| most.max(flow.abs()));
    PlausibilityParameters {
        force_noise: p.force_noise.unwrap_or(SHARE * a.piston_area * rig.supply.pressure),
        displacement_noise: p.displacement_noise.unwrap_or(SHARE * a.stroke),
        velocity_noise: p.velocity_noise.unwrap_or(SHARE * greatest / a.piston_area),
        spool_noise: p.spool_noise,
        load_pressure_tolerance: p.load_pressure_tolerance.unwrap_or(f64::MAX),
        false_alarms: p.false_alarms,
        settle_time: p.settle_time,
    }
}

macro_rules! precision {
    ($t:ty, $width:ident, $lanes:ident, $type:ty) => {
        impl Precision for $t {
            const WIDTH: Width = Width::$width;
            type Lanes<$lanes: Num> = $type;

            fn controller(parameters: &Parameters) -> Result<RigController<Self>> {
                Ok(RigController::<$t>::new(parameters)?)
            }

            fn channel(parameters: &Parameters) -> Result<Channel<Self, TABLE_CAPACITY>> {
                Ok(Channel::<$t, TABLE_CAPACITY>::new(parameters)?)
            }

            fn learner(parameters: &Parameters) -> Result<Learner<Self, TABLE_CAPACITY>> {
                Ok(Learner::<$t, TABLE_CAPACITY>::new(parameters)?)
            }
        }
    };
}
precision!(f32, Single, S, f32);
precision!(f64, Double, S, S);
