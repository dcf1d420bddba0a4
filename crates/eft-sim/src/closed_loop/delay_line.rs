//! A delay of whole samples, its own length in every lane.

use crate::rig::Num;

/// Ring of the last samples.
#[derive(Debug, Clone)]
pub(crate) struct DelayLine<S> {
    samples: Vec<S>,
    delays: Vec<usize>,
    newest: usize,
}

impl<S: Num> DelayLine<S> {
    /// At rest; `delay(i)` is lane `i`'s delay in samples.
    pub(crate) fn new(delay: impl Fn(usize) -> usize) -> Self {
        let delays: Vec<usize> = (0..S::LANES).map(delay).collect();
        let longest = delays.iter().copied().max().unwrap_or(0);
        Self { samples: vec![S::default(); longest + 1], delays, newest: 0 }
    }

    /// Whether no lane delays anything.
    pub(crate) fn is_none(&self) -> bool {
        self.samples.len() == 1
    }

    /// Takes a sample in and gives the delayed one out.
    #[inline]
    pub(crate) fn pass(&mut self, sample: S) -> S {
        let length = self.samples.len();
        if length == 1 {
            return sample;
        }
        self.newest = (self.newest + 1) % length;
        self.samples[self.newest] = sample;
        S::from_lanes(|i| self.samples[(self.newest + length - self.delays[i]) % length].lane(i))
    }
}
