//! The converter between the digital side and the valve's electronics.

use eft_core::{Mask, status};

use crate::config;
use crate::instruments::DelayLines;
use crate::instruments::quantizer::Quantizer;
use crate::lanes::Num;

/// Range, resolution and delay of the output in each lane.
#[derive(Debug, Clone)]
pub(crate) struct Dac {
    /// Empty if the converter of every lane is ideal.
    lanes: Vec<Option<Quantizer>>,
    delay: DelayLines,
}

impl Dac {
    /// The converters `dac(0)`, `dac(1)`, … of a number of lanes, with an input of `initial(i)` V until now.
    pub(crate) fn new<'a>(
        lanes: usize,
        dac: impl Fn(usize) -> &'a config::Dac,
        initial: impl Fn(usize) -> f64,
    ) -> Self {
        let lane = |i| dac(i).range.map(|range| Quantizer::new(range, dac(i).bits));
        let mut lanes: Vec<_> = (0..lanes).map(lane).collect();
        let converted = |i: usize| lanes[i].map_or(initial(i), |dac| dac.convert(initial(i)));
        let delay = DelayLines::new(lanes.len(), |i| dac(i).delay as usize, converted);
        if lanes.iter().all(Option::is_none) {
            lanes.clear();
        }
        Self { lanes, delay }
    }

    /// Whether the converter of every lane is ideal.
    pub(crate) fn is_ideal(&self) -> bool {
        self.lanes.is_empty() && self.delay.is_none()
    }

    /// The present output voltage, and [`status::COMMAND_LIMITED`] if the input was outside the range.
    #[inline(always)]
    pub(crate) fn convert<S: Num>(&mut self, voltage: S) -> (S, S::Flags) {
        if self.lanes.is_empty() {
            return (self.delay.delay(voltage), S::Flags::default());
        }
        let lane = |i: usize| self.lanes.get(i).copied().flatten();
        let out = S::from_lanes(|i| lane(i).map_or(voltage.lane(i), |dac| dac.convert(voltage.lane(i))));
        let clipped = S::Mask::from_lanes(|i| lane(i).is_some_and(|dac| dac.clips(voltage.lane(i))));
        (self.delay.delay(out), S::flag(clipped, status::COMMAND_LIMITED))
    }

    /// Visits every number of the state, to store or to replace it.
    pub(crate) fn numbers(&mut self, visit: &mut dyn FnMut(&mut f64)) {
        self.delay.numbers(visit);
    }
}
