//! Ground motions: acceleration records and the files they come in.
//!
//! [`read_record`] looks at the content and recognises PEER's AT2, CSMIP's and COSMOS's V2, K-NET's ASCII,
//! and columns of text (CSV). Each reader compares the number of points that a file declares with what it holds, and takes
//! memory only for what it holds.

mod at2;
mod block;
mod column_header;
mod columns;
mod cosmos_v2;
mod csmip_v2;
mod knet;
mod numbers;
mod read;
mod text;
mod unit;

pub use read::{MAX_FILE_SIZE, MAX_LINES, ReadOptions, parse, parse_with, read_record, read_record_with};
pub use unit::Unit;

use crate::checks;
use crate::error::Result;

/// Standard gravity in m/s², by which records in units of g are converted.
pub const STANDARD_GRAVITY: f64 = 9.80665;

/// One component of a ground motion: acceleration in m/s² at a constant step in s.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// What the file calls the record, or the file's own name.
    pub name: String,
    /// Ground acceleration, in m/s².
    pub acceleration: Vec<f64>,
    /// Time between two points, in s.
    pub dt: f64,
}

impl Record {
    /// A record from accelerations in m/s² and their step in s.
    ///
    /// # Errors
    /// When there are no points, one of them is not finite, or no record has the step.
    pub fn new(name: impl Into<String>, acceleration: Vec<f64>, dt: f64) -> Result<Self> {
        let record = Self { name: name.into(), acceleration, dt };
        record.validate()?;
        Ok(record)
    }

    /// Checks what [`Record::new`] checks: the fields are public, and may have been changed since.
    ///
    /// # Errors
    /// As [`Record::new`].
    pub fn validate(&self) -> Result<()> {
        checks::time_step("dt", self.dt)?;
        checks::signal("acceleration", &self.acceleration)
    }

    /// Peak ground acceleration in m/s²: the largest magnitude in the record.
    #[must_use]
    pub fn pga(&self) -> f64 {
        self.acceleration.iter().fold(0.0, |peak: f64, a| peak.max(a.abs()))
    }
}

/// What a reader found: values in the file's unit, and what the file says of itself.
#[derive(Debug)]
struct Draft {
    name: Option<String>,
    values: Vec<f64>,
    dt: Option<f64>,
    unit: Option<Unit>,
    /// What holds the values, where the file may leave their unit open.
    column: Option<String>,
}

#[cfg(test)]
mod tests;
