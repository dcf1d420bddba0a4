//! What a configuration is made from, and why it was refused.

use eft_core::{CompensationParameters, ConfigError, Mode, SignFrom};

use crate::status;

/// Points a flow table may have.
pub const TABLE_CAPACITY: usize = 21;

/// A controller's parameters in SI units; plain data, so that a constant one can stay in flash.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct eft_parameters {
    /// Points of the flow table in use.
    pub table_length: u32,
    /// 0 off, 1 linear, 2 nonlinear.
    pub mode: u8,
    /// 0 measured spool, 1 demanded flow.
    pub sign_from: u8,
    /// Zero.
    pub reserved: u16,
    /// Compensation level (1).
    pub level: f64,
    /// Piston area (m²).
    pub piston_area: f64,
    /// Supply pressure (Pa).
    pub supply_pressure: f64,
    /// Flow gain (m³/s) of the linear mode.
    pub flow_gain: f64,
    /// Valve gain (1/V).
    pub valve_gain: f64,
    /// Response delay (s).
    pub response_delay: f64,
    /// The lead network's α (1).
    pub lead_alpha: f64,
    /// Sample rate (Hz).
    pub sample_rate: f64,
    /// Force sensitivity (V/N).
    pub force_sensitivity: f64,
    /// Proportional gain (V/V).
    pub proportional_gain: f64,
    /// Derivative gain (s).
    pub derivative_gain: f64,
    /// Largest valve command (V).
    pub valve_command: f64,
    /// Largest rate of the valve command (V/s).
    pub valve_command_rate: f64,
    /// Opening (1) that raises the warning.
    pub spool_warning: f64,
    /// Velocity (m/s) beyond which a measurement is invalid.
    pub velocity_range: f64,
    /// Force (N) beyond which a measurement is invalid.
    pub force_range: f64,
    /// Spool opening (1) beyond which a measurement is invalid.
    pub spool_range: f64,
    /// Spool openings (1) of the flow table, strictly increasing.
    pub openings: [f64; TABLE_CAPACITY],
    /// Flows (m³/s) of the flow table, strictly increasing.
    pub flows: [f64; TABLE_CAPACITY],
}

impl eft_parameters {
    pub(crate) fn compensation(&self) -> Result<CompensationParameters, ConfigError> {
        let choice = |parameter, value: u8, highest: u8| ConfigError::OutOfRange {
            parameter,
            value: f64::from(value),
            lowest: 0.0,
            highest: f64::from(highest),
        };
        Ok(CompensationParameters {
            mode: match self.mode {
                0 => Mode::Off,
                1 => Mode::Linear,
                2 => Mode::Nonlinear,
                other => return Err(choice("mode", other, 2)),
            },
            sign_from: match self.sign_from {
                0 => SignFrom::Spool,
                1 => SignFrom::Demand,
                other => return Err(choice("sign_from", other, 1)),
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
                longest: TABLE_CAPACITY,
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
    pub parameter: [u8; 28],
}

impl eft_error {
    pub(crate) fn from(error: &ConfigError) -> Self {
        let (name, value, lowest, highest, index) = match *error {
            ConfigError::NotFinite { parameter } => (parameter, 0.0, 0.0, 0.0, 0),
            ConfigError::NotPositive { parameter, value } => (parameter, value, 0.0, 0.0, 0),
            ConfigError::OutOfRange { parameter, value, lowest, highest } => {
                (parameter, value, lowest, highest, 0)
            }
            ConfigError::NotIncreasing { parameter, index } | ConfigError::TooSteep { parameter, index } => {
                (parameter, 0.0, 0.0, 0.0, index)
            }
            ConfigError::Length { parameter, length, shortest, longest } => {
                (parameter, length as f64, shortest as f64, longest as f64, 0)
            }
            _ => ("", 0.0, 0.0, 0.0, 0),
        };
        let mut parameter = [0; 28];
        for (to, from) in parameter.iter_mut().take(27).zip(name.bytes()) {
            *to = from;
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
