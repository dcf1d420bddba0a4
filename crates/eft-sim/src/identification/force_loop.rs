//! Valve, oil and sensor latencies of a force loop, from one test of the whole rig.
//!
//! The valve command is the only signal without a latency. The spool follows it as
//! `g·exp(−s·δ_s)/(1 + s·T·(1 + s·τ))`, Eqs. (2) and (3), with the latency `δ_s` of its sensor. The
//! [flow balance](super::flow_balance) has the compressibility and the delay of the force behind the spool: above the
//! frequencies of the motion the oil's compression takes most of the flow.

use std::f64::consts::{PI, TAU};

use toml::Value;

use super::Estimate;
use super::flow_balance::{LEAST_EXCITATION, MotionSignals, OIL_BAND, excitation, fitted};
use super::gaps::{check_whole, detrend};
use super::least_squares::least_squares;
use crate::config::{Realization, RigConfig};
use crate::fourier::{Complex64, spectrum};
use crate::{Error, Result, checks};

/// Frequencies (Hz) at which the valve's response is fitted.
const VALVE_BAND: (f64, f64) = (1.0, 200.0);
/// Length (s) of the parts whose means are the valve's response.
const PART: f64 = 1.0;
/// Unit (s) of the time constants in the fit, so that all unknowns are of similar size.
const UNIT: f64 = 1e-3;
/// Least sample rate (Hz), for both bands.
const LEAST_RATE: f64 = 600.0;
const ITERATIONS: usize = 12;
/// Errors (1) of an identified plant that the designed loop allows for.
const IDENTIFIED_WITHIN: f64 = 0.2;

/// What a force loop depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceLoopEstimate {
    /// Latency (s) of the load cell.
    pub force_delay: Estimate,
    /// Latency (s) of the spool's sensor.
    pub spool_delay: Estimate,
    /// Delay (s) of the spool itself behind the valve command at low frequency.
    pub response_delay: Estimate,
    /// Pilot time constant `τ` (s).
    pub pilot_time_constant: Estimate,
    /// Compressibility of the oil (m³/Pa).
    pub compressibility: Estimate,
}

