//! The rig as self-calibration will have tuned it.

use std::f64::consts::TAU;

use eft_core::learner_tuning::{
    DELAY_RATE, FLOW_GAIN_RATE, GATE_THRESHOLD, VALVE_GAIN_RATE, VELOCITY_DELAY_REACH,
};

use crate::analysis::linear::{
    Complex, FlowGain, Time, compensated_share, delay_budget, linearize, valve_response,
};
use crate::config::{ForceLoop, Realization, RigConfig};
use crate::error::{Error, Result};
use crate::state_space::Responses;

/// Band (Hz) of a motion, and the number of frequencies in it.
const MOTION: (f64, f64) = (0.2, 12.0);
const FREQUENCIES: i32 = 100;
/// Band (Hz) of the delay budget.
const BUDGET: (f64, f64) = (0.25, 10.0);
/// Longest response delay (s) that a rig may have.
const LONGEST: f64 = 1.0;
/// Share of the flow (1) by which the curve correction extends the lowest flow gain.
const BY_CURVE: f64 = 0.2;
/// Time (s) until the first windows have a motion to learn from.
const FIRST_WINDOWS: f64 = 0.1;
/// Number of times at which the growth of a loop that is being calibrated is found.
const TIMES: i32 = 6;
/// Samples of the shortest response delay.
const SHORTEST: f64 = 2.0;

/// An estimate that self-calibration needs and does not reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Unreached {
    /// Flow gain and valve gain over the configured ones (1): the learner takes the smaller flow for a fault of a sensor, and
    /// learns nothing.
    Rejected(f64, f64),
    /// A flow gain over the configured one (1), and its lowest.
    FlowGain(f64, f64),
    /// A valve gain over the configured one (1), and its lowest.
    ValveGain(f64, f64),
    /// A delay (s) of the lead network, and the nearest.
    Delay(f64, f64),
}

/// The rig after self-calibration at a sample rate (Hz), with the gains that were designed for the configured
/// rig. Its lead network has the phase and the amplitude that make valve, controller and velocity exact at the
/// frequency of the motion, as far as the estimates reach. What is not learned, such as the oil and the leakage of the
/// feedforward, stays as configured. The flow gain is that of a motion which is large beside an unknown lap, and this lap is
/// not in the result.
///
/// # Errors
/// As [`linearize`]; a design that does not exist at this rate.
pub fn learned(rig: &RigConfig, sample_rate: f64) -> Result<RigConfig> {
    Ok(after_learning(&rig.with_known_lap(), 1.0, sample_rate)?.0)
}

/// As [`learned`], and what self-calibration needs and does not reach. An excess of flow is not among it, because the guard then
/// reduces the level. The rig's flow has this gain (1) because of its openings; the estimate follows them as they grow.
pub(crate) fn after_learning(
    rig: &RigConfig,
    gain: f64,
    sample_rate: f64,
) -> Result<(RigConfig, Vec<Unreached>)> {
    let calibrated = calibrated(rig, sample_rate)?;
    let motion = motion(&calibrated, sample_rate)?;
    let valve = valve_response(rig, motion.angular / TAU) / rig.compensation.valve_gain;
    let passed = valve * motion.used_over_true;
    let level = rig.compensation.level;
    let share = if level > 0.0 { compensated_share(&calibrated)? / level } else { 1.0 };
    let (flow_gain, valve_gain) = (share * motion.used_over_true.norm(), valve.norm());
    let known = rig.compensation.velocity_delay + rig.velocity_delay(sample_rate)?;
    let first = flow_gain / gain;
    if first * valve_gain < 1.0 && unexplained(first, valve_gain) > GATE_THRESHOLD {
        let fixed = rig.with_fixed_gains(sample_rate)?.varied(|values| {
            values.compensation.adaptive = false;
            values.compensation.velocity_delay = known;
        });
        return Ok((fixed, vec![Unreached::Rejected(first, valve_gain)]));
    }
    let velocity_delay = -motion.used_over_true.arg() / motion.angular;
    let most = known + VELOCITY_DELAY_REACH[1] * rig.compensation.response_delay;
    let mut unfound = (velocity_delay - most).max(0.0);
    let analog = rig.controller.realization == Realization::Analog;
    if analog && rig.controller.force_loop == ForceLoop::Pd {
        // The valve command is measured behind the converter, whose delay must be told.
        unfound += (f64::from(rig.plant().dac.delay) - f64::from(rig.dac.delay)) / sample_rate;
    }
    let budget = delay_budget(rig, sample_rate, BUDGET)?;
    let late = budget.hold + budget.computation - unfound;
    let asked = Lead::with_phase(motion.angular * late - passed.arg(), rig.compensation.lead_alpha);
    let limits = &rig.compensation.learning;
    let response_delay = rig.compensation.response_delay;
    let shortest = (limits.shortest_delay * response_delay).max(SHORTEST / sample_rate);
    let longest =
        (limits.longest_delay * response_delay).max(shortest) + velocity_delay.clamp(0.0, most.max(0.0));
    let wanted = asked.delay / motion.angular;
    let delay = wanted.clamp(shortest, longest.max(shortest));
    let lead = Lead::with_delay(motion.angular * delay, rig.compensation.lead_alpha);
    let by_curve = if rig.compensation.corrects_curve() { 1.0 - BY_CURVE } else { 1.0 };
    let (least_flow, least_gain) = (by_curve * limits.lowest_flow_gain, limits.lowest_valve_gain);
    let reached = (flow_gain / least_flow).min(1.0) * (valve_gain / least_gain).min(1.0);
    let found_level = reached * level / (share * lead.amplitude * passed.norm());
    let unreached = [
        (flow_gain < least_flow).then_some(Unreached::FlowGain(flow_gain, limits.lowest_flow_gain)),
        (valve_gain < least_gain).then_some(Unreached::ValveGain(valve_gain, least_gain)),
        (delay != wanted).then_some(Unreached::Delay(wanted, delay)),
    ];
    let rig = calibrated.varied(|values| {
        values.compensation.response_delay = delay.min(LONGEST);
        values.compensation.velocity_delay = 0.0;
        values.compensation.level = found_level;
    });
    Ok((rig, unreached.into_iter().flatten().collect()))
}

