//! The gate in front of the sensors: a reading that no rig could have reached since the last one counts as lost.

use crate::number::Real;

/// The signals, in the order of every array of them.
pub(crate) const FORCE: usize = 0;
pub(crate) const DISPLACEMENT: usize = 1;
pub(crate) const VELOCITY: usize = 2;
pub(crate) const SPOOL: usize = 3;

/// How far a reading may lie from the one that is foreseen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SensorGate<T> {
    /// In the signals' units.
    pub(crate) jump: [T; 4],
    /// Share of the way that the slopes go in a sample.
    pub(crate) share: T,
}

/// What the gate remembers of one signal. `default()` has seen nothing.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub(crate) struct Signal<T> {
    /// The last reading that was accepted, and its slope per sample.
    pub(crate) last: T,
    slope: T,
    /// Samples in a row that were not accepted.
    pub(crate) lost: u32,
    /// Times in a row that the reading repeated itself to the last bit.
    pub(crate) repeats: u32,
    /// Whether the last reading that was not accepted was a number.
    pub(crate) jumped: bool,
    seen: bool,
}

impl<T: Real> SensorGate<T> {
    /// One reading of a signal: itself, or NaN where it is not accepted.
    #[inline(always)]
    pub(crate) fn pass(&self, signal: &mut Signal<T>, jump: T, reading: T) -> T {
        let number = reading.abs() <= T::splat(f32::MAX as f64);
        let foreseen = signal.last + signal.slope * T::from_u32(signal.lost + 1);
        if !(number && (!signal.seen || (reading - foreseen).abs() <= jump)) {
            signal.lost = if signal.lost < MOST { signal.lost + 1 } else { MOST };
            signal.jumped = number;
            return T::splat(f64::NAN);
        }
        if signal.lost == 0 && signal.seen {
            signal.slope = signal.slope + self.share * ((reading - signal.last) - signal.slope);
        }
        let repeats = if signal.repeats < MOST { signal.repeats + 1 } else { MOST };
        signal.repeats = if signal.seen && reading == signal.last { repeats } else { 0 };
        (signal.last, signal.lost, signal.seen) = (reading, 0, true);
        reading
    }
}

/// Counts go no further.
const MOST: u32 = 1 << 20;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spike_is_lost_and_a_step_stays_lost() {
        let gate = SensorGate { jump: [1.0; 4], share: 0.1 };
        let mut signal = Signal::default();
        let mut pass = |reading: f64| gate.pass(&mut signal, 1.0, reading);
        // The first reading may be anything.
        assert!((pass(50.0) - 50.0).abs() < 1e-12);
        for n in 1..200 {
            let reading = 50.0 + 0.5 * f64::from(n);
            assert!((pass(reading) - reading).abs() < 1e-12, "{n}");
        }
        assert!(pass(-50.0).is_nan() && pass(f64::NAN).is_nan());
        // Two were lost; the slope is known.
        assert!((pass(151.0) - 151.0).abs() < 1e-12);
        for _ in 0..20 {
            assert!(pass(-150.0).is_nan());
        }
        assert_eq!((signal.lost, signal.jumped), (20, true));
    }
}
