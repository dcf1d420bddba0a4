//! The parts of the delay that the lead network must compensate for.

use super::inverse_dynamics::valve_response;
use super::velocity::sensed_velocity_delay;
use crate::design::phase_delay;
use crate::{Result, RigConfig, checks};

/// The parts of the delay between a velocity and the spool opening that compensates it, in s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DelayBudget {
    /// The servovalve: slope of its phase over the band.
    pub valve: f64,
    /// The converter after the compensation: half a sample of hold, and the converter's delay.
    pub hold: f64,
    /// Computation: whole samples.
    pub computation: f64,
    /// The velocity sensor: the slope of its phase over the band, from filter and samples of delay. For an
    /// estimated velocity it is the slope of the estimate with its sensors, negative if the estimate leads.
    pub sensor: f64,
    /// Derivative action: `−G_d/G_p`, the lead that the paper subtracts from the valve's delay.
    pub derivative: f64,
    /// Delay of the compensation's own path: valve, hold, computation and sensor.
    pub path: f64,
    /// The sum of all parts, as in the paper.
    pub total: f64,
}

/// The delay budget of a rig at a sample rate (Hz). Delays are phase slopes over a band (Hz).
///
/// The function does not change `compensation.response_delay`. The derivative acts on the force error only,
/// so `path` cancels the motion best; the paper's own tuning is `total`.
///
/// # Errors
/// An invalid sample rate or band.
pub fn delay_budget(rig: &RigConfig, sample_rate: f64, band: (f64, f64)) -> Result<DelayBudget> {
    checks::sample_rate("sample_rate", sample_rate)?;
    let valve = phase_delay(|frequency| valve_response(rig, frequency), band)?;
    let [hold, computation] = sampling_delays(rig, sample_rate);
    let sensor = sensed_velocity_delay(rig, sample_rate, band)?;
    let derivative = -rig.controller.derivative_gain / rig.controller.proportional_gain;
    let path = valve + hold + computation + sensor;
    Ok(DelayBudget { valve, hold, computation, sensor, derivative, path, total: path + derivative })
}

/// Delays (s) of the converter with its hold, and of the computation, at a sample rate (Hz).
pub(crate) fn sampling_delays(rig: &RigConfig, sample_rate: f64) -> [f64; 2] {
    let period = 1.0 / sample_rate;
    [0.5 + f64::from(rig.plant().dac.delay), f64::from(rig.compensation.computation_delay)]
        .map(|samples| samples * period)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn the_papers_rig_has_the_delay_that_it_was_tuned_to() {
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
