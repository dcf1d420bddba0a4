//! Compares the force with the load pressure, if the chamber pressures are measured. `F = A·P_L`, except for friction,
//! the piston's inertia and the sensors' errors.

use crate::integrity::integrity;
use crate::number::Real;
use crate::protection::gate::{SensorGate, Signal};
use crate::protection::plausibility::sums::Cusum;

/// Share of the pressure's force by which the two may differ.
pub(in crate::protection) const GAIN: f64 = 0.03;

/// The comparison's immutable configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LoadPressureWatch<T> {
    /// Piston area (m²).
    pub(in crate::protection) area: T,
    /// Largest jump of the reading, and largest change of a still one (Pa).
    pub(in crate::protection) jump: T,
    pub(in crate::protection) still: T,
    /// Allowed difference (N), and further samples (1) of the pressure's change for a delay between the sensors.
    pub(in crate::protection) tolerance: T,
    pub(in crate::protection) latency: T,
    /// Limit of the sum (N·s).
    pub(in crate::protection) limit: T,
}
integrity!(LoadPressureWatch<T>: area, jump, still, tolerance, latency, limit);

/// The comparison's state. `default()` is that before the first sample.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct LoadPressureState<T> {
    signal: Signal<T>,
    sum: Cusum<T>,
    /// Whether the pressure itself has failed. It is ignored from then on.
    pub(super) failed: bool,
}
integrity!(LoadPressureState<T>: signal, sum, failed);

impl<T: Real> LoadPressureState<T> {
    /// The state before the first sample of a sensor that may have failed.
    pub(super) fn restarted(&self) -> Self {
        Self { failed: self.failed, ..Self::default() }
    }
}

