//! Velocity for rigs that measure only displacement: a filtered derivative, and an observer that uses the force (or a
//! measured acceleration) as well.
//!
//! The delay of both is known. The lead network must compensate for it as for the valve's.

mod derivative;
mod observer;

pub use derivative::{FilteredDerivative, FilteredDerivativeState};
pub use observer::{VelocityObserver, VelocityObserverState};

use core::hash::{Hash, Hasher};
use core::hint::black_box;
use core::mem::discriminant;

use crate::checksum::{Integrity, Word};
use crate::error::{ConfigError, check, positive};
use crate::integrity::integrity;
use crate::number::Real;
use crate::parameters::{Parameters, VelocitySource};
use crate::signals::Input;

/// Source of a channel's velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Velocity<T> {
    Sensor,
    Derivative(FilteredDerivative<T>),
    /// With 1 over the mass (1/kg), the factor from force to acceleration.
    Observer(VelocityObserver<T>, T),
    Accelerometer(VelocityObserver<T>),
}

/// The number of a variant as read from memory, also where the compiler assumes a smaller range.
#[derive(Default)]
struct Number(u64);

impl Hasher for Number {
    fn write(&mut self, _: &[u8]) {}
    fn write_isize(&mut self, number: isize) {
        self.0 = black_box(number) as u64;
    }
    fn finish(&self) -> u64 {
        self.0
    }
}

impl<T: Real> Integrity for Velocity<T> {
    /// Each variant is compared by itself: after a memory fault no jump table must be used with a wrong number.
    fn add_to(&self, word: &mut Word) {
        let mut number = Number::default();
        discriminant(black_box(self)).hash(&mut number);
        number.finish().add_to(word);
        if let Self::Derivative(derivative) = black_box(self) {
            derivative.add_to(word);
        }
        if let Self::Observer(observer, delay) = black_box(self) {
            observer.add_to(word);
            delay.add_to(word);
        }
        if let Self::Accelerometer(observer) = black_box(self) {
            observer.add_to(word);
        }
    }
}

/// The state of a velocity estimate.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct VelocityState<T> {
    derivative: FilteredDerivativeState<T>,
    observer: VelocityObserverState<T>,
}
integrity!(VelocityState<T>: derivative, observer);

impl<T: Real> Velocity<T> {
    /// The state before the first valid sample after a gap of some ticks without an estimate. It resumes from the mean
    /// velocity of the gap. Without an earlier estimate it starts at rest.
    pub(crate) fn resumed(
        &self,
        before: &VelocityState<T>,
        input: &Input<T>,
        gap: Option<u32>,
    ) -> VelocityState<T> {
        let x = input.displacement;
        let ticks = gap.map(|gap| T::from_u32(gap) + T::splat(1.0));
        let observed = |observer: &VelocityObserver<T>, acceleration| match ticks {
            Some(ticks) => observer.resumed(&before.observer, x, ticks),
            None => observer.at_rest(x, acceleration),
        };
        match self {
            Self::Sensor => *before,
            Self::Derivative(derivative) => {
                let derivative = match ticks {
                    Some(ticks) => derivative.resumed(&before.derivative, x, ticks),
                    None => derivative.at_rest(x),
                };
                VelocityState { derivative, ..*before }
            }
            Self::Observer(observer, per_mass) => {
                VelocityState { observer: observed(observer, input.force * *per_mass), ..*before }
            }
            Self::Accelerometer(observer) => {
                VelocityState { observer: observed(observer, input.acceleration), ..*before }
            }
        }
    }

    /// Keeps the estimate of this source in a state of another configuration, and says whether there is one.
    pub(crate) fn take_over(&self, state: &mut VelocityState<T>) -> bool {
        let none = VelocityState::default();
        *state = match self {
            Self::Sensor => none,
            Self::Derivative(_) => VelocityState { derivative: state.derivative, ..none },
            Self::Observer(..) | Self::Accelerometer(_) => VelocityState { observer: state.observer, ..none },
        };
        *state != none
    }

    /// Goes over `gap` lost ticks before a valid displacement (m), so that its change does not count as that of one
    /// tick.
    pub(crate) fn bridge(&self, state: &mut VelocityState<T>, displacement: T, gap: T) {
        match self {
            Self::Sensor => {}
            Self::Derivative(derivative) => derivative.bridge(&mut state.derivative, displacement, gap),
            Self::Observer(observer, _) | Self::Accelerometer(observer) => {
                observer.bridge(&mut state.observer, gap);
            }
        }
    }

    /// One sample: the velocity (m/s).
    #[inline(always)]
    pub(crate) fn step(&self, state: &mut VelocityState<T>, input: &Input<T>) -> T {
        match self {
            Self::Sensor => input.velocity,
            Self::Derivative(derivative) => derivative.step(&mut state.derivative, input.displacement),
            Self::Observer(observer, per_mass) => {
                observer.step(&mut state.observer, input.displacement, input.force * *per_mass)
            }
            Self::Accelerometer(observer) => {
                observer.step(&mut state.observer, input.displacement, input.acceleration)
            }
        }
    }
}

