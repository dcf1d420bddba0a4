//! The servovalve and its inverse, each alone (Fig. 6 of the paper).

use std::f64::consts::TAU;

use nalgebra::Complex;

use crate::config::RigConfig;

/// Spool opening of the true valve per valve command (1/V) at a frequency (Hz), Eq. (4): torque
/// motor, pilot stage and spool with their inner loop.
#[must_use]
pub fn valve_response(rig: &RigConfig, frequency: f64) -> Complex<f64> {
    let valve = &rig.plant().servovalve;
    let s = Complex::new(0.0, TAU * frequency);
    let pilot = (s * valve.pilot_time_constant + 1.0).inv() * valve.pilot_flow_gain;
    let motor = valve.torque_motor_frequency.map_or(Complex::ONE, |natural| {
        let s = s / (TAU * natural);
        (s * s + s * (2.0 * valve.torque_motor_damping) + 1.0).inv()
    });
    let flow = motor * pilot;
    let moved = s * (valve.spool_area * valve.spool_stroke);
    flow / (moved + flow * (valve.spool_sensitivity * valve.spool_stroke))
}

/// Valve command per required opening (V) at a frequency (Hz), Eq. (8): the lead network, without the factor
/// `1/G_p` for the servovalve controller.
#[must_use]
pub fn lead_response(rig: &RigConfig, frequency: f64) -> Complex<f64> {
    let compensation = &rig.compensation;
    let s = Complex::new(0.0, TAU * frequency);
    let lead_time = compensation.lead_delay() / (1.0 - compensation.lead_alpha);
    (s * lead_time + 1.0) / (s * (compensation.lead_alpha * lead_time) + 1.0) / compensation.valve_gain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lead_times_valve_is_nearly_one_to_20_hz() {
        let rig = RigConfig::zhao2005();
        let combined = |frequency| lead_response(&rig, frequency) * valve_response(&rig, frequency);
        // Relative to rest, where the valve's gain is 0.1001, slightly different from the K_s by which the
        // lead divides.
        let rest = combined(0.0).norm();
        for (frequency, gain, degrees) in [(10.0, 1.033, -1.27), (20.0, 1.107, -5.4)] {
            let both: Complex<f64> = combined(frequency);
            assert!((both.norm() / rest - gain).abs() < 6e-4, "{}", both.norm());
            assert!((both.arg().to_degrees() - degrees).abs() < 0.05, "{}", both.arg().to_degrees());
        }
    }

    #[test]
    fn the_valve_is_of_second_order_at_59_hz() {
        let rig = RigConfig::zhao2005();
        let valve = &rig.servovalve;
        let omega = TAU * 59.1;
        let at_resonance = valve_response(&rig, 59.1);
        let gain = 1.0 / (valve.spool_sensitivity * valve.spool_stroke);
        // 1/(2jζ) at the natural frequency.
        assert!((at_resonance.norm() / gain * 2.0 * 0.961 - 1.0).abs() < 0.002);
        assert!((at_resonance.arg() + std::f64::consts::FRAC_PI_2).abs() < 0.002);
        let slow = valve_response(&rig, 0.01);
        assert!((-slow.arg() / (TAU * 0.01) - 2.0 * 0.961 / omega).abs() < 1e-5);
        for slow in [1e-6, 1e-200] {
            assert!((valve_response(&rig, 0.0) - valve_response(&rig, slow)).norm() < 1e-8, "{slow}");
        }
    }
}
