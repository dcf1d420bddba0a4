//! The rig as the overcompensation guard alone will have set its level.

use std::f64::consts::TAU;

use eft_core::guard_tuning::{LOWEST_LEVEL, TOLERATED, TOLERATED_WITH_INTEGRAL};

use crate::analysis::linear::{Complex, compensated_share, lead_response, sampling_delays, valve_response};
use crate::analysis::motion::motion;
use crate::{Result, RigConfig};

/// A rig whose compensation exceeds what its guard tolerates.
#[derive(Debug, Clone)]
pub(crate) struct Guarded {
    /// With the level at which the force error feeds no energy into the motion, as far as the guard reduces it.
    pub rig: RigConfig,
    /// Overcompensation (1) at the rig's own level, over the tolerated one.
    pub excess: f64,
}

/// The rig after its guard, without self-calibration, has reduced the level at a sample rate (Hz); `None` if the guard does
/// not act. It acts on a motion which is large beside an unknown lap, and this lap is not in the result.
///
/// # Errors
/// As [`linearize`](crate::analysis::linear::linearize); a design that does not exist at this rate.
pub fn guarded(rig: &RigConfig, sample_rate: f64) -> Result<Option<RigConfig>> {
    Ok(after_guard(&rig.with_known_lap(sample_rate)?, 1.0, sample_rate)?.map(|found| found.rig))
}

/// As [`guarded`], with what makes the guard act. The rig's flow has this gain (1) because of its openings. Where they pass
/// less, the guard has reduced the level at smaller ones, and raises it again.
///
/// # Errors
/// As [`guarded`].
pub(crate) fn after_guard(rig: &RigConfig, gain: f64, sample_rate: f64) -> Result<Option<Guarded>> {
    let compensation = &rig.compensation;
    if !compensation.guard || compensation.adaptive || compensation.level == 0.0 {
        return Ok(None);
    }
    let less = gain.min(1.0);
    let lasting = rig.with_fixed_gains(sample_rate)?;
    let fixed = lasting.varied(|values| values.servovalve.flow_gain_scale /= less);
    let motion = motion(&fixed, sample_rate)?;
    let (frequency, used) = (motion.angular / TAU, motion.used_over_true);
    let [hold, computation] = sampling_delays(rig, sample_rate);
    let late = Complex::from_polar(1.0, -motion.angular * (hold + computation));
    let supplied = lead_response(rig, frequency) * valve_response(rig, frequency) * late;
    // The error in phase with the velocity in use vanishes at this level.
    let full = compensated_share(&fixed)? * supplied.re;
    let whole = used.re / used.norm_sqr();
    let tolerated = if fixed.controller.integrates() { TOLERATED_WITH_INTEGRAL } else { TOLERATED };
    let excess = (full - whole) / tolerated;
    Ok((excess > 1.0).then(|| {
        let factor = ((whole / full).max(LOWEST_LEVEL) / less).min(1.0);
        let rig = lasting.varied(|values| values.compensation.level *= factor);
        Guarded { rig, excess }
    }))
}
