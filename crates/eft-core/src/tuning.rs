//! How the estimators and the guard are set.

use crate::error::{ConfigError, LARGEST, check, positive, within};

/// Shortest memory (s): no window lasts longer.
const SHORTEST: f64 = 0.05;

/// How estimators and guard are set; [`Tuning::DEFAULT`] suits sensors with noise of about 0.05 % of their range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tuning {
    /// Corner of the estimators' two equal low-passes (Hz).
    pub low_pass: f64,
    /// Corner of the estimators' high-pass (Hz).
    pub high_pass: f64,
    /// Shortest memory (s), at strong motion.
    pub memory: f64,
    /// Evidence (squared opening × s) at which half of the forgetting of the shortest memory is reached.
    pub half_evidence: f64,
    /// Evidence (squared opening × s) that is never forgotten.
    pub kept_evidence: f64,
    /// Opening (1) below which nothing is learned.
    pub excitation: f64,
    /// Bounds of the flow gain over the table's (1).
    pub flow_gain: (f64, f64),
    /// Bounds of the spool's gain over the configured one (1).
    pub valve_gain: (f64, f64),
    /// Bounds of the response delay over the configured one (1).
    pub response_delay: (f64, f64),
    /// Largest rates of the calibration (1/s): flow gain, spool's gain, response delay over the configured one.
    pub rates: (f64, f64, f64),
    /// Weights of the configuration (squared opening × s): flow gain, spool's gain; and (1/s, of squared opening
    /// rate) response delay.
    pub priors: (f64, f64, f64),
    /// Memory (s of motion in it) of a direction's correction of the table.
    pub curve_memory: f64,
    /// The same of a band of openings.
    pub curve_band_memory: f64,
    /// Part of the signals' squares (1) that the models may miss before they are not believed.
    pub error_share: f64,
    /// Overcompensation (1) at which the guard begins to act.
    pub tolerated: f64,
    /// Corner of the guard's two equal low-passes (Hz), above the structure's frequency.
    pub guard_low_pass: f64,
    /// Time (s) over which the guard averages.
    pub guard_average: f64,
    /// Time (s) in which the guard takes overcompensation back.
    pub guard_time: f64,
    /// Velocity (m/s) below which the guard has no voice.
    pub guard_quiet: f64,
}

impl Tuning {
    /// Found on the paper's rig.
    pub const DEFAULT: Self = Self {
        low_pass: 12.0,
        high_pass: 0.1,
        memory: 0.25,
        half_evidence: 1.5e-3,
        kept_evidence: 5.0e-5,
        excitation: 5.0e-4,
        flow_gain: (0.7, 1.35),
        valve_gain: (0.8, 1.25),
        response_delay: (0.2, 4.0),
        rates: (0.5, 0.2, 2.0),
        priors: (1.0e-7, 1.0e-6, 6.0e-5),
        curve_memory: 5.0,
        curve_band_memory: 0.2,
        error_share: 0.03,
        tolerated: 1.0e-2,
        guard_low_pass: 4.0,
        guard_average: 0.2,
        guard_time: 0.33,
        guard_quiet: 5.0e-3,
    };

    /// These, if they can be used.
    ///
    /// # Errors
    /// A number that is not finite or not positive, a bound beyond its counterpart, a memory shorter than a window, by
    /// name.
    pub(crate) const fn checked(&self) -> Result<&Self, ConfigError> {
        check!(positive("low_pass", self.low_pass));
        check!(positive("high_pass", self.high_pass));
        check!(within("memory", self.memory, SHORTEST, LARGEST));
        check!(positive("half_evidence", self.half_evidence));
        check!(positive("kept_evidence", self.kept_evidence));
        check!(positive("excitation", self.excitation));
        check!(bounds("flow_gain", self.flow_gain));
        check!(bounds("valve_gain", self.valve_gain));
        check!(bounds("response_delay", self.response_delay));
        let (flow_gain, valve_gain, delay) = self.rates;
        check!(positive("rates", flow_gain));
        check!(positive("rates", valve_gain));
        check!(positive("rates", delay));
        let (flow_gain, valve_gain, delay) = self.priors;
        check!(positive("priors", flow_gain));
        check!(positive("priors", valve_gain));
        check!(positive("priors", delay));
        check!(within("curve_memory", self.curve_memory, SHORTEST, LARGEST));
        check!(within("curve_band_memory", self.curve_band_memory, SHORTEST, LARGEST));
        check!(within("error_share", self.error_share, 0.0, 1.0));
        check!(positive("tolerated", self.tolerated));
        check!(positive("guard_low_pass", self.guard_low_pass));
        check!(positive("guard_average", self.guard_average));
        check!(within("guard_time", self.guard_time, SHORTEST, LARGEST));
        check!(positive("guard_quiet", self.guard_quiet));
        Ok(self)
    }
}

/// Refuses bounds between which nothing lies.
const fn bounds(parameter: &'static str, (lowest, highest): (f64, f64)) -> Result<f64, ConfigError> {
    within(parameter, highest, check!(positive(parameter, lowest)), LARGEST)
}
