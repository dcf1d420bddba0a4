//! The robust force loop: the paper's controller, Eq. (1), with an integral part. Its gains keep the oil
//! column damped on the given rig and on all rigs that deviate from it by [`Deviations`].
//!
//! For each `T_D = G_d/G_p`, `G_p` is the largest that all deviating rigs allow. The chosen `T_D` has the
//! lowest peak of the sensitivity `|1/(1 + L)|`.

mod margins;

use super::held_piston::{Gains, HeldPiston, Sampled};
use crate::state_space::StateSpace;
use crate::{Error, Result, checks};

/// Least damping ratio (1) of the oil column on the worst rig.
pub(super) const LEAST_DAMPING: f64 = 0.03;
/// Least damping ratio (1) and gain margin (1) of the rig itself.
pub(super) const NOMINAL_DAMPING: f64 = 0.2;
const NOMINAL_GAIN_MARGIN: f64 = 3.0;
/// Least static gain (1) of the loop; with less the loop does not control the force.
pub(super) const LEAST_STATIC_GAIN: f64 = 5.0;
/// Range of the search for the proportional gain (1) and its steps, of equal ratio. `T_D` (s) is sought from a tenth to
/// ten times the valve's time scale.
const GAINS: (f64, f64) = (1e-6, 1e3);
const GAIN_STEPS: u32 = 1 << 20;
/// Bisections of this range before the secant method, which then has a factor of 1.9.
const BISECTIONS: u32 = 5;
const TIME_STEPS: usize = 12;
/// Times of the integral part over the valve's time scale (1). The first is 10 ms and 17 Hz on the paper's rig. At the
/// specimen's frequency the integral part reduces what an error of the compensation, friction and overlap leave. A
/// shorter time decreases the coprime margin. A soft spring between actuator and specimen needs a longer one.
const INTEGRAL_TIMES: [f64; 4] = [1.75, 3.5, 7.0, 14.0];
/// Longest delay (samples) of the loop. Each sample is a state, and longer delays leave the oil column
/// undamped.
const LONGEST_DELAY: u32 = 16;
/// Simultaneous deviations of a rig from the one that the loop is designed for.
pub(super) struct Deviations {
    pub(super) oil_stiffness: [f64; 2],
    pub(super) pilot_time_constant: [f64; 2],
}

/// The extremes of the study of random rigs. Flow gain and delay have their worst values in all four.
const DEVIATIONS: Deviations = Deviations { oil_stiffness: [1.5, 0.6], pilot_time_constant: [2.0, 0.5] };
const FLOW_GAIN: f64 = 1.1;
/// Further delay: samples of a computation, and seconds of a late load cell, which are at most so many samples.
const FURTHER_SAMPLES: u32 = 2;
const LATENCY: f64 = 5e-4;
const LATENCY_SAMPLES: f64 = 14.0;

/// A force loop designed from a rig.
#[derive(Debug, Clone)]
pub struct ForceLoop {
    /// Proportional gain `G_p` (V/V).
    pub proportional_gain: f64,
    /// Derivative gain `G_d` (s).
    pub derivative_gain: f64,
    /// Integral gain `G_i` (1/s).
    pub integral_gain: f64,
    plants: Vec<Sampled>,
}

/// Robustness of a force loop on the rig it is designed for, with the piston at rest. With an underlap each is the
/// smaller of those within the lap and beyond it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceLoopMargins {
    /// Largest stable factor (1) on the loop's gain.
    pub gain: f64,
    /// Largest stable additional delay (s): the phase margin over the angular frequency where the loop's gain
    /// falls to 1.
    pub delay: f64,
    /// Damping ratio (1) of the oil column's mode.
    pub damping: f64,
    /// Normalised coprime margin (1) of the loop `L`, `inf |1 + L|/√(2·(1 + |L|²))`, at most `1/√2`; McFarlane and
    /// Glover, IEEE Trans. Automatic Control 37(6), 1992.
    pub e_max: f64,
}

