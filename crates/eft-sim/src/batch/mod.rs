//! Many tests at once, on all cores: what studies run on.
//!
//! Tests of one kind run side by side, a processor's width of them at a time, through the same plant and the same
//! controller as one alone. A test's outcome does not depend on the tests beside it, on their order or on the number of threads.

mod floor;
mod outcome;
mod pieces;
mod pool;
mod wide;

use crate::closed_loop::{Precision, SimulateOptions, simulate_actuators};
use crate::config::RigConfig;
use crate::error::{Error, Result};
use crate::ground_motion::excitation::Command;
use pieces::pieces;
use wide::SideBySide;

pub use outcome::Outcome;

/// One test of a batch.
#[derive(Debug, Clone, Copy)]
pub struct Test<'a> {
    /// The rig to be tested.
    pub rig: &'a RigConfig,
    /// The force (N) to be applied, one an actuator, the ground floor's first.
    pub commands: &'a [Command],
}

/// How a batch is run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BatchOptions {
    /// How each test is run.
    pub simulate: SimulateOptions,
    /// Threads; `None` is one a core.
    pub threads: Option<usize>,
    /// Whether the outcomes carry the traces.
    pub traces: bool,
    /// Whether to compute the metrics that need a Fourier transform, which take longer than the test.
    pub fft: bool,
}

/// Runs every test, the controllers in the precision `P`; one outcome each, in order. A test that fails is an error
/// in its place and loses no other.
///
/// `go_on(done, total)` is asked a few times a second, on the calling thread; when it says no, the batch ends
/// with [`Error::Interrupted`].
///
/// # Errors
/// No threads; an interruption.
pub fn simulate_batch<P: Precision>(
    tests: &[Test<'_>],
    options: &BatchOptions,
    go_on: impl FnMut(usize, usize) -> bool,
) -> Result<Vec<Result<Outcome>>> {
    let cores = || std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let threads = options.threads.unwrap_or_else(cores);
    if threads == 0 {
        return Err(Error::value("threads", 0, "must be at least 1"));
    }
    let alone = |place: usize, stopped: &dyn Fn() -> bool| {
        let Test { rig, commands } = tests[place];
        let runs = simulate_actuators::<P>(rig, commands, &options.simulate, |_, _| !stopped());
        (place, runs.and_then(|runs| Outcome::new(rig, runs, options)))
    };
    let pieces = pieces(tests, options);
    let work = |n: usize, stopped: &dyn Fn() -> bool| {
        let piece = &pieces[n];
        if let Some(kind) = piece.side_by_side {
            let side_by_side: Vec<_> = piece.places.iter().map(|&place| tests[place]).collect();
            let wide = SideBySide { tests: &side_by_side, kind, options, stopped };
            match wide.run_widest(P::WIDTH) {
                Some(Ok(outcomes)) => return piece.places.iter().copied().zip(outcomes).collect(),
                Some(Err(_)) if stopped() => return Vec::new(),
                // One of them is refused; each alone says which.
                _ => {}
            }
        }
        piece.places.iter().map(|&place| alone(place, stopped)).collect()
    };
    pool::run(threads, pieces.len(), tests.len(), work, go_on)
}

#[cfg(test)]
mod tests;
