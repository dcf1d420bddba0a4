//! Units of acceleration and their names in files.

use super::numbers::shown;
use super::text::{Fault, Line};

/// Standard gravity in m/s², for the conversion of records in units of g.
pub const STANDARD_GRAVITY: f64 = 9.80665;

/// A unit of acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// Standard gravity, 9.80665 m/s².
    Gravity,
    /// m/s².
    MetrePerSecondSquared,
    /// cm/s², also called gal.
    CentimetrePerSecondSquared,
    /// mm/s².
    MillimetrePerSecondSquared,
    /// in/s².
    InchPerSecondSquared,
    /// ft/s².
    FootPerSecondSquared,
}

impl Unit {
    /// A name of each unit, in their order, for messages.
    pub const NAMES: [&'static str; 6] = ["g", "m/s2", "cm/s2", "mm/s2", "in/s2", "ft/s2"];

    /// The name in [`Self::NAMES`].
    #[must_use]
    pub const fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }

    /// One of this unit, in m/s².
    #[must_use]
    pub const fn in_metres_per_second_squared(self) -> f64 {
        [STANDARD_GRAVITY, 1.0, 1e-2, 1e-3, 0.0254, 0.3048][self as usize]
    }

    /// The unit of a name such as `g`, `cm/sec/sec`, `m/s^2`, `mps2` or `gal`; letter case is ignored.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        let mut plain = name.trim().to_lowercase().replace("sec", "s").replace("⁻²", "-2").replace('²', "2");
        plain.retain(|c| {
            !c.is_whitespace() && !matches!(c, '^' | '*' | '_' | '(' | ')' | '[' | ']' | '.' | '·')
        });
        Some(match plain.as_str() {
            "g" | "gs" | "g's" => Self::Gravity,
            "m/s2" | "m/s/s" | "mps2" | "ms2" | "ms-2" => Self::MetrePerSecondSquared,
            "cm/s2" | "cm/s/s" | "cmps2" | "cms2" | "cms-2" | "gal" | "gals" => {
                Self::CentimetrePerSecondSquared
            }
            "mm/s2" | "mm/s/s" | "mmps2" | "mms2" | "mms-2" => Self::MillimetrePerSecondSquared,
            "in/s2" | "in/s/s" | "inps2" | "ins2" | "ins-2" => Self::InchPerSecondSquared,
            "ft/s2" | "ft/s/s" | "ftps2" | "fts2" | "fts-2" => Self::FootPerSecondSquared,
            _ => return None,
        })
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
            ("Gal", 0.01),
            (" m/s² ", 1.0),
            ("mps2", 1.0),
            ("m/s**2", 1.0),
            ("m·s⁻²", 1.0),
            ("in/sec^2", 0.0254),
        ] {
            assert_eq!(Unit::from_name(name).unwrap().in_metres_per_second_squared(), factor, "{name}");
        }
        for name in Unit::NAMES {
            assert_eq!(Unit::from_name(name).unwrap().name(), name);
        }
        for name in ["", "cm/s", "counts", "m", "cm", "gram"] {
            assert_eq!(Unit::from_name(name), None, "{name}");
        }
    }
}
