//! Ground motions: acceleration records and the files they come in.

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
    /// When there are no points, one of them is not finite, or the step is not positive and finite.
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
        checks::positive("dt", self.dt, "s")?;
        checks::signal("acceleration", &self.acceleration)
    }

    /// Peak ground acceleration in m/s²: the largest magnitude in the record.
    #[must_use]
    pub fn pga(&self) -> f64 {
        self.acceleration.iter().fold(0.0, |peak: f64, a| peak.max(a.abs()))
    }
}
