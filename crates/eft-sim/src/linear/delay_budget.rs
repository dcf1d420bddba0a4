//! Where the delay comes from that the lead network has to give back.

use std::f64::consts::{PI, TAU};

use nalgebra::Complex;

use super::inverse_dynamics::valve_response;
use super::velocity::sensed_velocity_delay;
use crate::checks;
use crate::config::RigConfig;
use crate::error::{Error, Result};

/// Frequencies at which a phase is fitted.
const POINTS: usize = 400;

/// The parts of the delay between a velocity and the spool opening that answers it, in s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DelayBudget {
    /// The servovalve: slope of its phase over the band.
    pub valve: f64,
    /// The converter behind the compensation: half a sample of hold, and its delay.
    pub hold: f64,
    /// Computation: whole samples.
    pub computation: f64,
    /// The velocity sensor: the slope of its phase over the band, by filter and samples of delay; where the velocity is
    /// estimated, that of the estimate behind the sensors it is made of, negative where it leads.
    pub sensor: f64,
    /// Derivative action: `−G_d/G_p`, the lead that the paper takes off the valve's delay.
    pub derivative: f64,
    /// What the compensation itself passes through: valve, hold, computation and sensor.
    pub path: f64,
    /// All parts, as the paper counts.
    pub total: f64,
}

/// The delay budget of a rig at a sample rate (Hz), delays taken as phase slopes over a band (Hz).
///
/// It changes nothing: `compensation.response_delay` stays as it is. The derivative acts on the force error only,
/// so the motion is cancelled best with `path`; the paper's own tuning is `total`.
///
/// # Errors
/// An invalid sample rate or band.
pub fn delay_budget(rig: &RigConfig, sample_rate: f64, band: (f64, f64)) -> Result<DelayBudget> {
    checks::sample_rate("sample_rate", sample_rate)?;
    let period = 1.0 / sample_rate;
    let valve = phase_delay(|frequency| valve_response(rig, frequency), band)?;
    let hold = (0.5 + f64::from(rig.plant().dac.delay)) * period;
    let computation = f64::from(rig.compensation.computation_delay) * period;
    let sensor = sensed_velocity_delay(rig, sample_rate, band)?;
    let derivative = -rig.controller.derivative_gain / rig.controller.proportional_gain;
    let path = valve + hold + computation + sensor;
    Ok(DelayBudget { valve, hold, computation, sensor, derivative, path, total: path + derivative })
}

/// The delay (s) of a response over a band (Hz): the slope of its phase against frequency, fitted with an intercept
/// at evenly spaced frequencies, over −2π.
///
/// # Errors
/// A band that is not positive, ordered and finite.
pub fn phase_delay(response: impl Fn(f64) -> Complex<f64>, band: (f64, f64)) -> Result<f64> {
    let (low, high) = band;
    checks::finite("band", high, "Hz")?;
    if !(low >= 0.0 && high > low) {
        return Err(Error::value(
            "band",
            format!("({low}, {high})"),
            "must be two frequencies in Hz, the lower first",
        ));
    }
    let step = (high - low) / (POINTS - 1) as f64;
    let middle = 0.5 * (low + high);
    let (mut last, mut unwrapped) = (0.0, 0.0);
    let (mut product, mut square) = (0.0, 0.0);
    for i in 0..POINTS {
        let frequency = low + i as f64 * step;
        let phase = response(frequency).arg();
        let jump = phase - last;
        unwrapped += if i == 0 { phase } else { jump - TAU * ((jump + PI) / TAU).floor() };
        last = phase;
        product += (frequency - middle) * unwrapped;
        square += (frequency - middle) * (frequency - middle);
    }
    // No delay is 0, not −0.
    Ok((0.0 - product) / square / TAU)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pure_delay_is_found_through_many_turns() {
        let delay = phase_delay(|f| Complex::from_polar(0.3, 1.0 - TAU * f * 0.7), (0.25, 10.0)).unwrap();
        assert!((delay - 0.7).abs() < 1e-12);
        assert!(phase_delay(|_| Complex::new(1.0, 0.0), (2.0, 1.0)).is_err());
        assert!(phase_delay(|_| Complex::new(1.0, 0.0), (f64::NAN, 1.0)).is_err());
    }

    #[test]
    fn the_paper_s_rig_needs_what_it_was_tuned_to() {
        let rig = RigConfig::zhao2005();
        let band = (0.25, 10.0);
        let budget = delay_budget(&rig, 1e4, band).unwrap();
        // 2ζ/ω_n = 5.18 ms is the limit at zero frequency; the slope over the band lies 0.5 to 6 % below.
        assert!((4.87e-3..5.16e-3).contains(&budget.valve), "{budget:?}");
        assert_eq!((budget.hold, budget.computation, budget.sensor), (0.5e-4, 0.0, 0.0));
        assert!((budget.derivative + 0.2481e-3).abs() < 1e-6);
        assert!((budget.total - 5.0e-3).abs() < 0.1e-3, "the paper tuned to 5 ms");
        let rig = rig.with(|rig| {
            rig.compensation.computation_delay = 1;
            rig.dac.delay = 1;
            rig.sensors.velocity.delay = 1;
            rig.sensors.velocity.bandwidth = Some(200.0);
        });
        let slower = delay_budget(&rig.unwrap(), 1e4, band).unwrap();
        assert!((slower.path - budget.path - 3e-4 - 1.0 / (TAU * 200.0)).abs() < 3e-6);
    }
}
