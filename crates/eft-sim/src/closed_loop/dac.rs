//! The converter between the digital side and the valve's electronics.

use eft_core::{Mask, status};

use crate::config;
use crate::rig::Num;
use crate::sensors::Quantizer;

/// Range and resolution of the output, each lane its own.
#[derive(Debug, Clone)]
pub(crate) struct Dac<S> {
    /// Empty where every lane's is ideal.
    lanes: Vec<Option<Quantizer>>,
    number: std::marker::PhantomData<S>,
}

impl<S: Num> Dac<S> {
    pub(crate) fn new<'a>(dac: impl Fn(usize) -> Option<&'a config::Dac>) -> Self {
        let lane = |i| dac(i).map(|dac| Quantizer::new(dac.range, dac.bits));
        let mut lanes: Vec<_> = (0..S::LANES).map(lane).collect();
        if lanes.iter().all(Option::is_none) {
            lanes.clear();
        }
        Self { lanes, number: std::marker::PhantomData }
    }

    /// Whether every lane's is ideal.
    pub(crate) fn is_ideal(&self) -> bool {
        self.lanes.is_empty()
    }

    /// The voltage that comes out, and [`status::COMMAND_LIMITED`] where the range cut it.
    #[inline(always)]
    pub(crate) fn convert(&self, voltage: S) -> (S, S::Flags) {
        if self.lanes.is_empty() {
            return (voltage, S::Flags::default());
        }
        let lane = |i: usize| self.lanes.get(i).copied().flatten();
        let out = S::from_lanes(|i| lane(i).map_or(voltage.lane(i), |dac| dac.convert(voltage.lane(i))));
        let clipped = S::Mask::from_lanes(|i| lane(i).is_some_and(|dac| dac.clips(voltage.lane(i))));
        (out, S::flag(clipped, status::COMMAND_LIMITED))
    }
}
