//! What a configuration is made from, and why it was refused.

use core::ffi::c_char;

use eft_core::{CompensationParameters, ConfigError, Mode, SignFrom};

use crate::status;

/// Points a flow table may have.
pub const EFT_TABLE_CAPACITY: usize = 21;

/// eft_parameters.mode: the piston's motion is not compensated.
pub const EFT_MODE_OFF: u8 = 0;
/// eft_parameters.mode: through the initial flow gain.
pub const EFT_MODE_LINEAR: u8 = 1;
/// eft_parameters.mode: through the inverse flow table and the load-pressure correction.
pub const EFT_MODE_NONLINEAR: u8 = 2;
/// eft_parameters.sign_from: the load-pressure correction takes its sign from the measured spool, as in the paper.
pub const EFT_SIGN_FROM_SPOOL: u8 = 0;
/// eft_parameters.sign_from: the sign of the demanded flow, free of chatter.
pub const EFT_SIGN_FROM_DEMAND: u8 = 1;

/// A controller's parameters in SI units; plain data, so that a constant one can stay in flash.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct eft_parameters {
    /// Points of the flow table in use.
    pub table_length: u32,
    /// EFT_MODE_...
    pub mode: u8,
    /// EFT_SIGN_FROM_...
    pub sign_from: u8,
    /// Zero.
    pub reserved: u16,
    /// Compensation level, 1.
    pub level: f64,
    /// Piston area, m².
    pub piston_area: f64,
    /// Supply pressure, Pa.
    pub supply_pressure: f64,
    /// Flow gain of the linear mode, m³/s.
    pub flow_gain: f64,
    /// Valve gain, 1/V.
    pub valve_gain: f64,
    /// Response delay, s.
    pub response_delay: f64,
    /// The lead network's α, 1.
    pub lead_alpha: f64,
    /// Sample rate, Hz.
    pub sample_rate: f64,
    /// Force sensitivity, V/N.
    pub force_sensitivity: f64,
    /// Proportional gain, V/V.
    pub proportional_gain: f64,
    /// Derivative gain, s.
    pub derivative_gain: f64,
    /// Largest valve command, V; DBL_MAX for no limit.
    pub valve_command: f64,
    /// Largest rate of the valve command, V/s; DBL_MAX for no limit.
    pub valve_command_rate: f64,
    /// Opening that raises EFT_SPOOL_WARNING, 1.
    pub spool_warning: f64,
    /// Velocity beyond which a measurement is invalid, m/s.
    pub velocity_range: f64,
    /// Force beyond which a measurement is invalid, N.
    pub force_range: f64,
    /// Spool opening beyond which a measurement is invalid, 1.
    pub spool_range: f64,
    /// Spool openings of the flow table, strictly increasing, 1.
    pub openings: [f64; EFT_TABLE_CAPACITY],
    /// Flows of the flow table, strictly increasing, m³/s.
    pub flows: [f64; EFT_TABLE_CAPACITY],
}

impl eft_parameters {
    pub(crate) fn compensation(&self) -> Result<CompensationParameters, ConfigError> {
        let choice = |parameter, value: u8, highest: u8| ConfigError::OutOfRange {
            parameter,
            value: f64::from(value),
            lowest: 0.0,
            highest: f64::from(highest),
        };
        if self.reserved != 0 {
            let value = f64::from(self.reserved);
            return Err(ConfigError::OutOfRange { parameter: "reserved", value, lowest: 0.0, highest: 0.0 });
        }
        Ok(CompensationParameters {
            mode: match self.mode {
                EFT_MODE_OFF => Mode::Off,
                EFT_MODE_LINEAR => Mode::Linear,
                EFT_MODE_NONLINEAR => Mode::Nonlinear,
                other => return Err(choice("mode", other, EFT_MODE_NONLINEAR)),
            },
            sign_from: match self.sign_from {
                EFT_SIGN_FROM_SPOOL => SignFrom::Spool,
                EFT_SIGN_FROM_DEMAND => SignFrom::Demand,
                other => return Err(choice("sign_from", other, EFT_SIGN_FROM_DEMAND)),
            },
            level: self.level,
            piston_area: self.piston_area,
            supply_pressure: self.supply_pressure,
            flow_gain: self.flow_gain,
            valve_gain: self.valve_gain,
            proportional_gain: self.proportional_gain,
            response_delay: self.response_delay,
            lead_alpha: self.lead_alpha,
            sample_rate: self.sample_rate,
            spool_warning: self.spool_warning,
            velocity_range: self.velocity_range,
            force_range: self.force_range,
            spool_range: self.spool_range,
        })
    }

    /// Openings and flows in use; a length beyond the capacity is an error.
    pub(crate) fn table(&self) -> Result<(&[f64], &[f64]), ConfigError> {
        let length = self.table_length as usize;
        match (self.openings.get(..length), self.flows.get(..length)) {
            (Some(openings), Some(flows)) => Ok((openings, flows)),
            _ => Err(ConfigError::Length {
                parameter: "table_length",
                length,
                shortest: 2,
                longest: EFT_TABLE_CAPACITY,
            }),
        }
    }
}

/// Why a configuration was refused.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct eft_error {
    /// The refused value (lengths as numbers); zero where there is none.
    pub value: f64,
    /// The lowest value allowed.
    pub lowest: f64,
    /// The highest value allowed.
    pub highest: f64,
    /// The entry of a table.
    pub index: u32,
    /// The parameter's name, ended by a zero byte.
    pub parameter: [c_char; 28],
}

impl eft_error {
    pub(crate) fn from(error: &ConfigError) -> Self {
        let (name, value, lowest, highest, index) =
            match *error {
                ConfigError::NotFinite { parameter } => (parameter, 0.0, 0.0, 0.0, 0),
                ConfigError::NotPositive { parameter, value }
                | ConfigError::NotWhole { parameter, value } => (parameter, value, 0.0, 0.0, 0),
                ConfigError::OutOfRange { parameter, value, lowest, highest } => {
                    (parameter, value, lowest, highest, 0)
                }
                ConfigError::NotIncreasing { parameter, index }
                | ConfigError::TooSteep { parameter, index } => (parameter, 0.0, 0.0, 0.0, index),
                ConfigError::Length { parameter, length, shortest, longest } => {
                    (parameter, length as f64, shortest as f64, longest as f64, 0)
                }
                _ => ("", 0.0, 0.0, 0.0, 0),
            };
        let mut parameter = [0; 28];
        for (to, from) in parameter.iter_mut().take(27).zip(name.bytes()) {
            *to = from as c_char;
        }
        Self { value, lowest, highest, index: index as u32, parameter }
    }
}

/// Writes the reason where the caller wants it, and gives its code.
pub(crate) fn refuse(error: &ConfigError, why: Option<&mut eft_error>) -> u8 {
    if let Some(why) = why {
        *why = eft_error::from(error);
    }
    status::of(error)
}
