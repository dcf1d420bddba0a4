//! The gate for readings: a reading that the rig cannot have reached since the last one counts as lost.

#[cfg(test)]
mod tests;

use crate::integrity::integrity;
use crate::number::Real;

/// The signals, in the order of every array of them.
pub(crate) const FORCE: usize = 0;
pub(crate) const DISPLACEMENT: usize = 1;
pub(crate) const VELOCITY: usize = 2;
pub(crate) const SPOOL: usize = 3;

/// The allowed distance of a reading from its prediction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SensorGate<T> {
    /// In the signals' units.
    pub(crate) tolerance: [T; 4],
    /// The same of a displacement (m) from which the velocity is estimated, and its further distance with each lost
    /// sample.
    pub(crate) displacement_tolerance: T,
    pub(crate) tolerance_growth: T,
    /// Jump of the force (N) that friction may add near a reversal, and the velocity (m/s) below which a reversal is
    /// near.
    pub(crate) friction_jump: T,
    pub(crate) reversal_velocity: T,
    /// Change from sample to sample below which a reading is still.
    pub(crate) still_change: [T; 4],
    /// Coefficient (1) of the average of the liveliness.
    pub(crate) liveliness_gain: T,
    /// Probability below which a series of still readings is a fault.
    pub(crate) still_probability: T,
    /// Coefficient (1) of the average of a slope.
    pub(crate) slope_gain: T,
    /// Number of readings in a row that must agree with their prediction after several that jumped.
    pub(crate) confirmations: u32,
}
integrity!(
    SensorGate<T>: tolerance, displacement_tolerance, tolerance_growth, friction_jump, reversal_velocity, still_change,
    liveliness_gain, still_probability, slope_gain, confirmations
);

/// The gate's state of one signal. `default()` is that before the first sample.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct Signal<T> {
    /// The last accepted reading, and its slope per sample.
    pub(crate) last: T,
    pub(crate) slope: T,
    /// Samples in a row that were not accepted.
    pub(crate) lost: u32,
    /// Numbers among these that disagreed with their prediction, and the readings since that agreed.
    jumps: u32,
    confirmed: u32,
    /// Times in a row that the reading repeated itself to the last bit.
    pub(crate) repeats: u32,
    /// Liveliness: share of the readings that were off the line of the two earlier ones, as noise is.
    liveliness: T,
    /// Readings in it, until it forgets as many.
    readings: T,
    /// Probability that a working sensor gives the present series of still readings; 0 before the first.
    pub(crate) likelihood: T,
    /// The last change from reading to reading.
    last_change: T,
    /// Whether the last reading that was not accepted was a number.
    pub(crate) jumped: bool,
    pub(crate) has_reading: bool,
}
integrity!(
    Signal<T>: last, slope, lost, jumps, confirmed, repeats, liveliness, readings, likelihood, last_change, jumped,
    has_reading
);

impl<T: Real> Signal<T> {
    /// Accepts the next reading.
    pub(crate) fn restart(&mut self) {
        (self.lost, self.has_reading) = (0, false);
    }

    /// Records a reading that disagrees with its prediction, or is no number.
    #[cold]
    fn refuse(&mut self, number: bool) {
        let jumps = if self.lost > 0 { self.jumps } else { 0 };
        self.jumps = jumps.saturating_add(u32::from(number));
        (self.jumped, self.confirmed) = (number, 0);
    }

    /// Whether the last reading was still or a repetition, as the readings of a failed sensor are.
    #[inline(always)]
    pub(crate) fn is_quiet(&self) -> bool {
        self.repeats > 0 || self.likelihood < T::splat(1.0)
    }

    /// Whether a working sensor is as still as this one with a smaller probability than this.
    #[inline(always)]
    pub(crate) fn is_stiller(&self, probability: T) -> bool {
        self.likelihood > T::splat(0.0) && self.likelihood < probability
    }
}

impl<T: Real> SensorGate<T> {
    /// One reading of a signal: the reading, or NaN if it is not accepted.
    // Inlined once a signal, it made the watched tick of a Cortex-M4F need 136 bytes of stack and 31 instructions more.
    #[inline(never)]
    pub(crate) fn accept(&self, signal: &mut Signal<T>, tolerance: T, still_change: T, reading: T) -> T {
        let number = reading.abs() <= T::splat(f32::MAX as f64);
        let predicted = signal.last + signal.slope * T::from_u32(signal.lost + 1);
        let agrees = number && (!signal.has_reading || (reading - predicted).abs() <= tolerance);
        if !agrees {
            signal.refuse(number);
        }
        if !agrees || signal.lost >= OUTLIER_LIMIT && self.awaits_confirmation(signal) {
            signal.lost = if signal.lost < LARGEST_COUNT { signal.lost + 1 } else { LARGEST_COUNT };
            return T::splat(f64::NAN);
        }
        if signal.lost == 0 && signal.has_reading {
            let change = reading - signal.last;
            signal.slope = signal.slope + self.slope_gain * (change - signal.slope);
            self.update_liveliness(signal, still_change, change);
        }
        let repeats = if signal.repeats < LARGEST_COUNT { signal.repeats + 1 } else { LARGEST_COUNT };
        signal.repeats = if signal.has_reading && reading == signal.last { repeats } else { 0 };
        (signal.last, signal.lost, signal.has_reading) = (reading, 0, true);
        reading
    }

