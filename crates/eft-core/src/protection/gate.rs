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
    pub(crate) jump: [T; 4],
    /// The same of a displacement (m) from which the velocity is estimated, and its further distance with each lost sample.
    pub(crate) near: T,
    pub(crate) bend: T,
    /// Jump of the force (N) that friction may add near a reversal, and the velocity (m/s) below which a reversal is near.
    pub(crate) friction: T,
    pub(crate) reversing: T,
    /// Change from sample to sample below which a reading is still.
    pub(crate) still: [T; 4],
    /// Coefficient (1) of the average of the liveliness.
    pub(crate) forgetting: T,
    /// Probability below which a series of still readings is a fault.
    pub(crate) chance: T,
    /// Coefficient (1) of the average of a slope.
    pub(crate) share: T,
    /// Number of readings in a row that must agree with their prediction after several that jumped.
    pub(crate) returns: u32,
}
integrity!(SensorGate<T>: jump, near, bend, friction, reversing, still, forgetting, chance, share, returns);

/// The gate's state of one signal. `default()` is that before the first sample.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct Signal<T> {
    /// The last accepted reading, and its slope per sample.
    pub(crate) last: T,
    slope: T,
    /// Samples in a row that were not accepted.
    pub(crate) lost: u32,
    /// Numbers among these that disagreed with their prediction, and the readings since that agreed.
    jumps: u32,
    returned: u32,
    /// Times in a row that the reading repeated itself to the last bit.
    pub(crate) repeats: u32,
    /// Liveliness: share of the readings that were off the line of the two earlier ones, as noise is.
    liveliness: T,
    /// Readings in it, until it forgets as many.
    heard: T,
    /// Probability that a working sensor gives the present series of still readings; 0 before the first.
    pub(crate) likelihood: T,
    /// The last change from reading to reading.
    step: T,
    /// Whether the last reading that was not accepted was a number.
    pub(crate) jumped: bool,
    pub(crate) seen: bool,
}
integrity!(Signal<T>: last, slope, lost, jumps, returned, repeats, liveliness, heard, likelihood, step, jumped, seen);

impl<T: Real> Signal<T> {
    /// Change per sample, low-passed.
    #[inline(always)]
    pub(crate) fn slope(&self) -> T {
        self.slope
    }

    /// Accepts the next reading.
    pub(crate) fn restart(&mut self) {
        (self.lost, self.seen) = (0, false);
    }

    /// Records a reading that disagrees with its prediction, or is no number.
    #[cold]
    fn refuse(&mut self, number: bool) {
        let jumps = if self.lost > 0 { self.jumps } else { 0 };
        self.jumps = jumps.saturating_add(u32::from(number));
        (self.jumped, self.returned) = (number, 0);
    }

    /// Whether the last reading was still or a repetition, as the readings of a failed sensor are.
    #[inline(always)]
    pub(crate) fn is_quiet(&self) -> bool {
        self.repeats > 0 || self.likelihood < T::splat(1.0)
    }

    /// Whether a working sensor is as still as this one with a smaller probability than this.
    #[inline(always)]
    pub(crate) fn is_stiller(&self, chance: T) -> bool {
        self.likelihood > T::splat(0.0) && self.likelihood < chance
    }
}

impl<T: Real> SensorGate<T> {
    /// One reading of a signal: the reading, or NaN if it is not accepted.
    // Inlined once a signal, it made the watched tick of a Cortex-M4F need 136 bytes of stack and 31 instructions more.
    #[inline(never)]
    pub(crate) fn pass(&self, signal: &mut Signal<T>, jump: T, still: T, reading: T) -> T {
        let number = reading.abs() <= T::splat(f32::MAX as f64);
        let foreseen = signal.last + signal.slope * T::from_u32(signal.lost + 1);
        let agrees = number && (!signal.seen || (reading - foreseen).abs() <= jump);
        if !agrees {
            signal.refuse(number);
        }
        if !agrees || signal.lost >= SEVERAL && self.must_return(signal) {
            signal.lost = if signal.lost < MOST { signal.lost + 1 } else { MOST };
            return T::splat(f64::NAN);
        }
        if signal.lost == 0 && signal.seen {
            let step = reading - signal.last;
            signal.slope = signal.slope + self.share * (step - signal.slope);
            self.listen(signal, still, step);
        }
        let repeats = if signal.repeats < MOST { signal.repeats + 1 } else { MOST };
        signal.repeats = if signal.seen && reading == signal.last { repeats } else { 0 };
        (signal.last, signal.lost, signal.seen) = (reading, 0, true);
        reading
    }

