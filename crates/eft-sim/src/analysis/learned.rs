//! The rig as self-calibration will have tuned it.

use std::f64::consts::{FRAC_PI_4, TAU};

use eft_core::learner_tuning::{
    CURVE_DEPARTURE, GATE_CAUTION, GATE_SIGNAL, GATE_THRESHOLD, LOW_PASS, SHORTEST_DELAY,
    VELOCITY_DELAY_REACH,
};
use eft_core::window_ticks;

use crate::Result;
use crate::analysis::guarded::after_guard;
use crate::analysis::linear::{compensated_share, deviation, sampling_delays, valve_response};
use crate::analysis::motion::motion;
use crate::config::{Realization, RigConfig, VelocitySource};

/// Longest response delay (s) that a rig may have.
const LONGEST: f64 = 1.0;
/// Noise over its standard deviation (1) that the gate meets in a test.
const LARGEST_NOISE: f64 = 4.0;

/// An estimate that self-calibration needs and does not reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Unreached {
    /// Flow gain and valve gain over the configured ones (1): the learner takes such a difference for the fault of a
    /// sensor, and learns nothing. Its guard reduces the level.
    Rejected(f64, f64),
    /// Flow gain and valve gain over the configured ones (1), which the learner accepts without noise of the
    /// sensors. With it, up to this root-mean-square opening (1) of a test, it may reject them all through.
    Doubtful(f64, f64, f64),
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
/// As [`linearize`](crate::analysis::linear::linearize); a design that does not exist at this rate.
pub fn learned(rig: &RigConfig, sample_rate: f64) -> Result<RigConfig> {
    let (rig, _) = after_learning(rig, 1.0, sample_rate)?;
    Ok(after_guard(&rig, 1.0, sample_rate)?.map_or(rig, |guarded| guarded.rig))
}

