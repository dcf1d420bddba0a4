//! Delays of whole samples, a length of its own in every lane.

use eft_core::{Real, Scalar};

/// Rings of the last samples, one a lane.
#[derive(Debug, Clone)]
pub(crate) struct DelayLines {
    /// Empty where nothing is delayed.
    lines: Vec<DelayLine>,
}

#[derive(Debug, Clone)]
struct DelayLine {
    samples: Vec<f64>,
    next: usize,
}

impl DelayLines {
    /// At rest; `delay(i)` is lane `i`'s delay in samples, of as many lanes as are passed.
    pub(crate) fn new(lanes: usize, delay: impl Fn(usize) -> usize) -> Self {
        let line = |i| DelayLine { samples: vec![0.0; delay(i)], next: 0 };
        let mut lines: Vec<_> = (0..lanes).map(line).collect();
        if lines.iter().all(|line| line.samples.is_empty()) {
            lines.clear();
        }
        Self { lines }
    }

    /// Whether no lane delays anything.
    pub(crate) fn is_none(&self) -> bool {
        self.lines.is_empty()
    }

    /// Takes a sample in and gives the delayed one out, in every lane.
    #[inline]
    pub(crate) fn pass<S: Scalar>(&mut self, sample: S) -> S {
        if self.lines.is_empty() {
            return sample;
        }
        S::from_lanes(|i| S::Element::from_f64(self.pass_lane(i, sample.lane(i).to_f64())))
    }

    /// The same in one lane.
    pub(crate) fn pass_lane(&mut self, lane: usize, sample: f64) -> f64 {
        let Some(line) = self.lines.get_mut(lane) else { return sample };
        let Some(oldest) = line.samples.get_mut(line.next) else { return sample };
        let delayed = std::mem::replace(oldest, sample);
        line.next = (line.next + 1) % line.samples.len();
        delayed
    }

    /// Visits every number that the lines remember, to keep it or to put another one there.
    pub(crate) fn numbers(&mut self, visit: &mut dyn FnMut(&mut f64)) {
        for line in &mut self.lines {
            line.samples.iter_mut().for_each(&mut *visit);
            let mut next = line.next as f64;
            visit(&mut next);
            line.next = next as usize;
        }
    }
}
