//! Many tests at once, on all cores, as studies run them.
//!
//! Tests of one kind run side by side in the processor's vector registers, with the same plant and controller
//! as a single test. A test's outcome depends neither on the other tests nor on their order and the number of
//! threads.

mod floor;
mod outcome;
mod pieces;
mod pool;
mod request;
mod wide;

use crate::closed_loop::{Precision, simulate_actuators};
use crate::{Result, checks};
use pieces::pieces;
use wide::SideBySide;

pub use outcome::Outcome;
pub use request::{BatchOptions, Test};

/// How many sets of tests of a batch run side by side on this processor.
pub fn side_by_side(tests: &[Test<'_>], options: &BatchOptions) -> usize {
    pieces(tests, options).iter().filter(|piece| piece.side_by_side.is_some()).count()
}

/// Runs every test, with the controllers in the precision `P`, and returns their outcomes in order. A test
/// that fails gives an error in its place and does not affect the others.
///
/// `go_on(done, total)` is called a few times a second on the calling thread. If it returns `false`, the
/// batch ends with [`Error::Interrupted`](crate::Error::Interrupted).
///
/// # Errors
/// Zero threads, or an interruption.
pub fn simulate_batch<P: Precision>(
    tests: &[Test<'_>],
    options: &BatchOptions,
    go_on: impl FnMut(usize, usize) -> bool,
) -> Result<Vec<Result<Outcome>>> {
    let cores = || std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let threads = options.threads.unwrap_or_else(cores);
    checks::require(threads > 0, "threads", 0, "must be at least 1")?;
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
                // One of the tests is refused; each test alone then gives its own error.
                _ => {}
            }
        }
        piece.places.iter().map(|&place| alone(place, stopped)).collect()
    };
    pool::run(threads, pieces.len(), tests.len(), work, go_on)
}