    /// Whether a reading that agrees with its prediction is not accepted yet. Near a reversal one of the wrong sign
    /// agrees as well.
    #[cold]
    fn awaits_confirmation(&self, signal: &mut Signal<T>) -> bool {
        signal.confirmed = signal.confirmed.saturating_add(1);
        signal.jumps >= OUTLIER_LIMIT && signal.confirmed <= self.confirmations
    }

    /// The probability that a working sensor was as still as this one in its latest readings.
    ///
    /// White noise changes a reading by less than a tenth of its deviation with a probability below 8 %, for any signal
    /// and any earlier readings. The share of readings off a line shows whether the sensor has noise.
    #[inline(always)]
    fn update_liveliness(&self, signal: &mut Signal<T>, still_change: T, change: T) {
        let (zero, one) = (T::splat(0.0), T::splat(1.0));
        let off_line = (change - signal.last_change).abs() > T::splat(OFF_LINE_CHANGE) * still_change;
        signal.last_change = change;
        // A mean over all readings at first, so that noise which stops soon after the start is noticed.
        let mean = one / (T::splat(PRIOR_READINGS) + signal.readings);
        let gain = if mean > self.liveliness_gain { mean } else { self.liveliness_gain };
        signal.readings = if mean > self.liveliness_gain { signal.readings + one } else { signal.readings };
        signal.liveliness =
            signal.liveliness + gain * (if off_line { one } else { zero } - signal.liveliness);
        let probability = T::splat(STILL_PROBABILITY_FACTOR) * (one - signal.liveliness);
        let probability = if probability > T::splat(LEAST_STILL_PROBABILITY) {
            probability
        } else {
            T::splat(LEAST_STILL_PROBABILITY)
        };
        let still = change.abs() <= still_change && signal.liveliness > T::splat(LIVELY);
        let least = T::splat(0.5) * self.still_probability;
        let likelihood = probability * if signal.likelihood > least { signal.likelihood } else { least };
        signal.likelihood = if still { likelihood } else { one };
    }

    /// Whether a signal has been still for longer than its noise allows.
    #[inline(always)]
    pub(crate) fn is_still(&self, signal: &Signal<T>) -> bool {
        signal.is_stiller(self.still_probability)
    }

    /// Whether a reading repeats itself for the third time although its sensor was moving and has noise, as a stuck
    /// sensor's does. A slower converter repeats a reading once or twice.
    #[inline(always)]
    pub(crate) fn is_stuck(&self, signal: &Signal<T>, still_change: T, reading: T) -> bool {
        signal.repeats + 1 >= OUTLIER_LIMIT
            && reading == signal.last
            && signal.liveliness > T::splat(LIVELY)
            && signal.slope.abs() > T::splat(MOVING_SLOPE) * still_change
    }

    /// Largest jump of a displacement from which the velocity is estimated. A slower converter repeats a reading after
    /// a step of more than one sample's path, and such a step follows its repetitions.
    #[inline(always)]
    pub(crate) fn estimated_tolerance(&self, signal: &Signal<T>, reading: T) -> T {
        let ripple = T::splat(SLOPE_RIPPLE) * signal.slope.abs();
        if reading == signal.last && (signal.repeats > 0 || signal.last_change.abs() > ripple) {
            return T::splat(f32::MAX as f64);
        }
        self.displacement_tolerance
            + self.tolerance_growth * T::from_u32(signal.lost)
            + ripple * T::from_u32(signal.repeats)
    }

    /// Largest jump of the force at a velocity (m/s); friction changes its sign with it.
    #[inline(always)]
    pub(crate) fn force_tolerance(&self, tolerance: T, velocity: T) -> T {
        if velocity.abs() < self.reversal_velocity { tolerance + self.friction_jump } else { tolerance }
    }
}

/// Distance of a reading from the line of the two earlier ones, in units of a still change. The second difference of
/// white noise is √3 times as large as the first.
const OFF_LINE_CHANGE: f64 = 1.7320508;
/// Number of readings on a line with which the liveliness begins. By the rule of three, a share of 3/n is possible with
/// a probability of 5 % if none of n readings was on a line.
const PRIOR_READINGS: f64 = 3.0;
/// Share of readings off a line above which a sensor is alive.
const LIVELY: f64 = 0.75;
/// Factor on the mean slope, which ripples with the jumps of a slower converter.
const SLOPE_RIPPLE: f64 = 1.5;
/// Slope per sample in units of a still change, five deviations of the noise, from which on a sensor does not stand.
const MOVING_SLOPE: f64 = 50.0;
/// Probability of a still reading: at least this value, and this factor times that of a reading on a line.
const LEAST_STILL_PROBABILITY: f64 = 0.13;
const STILL_PROBABILITY_FACTOR: f64 = 1.6;

/// Number of readings without an accepted one between them whose jumps are no single outliers.
const OUTLIER_LIMIT: u32 = 3;
/// Upper limit of the counts.
pub(crate) const LARGEST_COUNT: u32 = 1 << 20;
