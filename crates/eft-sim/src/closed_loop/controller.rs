//! The controller of a rig: what the configuration says about it, handed to `eft-core`.
//!
//! Only what a controller can know goes in: nothing of the true plant does.

use eft_core::{
    AdaptiveCompensation, AdaptiveController, AdaptiveParameters, Compensation, CompensationParameters,
    Controller, Feedforward, FilteredDerivative, FlowTable, Limiter, Mode, Protection, ProtectionParameters,
    Real, ServovalveController, SignFrom, Tuning, VelocityObserver,
};

use crate::closed_loop::simulate::{SimulateOptions, simulate_controlled};
use crate::closed_loop::test_run::TestRun;
use crate::config::{self, RigConfig};
use crate::error::Result;
use crate::excitation::Command;
use crate::linear::{observer_gains, velocity_delay};
use crate::rig::TABLE_CAPACITY;

/// The controller of a simulated rig; its tables have the simulator's capacity.
pub type RigController<S> = Controller<S, TABLE_CAPACITY>;

/// The adaptive controller of a simulated rig.
pub type RigAdaptiveController<S> = AdaptiveController<S, TABLE_CAPACITY>;

/// A precision the controller can run in.
pub trait Precision: Real + 'static {
    /// The controller of a rig at a sample rate (Hz).
    ///
    /// # Errors
    /// What `eft-core` refuses.
    fn controller(rig: &RigConfig, sample_rate: f64) -> Result<RigController<Self>>;

    /// The flow feedforward of a rig at a sample rate (Hz); off where its configuration says so.
    ///
    /// # Errors
    /// What `eft-core` refuses.
    fn feedforward(rig: &RigConfig, sample_rate: f64) -> Result<Feedforward<Self>>;

    /// The adaptive controller of a rig at a sample rate (Hz).
    ///
    /// # Errors
    /// What `eft-core` refuses.
    fn adaptive(rig: &RigConfig, sample_rate: f64) -> Result<RigAdaptiveController<Self>>;

    /// A whole test, as [`simulate`](crate::simulate) runs it: compiled once here, and not again in every crate that
    /// calls it.
    ///
    /// # Errors
    /// As [`simulate`](crate::simulate).
    #[doc(hidden)]
    fn test(
        rig: &RigConfig,
        command: &Command,
        options: &SimulateOptions,
        go_on: &mut dyn FnMut(usize, usize) -> bool,
    ) -> Result<TestRun>;

    /// The derivative that a rig takes its velocity from, at a sample rate (Hz).
    ///
    /// # Errors
    /// What `eft-core` refuses.
    fn derivative(rig: &RigConfig, sample_rate: f64) -> Result<FilteredDerivative<Self>>;

    /// The observer that a rig takes its velocity from, at a sample rate (Hz).
    ///
    /// # Errors
    /// What `eft-core` refuses.
    fn observer(rig: &RigConfig, sample_rate: f64) -> Result<VelocityObserver<Self>>;

    /// A protection of the specimen.
    ///
    /// # Errors
    /// What `eft-core` refuses.
    fn protection(parameters: &ProtectionParameters) -> Result<Protection<Self>>;
}

/// Everything the compensation is made from, at a sample rate (Hz).
pub fn compensation_parameters(rig: &RigConfig, sample_rate: f64) -> CompensationParameters {
    let c = &rig.compensation;
    // Any plausible number passes where no range is set.
    let unlimited = f64::from(f32::MAX);
    CompensationParameters {
        mode: match c.mode {
            config::Mode::Off => Mode::Off,
            config::Mode::Linear => Mode::Linear,
            config::Mode::Nonlinear => Mode::Nonlinear,
        },
        level: c.level,
        piston_area: rig.actuator.piston_area,
        supply_pressure: rig.supply.pressure,
        flow_gain: c.flow_gain,
        valve_gain: c.valve_gain,
        proportional_gain: rig.controller.proportional_gain,
        response_delay: c.response_delay,
        lead_alpha: c.lead_alpha,
        sample_rate,
        sign_from: match c.sign_from {
            config::SignFrom::Spool => SignFrom::Spool,
            config::SignFrom::Demand => SignFrom::Demand,
        },
        spool_warning: rig.limits.spool_warning,
        velocity_range: rig.limits.velocity_range.unwrap_or(unlimited),
        force_range: rig.limits.force_range.unwrap_or(unlimited),
        spool_range: rig.limits.spool_range.unwrap_or(unlimited),
    }
}

