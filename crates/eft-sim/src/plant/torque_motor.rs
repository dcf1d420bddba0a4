//! The torque motor before the pilot stage: `ẅ + 2ζω·ẇ + ω²·w = ω²·K_vp·e`, where `w` is the demanded pilot
//! flow.

use std::f64::consts::TAU;

use eft_core::Mask;

use crate::config::RigConfig;
use crate::lanes::Num;

/// Natural frequency and damping of the motor's armature.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TorqueMotor<S: Num> {
    /// Whether any lane's motor has a lag.
    present: bool,
    lags: S::Mask,
    squared_frequency: S,
    damping: S,
}

impl<S: Num> TorqueMotor<S> {
    pub(crate) fn pack<'a>(rig: &dyn Fn(usize) -> &'a RigConfig) -> Self {
        let frequency = |i: usize| rig(i).servovalve.torque_motor_frequency.map_or(0.0, |f| TAU * f);
        Self {
            present: (0..S::LANES).any(|i| frequency(i) > 0.0),
            lags: S::Mask::from_lanes(|i| frequency(i) > 0.0),
            squared_frequency: S::from_lanes(|i| frequency(i) * frequency(i)),
            damping: S::from_lanes(|i| 2.0 * rig(i).servovalve.torque_motor_damping * frequency(i)),
        }
    }

    /// The demanded pilot flow (m³/s) after the motor: the motor's state in lanes with a lag, the unchanged
    /// demand in the others.
    #[inline(always)]
    pub(crate) fn output(&self, [flow, _]: [S; 2], demanded_flow: S) -> S {
        if self.present { S::select(self.lags, flow, demanded_flow) } else { demanded_flow }
    }

    /// Rates of the motor's flow (m³/s²) and of its rate (m³/s³) for the demanded flow (m³/s).
    #[inline(always)]
    pub(crate) fn rate(&self, [flow, rate]: [S; 2], demanded_flow: S) -> [S; 2] {
        if self.present {
            [rate, self.squared_frequency * (demanded_flow - flow) - self.damping * rate]
        } else {
            [S::splat(0.0); 2]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::changed;
    use crate::plant::runge_kutta::{Equations, Stages, runge_kutta};

    struct Step(TorqueMotor<f64>);

    impl Equations<f64> for Step {
        fn rate(&mut self, state: &[f64], _: f64, rate: &mut [f64]) {
            rate.copy_from_slice(&self.0.rate([state[0], state[1]], 1.0));
        }
    }

    #[test]
    fn the_step_response_is_that_of_a_second_order_system() {
        let (frequency, damping): (f64, f64) = (250.0, 0.5);
        let rig = changed(&[
            ("servovalve.torque_motor_frequency", frequency.into()),
            ("servovalve.torque_motor_damping", damping.into()),
        ]);
        let mut motor = Step(TorqueMotor::pack(&|_| &rig));
        let (mut state, step) = ([0.0; 2], 1e-5);
        let mut stages = Stages::new(&state);
        for n in 1..=400 {
            runge_kutta(&mut state, &mut stages, 0.0, step, &mut motor);
            let (time, omega) = (f64::from(n) * step, TAU * frequency);
            let damped = omega * (1.0 - damping * damping).sqrt();
            let part = (damped * time).cos() + damping * omega / damped * (damped * time).sin();
            let expected = 1.0 - (-damping * omega * time).exp() * part;
            assert!((state[0] - expected).abs() < 1e-8, "{time}: {} {expected}", state[0]);
        }
        assert_eq!((motor.0.output(state, 2.0), motor.0.output([3.0, 1.0], 2.0)), (state[0], 3.0));
        let plain = changed(&[]);
        let plain = TorqueMotor::<f64>::pack(&|_| &plain);
        assert_eq!(plain.output([3.0, 1.0], 2.0), 2.0);
    }
}
