//! The limits of the verdict.

use crate::config::section::section;

section! {
    /// `[verdict]`: limits beyond which the verdict is a caution, and beyond which it is no.
    pub struct Verdict {
        /// Limits of the verdict "caution".
        pub caution: VerdictLimits,
        /// Limits of the verdict "no".
        pub no: VerdictLimits,
    }
}

section! {
    /// One set of limits.
    pub struct VerdictLimits {
        /// Largest force error, rms over rms, dimensionless.
        pub force_error: f64,
        /// Largest displacement error against the ideal response, rms over rms, dimensionless.
        pub displacement_error: f64,
        /// Least factor on the force loop's gain that makes it unstable, dimensionless.
        pub gain_margin: f64,
        /// Least additional dead time that makes the loop unstable, s.
        pub dead_time: f64,
        /// Least factor on the compensation level that makes the loop unstable, dimensionless.
        pub level_margin: f64,
        /// Largest force error from 30 to 150 Hz over the rms command, dimensionless.
        pub oscillation: f64,
        /// Least supply pressure over the configured one, dimensionless.
        pub supply_pressure: f64,
    }
}
