//! Velocity for rigs that measure only displacement: a filtered derivative, and a steady-state Kalman observer that
//! uses the force (or a measured acceleration) as well.
//!
//! Both have a delay that is known, and that the lead network has to make up for like the valve's.

use crate::error::{ConfigError, LARGEST, check, positive, within};
use crate::scalar::Scalar;

/// Difference from sample to sample, then two equal first-order low-passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilteredDerivative<S> {
    sample_rate: S,
    share: S,
}

/// What a filtered derivative remembers; made by [`FilteredDerivative::at_rest`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct FilteredDerivativeState<S> {
    displacement: S,
    first: S,
    second: S,
}

impl<S: Scalar> FilteredDerivative<S> {
    /// One sample: velocity (m/s) for the measured displacement (m).
    ///
    /// # NaN
    /// A displacement that is not finite, or beyond [`LARGEST`], leaves the state and comes back as NaN for the controller
    /// to refuse.
    ///
    /// # Cost
    /// Four multiplications and additions, three selections.
    #[inline(always)]
    pub fn step(&self, state: &mut FilteredDerivativeState<S>, displacement: S) -> S {
        let good = displacement.abs().le(S::splat(LARGEST));
        let slope = (displacement - state.displacement) * self.sample_rate;
        let first = state.first + self.share * (slope - state.first);
        let second = state.second + self.share * (first - state.second);
        state.displacement = S::select(good, displacement, state.displacement);
        state.first = S::select(good, first, state.first);
        state.second = S::select(good, second, state.second);
        S::select(good, state.second, S::splat(f64::NAN))
    }

    /// The state after long at this displacement (m): no kick in the next step.
    #[inline(always)]
    pub fn at_rest(&self, displacement: S) -> FilteredDerivativeState<S> {
        let good = displacement.abs().le(S::splat(LARGEST));
        let displacement = S::select(good, displacement, S::splat(0.0));
        FilteredDerivativeState { displacement, ..FilteredDerivativeState::default() }
    }

    /// Those of single rigs side by side.
    pub fn pack<'a>(lane: impl Fn(usize) -> &'a FilteredDerivative<S::Element>) -> Self
    where
        S::Element: 'a,
    {
        Self { sample_rate: S::from_lanes(|i| lane(i).sample_rate), share: S::from_lanes(|i| lane(i).share) }
    }
}

/// Displacement, velocity and the acceleration that the input leaves out, each corrected by the displacement.
///
/// Between two samples the acceleration is the input's mean plus a drift that the observer finds: with force over mass
/// as input the drift is what spring and damper do, so neither has to be known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VelocityObserver<S> {
    period: S,
    half_square: S,
    on_displacement: S,
    on_velocity: S,
    on_drift: S,
}

/// What an observer remembers; made by [`VelocityObserver::at_rest`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct VelocityObserverState<S> {
    displacement: S,
    velocity: S,
    drift: S,
    acceleration: S,
}

impl<S: Scalar> VelocityObserver<S> {
    /// One sample: velocity (m/s) for the measured displacement (m) and acceleration (m/s²), measured or the force over
    /// the mass it moves.
    ///
    /// # NaN
    /// A sample that is not finite, or beyond [`LARGEST`], leaves the state and comes back as NaN for the controller to
    /// refuse.
    ///
    /// # Cost
    /// Eight multiplications, ten additions, five selections.
    #[inline(always)]
    pub fn step(&self, state: &mut VelocityObserverState<S>, displacement: S, acceleration: S) -> S {
        let largest = S::splat(LARGEST);
        let good = displacement.abs().le(largest) & acceleration.abs().le(largest);
        let mean = S::splat(0.5) * (state.acceleration + acceleration) + state.drift;
        let foreseen = state.displacement + self.period * state.velocity + self.half_square * mean;
        let error = displacement - foreseen;
        let next = VelocityObserverState {
            displacement: foreseen + self.on_displacement * error,
            velocity: state.velocity + self.period * mean + self.on_velocity * error,
            drift: state.drift + self.on_drift * error,
            acceleration,
        };
        state.displacement = S::select(good, next.displacement, state.displacement);
        state.velocity = S::select(good, next.velocity, state.velocity);
        state.drift = S::select(good, next.drift, state.drift);
        state.acceleration = S::select(good, next.acceleration, state.acceleration);
        S::select(good, state.velocity, S::splat(f64::NAN))
    }

    /// The state after long at this displacement (m) and input (m/s²), at rest: the drift holds the input's balance.
    #[inline(always)]
    pub fn at_rest(&self, displacement: S, acceleration: S) -> VelocityObserverState<S> {
        let largest = S::splat(LARGEST);
        let good = displacement.abs().le(largest) & acceleration.abs().le(largest);
        let zero = S::splat(0.0);
        let acceleration = S::select(good, acceleration, zero);
        let displacement = S::select(good, displacement, zero);
        VelocityObserverState { displacement, velocity: zero, drift: -acceleration, acceleration }
    }

    /// Those of single rigs side by side.
    pub fn pack<'a>(lane: impl Fn(usize) -> &'a VelocityObserver<S::Element>) -> Self
    where
        S::Element: 'a,
    {
        Self {
            period: S::from_lanes(|i| lane(i).period),
            half_square: S::from_lanes(|i| lane(i).half_square),
            on_displacement: S::from_lanes(|i| lane(i).on_displacement),
            on_velocity: S::from_lanes(|i| lane(i).on_velocity),
            on_drift: S::from_lanes(|i| lane(i).on_drift),
        }
    }
}