/// Refuses delays of the loop (samples) above a longest one, by the keys that state them.
pub(super) fn refuse_long_delay(keys: &str, samples: u32, longest: u32) -> Result<()> {
    let allowed = format!("a robust force loop is designed for at most {longest} samples");
    checks::require(samples <= longest, keys, samples, allowed)
}

/// The deviating rigs, sampled.
pub(super) fn corners(plant: &HeldPiston, deviations: &Deviations) -> Vec<Sampled> {
    let mut corners = Vec::new();
    for plant in plant.slopes() {
        for oil_stiffness in deviations.oil_stiffness {
            let deviating =
                deviations.pilot_time_constant.map(|time| plant.deviating(oil_stiffness, time).sampled());
            corners.extend(deviating);
        }
    }
    corners
}

/// Designs the loop of a rig without a known latency, which takes tens of milliseconds.
pub(super) fn search(plant: &HeldPiston) -> Result<ForceLoop> {
    refuse_long_delay("sensors.force.delay + dac.delay", plant.delay, LONGEST_DELAY)?;
    let nominal = plant.both_sampled();
    let corners = corners(plant, &DEVIATIONS);
    // The spool's response delay at low frequencies (s).
    let scale = plant.spool_volume / (plant.pilot_flow_gain * plant.spool_voltage);
    // A longer integral time comes before a higher peak.
    let (mut others, mut largest) = (Vec::new(), None);
    for integral_time in INTEGRAL_TIMES {
        let mut tried = damped_gains(&nominal, &corners, scale, integral_time * scale).map_err(no_poles)?;
        tried.sort_by(|(peak, _), (other, _)| peak.total_cmp(other));
        let mut tried = tried.into_iter().map(|(_, gains)| gains);
        let best = tried.next().map(|gains| accept(gains, &nominal, plant, &mut largest));
        if let Some(designed) = best.transpose()?.flatten() {
            return Ok(designed);
        }
        others.extend(tried);
    }
    for gains in others {
        if let Some(designed) = accept(gains, &nominal, plant, &mut largest)? {
            return Ok(designed);
        }
    }
    Err(refusal(largest))
}

/// The largest gains for each `T_D` that keep every corner damped with an integral time (s), each with the peak of the
/// sensitivity.
fn damped_gains(
    nominal: &[Sampled],
    corners: &[Sampled],
    scale: f64,
    integral_time: f64,
) -> Result<Vec<(f64, Gains)>> {
    let mut tried = Vec::new();
    for step in 0..TIME_STEPS {
        let time = 0.1 * scale * libm::pow(30.0, step as f64 / (TIME_STEPS - 1) as f64);
        if let Some(gains) = largest_damped_gains(corners, time, integral_time)? {
            let peaks = nominal.iter().map(|plant| plant.peak_sensitivity(gains));
            tried.push((peaks.fold(0.0, f64::max), gains));
        }
    }
    Ok(tried)
}

/// The loop with these gains if the rig itself has its margins and the loop its static gain. `largest` becomes the
/// largest static gain of a loop with the margins.
fn accept(
    gains: Gains,
    nominal: &[Sampled],
    plant: &HeldPiston,
    largest: &mut Option<f64>,
) -> Result<Option<ForceLoop>> {
    if !damped(nominal, gains, NOMINAL_DAMPING).map_err(no_poles)? {
        return Ok(None);
    }
    for plant in nominal {
        if !plant.has_gain_margin(gains, NOMINAL_GAIN_MARGIN).map_err(no_poles)? {
            return Ok(None);
        }
    }
    let static_gain = gains.proportional * plant.static_gain();
    *largest = Some(largest.map_or(static_gain, |largest: f64| largest.max(static_gain)));
    Ok((static_gain >= LEAST_STATIC_GAIN).then(|| ForceLoop::new(gains, nominal)))
}

