//! The limits of the verdict.

use crate::config::schema::Kind::Float;
use crate::config::schema::{float, key};
use crate::config::section::section;

/// The rows of one set of limits: section, the verdict beyond them, and the defaults.
#[rustfmt::skip]
macro_rules! limits {
    ($section:literal, $verdict:literal, $force:expr, $displacement:expr, $gain:expr, $time:expr, $level:expr, $oil:expr, $supply:expr) => {
        &[
            key(concat!($section, "force_error"), "", Float(1e-6, 1e6), float($force), concat!("force error, rms over rms, above which the verdict is ", $verdict)),
            key(concat!($section, "displacement_error"), "", Float(1e-6, 1e6), float($displacement), concat!("displacement error against the ideal response, rms over rms, above which the verdict is ", $verdict)),
            key(concat!($section, "gain_margin"), "", Float(1.0, 1e3), float($gain), concat!("gain margin of the force loop below which the verdict is ", $verdict)),
            key(concat!($section, "dead_time"), "s", Float(0.0, 1.0), float($time), concat!("additional dead time that makes the loop unstable, below which the verdict is ", $verdict)),
            key(concat!($section, "level_margin"), "", Float(1.0, 1e3), float($level), concat!("factor on the compensation level that makes the loop unstable, below which the verdict is ", $verdict, "; not used with self-calibration")),
            key(concat!($section, "oscillation"), "", Float(1e-6, 1e6), float($oil), concat!("force error from 30 to 150 Hz, of the oil column, over rms command, above which the verdict is ", $verdict)),
            key(concat!($section, "supply_pressure"), "", Float(0.0, 1.0), float($supply), concat!("least supply pressure over the configured one below which the verdict is ", $verdict)),
        ]
    };
}

section! {
    /// `[verdict]`: limits beyond which the verdict is a caution, and beyond which it is no.
    pub struct Verdict in "verdict." {
        /// Limits of the verdict "caution".
        caution: VerdictLimits { limits!("verdict.caution.", "a caution", 0.1, 0.1, 1.2, 1e-3, 1.02, 0.05, 0.9) };
        /// Limits of the verdict "no".
        no: VerdictLimits { limits!("verdict.no.", "no", 0.3, 0.3, 1.1, 1e-4, 1.0, 0.3, 0.7) };
    }
}

section! {
    /// One set of limits.
    pub struct VerdictLimits in "" {
        /// Largest force error, rms over rms, dimensionless.
        force_error: f64;
        /// Largest displacement error against the ideal response, rms over rms, dimensionless.
        displacement_error: f64;
        /// Least factor on the force loop's gain that makes it unstable, dimensionless.
        gain_margin: f64;
        /// Least additional dead time that makes the loop unstable, s.
        dead_time: f64;
        /// Least factor on the compensation level that makes the loop unstable, dimensionless.
        level_margin: f64;
        /// Largest force error from 30 to 150 Hz over the rms command, dimensionless.
        oscillation: f64;
        /// Least supply pressure over the configured one, dimensionless.
        supply_pressure: f64;
    }
}
