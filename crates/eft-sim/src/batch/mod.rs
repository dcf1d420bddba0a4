//! Many tests at once, on all cores, as studies run them.
//!
//! Tests of one kind run side by side in the processor's vector registers, with the same plant and controller
//! as a single test. A test's outcome depends neither on the other tests nor on their order and the number of
//! threads.

mod actuator_recorder;
mod chunks;
mod lane_batch;
mod outcome;
mod pool;
mod request;

use crate::closed_loop::{Precision, simulate_actuators};
use crate::{Result, checks};
use chunks::chunks;
use lane_batch::LaneBatch;

pub use outcome::Outcome;
pub use request::{BatchOptions, Test};

/// How many sets of tests of a batch run side by side on this processor.
pub fn side_by_side(tests: &[Test<'_>], options: &BatchOptions) -> usize {
    chunks(tests, options).iter().filter(|chunk| chunk.side_by_side.is_some()).count()
}

/// Runs every test, with the controllers in the precision `P`, and returns their outcomes in order. A test
/// that fails gives an error in its place and does not affect the others.
///
/// `progress(done, total)` is called a few times a second on the calling thread. If it returns `false`, the
/// batch ends with [`Error::Interrupted`](crate::Error::Interrupted).
///
/// # Errors
/// Zero threads, or an interruption.
pub fn simulate_batch<P: Precision>(
    tests: &[Test<'_>],
    options: &BatchOptions,
    progress: impl FnMut(usize, usize) -> bool,
) -> Result<Vec<Result<Outcome>>> {
    let cores = || std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let threads = options.threads.unwrap_or_else(cores);
    checks::require(threads > 0, "threads", 0, "must be at least 1")?;
    let alone = |index: usize, stopped: &dyn Fn() -> bool| {
        let Test { rig, commands } = tests[index];
        let runs = simulate_actuators::<P>(rig, commands, &options.simulate, |_, _| !stopped());
        (index, runs.and_then(|runs| Outcome::new(rig, runs, options)))
    };
    let chunks = chunks(tests, options);
    let work = |n: usize, stopped: &dyn Fn() -> bool| {
        let chunk = &chunks[n];
        if let Some(kind) = chunk.side_by_side {
            let side_by_side: Vec<_> = chunk.indices.iter().map(|&index| tests[index]).collect();
            let lanes = LaneBatch { tests: &side_by_side, kind, options, stopped };
            match lanes.run_in_widest_lanes(P::WIDTH) {
                Some(Ok(outcomes)) => return chunk.indices.iter().copied().zip(outcomes).collect(),
                Some(Err(_)) if stopped() => return Vec::new(),
                // One of the tests is refused; each test alone then gives its own error.
                _ => {}
            }
        }
        chunk.indices.iter().map(|&index| alone(index, stopped)).collect()
    };
    pool::run(threads, chunks.len(), tests.len(), work, progress)
}