    /// Whether a reading that agrees with its prediction is not accepted yet. Near a reversal one of the wrong sign agrees as
    /// well.
    #[cold]
    fn must_return(&self, signal: &mut Signal<T>) -> bool {
        signal.returned = signal.returned.saturating_add(1);
        signal.jumps >= SEVERAL && signal.returned <= self.returns
    }

    /// The probability that a working sensor was as still as this one in its latest readings.
    ///
    /// White noise changes a reading by less than a tenth of its deviation with a probability below 8 %, for any signal
    /// and any earlier readings. The share of readings off a line shows whether the sensor has noise.
    #[inline(always)]
    fn listen(&self, signal: &mut Signal<T>, still: T, step: T) {
        let (zero, one) = (T::splat(0.0), T::splat(1.0));
        let off = (step - signal.step).abs() > T::splat(OFF_A_LINE) * still;
        signal.step = step;
        // A mean over all readings at first, so that noise which stops soon after the start is noticed.
        let mean = one / (T::splat(UNHEARD) + signal.heard);
        let share = if mean > self.forgetting { mean } else { self.forgetting };
        signal.heard = if mean > self.forgetting { signal.heard + one } else { signal.heard };
        signal.liveliness = signal.liveliness + share * (if off { one } else { zero } - signal.liveliness);
        let each = T::splat(MARGIN) * (one - signal.liveliness);
        let each = if each > T::splat(LEAST) { each } else { T::splat(LEAST) };
        let still = step.abs() <= still && signal.liveliness > T::splat(ALIVE);
        let least = T::splat(0.5) * self.chance;
        let likelihood = each * if signal.likelihood > least { signal.likelihood } else { least };
        signal.likelihood = if still { likelihood } else { one };
    }

    /// Whether a signal has been still for longer than its noise allows.
    #[inline(always)]
    pub(crate) fn is_still(&self, signal: &Signal<T>) -> bool {
        signal.is_stiller(self.chance)
    }

    /// Whether a reading repeats itself for the third time although its sensor was moving and has noise, as a stuck
    /// sensor's does. A slower converter repeats a reading once or twice.
    #[inline(always)]
    pub(crate) fn stands(&self, signal: &Signal<T>, still: T, reading: T) -> bool {
        signal.repeats + 1 >= SEVERAL
            && reading == signal.last
            && signal.liveliness > T::splat(ALIVE)
            && signal.slope.abs() > T::splat(MOVING) * still
    }

    /// Largest jump of a displacement from which the velocity is estimated. A slower converter repeats a reading after a
    /// step of more than one sample's path, and such a step follows its repetitions.
    #[inline(always)]
    pub(crate) fn path(&self, signal: &Signal<T>, reading: T) -> T {
        let ripple = T::splat(RIPPLE) * signal.slope.abs();
        if reading == signal.last && (signal.repeats > 0 || signal.step.abs() > ripple) {
            return T::splat(f32::MAX as f64);
        }
        self.near + self.bend * T::from_u32(signal.lost) + ripple * T::from_u32(signal.repeats)
    }

    /// Largest jump of the force at a velocity (m/s); friction changes its sign with it.
    #[inline(always)]
    pub(crate) fn jump_of_force(&self, jump: T, velocity: T) -> T {
        if velocity.abs() < self.reversing { jump + self.friction } else { jump }
    }
}

/// Distance of a reading from the line of the two earlier ones, in units of a still change. The second difference of white
/// noise is √3 times as large as the first.
const OFF_A_LINE: f64 = 1.7320508;
/// Number of readings on a line with which the liveliness begins. By the rule of three, a share of 3/n is possible with a
/// probability of 5 % if none of n readings was on a line.
const UNHEARD: f64 = 3.0;
/// Share of readings off a line above which a sensor is alive.
const ALIVE: f64 = 0.75;
/// Factor on the mean slope, which ripples with the jumps of a slower converter.
const RIPPLE: f64 = 1.5;
/// Slope per sample in units of a still change, five deviations of the noise, from which on a sensor does not stand.
const MOVING: f64 = 50.0;
/// Probability of a still reading: at least this value, and this factor times that of a reading on a line.
const LEAST: f64 = 0.13;
const MARGIN: f64 = 1.6;

/// Number of readings without an accepted one between them whose jumps are no single outliers.
const SEVERAL: u32 = 3;
/// Upper limit of the counts.
const MOST: u32 = 1 << 20;