/// The refusal of a rig, by the largest static gain (1) of a loop with the margins.
fn refusal(largest: Option<f64>) -> Error {
    let missing = largest.map_or_else(
        || "none leave the rig itself its damping and gain margin".to_owned(),
        |largest| {
            format!(
                "those that do leave a static loop gain of {largest:.1}, and {LEAST_STATIC_GAIN} is needed"
            )
        },
    );
    let allowed = format!(
        "no gains of use keep the oil column of every rig nearby damped: {missing}; \
        take a faster valve or load cell, a higher controller.sample_rate, less delay or leakage, or \"pd\""
    );
    Error::value("controller.force_loop", "\"robust\"", allowed)
}

/// Whether the oil column of every corner has at least this damping ratio (1).
pub(super) fn damped(corners: &[Sampled], gains: Gains, least: f64) -> Result<bool> {
    for corner in corners {
        if corner.damping(gains)? < least {
            return Ok(false);
        }
    }
    Ok(true)
}

/// The refusal of a rig whose poles cannot be computed.
pub(super) fn no_poles(_: Error) -> Error {
    let allowed = "the poles of this rig cannot be computed in double precision; \
        correct the values of servovalve, or take \"pd\"";
    Error::value("controller.force_loop", "\"robust\"", allowed)
}

/// The largest proportional gain with `T_D` and an integral time (s) that keeps every corner damped.
fn largest_damped_gains(corners: &[Sampled], time: f64, integral_time: f64) -> Result<Option<Gains>> {
    let gains_of = |proportional: f64| Gains {
        proportional,
        derivative: proportional * time,
        integral: proportional / integral_time,
    };
    let (mut low, high) = GAINS;
    // With little leakage the integral part causes a slow oscillation at the smallest gains.
    while !damped(corners, gains_of(low), LEAST_DAMPING)? {
        low *= 10.0;
        if low > high {
            return Ok(None);
        }
    }
    let gains = |step: u32| gains_of(low * libm::pow(high / low, f64::from(step) / f64::from(GAIN_STEPS)));
    // Between small gains with a slow oscillation and too large ones there may be two ranges of damped gains, of which
    // bisection chooses one.
    let (mut first, mut end) = (0, GAIN_STEPS);
    while end - first > GAIN_STEPS >> BISECTIONS {
        let middle = (first + end) / 2;
        if damped(corners, gains(middle), LEAST_DAMPING)? { first = middle } else { end = middle }
    }
    // A corner may be undamped at the last gain of another one.
    while !damped(corners, gains(end - 1), LEAST_DAMPING)? {
        for corner in corners {
            end = first_undamped(|step| Ok(corner.damping(gains(step))? - LEAST_DAMPING), first, end)?;
        }
    }
    // Four digits are independent of rounding differences between machines.
    Ok(Some(gains(end - 1).map(four_digits)))
}

/// A step of the gain without an excess of damping (1), whose step before has one, and at most `end`. The step `from`
/// must have an excess. Among several such steps it is any of them. The search is the Illinois method: secants, in
/// which an end that stays counts half.
fn first_undamped(excess: impl Fn(u32) -> Result<f64>, from: u32, end: u32) -> Result<u32> {
    let last = excess(end - 1)?;
    if last >= 0.0 {
        return Ok(end);
    }
    let (mut below, mut above) = ((from, excess(from)?), (end - 1, last));
    let mut stayed = 0;
    while above.0 - below.0 > 1 {
        let width = above.0 - below.0;
        let share = f64::from(width) * below.1 / (below.1 - above.1);
        let next = below.0 + (share as u32).clamp(1, width - 1);
        let found = excess(next)?;
        if found < 0.0 {
            above = (next, found);
            stayed = stayed.min(0) - 1;
        } else {
            below = (next, found);
            stayed = stayed.max(0) + 1;
        }
        match stayed {
            2.. => above.1 *= 0.5,
            ..=-2 => below.1 *= 0.5,
            _ => (),
        }
    }
    Ok(above.0)
}