/// Exponent (1) by which a deviation grows until self-calibration has found gains and delays, at the learner's largest rates and
/// at a sample rate (Hz); 0 for a loop that is stable at first.
///
/// # Errors
/// As [`learned`].
pub fn growth_until_learned(rig: &RigConfig, sample_rate: f64) -> Result<f64> {
    let told = rig.with_known_lap();
    let (learned, _) = after_learning(&told, 1.0, sample_rate)?;
    let (first, last) = (&rig.compensation, &learned.compensation);
    if first.level == 0.0 || last.level == 0.0 {
        return Ok(0.0);
    }
    let delays = [first.response_delay + first.velocity_delay, last.response_delay + last.velocity_delay];
    let (gain, delay) = (first.level / last.level, delays[1] - delays[0]);
    let valve_gain = valve_response(rig, 0.0).norm() / first.valve_gain;
    let flow_gain = gain / valve_gain;
    let for_flow = (flow_gain - 1.0).abs() / FLOW_GAIN_RATE;
    let for_valve = (valve_gain - 1.0).abs() / VALVE_GAIN_RATE;
    let for_delay = delay.abs() / (DELAY_RATE * first.response_delay);
    let duration = FIRST_WINDOWS + for_flow.max(for_valve).max(for_delay);
    let growth = |time: f64| {
        let found =
            |needed: f64| if needed > 0.0 { ((time - FIRST_WINDOWS) / needed).clamp(0.0, 1.0) } else { 1.0 };
        let rig = learned.varied(|values| {
            let flow_gain = 1.0 + (flow_gain - 1.0) * found(for_flow);
            let valve_gain = 1.0 + (valve_gain - 1.0) * found(for_valve);
            values.compensation.level = first.level / (flow_gain * valve_gain);
            values.compensation.response_delay = delays[0] + delay * found(for_delay);
        });
        linearize(&rig, FlowGain::Mean, Time::Sampled(sample_rate))?.growth_rate()
    };
    if growth(0.0)? <= 0.0 {
        return Ok(0.0);
    }
    let rates = (0..TIMES).map(|i| Ok(growth(duration * (f64::from(i) + 0.5) / f64::from(TIMES))?.max(0.0)));
    Ok(rates.sum::<Result<f64>>()? * duration / f64::from(TIMES))
}

/// Squared error of the learner's models of flow and spool before it has learned these gains (1), as a share of the signals'
/// squares (1).
fn unexplained(flow_gain: f64, valve_gain: f64) -> f64 {
    let spool = valve_gain * valve_gain;
    let error = (flow_gain - 1.0).powi(2) * spool + (valve_gain - 1.0).powi(2);
    error / (flow_gain * flow_gain * spool + 2.0 * spool + 1.0)
}

/// The rig without estimators, and with the flow curve as far as the controller corrects it.
fn calibrated(rig: &RigConfig, sample_rate: f64) -> Result<RigConfig> {
    let table = (!rig.compensation.corrects_curve()).then(|| rig.plant().servovalve.flow_table.clone());
    Ok(rig.with_fixed_gains(sample_rate)?.varied(|values| {
        values.compensation.adaptive = false;
        if table.is_some() {
            values.servovalve.true_flow_table.clone_from(&table);
        }
    }))
}

/// Root-mean-square frequency of a motion.
pub(super) struct Motion {
    /// In rad/s.
    pub(super) angular: f64,
    /// The velocity in use over the true one, at this frequency.
    pub(super) used_over_true: Complex<f64>,
}

