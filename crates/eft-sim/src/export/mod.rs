//! From a rig to a ready configuration for firmware, as source text.

mod c;
mod notes;
mod rust;

use eft_core::{AdaptiveParameters, CompensationParameters, Levels, ProtectionParameters};

use crate::closed_loop::{
    Precision, adaptive_parameters, adapts, compensation_parameters, observer_per_mass, protection_parameters,
};
use crate::config::{RigConfig, VelocitySource};
use crate::error::{Error, Result};
use crate::linear::observer_gains;

/// Points a flow table may have in the C interface.
const C_CAPACITY: usize = 21;

/// The language of the exported configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// A constant `eft_core::Controller` or `AdaptiveController`, checked by the compiler; beside it `VELOCITY` and
    /// `PROTECTION` where the rig has them.
    Rust,
    /// A constant `eft_parameters` or `eft_adaptive_parameters` for `eft.h`, checked here and again by
    /// `eft_configure_f32` or `eft_adaptive_configure_f32`; beside it `EFT_VELOCITY` and `EFT_PROTECTION`.
    C,
}

impl std::str::FromStr for Target {
    type Err = Error;
    fn from_str(name: &str) -> Result<Self> {
        match name {
            "rust" => Ok(Self::Rust),
            "c" => Ok(Self::C),
            other => Err(Error::value("target", other, "must be \"rust\" or \"c\"")),
        }
    }
}

/// All that a rig's firmware is made from.
struct Parts<'a> {
    rig: &'a RigConfig,
    name: &'a str,
    compensation: CompensationParameters,
    adaptive: Option<AdaptiveParameters>,
    velocity: Option<Velocity>,
    protection: Option<ProtectionParameters>,
}

impl Parts<'_> {
    fn looks_ahead(&self) -> bool {
        self.rig.compensation.feedforward && self.rig.compensation.look_ahead
    }
}

/// What makes the velocity of a rig that measures only displacement.
enum Velocity {
    /// With its corner (Hz).
    Derivative(f64),
    /// With its gains, and one over the mass (1/kg) that the force moves; none where the acceleration is measured.
    Observer([f64; 3], Option<f64>),
}

/// The configuration of a rig's controller as a source file; the digital side runs at `controller.sample_rate`. A rig
/// with feedforward, estimators, guard or supply correction makes an adaptive controller. A velocity that is estimated
/// and a protection are constants of their own, for the functions that stand around the controller. What a constant cannot
/// hold, such as the supply pressure that has to be given or when the soft end begins, the first comment says.
///
/// # Errors
/// A rig that the controller refuses, in `f32` or at all; a computation delay, which the firmware's own timing makes; for
/// C, a flow table of more than 21 points.
pub fn export(rig: &RigConfig, name: &str, target: Target) -> Result<String> {
    rig.validate()?;
    let rate = rig.controller.sample_rate;
    <f32 as Precision>::controller(rig, rate)?;
    exportable(rig)?;
    let points = rig.servovalve.flow_table.openings.len();
    if target == Target::C && points > C_CAPACITY {
        return Err(Error::value("servovalve.flow_table", points, "must have at most 21 points for C"));
    }
    let parts = Parts {
        rig,
        name,
        compensation: compensation_parameters(rig, rate),
        adaptive: adaptive(rig, rate)?,
        velocity: velocity(rig, rate)?,
        protection: protection(rig, rate)?,
    };
    let mut out = String::new();
    let written = match target {
        Target::Rust => rust::write(&mut out, &parts),
        Target::C => c::write(&mut out, &parts),
    };
    written.map_err(|_| Error::value("name", name, "could not be written"))?;
    Ok(out)
}

fn adaptive(rig: &RigConfig, rate: f64) -> Result<Option<AdaptiveParameters>> {
    if !adapts(rig) && !rig.compensation.feedforward {
        return Ok(None);
    }
    <f32 as Precision>::adaptive(rig, rate)?;
    Ok(Some(adaptive_parameters(rig, rate)?))
}

fn velocity(rig: &RigConfig, rate: f64) -> Result<Option<Velocity>> {
    Ok(match rig.controller.velocity_source {
        VelocitySource::Sensor => None,
        VelocitySource::Derivative => {
            <f32 as Precision>::derivative(rig, rate)?;
            Some(Velocity::Derivative(rig.controller.velocity_corner))
        }
        VelocitySource::Observer | VelocitySource::Accelerometer => {
            <f32 as Precision>::observer(rig, rate)?;
            Some(Velocity::Observer(observer_gains(rig, rate)?, observer_per_mass(rig)))
        }
    })
}

fn protection(rig: &RigConfig, rate: f64) -> Result<Option<ProtectionParameters>> {
    if !rig.protection.enabled {
        return Ok(None);
    }
    let parameters = protection_parameters(rig, rate);
    <f32 as Precision>::protection(&parameters)?;
    Ok(Some(parameters))
}

/// Refuses what only the firmware itself can make.
pub(crate) fn exportable(rig: &RigConfig) -> Result<()> {
    match rig.compensation.computation_delay {
        0 => Ok(()),
        delay => Err(Error::value("compensation.computation_delay", delay, "must be 0 for firmware")),
    }
}

/// A number that reads back as itself, in both languages.
fn number(value: f64) -> String {
    format!("{value:?}")
}

/// A limit that may be none.
fn limit(value: f64, none: &str) -> String {
    if value < f64::MAX { number(value) } else { none.to_owned() }
}

fn list(values: &[f64]) -> String {
    values.iter().map(|&v| number(v)).collect::<Vec<_>>().join(", ")
}

/// What the adaptive controller knows besides, by the same names in both languages.
fn adaptive_fields(a: &AdaptiveParameters) -> [(&'static str, f64, &'static str); 3] {
    [
        ("compressibility", a.compressibility, "m3/Pa"),
        ("leakage", a.leakage, "m3/(s Pa)"),
        ("velocity_delay", a.velocity_delay, "s"),
    ]
}

/// The fields that both languages name alike.
fn fields(p: &CompensationParameters) -> [(&'static str, f64, &'static str); 11] {
    [
        ("level", p.level, "1"),
        ("piston_area", p.piston_area, "m2"),
        ("supply_pressure", p.supply_pressure, "Pa"),
        ("flow_gain", p.flow_gain, "m3/s"),
        ("valve_gain", p.valve_gain, "1/V"),
        ("response_delay", p.response_delay, "s"),
        ("lead_alpha", p.lead_alpha, "1"),
        ("spool_warning", p.spool_warning, "1"),
        ("velocity_range", p.velocity_range, "m/s"),
        ("force_range", p.force_range, "N"),
        ("spool_range", p.spool_range, "1"),
    ]
}

/// The levels of a protection by signal, with their unit.
fn levels(p: &ProtectionParameters) -> [(&'static str, Levels, &'static str); 4] {
    [
        ("force", p.force, "N"),
        ("displacement", p.displacement, "m"),
        ("velocity", p.velocity, "m/s"),
        ("spool", p.spool, "1"),
    ]
}

/// The rest of a protection, by the same names in both languages.
fn protection_fields(p: &ProtectionParameters) -> [(&'static str, f64, &'static str); 5] {
    [
        ("start_time", p.start_time, "s"),
        ("ramp_time", p.ramp_time, "s"),
        ("shutdown_time", p.shutdown_time, "s"),
        ("lost_samples", p.lost_samples, "1"),
        ("fault_time", p.fault_time, "s"),
    ]
}

#[cfg(test)]
mod tests;