/// As [`learned`], and what self-calibration needs and does not reach. A flow beyond the largest gain is not among it,
/// because the guard then reduces the level. The rig's flow has this gain (1) because of its openings; the estimate
/// follows them as they grow.
pub(crate) fn after_learning(
    rig: &RigConfig,
    gain: f64,
    sample_rate: f64,
) -> Result<(RigConfig, Vec<Unreached>)> {
    let lap = rig.plant().servovalve.overlap - rig.compensated_lap();
    let rig = &rig.with_known_lap(sample_rate)?;
    let calibrated = calibrated(rig, sample_rate)?;
    let level = rig.compensation.level;
    let share = if level > 0.0 { compensated_share(&calibrated)? / level } else { 1.0 };
    let valve_at = |frequency: f64| valve_response(rig, frequency) / rig.compensation.valve_gain;
    // The estimates that last are those from the motion with learned gains.
    let with_gains = calibrated.varied(|values| values.compensation.level /= share * valve_at(0.0).norm());
    let motion = motion(&with_gains, sample_rate)?;
    let valve = valve_at(motion.angular / TAU);
    let passed = valve * motion.used_over_true;
    let (flow_gain, valve_gain) = (share * motion.used_over_true.norm(), valve.norm());
    let known = rig.compensation.velocity_delay + rig.velocity_delay(sample_rate)?;
    let first = flow_gain / gain;
    let limits = &rig.compensation.learning;
    let judged = judged_opening(limits.excitation);
    let at_first = first * (1.0 - lap / judged).max(0.0);
    if rejected(at_first, first, valve_gain) {
        let fixed = rig.with_fixed_gains(sample_rate)?.varied(|values| {
            values.compensation.adaptive = false;
            values.compensation.guard = true;
            values.compensation.velocity_delay = known;
        });
        return Ok((fixed, vec![Unreached::Rejected(first, valve_gain)]));
    }
    let noise = LARGEST_NOISE * noise_in_band(rig, sample_rate);
    let rejects = noise > 0.0 && noise > judged * tolerated_noise(GATE_THRESHOLD, at_first, valve_gain);
    let after = tolerated_noise(GATE_CAUTION * GATE_THRESHOLD, first, valve_gain);
    let recovers_at = if after > 0.0 { noise / after } else { f64::INFINITY };
    let velocity_delay = -motion.used_over_true.arg() / motion.angular;
    let most = known + VELOCITY_DELAY_REACH[1] * rig.compensation.response_delay;
    let mut unfound = (velocity_delay - most).max(0.0);
    if rig.controller.realization == Realization::Analog {
        // The valve command is measured behind the converter, whose delay must be told.
        unfound += (f64::from(rig.plant().dac.delay) - f64::from(rig.dac.delay)) / sample_rate;
    }
    let [hold, computation] = sampling_delays(rig, sample_rate);
    let late = hold + computation - unfound;
    let asked = Lead::with_phase(motion.angular * late - passed.arg(), rig.compensation.lead_alpha);
    let response_delay = rig.compensation.response_delay;
    let shortest = (limits.shortest_delay * response_delay).max(SHORTEST_DELAY / sample_rate);
    let longest =
        (limits.longest_delay * response_delay).max(shortest) + velocity_delay.clamp(0.0, most.max(0.0));
    let wanted = asked.delay / motion.angular;
    let delay = wanted.clamp(shortest, longest.max(shortest));
    let lead = Lead::with_delay(motion.angular * delay, rig.compensation.lead_alpha);
    let by_curve = if rig.compensation.corrects_curve() { 1.0 - CURVE_DEPARTURE } else { 1.0 };
    let (least_flow, least_gain) = (by_curve * limits.lowest_flow_gain, limits.lowest_valve_gain);
    let reached = (flow_gain / least_flow).min(1.0) * (valve_gain / least_gain).min(1.0);
    let found_level = reached * level / (share * lead.amplitude * passed.norm());
    let unreached = [
        rejects.then_some(Unreached::Doubtful(first, valve_gain, recovers_at)),
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

/// Root-mean-square opening (1) from which on the gate rejects, where something is learned from this opening (1) on. Four signals
/// of the gate follow the opening.
fn judged_opening(excitation: f64) -> f64 {
    (GATE_SIGNAL / 4.0).sqrt() * excitation
}

/// Whether the learner's gate refuses the second flow gain (1) all through a test, of which it judges the first one
/// at first.
fn rejected(at_first: f64, flow_gain: f64, valve_gain: f64) -> bool {
    // A flow that is on the other side of the configured one at first is accepted on its way.
    let passes = (at_first - 1.0) * (flow_gain - 1.0) < 0.0;
    // After one rejection the gate allows less.
    let refuses = |allowed, flow_gain| tolerated_noise(allowed, flow_gain, valve_gain) < 0.0;
    !passes && refuses(GATE_THRESHOLD, at_first) && refuses(GATE_CAUTION * GATE_THRESHOLD, flow_gain)
}

/// Noise over the root-mean-square opening (1) up to which a gate with this threshold (1) accepts these gains (1).
/// Their error and the noise may have the same sign for as long as the gate averages, so amplitudes add. Negative
/// for gains that it refuses.
fn tolerated_noise(threshold: f64, flow_gain: f64, valve_gain: f64) -> f64 {
    2.0 * (threshold.sqrt() - unexplained(flow_gain, valve_gain).sqrt())
}

/// Standard deviation of the sensors' noise in the band of the flow model, as an opening (1).
fn noise_in_band(rig: &RigConfig, sample_rate: f64) -> f64 {
    let (sensors, known) = (&rig.plant().sensors, &rig.actuator);
    let per_velocity = known.piston_area / rig.compensation.flow_gain;
    let per_force = known.compressibility / (known.piston_area * rig.compensation.flow_gain);
    // Shares of the variance of white noise that pass two low-passes, and with a derivative.
    let passed = 2.0 * FRAC_PI_4 * LOW_PASS / sample_rate;
    let rate = passed * (TAU * LOW_PASS) * (TAU * LOW_PASS);
    let moving = match rig.controller.velocity_source {
        VelocitySource::Sensor => passed * deviation(&sensors.velocity).powi(2),
        _ => rate * deviation(&sensors.displacement).powi(2),
    };
    // The change of the force is that between two ticks, a window apart.
    let force = f64::from(window_ticks(sample_rate)) * rate * deviation(&sensors.force).powi(2);
    let spool = passed * deviation(&sensors.spool).powi(2);
    (spool + per_velocity * per_velocity * moving + per_force * per_force * force).sqrt()
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
    fn a_lap_makes_the_gate_refuse_gains_that_it_would_accept() {
        for (flow_gain, lap, refused) in [
            (0.66, 0.0, true),
            (0.7, 0.0, false),
            (1.37, 0.0, false),
            (1.4, 0.0, true),
            (0.78, 0.5, false),
            (0.76, 0.5, true),
            (1.24, -0.5, false),
            (1.28, -0.5, true),
            (1.5, 0.5, false),
            (1.45, 0.1, false),
            (0.6, -1.0, false),
        ] {
            let at_first = flow_gain * (1.0 - lap);
            assert_eq!(rejected(at_first, flow_gain, 1.0), refused, "{flow_gain} {lap}");
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
