//! Why a configuration was refused: a small `Copy` value that names the parameter.

use core::fmt;

/// No parameter, measurement or command is larger, in SI units: products of three of them stay finite in `f32`.
pub const LARGEST: f64 = 1.0e12;
/// No positive parameter is smaller, in SI units.
pub const SMALLEST: f64 = 1.0e-18;

/// A refused configuration. Constructors return it; no step ever does.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ConfigError {
    /// NaN or infinite.
    NotFinite {
        /// The parameter's name.
        parameter: &'static str,
    },
    /// Zero or negative where only positive values make sense.
    NotPositive {
        /// The parameter's name.
        parameter: &'static str,
        /// The value given.
        value: f64,
    },
    /// Outside the stated range.
    OutOfRange {
        /// The parameter's name.
        parameter: &'static str,
        /// The value given.
        value: f64,
        /// The lowest value allowed.
        lowest: f64,
        /// The highest value allowed.
        highest: f64,
    },
    /// An entry of a table that is not finite or outside the stated range.
    Entry {
        /// The table's name.
        parameter: &'static str,
        /// The entry.
        index: usize,
        /// The value given.
        value: f64,
        /// The lowest value allowed.
        lowest: f64,
        /// The highest value allowed.
        highest: f64,
    },
    /// A table whose entries do not increase strictly, after rounding to the scalar in use.
    NotIncreasing {
        /// The table's name.
        parameter: &'static str,
        /// The first entry that is not larger than the one before it.
        index: usize,
    },
    /// A table with a segment whose slope overflows the scalar in use.
    TooSteep {
        /// The table's name.
        parameter: &'static str,
        /// The entry at the segment's upper end.
        index: usize,
    },
    /// A table whose length is not allowed, or two tables of different lengths.
    Length {
        /// The table's name.
        parameter: &'static str,
        /// The length given.
        length: usize,
        /// The shortest length allowed.
        shortest: usize,
        /// The longest length allowed.
        longest: usize,
    },
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NotFinite { parameter } => write!(f, "{parameter} is not finite: must be a finite number"),
            Self::NotPositive { parameter, value } => {
                write!(f, "{parameter} = {}: must be positive", Short(value))
            }
            Self::OutOfRange { parameter, value, lowest, highest } => {
                let (value, lowest, highest) = (Short(value), Short(lowest), Short(highest));
                write!(f, "{parameter} = {value}: must lie in [{lowest}, {highest}]")
            }
            Self::Entry { parameter, index, value, lowest, highest } => {
                let (value, lowest, highest) = (Short(value), Short(lowest), Short(highest));
                write!(f, "{parameter}[{index}] = {value}: must lie in [{lowest}, {highest}]")
            }
            Self::NotIncreasing { parameter, index } => {
                write!(
                    f,
                    "{parameter}[{index}] is not larger than the entry before it: must increase strictly"
                )
            }
            Self::TooSteep { parameter, index } => {
                write!(f, "{parameter} rises too steeply to entry {index}: its slope must be a finite number")
            }
            Self::Length { parameter, length, shortest, longest } => {
                write!(f, "{parameter} has {length} entries: must have {shortest} to {longest}")
            }
        }
    }
}

impl core::error::Error for ConfigError {}

/// A number (in any unit) in the usual notation, with powers of ten for very small and very large ones. Both forms are
/// the shortest that read back to the same bits. For messages, not for a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Short(pub f64);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = self.0.abs();
        if size == 0.0 || !size.is_finite() || (1e-3..1e7).contains(&size) {
            write!(f, "{}", self.0)
        } else {
            write!(f, "{:e}", self.0)
        }
    }
}

/// Refuses NaN and infinities.
pub(crate) const fn finite(parameter: &'static str, value: f64) -> Result<f64, ConfigError> {
    if value.is_finite() { Ok(value) } else { Err(ConfigError::NotFinite { parameter }) }
}

/// Refuses everything but positive values of plausible size.
pub(crate) const fn positive(parameter: &'static str, value: f64) -> Result<f64, ConfigError> {
    match finite(parameter, value) {
        Ok(v) if v > 0.0 => within(parameter, v, SMALLEST, LARGEST),
        Ok(value) => Err(ConfigError::NotPositive { parameter, value }),
        Err(e) => Err(e),
    }
}

/// A measuring range; what lies beyond [`LARGEST`] is never valid.
pub(crate) const fn range(parameter: &'static str, value: f64) -> Result<f64, ConfigError> {
    match within(parameter, value, 0.0, f64::MAX) {
        Ok(v) if v > LARGEST => Ok(LARGEST),
        other => other,
    }
}

/// Refuses everything outside `[lowest, highest]`.
pub(crate) const fn within(
    parameter: &'static str,
    value: f64,
    lowest: f64,
    highest: f64,
) -> Result<f64, ConfigError> {
    match finite(parameter, value) {
        Ok(v) if v >= lowest && v <= highest => Ok(v),
        Ok(value) => Err(ConfigError::OutOfRange { parameter, value, lowest, highest }),
        Err(e) => Err(e),
    }
}

/// `?` for constant functions.
macro_rules! check {
    ($e:expr) => {
        match $e {
            Ok(v) => v,
            Err(e) => return Err(e),
        }
    };
}
pub(crate) use check;

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;

    use super::*;

    #[test]
    fn bounds_are_in_their_range_and_zero_is_not_positive() {
        let accepted = [0.999, 1.0, 1.5, 2.0, 2.001].map(|value| within("level", value, 1.0, 2.0).is_ok());
        assert_eq!(accepted, [false, true, true, true, false]);
        let zero = ConfigError::NotPositive { parameter: "mass", value: 0.0 };
        assert_eq!((positive("mass", 0.0), positive("mass", 2.0)), (Err(zero), Ok(2.0)));
        let ranges = [0.0, 7.0, LARGEST, 1.001 * LARGEST, f64::MAX].map(|value| range("spool_range", value));
        assert_eq!(ranges, [0.0, 7.0, LARGEST, LARGEST, LARGEST].map(Ok));
    }

    #[test]
    fn only_small_and_large_numbers_have_powers_of_ten() {
        for (number, text) in [
            (0.0, "0"),
            (-2.5, "-2.5"),
            (1e-3, "0.001"),
            (9.9e-4, "9.9e-4"),
            (9_999_999.0, "9999999"),
            (1e7, "1e7"),
            (f64::NEG_INFINITY, "-inf"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(Short(number).to_string(), text);
        }
    }

    #[test]
    fn no_message_counts_zeros() {
        let error = positive("sample_rate", 1e-300).unwrap_err();
        assert_eq!(error.to_string(), "sample_rate = 1e-300: must lie in [1e-18, 1e12]");
        assert_eq!(positive("mass", -5e300).unwrap_err().to_string(), "mass = -5e300: must be positive");
        let error = within("lead_alpha", 1.5, 0.001, 0.99).unwrap_err();
        assert_eq!(error.to_string(), "lead_alpha = 1.5: must lie in [0.001, 0.99]");
    }
}