macro_rules! constructor {
    ($t:ty) => {
        impl Velocity<$t> {
            pub(crate) const fn new(p: &Parameters) -> Result<Self, ConfigError> {
                Ok(match p.velocity_source {
                    VelocitySource::Sensor => Self::Sensor,
                    VelocitySource::Derivative { corner } => {
                        Self::Derivative(check!(FilteredDerivative::<$t>::new(corner, p.sample_rate)))
                    }
                    VelocitySource::Observer { gains, mass } => Self::Observer(
                        check!(VelocityObserver::<$t>::new(gains, p.sample_rate)),
                        (1.0 / check!(positive("mass", mass))) as $t,
                    ),
                    VelocitySource::Accelerometer { gains } => {
                        Self::Accelerometer(check!(VelocityObserver::<$t>::new(gains, p.sample_rate)))
                    }
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
    fn lost_samples_of_a_motion_leave_its_estimate() {
        let gains = [0.05, 5.0, 50.0];
        let sources = [
            VelocitySource::Derivative { corner: 80.0 },
            VelocitySource::Observer { gains, mass: 4.0 },
            VelocitySource::Accelerometer { gains },
        ];
        for (velocity, gap) in sources.map(made).iter().zip([1, 3, 9]) {
            let at = |tick: u32| Input {
                displacement: 0.5 * f64::from(tick) / RATE,
                acceleration: 0.0,
                force: 0.0,
                ..Input::default()
            };
            let mut state = velocity.resumed(&VelocityState::default(), &at(0), None);
            for tick in 0..40_000 {
                velocity.step(&mut state, &at(tick));
            }
            let first = at(40_000 + gap);
            velocity.bridge(&mut state, first.displacement, f64::from(gap));
            let found = velocity.step(&mut state, &first);
            assert!((found - 0.5).abs() < 1e-6, "{velocity:?}: {found}");
        }
    }

    fn made(velocity_source: VelocitySource) -> Velocity<f64> {
        Velocity::<f64>::new(&Parameters { velocity_source, ..Parameters::ZHAO2005 }).unwrap()
    }

    #[test]
    fn an_observer_takes_force_over_mass_for_the_acceleration() {
        let gains = [0.05, 5.0, 50.0];
        let by_force = made(VelocitySource::Observer { gains, mass: 4.0 });
        let by_sensor = made(VelocitySource::Accelerometer { gains });
        let at = |displacement, acceleration| Input {
            displacement,
            acceleration,
            force: 4.0 * acceleration,
            ..Input::default()
        };
        let before = VelocityState::default();
        let [mut state, mut like] =
            [&by_force, &by_sensor].map(|by| by.resumed(&before, &at(0.02, 3.0), None));
        assert_eq!(state, like);
        assert!(by_force.step(&mut { state }, &at(0.02, 3.0)).abs() < 1e-15);
        let moved = at(0.021, 5.0);
        assert_eq!((by_force.step(&mut state, &moved), state), (by_sensor.step(&mut like, &moved), like));
    }

    #[test]
    fn bad_parameters_are_refused() {
        assert!(FilteredDerivative::<f64>::new(0.0, RATE).is_err());
        assert!(FilteredDerivative::<f64>::new(80.0, f64::NAN).is_err());
        assert!(VelocityObserver::<f64>::new([1.5, 0.0, 0.0], RATE).is_err());
        assert!(VelocityObserver::<f64>::new([0.5, -1.0, 0.0], RATE).is_err());
    }

    #[test]
    fn an_observer_whose_poles_are_not_within_the_unit_circle_is_refused() {
        let made = |gains| VelocityObserver::<f64>::new(gains, RATE);
        // To either side of each bound: of the velocity's gain 4 − 2α over the period, of the drift's 2αk₂/(2 − α) over
        // it.
        let (most, drift) = (3.8 * RATE, 2.0 * 0.1 * 5.0 / 1.9 * RATE);
        assert!(made([0.1, 0.999 * most, 1.0]).is_ok() && made([0.1, 1.001 * most, 1.0]).is_err());
        assert!(made([0.1, 5.0, 0.999 * drift]).is_ok() && made([0.1, 5.0, 1.001 * drift]).is_err());
        for gains in [[0.0, 5.0, 50.0], [0.1, 0.0, 50.0], [0.1, 5.0, 0.0]] {
            assert!(made(gains).is_err(), "{gains:?}");
        }
        // Accepted gains forget the initial state, also close to the bounds.
        for gains in
            [[0.1, 0.99 * most, 1e3], [0.1, 5.0, 0.99 * drift], [1.0, 1.98 * RATE, RATE], [1e-3, 1.0, 1.0]]
        {
            let observer = made(gains).unwrap();
            let mut state = observer.at_rest(1.0, 3.0);
            let velocity = |state: &mut _| observer.step(state, 0.0, 0.0).abs();
            let first = (0..1000).map(|_| velocity(&mut state)).fold(0.0, f64::max);
            for _ in 0..400_000 {
                velocity(&mut state);
            }
            let last = (0..1000).map(|_| velocity(&mut state)).fold(0.0, f64::max);
            assert!(last < 1e-3 * first, "{gains:?}: {first} {last}");
        }
    }
}
