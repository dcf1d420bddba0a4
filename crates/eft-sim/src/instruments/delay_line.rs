//! Delays of whole samples, with a separate length for each lane.

use eft_core::{Real, Scalar};

/// Ring buffers of the last samples, one per lane.
#[derive(Debug, Clone)]
pub(crate) struct DelayLines {
    /// Empty if no lane has a delay.
    lines: Vec<DelayLine>,
}

#[derive(Debug, Clone)]
struct DelayLine {
    samples: Vec<f64>,
    next: usize,
}

impl DelayLines {
    /// For a number of lanes; `delay(i)` is the delay of lane `i` in samples, `initial(i)` its signal before the first
    /// one.
    pub(crate) fn new(lanes: usize, delay: impl Fn(usize) -> usize, initial: impl Fn(usize) -> f64) -> Self {
        let line = |i| DelayLine { samples: vec![initial(i); delay(i)], next: 0 };
        let mut lines: Vec<_> = (0..lanes).map(line).collect();
        if lines.iter().all(|line| line.samples.is_empty()) {
            lines.clear();
        }
        Self { lines }
    }

    /// Whether no lane has a delay.
    pub(crate) fn is_none(&self) -> bool {
        self.lines.is_empty()
    }

    /// Stores a sample and returns the delayed one, in every lane.
    #[inline(always)]
    pub(crate) fn delay<S: Scalar>(&mut self, sample: S) -> S {
        if self.lines.is_empty() { sample } else { self.delayed(sample) }
    }

    // A separate function, so that the check before it is inlined.
    #[inline(never)]
    fn delayed<S: Scalar>(&mut self, sample: S) -> S {
        S::from_lanes(|i| S::Element::from_f64(self.delay_lane(i, sample.lane(i).to_f64())))
    }

    /// The same in one lane.
    pub(crate) fn delay_lane(&mut self, lane: usize, sample: f64) -> f64 {
        let Some(line) = self.lines.get_mut(lane) else { return sample };
        let Some(oldest) = line.samples.get_mut(line.next) else { return sample };
        let delayed = std::mem::replace(oldest, sample);
        line.next = (line.next + 1) % line.samples.len();
        delayed
    }

    /// Visits every number of the state, to store or to replace it.
    pub(crate) fn numbers(&mut self, visit: &mut dyn FnMut(&mut f64)) {
        for line in &mut self.lines {
            line.samples.iter_mut().for_each(&mut *visit);
            let mut next = line.next as f64;
            visit(&mut next);
            line.next = next as usize;
        }
    }
}