impl<T: Real> LoadPressureWatch<T> {
    /// One sample of force (N; NaN if lost) and load pressure (Pa); `period` is the sample period (s). The result is
    /// whether they contradict each other.
    #[inline(always)]
    pub(super) fn contradicts(
        &self,
        state: &mut LoadPressureState<T>,
        gate: &SensorGate<T>,
        (lost_samples, repeats): (u32, u32),
        period: T,
        [force, pressure]: [T; 2],
    ) -> bool {
        let pressure = gate.accept(&mut state.signal, self.jump, self.still, pressure);
        let difference = force - self.area * pressure;
        if difference.is_finite() {
            let change = state.signal.slope * self.latency;
            let allowed = self.area * (T::splat(GAIN) * pressure.abs() + change.abs());
            state.sum.add(period * difference, period * (self.tolerance + allowed), self.limit);
        }
        let beyond = state.sum.is_beyond(self.limit, T::splat(1.0));
        // The next readings show whether the pressure itself has failed, which is not a fault of the force.
        let repeated = beyond && state.signal.repeats >= repeats;
        state.failed |= state.signal.lost > lost_samples || gate.is_still(&state.signal) || repeated;
        beyond && !(state.failed || state.signal.is_quiet())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AREA: f64 = 8.0e-3;
    const PERIOD: f64 = 1.0 / 4096.0;
    const WATCH: LoadPressureWatch<f64> =
        LoadPressureWatch { area: AREA, jump: 3.0e5, still: 1.0, tolerance: 500.0, latency: 2.0, limit: 0.5 };
    const GATE: SensorGate<f64> = SensorGate {
        tolerance: [0.0; 4],
        displacement_tolerance: 0.0,
        tolerance_growth: 0.0,
        friction_jump: 0.0,
        reversal_velocity: 0.0,
        still_change: [0.0; 4],
        liveliness_gain: 1e-2,
        still_probability: 1e-10,
        slope_gain: 0.1,
        confirmations: 6,
    };

    /// A force of 6 kN at 1.5 Hz.
    fn swing(time: f64) -> f64 {
        6.0e3 * libm::sin(core::f64::consts::TAU * 1.5 * time)
    }

    /// Time (s) of the first contradiction within 2 s, and whether the pressure has failed at the end. The arguments
    /// are force (N) and load pressure (Pa) at a time (s).
    fn first(force: impl Fn(f64) -> f64, pressure: impl Fn(f64) -> f64) -> (Option<f64>, bool) {
        let mut state = LoadPressureState::default();
        let mut found = None;
        for time in (0..8192).map(|n| f64::from(n) * PERIOD) {
            let readings = [force(time), pressure(time)];
            if WATCH.contradicts(&mut state, &GATE, (10, 12), PERIOD, readings) {
                found = found.or(Some(time));
            }
        }
        (found, state.failed)
    }

    #[test]
    fn a_wrong_force_is_noticed_and_friction_delay_and_noise_are_not() {
        let pressure = |time: f64| swing(time) / AREA;
        let from = |start: f64, then: fn(f64) -> f64| {
            move |time: f64| if time < start { swing(time) } else { then(swing(time)) }
        };
        // At the largest force, and when it passes zero.
        for (start, most) in [(0.5, 1.5e-3), (2.0 / 3.0, 0.02)] {
            for wrong in [|_| 0.0, |force: f64| -force, |force: f64| 0.7 * force] {
                let (found, failed) = first(from(start, wrong), pressure);
                let weak = wrong(1.0) > 0.5;
                let most = if weak { most + 0.1 } else { most };
                assert!(found.is_some_and(|time| time - start < most) && !failed, "{start}: {found:?}");
            }
        }
        let velocity = |time: f64| libm::cos(core::f64::consts::TAU * 1.5 * time);
        let friction = |time: f64| swing(time) - 490.0 * velocity(time).signum();
        assert_eq!(first(friction, pressure), (None, false));
        assert_eq!(first(|time| swing(time - 2.0 * PERIOD), pressure), (None, false));
        assert_eq!(first(|time| 1.02 * swing(time) + 400.0, pressure), (None, false));
        // Lost readings of the force are no contradiction.
        assert_eq!(first(|_| f64::NAN, pressure), (None, false));
    }

    #[test]
    fn a_pressure_that_fails_by_itself_is_ignored() {
        for start in [0.3, 0.5, 2.0 / 3.0, 1.1] {
            for wrong in [|_, _| f64::NAN, |_, _| 0.0, |_, start: f64| swing(start) / AREA] {
                let pressure = |time: f64| if time < start { swing(time) / AREA } else { wrong(time, start) };
                assert_eq!(first(swing, pressure), (None, true), "{start}");
            }
        }
    }

    #[test]
    fn a_difference_counts_beyond_the_tolerance_a_share_and_the_change_in_a_delay() {
        let watch = LoadPressureWatch { limit: 90.0, ..WATCH };
        let gate = SensorGate { slope_gain: 1.0, ..GATE };
        for (first, change, force) in
            [(2.0e5, 1.0e4, 9.0e3), (-2.0e5, -1.0e4, 9.0e3), (2.0e5, -1.0e4, -7.0e3)]
        {
            let mut state = LoadPressureState::default();
            for n in 0..3_u8 {
                state.sum = Cusum { above: 9.0, below: 9.0 };
                let pressure = first + change * f64::from(n);
                watch.contradicts(&mut state, &gate, (10, 12), PERIOD, [force, pressure]);
            }
            let pressure = first + 2.0 * change;
            let residual = force - AREA * pressure;
            let allowed = 500.0 + AREA * (0.03 * pressure.abs() + 2.0 * change.abs());
            for (found, side) in [(state.sum.above, 1.0), (state.sum.below, -1.0)] {
                let expected = 9.0 + PERIOD * (side * residual - allowed);
                assert!((found - expected).abs() < 1e-12, "{force} {side}: {found}, not {expected}");
            }
        }
    }

    #[test]
    fn a_pressure_fails_by_twelve_repetitions_in_contradiction_or_by_eleven_lost_readings() {
        for (sum, repeats, lost, pressure, failed) in [
            (0.6, 11, 0, 0.0, true),
            (0.6, 10, 0, 0.0, false),
            (0.4, 11, 0, 0.0, false),
            (0.0, 0, 10, f64::NAN, true),
            (0.0, 0, 9, f64::NAN, false),
        ] {
            let mut state = LoadPressureState::default();
            // A force at its tolerance leaves the sum.
            let contradicts = |state: &mut _, pressure| {
                WATCH.contradicts(state, &GATE, (10, 12), PERIOD, [500.0, pressure])
            };
            contradicts(&mut state, 0.0);
            (state.sum.above, state.signal.repeats, state.signal.lost) = (sum, repeats, lost);
            // Also before it has failed, a reading that repeats contradicts nothing.
            assert!(!contradicts(&mut state, pressure), "{sum} {repeats} {lost}");
            assert_eq!(state.failed, failed, "{sum} {repeats} {lost}");
        }
    }
}
