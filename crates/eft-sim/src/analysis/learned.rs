//! The rig as self-calibration will have tuned it.

use std::f64::consts::TAU;

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

/// The rig after self-calibration at a sample rate (Hz), with the gains that were designed for the configured
/// rig. Its lead network has the phase and the amplitude that make valve, controller and velocity exact at the
/// frequency of the motion. What is not learned, such as the oil and the leakage of the feedforward, stays as configured.
///
/// # Errors
/// As [`linearize`]; a design that does not exist at this rate.
pub fn learned(rig: &RigConfig, sample_rate: f64) -> Result<RigConfig> {
    let calibrated = calibrated(rig, sample_rate)?;
    let motion = motion(&calibrated, sample_rate)?;
    let valve = valve_response(rig, motion.angular / TAU) / rig.compensation.valve_gain;
    let passed = valve * motion.used_over_true;
    // The velocity's delay that is found ends twice the configured response delay above the known one.
    let known = rig.compensation.velocity_delay + rig.velocity_delay(sample_rate)?;
    let found = known + 2.0 * rig.compensation.response_delay;
    let mut unfound = (-motion.used_over_true.arg() / motion.angular - found).max(0.0);
    let analog = rig.controller.realization == Realization::Analog;
    if analog && rig.controller.force_loop == ForceLoop::Pd {
        // The valve command is measured behind the converter, whose delay must be told.
        unfound += (f64::from(rig.plant().dac.delay) - f64::from(rig.dac.delay)) / sample_rate;
    }
    let budget = delay_budget(rig, sample_rate, BUDGET)?;
    let late = budget.hold + budget.computation - unfound;
    let lead = Lead::with_phase(motion.angular * late - passed.arg(), rig.compensation.lead_alpha);
    let level = rig.compensation.level;
    let share = if level > 0.0 { compensated_share(&calibrated)? / level } else { 1.0 };
    let found_level = level / (share * lead.amplitude * passed.norm());
    Ok(calibrated.varied(|values| {
        values.compensation.response_delay = (lead.delay / motion.angular).min(LONGEST);
        values.compensation.velocity_delay = 0.0;
        values.compensation.level = found_level;
    }))
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
struct Motion {
    /// In rad/s.
    angular: f64,
    /// The velocity in use over the true one, at this frequency.
    used_over_true: Complex<f64>,
}

fn motion(rig: &RigConfig, sample_rate: f64) -> Result<Motion> {
    let model = linearize(rig, FlowGain::Nominal, Time::Sampled(sample_rate))?;
    let row = |quantity: &str| model.outputs.iter().position(|name| name.starts_with(quantity));
    let rows: Vec<usize> = ["velocity", "measured_velocity"].into_iter().filter_map(row).collect();
    let responses = Responses::new(&model, &rows);
    let at = |frequency: f64| {
        let found = responses.at(Complex::from_polar(1.0, TAU * frequency / sample_rate));
        let found = found.ok_or_else(|| {
            Error::value("frequency of the motion", frequency, "must not lie on a pole of the model")
        })?;
        Ok::<_, Error>([found[(0, 0)], found[(1, 0)]])
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
        let delay = (2.0 * slope / (1.0 + root)).min(1.0 / curve.sqrt());
        Self { delay, amplitude: 1.0_f64.hypot(delay * (1.0 + lag)) / 1.0_f64.hypot(delay * lag) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::linear::lead_response;

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
