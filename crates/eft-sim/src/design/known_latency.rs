//! The gains behind a load cell of known latency.

use super::force_loop::{self, Deviation, ForceLoop, corners, damped, no_poles, refuse_long_delay};
use super::held_piston::{Gains, HeldPiston, Sampled};
use crate::error::{Error, Result};

/// Longest delay (samples) of the loop with the latency. Few gains are tried, and a fast rate has many samples.
const LONGEST_LATENCY: u32 = 32;
/// The extremes of the study of laboratory rigs, narrower than those of a loop without a latency: every share of the
/// gains that is given up costs accuracy.
const DEVIATIONS: [Deviation; 4] = [
    Deviation { oil_stiffness: 1.5, pilot_time_constant: 1.7 },
    Deviation { oil_stiffness: 1.5, pilot_time_constant: 0.6 },
    Deviation { oil_stiffness: 0.75, pilot_time_constant: 1.7 },
    Deviation { oil_stiffness: 0.75, pilot_time_constant: 0.6 },
];
/// Least damping ratio (1) of the oil column on the worst of them.
const LATE_DAMPING: f64 = 0.01;
/// Least gain margin (1) and coprime margin (1) of a rig with a known latency.
const LATE_GAIN_MARGIN: f64 = 2.0;
const LATE_COPRIME_MARGIN: f64 = 0.2;
/// Factors (1) on the time of the integral part that are tried in turn.
const LATE_INTEGRAL_TIMES: [f64; 4] = [1.0, 2.0, 4.0, 8.0];
/// Factor (1) from one smaller gain to the next in the search for gains that a known latency allows.
const LATENCY_STEP: f64 = 0.98;

/// Designs a force loop. A known latency of the load cell makes the gains smaller; the integral time stays, or becomes
/// longer.
pub(super) fn search(plant: &HeldPiston) -> Result<ForceLoop> {
    let punctual = force_loop::search(&HeldPiston { latency: 0.0, ..plant.clone() })?;
    if plant.latency > 0.0 { slowed(&punctual, plant) } else { Ok(punctual) }
}

/// The gains of a loop for the same rig with a known latency: the largest share of them that keeps the margins
/// of the rig and the damping of every corner.
fn slowed(punctual: &ForceLoop, plant: &HeldPiston) -> Result<ForceLoop> {
    refuse_long_delay("controller.force_delay + dac.delay", plant.samples(), LONGEST_LATENCY)?;
    let nominal = plant.sampled();
    // The given gains keep the corners of a short latency damped, but for rounding.
    let short = plant.samples() - plant.delay <= plant.unknown_delay();
    let corners = if short { Vec::new() } else { corners(plant, &DEVIATIONS) };
    for longer in LATE_INTEGRAL_TIMES {
        let mut gains = punctual.gains();
        gains.integral /= longer;
        while gains.proportional * plant.static_gain() >= force_loop::LEAST_STATIC_GAIN {
            let slower = ForceLoop::new(gains, &nominal);
            let robust = has_margins(&nominal, gains).map_err(no_poles)?
                && damped(&corners, gains, LATE_DAMPING).map_err(no_poles)?
                && slower.coprime_margin() >= LATE_COPRIME_MARGIN;
            if robust {
                return Ok(slower);
            }
            gains = gains.scaled(LATENCY_STEP).rounded();
        }
    }
    let allowed = "no robust force loop keeps the oil column damped behind so late a load cell; \
        shorten its latency, or take controller.force_loop = \"pd\"";
    Err(Error::value("controller.force_delay", plant.latency, allowed))
}

/// Whether the rig itself with its latency has the least damping and gain margin.
fn has_margins(nominal: &Sampled, gains: Gains) -> Result<bool> {
    Ok(nominal.damping(gains)? >= force_loop::NOMINAL_DAMPING
        && nominal.damping(gains.scaled(LATE_GAIN_MARGIN))? > 0.0)
}

#[cfg(test)]
mod tests;