/// Rounded to four significant digits.
pub(super) fn four_digits(value: f64) -> f64 {
    let scale = libm::pow(10.0, 3.0 - libm::floor(libm::log10(value)));
    libm::round(value * scale) / scale
}

impl HeldPiston {
    /// The loop's static gain per unit of proportional gain (1).
    pub(super) fn static_gain(&self) -> f64 {
        self.force_sensitivity * self.piston_area * self.flow_gain / (self.spool_voltage * self.leakage)
    }

    /// This plant, and the one beyond an underlap.
    fn slopes(&self) -> impl Iterator<Item = Self> {
        let beyond = self.flow_gain_beyond.map(|flow_gain| Self { flow_gain, ..self.clone() });
        std::iter::once(self.clone()).chain(beyond)
    }

    /// Both sampled.
    pub(super) fn both_sampled(&self) -> Vec<Sampled> {
        self.slopes().map(|plant| plant.sampled()).collect()
    }

    /// Further delay (samples) of a corner for what is not known.
    pub(super) fn unknown_delay(&self) -> u32 {
        FURTHER_SAMPLES + libm::round(LATENCY * self.sample_rate).min(LATENCY_SAMPLES) as u32
    }

    fn deviating(&self, oil_stiffness: f64, pilot_time_constant: f64) -> Self {
        Self {
            compressibility: self.compressibility / oil_stiffness,
            pilot_time_constant: self.pilot_time_constant * pilot_time_constant,
            flow_gain: self.flow_gain * FLOW_GAIN,
            // A known latency replaces what is not known if it is longer.
            delay: self.samples().max(self.delay + self.unknown_delay()),
            latency: 0.0,
            ..self.clone()
        }
    }
}

impl ForceLoop {
    /// On plants of which the first is the one about rest.
    pub(super) fn new(gains: Gains, plants: &[Sampled]) -> Self {
        Self {
            proportional_gain: gains.proportional,
            derivative_gain: gains.derivative,
            integral_gain: gains.integral,
            plants: plants.to_vec(),
        }
    }

    /// These gains on another plant.
    #[cfg(test)]
    pub(crate) fn on(&self, plant: &HeldPiston) -> Self {
        Self::new(self.gains(), &plant.both_sampled())
    }

    /// The loop from force command (N) to measured force (N), opened after the load cell.
    pub fn open_loop(&self) -> StateSpace {
        self.plants[0].model(self.gains(), false)
    }

    /// The same, closed.
    pub fn closed_loop(&self) -> StateSpace {
        self.plants[0].model(self.gains(), true)
    }

    /// The margins.
    ///
    /// # Errors
    /// As [`StateSpace::poles`].
    pub fn margins(&self) -> Result<ForceLoopMargins> {
        let gains = self.gains();
        let mut least =
            ForceLoopMargins { gain: f64::INFINITY, delay: f64::INFINITY, damping: 1.0, e_max: 1.0 };
        for plant in &self.plants {
            least = ForceLoopMargins {
                gain: least.gain.min(plant.gain_margin(gains)?),
                delay: least.delay.min(plant.delay_margin(gains)),
                damping: least.damping.min(plant.damping(gains)?),
                e_max: least.e_max.min(plant.coprime_margin(gains)),
            };
        }
        Ok(least)
    }

    /// The least coprime margin (1).
    pub(super) fn coprime_margin(&self) -> f64 {
        self.plants.iter().map(|plant| plant.coprime_margin(self.gains())).fold(1.0, f64::min)
    }

    pub(super) fn gains(&self) -> Gains {
        Gains {
            proportional: self.proportional_gain,
            derivative: self.derivative_gain,
            integral: self.integral_gain,
        }
    }
}

#[cfg(test)]
pub(super) mod tests;