pub(super) fn motion(rig: &RigConfig, sample_rate: f64) -> Result<Motion> {
    let model = linearize(rig, FlowGain::Nominal, Time::Sampled(sample_rate))?;
    // In a building that of the top floor under its own force, which is mostly that of the first mode. All controllers are taken
    // to learn the same.
    let row = |quantity: &str| model.outputs.iter().rposition(|name| name.starts_with(quantity));
    let rows: Vec<usize> = ["velocity", "measured_velocity"].into_iter().filter_map(row).collect();
    let responses = Responses::new(&model, &rows);
    let top = model.inputs.len().saturating_sub(1);
    let at = |frequency: f64| {
        let found = responses.at(Complex::from_polar(1.0, TAU * frequency / sample_rate));
        let found = found.ok_or_else(|| {
            Error::value("frequency of the motion", frequency, "must not lie on a pole of the model")
        })?;
        Ok::<_, Error>([found[(0, top)], found[(1, top)]])
    };
    let (mut moments, mut squares) = (0.0, 0.0);
    for i in 0..FREQUENCIES {
        let along = f64::from(i) / f64::from(FREQUENCIES - 1);
        let frequency = MOTION.0 * (MOTION.1 / MOTION.0).powf(along);
        let square = at(frequency)?[0].norm_sqr();
        moments += square * frequency * frequency;
        squares += square;
    }
    let frequency = (moments / squares).sqrt();
    let [true_velocity, used] = at(frequency)?;
    Ok(Motion { angular: TAU * frequency, used_over_true: used / true_velocity })
}

/// A lead network at one frequency.
struct Lead {
    /// Its delay times the frequency (rad).
    delay: f64,
    amplitude: f64,
}

impl Lead {
    /// The network with a phase (rad), as far as it reaches.
    fn with_phase(phase: f64, alpha: f64) -> Self {
        if phase <= 0.0 {
            return Self { delay: 0.0, amplitude: 1.0 };
        }
        let lag = alpha / (1.0 - alpha);
        // tan(phase) = x/(1 + lag·(1 + lag)·x²); beyond the largest phase x is that of the largest.
        let (slope, curve) = (phase.min(1.5).tan(), lag * (1.0 + lag));
        let root = (1.0 - 4.0 * slope * slope * curve).max(0.0).sqrt();
        Self::with_delay((2.0 * slope / (1.0 + root)).min(1.0 / curve.sqrt()), alpha)
    }

    /// The network with a delay times the frequency (rad).
    fn with_delay(delay: f64, alpha: f64) -> Self {
        let lag = alpha / (1.0 - alpha);
        Self { delay, amplitude: 1.0_f64.hypot(delay * (1.0 + lag)) / 1.0_f64.hypot(delay * lag) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::guarded;
    use crate::analysis::linear::lead_response;

    #[test]
    fn a_lap_that_nobody_knows_changes_neither_learned_nor_guarded_level() {
        let level = |overlap: f64, adaptive: bool| {
            let rig = RigConfig::zhao2005().replace(&[
                ("compensation.guard", true.into()),
                ("compensation.adaptive", adaptive.into()),
                ("servovalve.flow_gain_scale", 1.2.into()),
                ("truth.servovalve.overlap", overlap.into()),
            ]);
            let rig = rig.unwrap();
            let tuned =
                if adaptive { learned(&rig, 4096.0) } else { guarded(&rig, 4096.0).map(Option::unwrap) };
            tuned.unwrap().compensation.level
        };
        for adaptive in [true, false] {
            let (with, without) = (level(-1e-3, adaptive), level(0.0, adaptive));
            assert!((with - without).abs() < 1e-9 && without < 0.9, "{adaptive}: {with} {without}");
        }
    }

    #[test]
    fn a_lead_has_the_phase_that_was_asked_for() {
        for (phase, alpha) in [(0.05, 0.1), (0.3, 0.1), (0.4, 0.01), (0.2, 0.3)] {
            let lead = Lead::with_phase(phase, alpha);
            let rig = RigConfig::zhao2005().replace(&[
                ("compensation.response_delay", (lead.delay / (TAU * 3.0)).into()),
                ("compensation.lead_alpha", alpha.into()),
            ]);
            let rig = rig.unwrap();
            let passed = lead_response(&rig, 3.0) / lead_response(&rig, 0.0);
            assert!((passed.arg() - phase).abs() < 1e-12, "{phase} {alpha}: {}", passed.arg());
            assert!((passed.norm() - lead.amplitude).abs() < 1e-12);
        }
        // The largest phase of this network is 55 degrees.
        let most = Lead::with_phase(1.2, 0.1).delay;
        assert!((most - Lead::with_phase(1.4, 0.1).delay).abs() < 1e-12);
    }
}