macro_rules! constructor {
    ($t:ty) => {
        impl FilteredDerivative<$t> {
            /// From the corner of its low-passes (Hz) and the sample rate (Hz).
            ///
            /// # Errors
            /// Either not positive and finite.
            pub const fn new(corner: f64, sample_rate: f64) -> Result<Self, ConfigError> {
                let rate = check!(positive("sample_rate", sample_rate));
                let angle = core::f64::consts::TAU * check!(positive("corner", corner)) / rate;
                let share = angle / (1.0 + 0.5 * angle);
                // A corner above what the rate can carry filters nothing.
                let share = if share < 1.0 { share } else { 1.0 };
                Ok(Self { sample_rate: rate as $t, share: share as $t })
            }
        }

        impl VelocityObserver<$t> {
            /// From its gains on displacement (1), velocity (1/s) and drift (1/s²), and the sample rate (Hz).
            ///
            /// # Errors
            /// A gain on the displacement outside [0, 1], another that is negative, a sample rate not positive, or any not finite.
            pub const fn new(gains: [f64; 3], sample_rate: f64) -> Result<Self, ConfigError> {
                let period = 1.0 / check!(positive("sample_rate", sample_rate));
                let [displacement, velocity, drift] = gains;
                let most = LARGEST;
                Ok(Self {
                    period: period as $t,
                    half_square: (0.5 * period * period) as $t,
                    on_displacement: check!(within("gain_on_displacement", displacement, 0.0, 1.0)) as $t,
                    on_velocity: check!(within("gain_on_velocity", velocity, 0.0, most)) as $t,
                    on_drift: check!(within("gain_on_drift", drift, 0.0, most)) as $t,
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

    const RATE: f64 = 4096.0;
    const OMEGA: f64 = core::f64::consts::TAU * 1.6;

    /// Delay (s) and gain of an estimate of the velocity of a sine of 1.6 Hz, by its quadratures.
    fn judged(mut estimate: impl FnMut(f64, f64) -> f64) -> (f64, f64) {
        let (mut sine, mut cosine) = (0.0, 0.0);
        // Ten whole periods, after ten to settle.
        for n in 0..51_200_u32 {
            let (s, c) = (OMEGA * f64::from(n) / RATE).sin_cos();
            let velocity = estimate(0.05 * s, -0.05 * OMEGA * OMEGA * s);
            if n >= 25_600 {
                cosine += velocity * c;
                sine += velocity * s;
            }
        }
        (sine.atan2(cosine) / OMEGA, (sine * sine + cosine * cosine).sqrt() / (0.05 * OMEGA * 12_800.0))
    }

    #[test]
    fn the_derivatives_delay_is_known() {
        let derivative = FilteredDerivative::<f64>::new(80.0, RATE).unwrap();
        let mut state = derivative.at_rest(0.0);
        let (delay, gain) = judged(|x, _| derivative.step(&mut state, x));
        // Half a sample of the difference, and two low-passes.
        let share = derivative.share;
        let expected = (0.5 + 2.0 * (1.0 - share) / share) / RATE;
        assert!((delay - expected).abs() < 0.01 * expected, "{delay} {expected}");
        assert!((gain - 1.0).abs() < 2e-3, "{gain}");
    }

    #[test]
    fn with_the_true_acceleration_the_observer_has_no_delay() {
        let observer = VelocityObserver::<f64>::new([0.05, 5.0, 50.0], RATE).unwrap();
        let mut state = observer.at_rest(0.0, 0.0);
        let (delay, gain) = judged(|x, a| observer.step(&mut state, x, a));
        assert!(delay.abs() < 1e-6 && (gain - 1.0).abs() < 1e-4, "{delay} {gain}");
        // And without any, it follows by the displacement alone.
        let mut state = observer.at_rest(0.0, 0.0);
        let (delay, gain) = judged(|x, _| observer.step(&mut state, x, 0.0));
        assert!(delay > 0.0 && (gain - 1.0).abs() < 0.2, "{delay} {gain}");
    }

    #[test]
    fn at_rest_nothing_moves_and_a_bad_sample_leaves_the_state() {
        let observer = VelocityObserver::<f32>::new([0.05, 5.0, 50.0], RATE).unwrap();
        let derivative = FilteredDerivative::<f32>::new(80.0, RATE).unwrap();
        let (mut s, mut d) = (observer.at_rest(0.02, 1.5), derivative.at_rest(0.02));
        assert!(observer.step(&mut s, 0.02, 1.5).abs() < 1e-9 && derivative.step(&mut d, 0.02).abs() < 1e-9);
        let (before, before_d) = (s, d);
        for bad in [f32::NAN, f32::INFINITY, 1e30] {
            assert!(observer.step(&mut s, bad, 0.0).is_nan() && observer.step(&mut s, 0.0, bad).is_nan());
            assert!(derivative.step(&mut d, bad).is_nan());
        }
        assert!(s == before && d == before_d);
    }

    #[test]
    fn bad_parameters_are_refused() {
        assert!(FilteredDerivative::<f64>::new(0.0, RATE).is_err());
        assert!(FilteredDerivative::<f64>::new(80.0, f64::NAN).is_err());
        assert!(VelocityObserver::<f64>::new([1.5, 0.0, 0.0], RATE).is_err());
        assert!(VelocityObserver::<f64>::new([0.5, -1.0, 0.0], RATE).is_err());
    }
}
