//! Velocity by a steady-state Kalman observer of the displacement, with the force or a measured acceleration.

use crate::error::{ConfigError, LARGEST, check, positive, within};
use crate::integrity::integrity;
use crate::number::Real;

/// States: displacement, velocity, and the acceleration that the input does not contain. The displacement corrects
/// each.
///
/// Between two samples the acceleration is the input's mean plus a drift that the observer estimates. With force over
/// mass as input, the drift is the acceleration by spring and damper, so that neither has to be known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VelocityObserver<T> {
    period: T,
    half_square: T,
    displacement_gain: T,
    velocity_gain: T,
    drift_gain: T,
}
integrity!(VelocityObserver<T>: period, half_square, displacement_gain, velocity_gain, drift_gain);

/// The state of an observer, made by [`VelocityObserver::at_rest`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct VelocityObserverState<T> {
    displacement: T,
    velocity: T,
    drift: T,
    acceleration: T,
}
integrity!(VelocityObserverState<T>: displacement, velocity, drift, acceleration);

impl<T: Real> VelocityObserver<T> {
    /// One sample: velocity (m/s) for the measured displacement (m) and the acceleration (m/s²). The acceleration is
    /// measured, or is the force over the mass that it moves.
    ///
    /// # NaN
    /// A sample that is not finite, or beyond [`LARGEST`], leaves the state as it was. The result is NaN, which the
    /// controller refuses.
    ///
    /// # Cost
    /// Eight multiplications, ten additions, two comparisons.
    #[inline(always)]
    pub fn step(&self, state: &mut VelocityObserverState<T>, displacement: T, acceleration: T) -> T {
        if !accepts(displacement, acceleration) {
            return T::splat(f64::NAN);
        }
        let mean = T::splat(0.5) * (state.acceleration + acceleration) + state.drift;
        let predicted = state.displacement + self.period * state.velocity + self.half_square * mean;
        let innovation = displacement - predicted;
        *state = VelocityObserverState {
            displacement: predicted + self.displacement_gain * innovation,
            velocity: state.velocity + self.period * mean + self.velocity_gain * innovation,
            drift: state.drift + self.drift_gain * innovation,
            acceleration,
        };
        state.velocity
    }

    /// Goes over `gap` lost samples, as they are foreseen with the last acceleration.
    pub(crate) fn bridge(&self, state: &mut VelocityObserverState<T>, gap: T) {
        let time = gap * self.period;
        let mean = state.acceleration + state.drift;
        state.displacement = state.displacement + time * (state.velocity + T::splat(0.5) * time * mean);
        state.velocity = state.velocity + time * mean;
    }

    /// Resumes after `ticks` samples of which all but this one were lost, as if the displacement (m) had changed
    /// linearly.
    pub(crate) fn resumed(
        &self,
        before: &VelocityObserverState<T>,
        displacement: T,
        ticks: T,
    ) -> VelocityObserverState<T> {
        let change = (displacement - before.displacement) / ticks;
        let (displacement, velocity) = (displacement - change, change / self.period);
        VelocityObserverState { displacement, velocity, ..*before }
    }

    /// The steady state at this displacement (m) and acceleration (m/s²), at rest. The drift balances the acceleration.
    /// An invalid value counts as 0.
    pub fn at_rest(&self, displacement: T, acceleration: T) -> VelocityObserverState<T> {
        let zero = T::splat(0.0);
        let valid = |value: T| if value.abs() <= T::splat(LARGEST) { value } else { zero };
        let (displacement, acceleration) = (valid(displacement), valid(acceleration));
        VelocityObserverState { displacement, velocity: zero, drift: zero - acceleration, acceleration }
    }
}

#[inline(always)]
fn accepts<T: Real>(displacement: T, acceleration: T) -> bool {
    let largest = T::splat(LARGEST);
    displacement.abs() <= largest && acceleration.abs() <= largest
}

/// A gain below its bound, which it must not reach.
const fn below(parameter: &'static str, value: f64, most: f64) -> Result<f64, ConfigError> {
    if value < most {
        Ok(value)
    } else {
        Err(ConfigError::OutOfRange { parameter, value, lowest: 0.0, highest: most })
    }
}

