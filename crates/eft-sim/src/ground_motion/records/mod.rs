//! Ground motions: acceleration records and their file formats.
//!
//! [`read_record`] looks at the content and recognises PEER's AT2, CSMIP's and COSMOS's V2, K-NET's ASCII,
//! and columns of text (CSV). Each reader compares the declared number of points with the content, and
//! allocates memory for the content only.

mod at2;
mod block;
mod column_header;
mod columns;
mod cosmos_v2;
mod csmip_v2;
mod knet;
mod notes;
mod numbers;
mod read;
mod text;
mod unit;

pub use read::{MAX_FILE_SIZE, MAX_LINES, ReadOptions, parse, parse_with, read_record, read_record_with};
pub use unit::{STANDARD_GRAVITY, Unit};

use crate::{Result, checks};

/// One component of a ground motion: acceleration in m/s² at a constant step in s.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// The name of the record in the file, or the name of the file.
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
    /// If there are no points, one of them is not finite, or the step is outside its range.
    pub fn new(name: impl Into<String>, acceleration: Vec<f64>, dt: f64) -> Result<Self> {
        let record = Self { name: name.into(), acceleration, dt };
        record.validate()?;
        Ok(record)
    }

    /// Repeats the checks of [`Record::new`], because the public fields may have changed.
    ///
    /// # Errors
    /// As [`Record::new`].
    pub fn validate(&self) -> Result<()> {
        // Real records are well within.
        checks::within("dt", self.dt, 1e-9, 1e6, "s")?;
        checks::signal("acceleration", &self.acceleration)
    }

    /// Peak ground acceleration in m/s²: the largest magnitude in the record.
    #[must_use]
    pub fn pga(&self) -> f64 {
        self.acceleration.iter().fold(0.0, |peak: f64, a| peak.max(a.abs()))
    }
}

/// The result of a reader: values in the file's unit, and the information in the file.
#[derive(Debug)]
struct Draft {
    name: Option<String>,
    values: Vec<f64>,
    dt: Option<f64>,
    unit: Option<Unit>,
    /// Name of the column with the values, for formats that may omit the unit.
    column: Option<String>,
}

#[cfg(test)]
mod tests;