/// Whether anything of the adaptive controller beyond the feedforward is asked for.
pub fn adapts(rig: &RigConfig) -> bool {
    let c = &rig.compensation;
    c.adaptive || c.guard || c.supply_correction
}

/// Everything the adaptive compensation is made from, at a sample rate (Hz).
///
/// # Errors
/// An observer without its mass, or an invalid sample rate.
pub fn adaptive_parameters(rig: &RigConfig, sample_rate: f64) -> Result<AdaptiveParameters> {
    Ok(AdaptiveParameters {
        compensation: compensation_parameters(rig, sample_rate),
        compressibility: rig.actuator.compressibility,
        leakage: rig.actuator.leakage,
        force_sensitivity: rig.controller.force_sensitivity,
        computation_delay: rig.compensation.computation_delay,
        velocity_delay: velocity_delay(rig, sample_rate)?,
        feedforward: rig.compensation.feedforward,
        adaptive: rig.compensation.adaptive,
        correct_curve: rig.compensation.curve_correction,
        guard: rig.compensation.adaptive || rig.compensation.guard,
        tuning: Tuning::DEFAULT,
    })
}

macro_rules! precision {
    ($t:ty) => {
        impl Precision for $t {
            fn controller(rig: &RigConfig, sample_rate: f64) -> Result<RigController<Self>> {
                let known = &rig.servovalve.flow_table;
                let table = FlowTable::<$t, TABLE_CAPACITY>::new(&known.openings, &known.flows)?;
                let c = &rig.controller;
                Ok(Controller {
                    compensation: Compensation::<$t, TABLE_CAPACITY>::new(
                        &compensation_parameters(rig, sample_rate),
                        &table,
                    )?,
                    servovalve: ServovalveController::<$t>::new(
                        c.force_sensitivity,
                        c.proportional_gain,
                        c.derivative_gain,
                        sample_rate,
                    )?,
                    limiter: Limiter::<$t>::new(
                        rig.limits.valve_command.unwrap_or(f64::MAX),
                        rig.limits.valve_command_rate.unwrap_or(f64::MAX),
                        sample_rate,
                    )?,
                })
            }

            fn test(
                rig: &RigConfig,
                command: &Command,
                options: &SimulateOptions,
                go_on: &mut dyn FnMut(usize, usize) -> bool,
            ) -> Result<TestRun> {
                simulate_controlled::<$t>(rig, command, options, None, go_on)
            }

            fn adaptive(rig: &RigConfig, sample_rate: f64) -> Result<RigAdaptiveController<Self>> {
                let known = &rig.servovalve.flow_table;
                let table = FlowTable::<$t, TABLE_CAPACITY>::new(&known.openings, &known.flows)?;
                let parameters = adaptive_parameters(rig, sample_rate)?;
                let fixed = Self::controller(rig, sample_rate)?;
                Ok(AdaptiveController {
                    compensation: AdaptiveCompensation::<$t, TABLE_CAPACITY>::new(&parameters, &table)?,
                    servovalve: fixed.servovalve,
                    limiter: fixed.limiter,
                })
            }

            fn derivative(rig: &RigConfig, sample_rate: f64) -> Result<FilteredDerivative<Self>> {
                Ok(FilteredDerivative::<$t>::new(rig.controller.velocity_corner, sample_rate)?)
            }

            fn observer(rig: &RigConfig, sample_rate: f64) -> Result<VelocityObserver<Self>> {
                Ok(VelocityObserver::<$t>::new(observer_gains(rig, sample_rate)?, sample_rate)?)
            }

            fn protection(parameters: &ProtectionParameters) -> Result<Protection<Self>> {
                Ok(Protection::<$t>::new(parameters)?)
            }

            fn feedforward(rig: &RigConfig, sample_rate: f64) -> Result<Feedforward<Self>> {
                if !rig.compensation.feedforward {
                    return Ok(Feedforward::<$t>::OFF);
                }
                let a = &rig.actuator;
                Ok(Feedforward::<$t>::new(a.piston_area, a.compressibility, a.leakage, sample_rate)?)
            }
        }
    };
}
precision!(f32);
precision!(f64);
