//! The estimates of self-calibration on their way to the learned ones.

use eft_core::learner_tuning::{DELAY_RATE, FLOW_GAIN_RATE, VALVE_GAIN_RATE};

use crate::analysis::learned::after_learning;
use crate::analysis::linear::{FlowGain, Time, linearize, valve_response};
use crate::{Result, RigConfig};

/// Time (s) until the first windows have a motion to learn from.
const FIRST_WINDOWS: f64 = 0.1;
/// Number of times at which the growth of a loop that is being calibrated is found.
const TIMES: i32 = 6;

/// Self-calibration from the configured gains and delays to the learned ones, at the largest rates.
pub(crate) struct Adaptation {
    learned: RigConfig,
    level: f64,
    flow_gain: f64,
    valve_gain: f64,
    /// Delays (s) that the lead network compensates for, first and last.
    delays: [f64; 2],
    /// Times (s) that flow gain, valve gain and delays need.
    needed: [f64; 3],
    /// Flow gain (1) of a small opening over that of the test's, as far as a guard acts on it.
    pub(crate) small_gain: f64,
}

impl Adaptation {
    /// From a rig to the same rig [after learning](after_learning), at a sample rate (Hz).
    ///
    /// # Errors
    /// As [`RigConfig::velocity_delay`].
    pub(crate) fn of(rig: &RigConfig, learned: &RigConfig, sample_rate: f64) -> Result<Self> {
        let (first, last) = (&rig.compensation, &learned.compensation);
        let delays = [rig.first_lead(sample_rate)?, last.lead_delay()];
        let gain = if last.level > 0.0 { first.level / last.level } else { 1.0 };
        let valve_gain = valve_response(rig, 0.0).norm() / first.valve_gain;
        let flow_gain = gain / valve_gain;
        let needed = [
            (flow_gain - 1.0).abs() / FLOW_GAIN_RATE,
            (valve_gain - 1.0).abs() / VALVE_GAIN_RATE,
            (delays[1] - delays[0]).abs() / (DELAY_RATE * first.response_delay),
        ];
        let (learned, level) = (learned.clone(), first.level);
        Ok(Self { learned, level, flow_gain, valve_gain, delays, needed, small_gain: 1.0 })
    }

    /// Of a rig with a guard that learns nothing. Its flow has this gain (1) because of its openings.
    pub(crate) fn of_guard(rig: &RigConfig, gain: f64) -> Self {
        Self {
            learned: rig.clone(),
            level: rig.compensation.level,
            flow_gain: 1.0,
            valve_gain: 1.0,
            delays: [rig.compensation.lead_delay(); 2],
            needed: [0.0; 3],
            small_gain: 1.0 / gain.min(1.0),
        }
    }

    /// Time (s) of learning.
    pub(crate) fn duration(&self) -> f64 {
        FIRST_WINDOWS + self.needed.into_iter().fold(0.0, f64::max)
    }

    /// The rig after a time (s) of learning.
    pub(crate) fn after(&self, time: f64) -> RigConfig {
        let time = time - FIRST_WINDOWS;
        let found = |needed: f64| if needed > 0.0 { (time / needed).clamp(0.0, 1.0) } else { 1.0 };
        let [of_flow, of_valve, of_delay] = self.needed.map(found);
        let flow_gain = 1.0 + (self.flow_gain - 1.0) * of_flow;
        let valve_gain = 1.0 + (self.valve_gain - 1.0) * of_valve;
        let delay = self.delays[0] + (self.delays[1] - self.delays[0]) * of_delay;
        self.learned.varied(|values| {
            values.compensation.level = self.level / (flow_gain * valve_gain);
            values.compensation.response_delay = delay - values.compensation.velocity_delay;
        })
    }
}

/// Exponent (1) by which a deviation grows until self-calibration has found gains and delays, at the learner's largest
/// rates and at a sample rate (Hz); 0 for a loop that is stable at first.
///
/// # Errors
/// As [`learned`](super::learned()).
pub fn growth_until_learned(rig: &RigConfig, sample_rate: f64) -> Result<f64> {
    let (learned, _) = after_learning(rig, 1.0, sample_rate)?;
    if rig.compensation.level == 0.0 || learned.compensation.level == 0.0 {
        return Ok(0.0);
    }
    let adaptation = Adaptation::of(rig, &learned, sample_rate)?;
    let growth = |time: f64| {
        linearize(&adaptation.after(time), FlowGain::Mean, Time::Sampled(sample_rate))?.growth_rate()
    };
    if growth(0.0)? <= 0.0 {
        return Ok(0.0);
    }
    let step = adaptation.duration() / f64::from(TIMES);
    let rates = (0..TIMES).map(|i| Ok(growth(step * (f64::from(i) + 0.5))?.max(0.0)));
    Ok(rates.sum::<Result<f64>>()? * step)
}
