//! The gains for what is known of a rig beyond its data sheets: the latency of the load cell, and an identified valve
//! and oil. They are a share of those for the data sheets.

use super::force_loop::{self, Deviations, ForceLoop, corners, damped, no_poles, refuse_long_delay};
use super::held_piston::{Gains, HeldPiston, Sampled};
use crate::{Error, Result};

/// Longest delay (samples) of the loop with the latency. Few gains are tried, and a fast rate has many samples.
const LONGEST_LATENCY: u32 = 32;
/// The extremes of the study of laboratory rigs, narrower than those of a loop without a latency: every share of the
/// gains that is given up costs accuracy.
const DEVIATIONS: Deviations = Deviations { oil_stiffness: [1.5, 0.75], pilot_time_constant: [1.7, 0.6] };
/// Those of an identified rig. On 1,000 laboratory rigs the found compressibility was 0.88 to 1.20 times the true one,
/// and the pilot time constant 0.92 to 1.15 times.
const IDENTIFIED: Deviations = Deviations { oil_stiffness: [1.2, 0.8], pilot_time_constant: [1.25, 0.8] };
/// Least damping ratio (1) of the oil column on the worst of them behind a late load cell.
const LATENCY_DAMPING: f64 = 0.01;
/// Least gain margin (1) of the rig itself, and of an identified one. On the stiffest oil, 1.5 and 1.2 times as stiff,
/// both leave about 1.33.
const GAIN_MARGIN: f64 = 2.0;
const IDENTIFIED_GAIN_MARGIN: f64 = 1.6;
/// Least coprime margin (1) of the rig itself.
const COPRIME_MARGIN: f64 = 0.2;
/// Factors (1) on the time of the integral part that are tried in turn.
const INTEGRAL_TIMES: [f64; 4] = [1.0, 2.0, 4.0, 8.0];
/// Largest share (1) of the gains for an identified rig, and the factor (1) from one share to the next smaller one.
const LARGEST_SHARE: f64 = 2.5;
const SHARE_STEP: f64 = 0.98;
/// Least share (1) of the gains that is of use. Without leakage the static gain is infinite, and ends no search.
const LEAST_SHARE: f64 = 0.05;

/// Designs a force loop. A known latency of the load cell makes its gains smaller, an identified rig makes them larger.
pub(super) fn search(plant: &HeldPiston) -> Result<ForceLoop> {
    let base = force_loop::search(&HeldPiston { latency: 0.0, identified: false, ..plant.clone() })?;
    if plant.latency > 0.0 || plant.identified { scale_gains(&base, plant) } else { Ok(base) }
}

/// The largest share of the gains that keeps the margins of the rig and the damping of every corner. The integral time
/// stays, or becomes longer.
fn scale_gains(base: &ForceLoop, plant: &HeldPiston) -> Result<ForceLoop> {
    refuse_long_delay("controller.force_delay + dac.delay", plant.samples(), LONGEST_LATENCY)?;
    let nominal = plant.both_sampled();
    let short_latency = plant.samples() - plant.delay <= plant.unknown_delay();
    let corners = match (plant.identified, short_latency) {
        (true, _) => corners(plant, &IDENTIFIED),
        (false, false) => corners(plant, &DEVIATIONS),
        // The given gains keep the corners of a short latency damped, but for rounding.
        (false, true) => Vec::new(),
    };
    let damping = if short_latency { force_loop::LEAST_DAMPING } else { LATENCY_DAMPING };
    let (largest_share, gain_margin) =
        if plant.identified { (LARGEST_SHARE, IDENTIFIED_GAIN_MARGIN) } else { (1.0, GAIN_MARGIN) };
    for factor in INTEGRAL_TIMES {
        let mut gains = base.gains();
        gains.integral /= factor;
        gains = gains.scaled(largest_share);
        while gains.proportional * plant.static_gain() >= force_loop::LEAST_STATIC_GAIN
            && gains.proportional >= LEAST_SHARE * base.proportional_gain
        {
            let candidate = ForceLoop::new(gains, &nominal);
            let robust = has_margins(&nominal, gains, gain_margin).map_err(no_poles)?
                && damped(&corners, gains, damping).map_err(no_poles)?
                && candidate.coprime_margin() >= COPRIME_MARGIN;
            if robust {
                return Ok(candidate);
            }
            gains = gains.scaled(SHARE_STEP).map(force_loop::four_digits);
        }
    }
    if plant.latency == 0.0 {
        let allowed = "no gains of use keep the oil column of the identified rig damped; take \"pd\"";
        return Err(Error::value("controller.force_loop", "\"robust\"", allowed));
    }
    let allowed = "no robust force loop keeps the oil column damped behind so late a load cell; \
        shorten its latency, or take controller.force_loop = \"pd\"";
    Err(Error::value("controller.force_delay", plant.latency, allowed))
}

/// Whether the rig itself with its latency has the least damping and gain margin.
fn has_margins(nominal: &[Sampled], gains: Gains, gain_margin: f64) -> Result<bool> {
    Ok(damped(nominal, gains, force_loop::NOMINAL_DAMPING)?
        // Not even an undamped one.
        && damped(nominal, gains.scaled(gain_margin), f64::MIN_POSITIVE)?)
}

#[cfg(test)]
mod tests;
