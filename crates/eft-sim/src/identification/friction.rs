//! Friction of the seals and compressibility of the oil, from the [flow balance](super::flow_balance) of a test.

use super::Estimate;
use super::flow_balance::{LEAST_EXCITATION, MotionSignals, excitation, fitted};
use crate::{Result, RigConfig, checks};

/// Frequencies (Hz) of the fit. Below them the drifts of the flows prevail, above them the sensors' noise.
const BAND: (f64, f64) = (0.5, 40.0);

/// The seals' friction with what is found beside it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionEstimate {
    /// Coulomb friction `F_c` (N) whose flow is the measured one at the configured compressibility.
    pub friction: Estimate,
    /// Compressibility of the oil `K` (m³/Pa).
    pub compressibility: Estimate,
    /// Flow over that of the configured valve (1), in the negative and in the positive direction.
    pub flow_factors: [Estimate; 2],
    /// Delay (s) of the velocity behind the spool, by their sensors.
    pub velocity_delay: Estimate,
}

/// The friction of a rig's seals from a test sampled at a rate (Hz). A sweep through the natural frequency is best: the
/// motion must change, so that the friction differs from a delay.
///
/// # Errors
/// Unequal, too short or incomplete signals, a motion without reversals, or flows of another size than those of the
/// configured valve.
pub fn identify_friction(
    rig: &RigConfig,
    signals: MotionSignals<'_>,
    sample_rate: f64,
) -> Result<FrictionEstimate> {
    checks::sample_rate("sample_rate", sample_rate)?;
    signals.check(sample_rate)?;
    // A fast sweep shows the delay of the force, and needs it: a late compression looks like friction.
    let [back, forth, delay, oil, friction, ..] =
        if excitation(signals.force, sample_rate)? < LEAST_EXCITATION {
            fitted::<7>(rig, signals, sample_rate, BAND)?
        } else {
            let [found @ .., _] = fitted::<8>(rig, signals, sample_rate, BAND)?;
            found
        };
    Ok(FrictionEstimate {
        friction,
        compressibility: oil.times(rig.actuator.compressibility),
        flow_factors: [back, forth],
        velocity_delay: delay,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    const RATE: f64 = 1024.0;

    /// A motion with several frequencies, and the spool opening that its flow balance requires of a linear valve.
    fn test(friction: f64, oil: f64) -> (RigConfig, [Vec<f64>; 3]) {
        let table =
            crate::config::FlowCurve { openings: vec![-1.0, 0.0, 1.0], flows: vec![-0.02, 0.0, 0.02] };
        let rig = RigConfig::zhao2005().with(|rig| {
            rig.servovalve.flow_table = table;
            rig.servovalve.null_bias = 0.03;
            rig.actuator.friction_velocity = 5e-3;
        });
        let rig = rig.unwrap();
        let (area, supply) = (rig.actuator.piston_area, rig.supply.pressure);
        let mut signals = [const { Vec::new() }; 3];
        for i in 0..8192 {
            let t = f64::from(i) / RATE;
            // Whole periods in the record.
            let wave = |f: f64, phase: f64| (TAU * f * t + phase).sin_cos();
            let (v, dv) = [(1.0, 0.0, 0.1), (2.5, 1.0, 0.05), (5.75, 2.0, 0.02)]
                .iter()
                .map(|(f, phase, a)| (a * wave(*f, *phase).0, a * TAU * f * wave(*f, *phase).1))
                .fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
            let (f, df) = (4000.0 * wave(1.5, 0.4).0, 4000.0 * TAU * 1.5 * wave(1.5, 0.4).1);
            // The plant's friction, with a velocity that the samples resolve.
            let width = rig.actuator.friction_velocity;
            let rubbed = friction * dv * width.powi(2) / v.hypot(width).powi(3);
            let compliance = rig.actuator.compressibility / area;
            let flow = area * v + rig.actuator.leakage / area * f + compliance * (oil * df + rubbed);
            let root = (1.0 - flow.signum() * f / (area * supply)).sqrt();
            for (signal, value) in
                signals.iter_mut().zip([flow / root / 0.02 + rig.servovalve.null_bias, v, f])
            {
                signal.push(value);
            }
        }
        (rig, signals)
    }

    fn found(rig: &RigConfig, signals: &[Vec<f64>; 3]) -> Result<FrictionEstimate> {
        let [spool, velocity, force] = signals;
        identify_friction(rig, MotionSignals { spool, velocity, force }, RATE)
    }

    #[test]
    fn friction_and_oil_of_a_known_balance_are_found() {
        for (friction, oil) in [(0.0, 1.0), (900.0, 1.3)] {
            let (rig, signals) = test(friction, oil);
            let found = found(&rig, &signals).unwrap();
            assert!((found.friction.value - friction).abs() < 20.0, "{found:?}");
            assert!(
                (found.compressibility.value / rig.actuator.compressibility - oil).abs() < 0.02,
                "{found:?}"
            );
            for factor in found.flow_factors {
                assert!((factor.value - 1.0).abs() < 0.002, "{found:?}");
            }
            assert!(found.velocity_delay.value.abs() < 2e-5, "{found:?}");
        }
    }

    #[test]
    fn a_late_velocity_is_a_delay_and_no_friction() {
        let (rig, mut signals) = test(900.0, 1.0);
        // The motion is periodic in the record.
        signals[1].rotate_right(2);
        let found = found(&rig, &signals).unwrap();
        assert!((found.velocity_delay.value - 2.0 / RATE).abs() < 2e-4, "{found:?}");
        assert!((found.friction.value - 900.0).abs() < 150.0, "{found:?}");
    }

    #[test]
    fn a_record_that_ends_in_motion_needs_no_whole_periods() {
        for (friction, oil, length) in [(0.0, 1.0, 7001), (900.0, 1.3, 5555)] {
            let (rig, mut signals) = test(friction, oil);
            signals.iter_mut().for_each(|signal| signal.truncate(length));
            // An offset of the sensor does not move the piston.
            signals[1].iter_mut().for_each(|v| *v += 0.02);
            let found = found(&rig, &signals).unwrap();
            assert!((found.friction.value - friction).abs() < 30.0, "{found:?}");
            let ratio = found.compressibility.value / rig.actuator.compressibility;
            assert!((ratio - oil).abs() < 0.02, "{found:?}");
        }
    }

    #[test]
    fn a_drift_of_the_velocity_is_no_friction() {
        let (rig, mut signals) = test(0.0, 1.0);
        let length = signals[1].len() as f64;
        signals[1].iter_mut().enumerate().for_each(|(i, v)| *v += 0.02 * i as f64 / length);
        let found = found(&rig, &signals).unwrap();
        assert!(found.friction.value.abs() < 5.0, "{found:?}");
    }

    #[test]
    fn what_determines_nothing_is_refused() {
        let (rig, signals) = test(900.0, 1.0);
        let refused = |signals: &[Vec<f64>; 3]| found(&rig, signals).unwrap_err().to_string();
        let still = signals.each_ref().map(|signal| vec![0.0; signal.len()]);
        assert!(refused(&still).contains("hardly moves"));
        let mut reversed = signals.clone();
        reversed[0].iter_mut().for_each(|x| *x = -*x);
        assert!(refused(&reversed).contains("check gains, units and signs"));
        for factor in [-1.0, 1e-3] {
            let mut scaled = signals.clone();
            scaled[2].iter_mut().for_each(|f| *f *= factor);
            let text = refused(&scaled);
            assert!(
                text.starts_with("force = ") && text.contains("check its unit and sign"),
                "{factor}: {text}"
            );
        }
        let mut short = signals.clone();
        short[2].pop();
        assert!(refused(&short).contains("force"));
        let mut gap = signals;
        gap[1][100] = f64::NAN;
        assert!(refused(&gap).contains("velocity"));
    }
}
