//! Units of acceleration in files.

use super::numbers::shown;
use super::text::{Fault, Line};
use crate::units;

pub use crate::units::STANDARD_GRAVITY;

/// The SI unit of acceleration.
const SI: &str = "m/s2";

/// A unit of acceleration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit(f64);

impl Unit {
    /// Standard gravity, 9.80665 m/s².
    pub const GRAVITY: Self = Self(STANDARD_GRAVITY);

    /// A customary name.
    pub(super) fn name(self) -> String {
        let same = |name: &&str| Self::from_name(name) == Some(self);
        units::units_of(SI).split(", ").filter(same).last().map_or(format!("{} {SI}", self.0), Into::into)
    }

    /// One of this unit, in m/s².
    #[must_use]
    pub const fn in_metres_per_second_squared(self) -> f64 {
        self.0
    }

    /// The unit of a name such as `g`, `cm/sec/sec`, `m/s^2`, `mps2` or `gal`; letter case is ignored.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        units::factor_of_column(name, SI).map(Self)
    }

    /// The unit that a line names, with what stands before it there for the message.
    pub(super) fn known(name: &str, line: &Line<'_>, before: &str) -> Result<Self, Fault> {
        Self::from_name(name).ok_or_else(|| {
            Fault::at(line, format!("{before}`{}` is not a known unit of acceleration", shown(name)))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_columns_in_common_files_are_recognised() {
        for (name, factor) in [
            ("G", 9.80665),
            ("cm/sec/sec", 0.01),
            ("cm/sec2", 0.01),
            ("cm/s^2", 0.01),
            ("CM/SEC**2", 0.01),
            ("cm_s-2", 0.01),
            ("Gal", 0.01),
            ("GAL", 0.01),
            (" m/s² ", 1.0),
            ("[m/s/s]", 1.0),
            ("mps2", 1.0),
            ("m/s**2", 1.0),
            ("m·s⁻²", 1.0),
            ("MMS2", 0.001),
            ("in/sec^2", 0.0254),
            ("ft/s/s", 0.3048),
        ] {
            let found = Unit::from_name(name).unwrap_or_else(|| panic!("{name}"));
            assert_eq!(found.in_metres_per_second_squared(), factor, "{name}");
        }
        assert_eq!(Unit::from_name("in/sec^2").unwrap().name(), "in/s2");
        assert_eq!(Unit::from_name("Gal").unwrap().name(), "cm/s2");
        for name in ["", "cm/s", "counts", "m", "cm", "gram"] {
            assert_eq!(Unit::from_name(name), None, "{name}");
        }
    }
}