macro_rules! constructor {
    ($t:ty) => {
        impl VelocityObserver<$t> {
            /// From its gains on displacement (1), velocity (1/s) and drift (1/s²), and the sample rate (Hz).
            ///
            /// # Errors
            /// Gains whose poles do not lie within the unit circle (Jury's criterion): a gain that is not positive, a
            /// gain on the displacement above 1, or another one above its bound by the earlier ones. A sample rate that
            /// is not positive. Any number that is not finite.
            pub const fn new(gains: [f64; 3], sample_rate: f64) -> Result<Self, ConfigError> {
                let period = 1.0 / check!(positive("sample_rate", sample_rate));
                let [displacement, velocity, drift] = gains;
                check!(within(
                    "gain_on_displacement",
                    check!(positive("gain_on_displacement", displacement)),
                    0.0,
                    1.0
                ));
                // With α, β = Δt·k₂ and γ = Δt²·k₃/2 the poles are those of
                // z³ + (α + β + γ − 3)z² + (3 − 2α − β + γ)z + α − 1.
                let most = (4.0 - 2.0 * displacement) / period;
                check!(below("gain_on_velocity", check!(positive("gain_on_velocity", velocity)), most));
                let most = 2.0 * displacement * velocity / ((2.0 - displacement) * period);
                check!(below("gain_on_drift", check!(positive("gain_on_drift", drift)), most));
                Ok(Self {
                    period: period as $t,
                    half_square: (0.5 * period * period) as $t,
                    displacement_gain: displacement as $t,
                    velocity_gain: velocity as $t,
                    drift_gain: drift as $t,
                })
            }
        }
    };
}
constructor!(f32);
constructor!(f64);

#[cfg(test)]
mod tests {
    use super::*;

    const GAINS: [f64; 3] = [0.25, 30.0, 500.0];

    fn observer() -> VelocityObserver<f64> {
        VelocityObserver::<f64>::new(GAINS, 100.0).unwrap()
    }

    fn near(what: &str, found: f64, expected: f64) {
        assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{what}: {found:e}, not {expected:e}");
    }

    #[test]
    fn a_step_is_a_constant_acceleration_corrected_by_the_displacement() {
        let mut state =
            VelocityObserverState { displacement: 0.02, velocity: 0.7, drift: -3.0, acceleration: 5.0 };
        let velocity = observer().step(&mut state, 0.03, 9.0);
        // The mean of both accelerations and the drift, for 10 ms.
        let mean = 7.0 - 3.0;
        let predicted = 0.02 + 0.01 * 0.7 + 0.5 * 1e-4 * mean;
        let error = 0.03 - predicted;
        near("displacement", state.displacement, predicted + 0.25 * error);
        near("velocity", state.velocity, 0.7 + 0.01 * mean + 30.0 * error);
        near("drift", state.drift, -3.0 + 500.0 * error);
        near("acceleration", state.acceleration, 9.0);
        near("estimate", velocity, state.velocity);
    }

    #[test]
    fn after_a_gap_it_has_the_mean_velocity_of_the_gap() {
        let before =
            VelocityObserverState { displacement: 0.02, velocity: 0.7, drift: -3.0, acceleration: 5.0 };
        let state = observer().resumed(&before, 0.06, 4.0);
        near("displacement", state.displacement, 0.05);
        near("velocity", state.velocity, 0.01 / 0.01);
        near("drift", state.drift, -3.0);
    }

    #[test]
    fn displacement_and_acceleration_must_both_be_within_the_largest_number() {
        for (displacement, acceleration, accepted) in [
            (LARGEST, -LARGEST, true),
            (1.001 * LARGEST, 0.0, false),
            (0.0, 1.001 * LARGEST, false),
            (f64::NAN, 0.0, false),
            (0.0, f64::NAN, false),
        ] {
            assert_eq!(accepts(displacement, acceleration), accepted, "{displacement} {acceleration}");
            let rest = observer().at_rest(displacement, acceleration);
            assert_eq!(rest == VelocityObserverState::default(), !accepted);
            let stands = observer().at_rest(0.02, acceleration);
            near("displacement", stands.displacement, 0.02);
            near("drift", stands.drift, if acceleration.abs() <= LARGEST { -acceleration } else { 0.0 });
        }
    }
}