impl ForceLoopEstimate {
    /// The keys of a rig that take these values. A friction keeps its flow, which the compressibility scales. The rig counts as
    /// identified if two deviations of oil and pilot time constant are within what the design allows for.
    pub fn keys(&self, rig: &RigConfig) -> [(&'static str, Value); 6] {
        let (valve, actuator) = (&rig.servovalve, &rig.actuator);
        let pilot_flow_gain = valve.spool_area / (valve.spool_sensitivity * self.response_delay.value);
        let compressibility =
            self.compressibility.value + actuator.compressibility - rig.measured_compressibility();
        let friction = actuator.friction * actuator.compressibility / compressibility;
        [
            ("controller.force_delay", self.force_delay.value.max(0.0).into()),
            ("controller.identified_plant", self.is_certain().into()),
            ("servovalve.pilot_time_constant", self.pilot_time_constant.value.into()),
            ("servovalve.pilot_flow_gain", pilot_flow_gain.into()),
            ("actuator.compressibility", compressibility.into()),
            ("actuator.friction", friction.into()),
        ]
    }

    fn is_certain(&self) -> bool {
        [self.compressibility, self.pilot_time_constant]
            .iter()
            .all(|one| 2.0 * one.uncertainty <= IDENTIFIED_WITHIN * one.value)
    }
}

/// Valve, oil and latencies from a test, with the signals as the controller samples them at a rate (Hz). A sweep from 0
/// to 40 Hz or more is best.
///
/// A configured torque motor and the hold of a digital valve command count to the valve. The valve must have the form
/// of the paper's: a further lag of the valve counts to the sensors.
///
/// # Errors
/// Unequal, too short or incomplete signals, a spool that does not follow the valve command, flows of another size than
/// those of the configured valve, a sample rate below 600 Hz, or a test without the frequencies of the fit.
pub fn identify_force_loop(
    rig: &RigConfig,
    valve_command: &[f64],
    signals: MotionSignals<'_>,
    sample_rate: f64,
) -> Result<ForceLoopEstimate> {
    checks::sample_rate("sample_rate", sample_rate)?;
    signals.check(sample_rate)?;
    check_whole(&[("valve_command", valve_command), ("spool", signals.spool)], 1)?;
    let allowed = format!("must be at least {LEAST_RATE} Hz");
    checks::require(sample_rate >= LEAST_RATE, "sample_rate", sample_rate, allowed)?;
    check_excitation(signals.force, sample_rate)?;
    let [spool_delay, response_delay, pilot_time_constant] =
        of_spool(rig, valve_command, signals.spool, sample_rate)?;
    let [_, _, _, oil, .., behind] = fitted::<8>(rig, signals, sample_rate, OIL_BAND)?;
    let force_delay =
        Estimate::new(spool_delay.value + behind.value, spool_delay.uncertainty.hypot(behind.uncertainty));
    let compressibility = oil.times(rig.actuator.compressibility);
    let attached = rig.measured_compressibility() - rig.actuator.compressibility;
    let name = "actuator.attachment_stiffness as m³/Pa";
    let allowed =
        format!("must leave more than 0 of the measured {:.3e} m³/Pa to the oil", compressibility.value);
    checks::require(compressibility.value > attached, name, attached, allowed)?;
    Ok(ForceLoopEstimate { force_delay, spool_delay, response_delay, pilot_time_constant, compressibility })
}

/// Refuses a force that is noise in the oil's band.
fn check_excitation(force: &[f64], sample_rate: f64) -> Result<()> {
    let ratio = excitation(force, sample_rate)?;
    // No number if the force is zero.
    let found = format!("spectral density {ratio:.1} times that of the noise");
    let (low, high) = OIL_BAND;
    let allowed =
        format!("must be {LEAST_EXCITATION} times from {low} to {high} Hz: run a sweep to {high} Hz");
    checks::require(ratio >= LEAST_EXCITATION, "force", found, allowed)
}

/// The latency of the spool's sensor, the valve's delay and its pilot time constant, by Gauss–Newton steps.
fn of_spool(
    rig: &RigConfig,
    valve_command: &[f64],
    spool: &[f64],
    sample_rate: f64,
) -> Result<[Estimate; 3]> {
    let hold = match rig.controller.realization {
        Realization::Digital => 0.5 / sample_rate,
        Realization::Analog => 0.0,
    };
    let motor = rig.servovalve.torque_motor_frequency.map(|frequency| TAU * frequency);
    let refused = || {
        let allowed = "must follow the valve command with the response of a three-stage valve";
        Error::value("spool", "no response of this form", allowed)
    };
    // The response without what is known of the valve.
    let responses: Vec<_> = response(valve_command, spool, sample_rate)?
        .into_iter()
        .map(|(frequency, response, weight)| {
            let s = Complex64::new(0.0, TAU * frequency);
            let motor = motor.map_or(Complex64::from(1.0), |motor| {
                let s = s / motor;
                s * s + s * (2.0 * rig.servovalve.torque_motor_damping) + 1.0
            });
            (s, response * (s * hold).exp() * motor, weight)
        })
        .collect();
    // The fit is of the inverse's coefficients, and begins with the configured valve.
    let gain = responses.first().ok_or_else(refused)?.1.norm().recip();
    let (time, lag) = (rig.compensation.response_delay, rig.servovalve.pilot_time_constant);
    let (mut inverse, mut delay) = ([gain, gain * time / UNIT, gain * time * lag / (UNIT * UNIT)], 0.0);
    let mut uncertainty = [f64::NAN; 3];
    for _ in 0..ITERATIONS {
        let rows = responses.iter().map(|&(s, response, weight)| {
            let (late, s) = ((s * -delay).exp(), s * UNIT);
            let denominator = s * s * inverse[2] + s * inverse[1] + inverse[0];
            let model = late / denominator;
            let weight = weight / model.norm();
            let slope = model / denominator * -weight;
            ([slope, slope * s, slope * s * s, model * s * -weight], (response - model) * weight)
        });
        let steps = least_squares::<4>(rows).ok_or_else(refused)?;
        for (one, step) in inverse.iter_mut().zip(&steps) {
            *one += step.value;
        }
        delay += UNIT * steps[3].value;
        // Latency, delay and time constant; a quotient has the uncertainty of its numerator.
        let shares = [1.0, inverse[0], inverse[1]];
        uncertainty = [3, 1, 2].map(|i| UNIT * steps[i].uncertainty);
        uncertainty.iter_mut().zip(shares).for_each(|(one, share)| *one = (*one / share).abs());
    }
    let values = [delay, UNIT * inverse[1] / inverse[0], UNIT * inverse[2] / inverse[1]];
    if !(values[0].abs() < 0.1 && values[1..].iter().all(|&time| time > 0.0 && time < 0.1)) {
        return Err(refused());
    }
    Ok(std::array::from_fn(|i| Estimate::new(values[i], uncertainty[i])))
}

/// Frequency (Hz), spool over valve command (1/V), and weight, by Welch's means over halfway overlapping parts.
fn response(valve_command: &[f64], spool: &[f64], sample_rate: f64) -> Result<Vec<(f64, Complex64, f64)>> {
    // A mean would leak into the lowest frequency.
    let [valve_command, spool] = [valve_command, spool].map(|signal| detrend(signal, |_| 1.0));
    let length = (PART * sample_rate).round() as usize;
    let window: Vec<f64> = (0..length).map(|i| (PI * i as f64 / length as f64).sin().powi(2)).collect();
    let bins = length / 2 + 1;
    let (mut cross, mut powers) = (vec![Complex64::default(); bins], vec![[0.0; 2]; bins]);
    for start in (0..=valve_command.len() - length).step_by(length / 2) {
        let windowed = |signal: &[f64]| {
            let part = &signal[start..start + length];
            spectrum(&part.iter().zip(&window).map(|(x, w)| x * w).collect::<Vec<_>>())
        };
        let (command, spool) = (windowed(&valve_command)?, windowed(&spool)?);
        for k in 0..bins {
            cross[k] += spool[k] * command[k].conj();
            powers[k][0] += command[k].norm_sqr();
            powers[k][1] += spool[k].norm_sqr();
        }
    }
    let width = sample_rate / length as f64;
    let (first, last) = ((VALVE_BAND.0 / width).ceil() as usize, (VALVE_BAND.1 / width) as usize);
    let means = (first..=last.min(2 * bins / 3)).filter_map(|k| {
        let [of_command, of_spool] = powers[k];
        let coherence = cross[k].norm_sqr() / (of_command * of_spool);
        // The relative variance of a mean is that of its incoherent part.
        let weight = (coherence / (1.0 - coherence).max(1e-6)).sqrt();
        weight.is_finite().then(|| (k as f64 * width, cross[k] / of_command, weight))
    });
    Ok(means.collect())
}
