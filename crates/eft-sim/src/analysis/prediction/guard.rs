//! When a guard alone acts in a test, and the errors until then.

use std::f64::consts::TAU;

use eft_core::guard_tuning::{AVERAGE, LOW_PASS, QUIET, REMOVAL};

use crate::analysis::Guarded;
use crate::analysis::linear::{Complex, StateSpace};
use crate::analysis::prediction::signals::{Faded, Signals};
use crate::error::Result;
use crate::ground_motion::excitation::Command;

/// Time (s) for which an unstable motion grows after the guard has begun.
const GROWS_ON: f64 = 0.3;
/// Exponent (1) from which on the motion is so large that no estimate is needed.
const ENDS: f64 = 5.0;
/// Growth (1) by which an unstable motion certainly reaches the guard's threshold during a test.
const CERTAIN: f64 = 10.0;

/// The sample by which the guard has reduced the level of a stable loop with this model; `None` if the motion stays too small.
pub(super) fn reduced(guarded: &Guarded, model: &StateSpace, commands: &[Command]) -> Result<Option<usize>> {
    let Some(faded) = Faded::of(commands)? else { return Ok(None) };
    let rate = commands[0].sample_rate;
    // The guard compares the excess with the square of the velocity over the sum of both squares.
    let quiet = QUIET * QUIET;
    let enough = quiet * (1.0 / (guarded.excess - 1.0)).max(1.0);
    let mut first: Option<usize> = None;
    for own in Signals::of(model, commands, &faded)? {
        let low_pass = |bin: usize| Complex::new(1.0, faded.frequency(bin) / LOW_PASS).powi(-2);
        let passed = own.velocity.iter().enumerate().map(|(bin, value)| value * low_pass(bin)).collect();
        let (mut mean, mut removed, mut began) = (0.0, 0.0, false);
        for (sample, velocity) in faded.signal(passed)?.enumerate() {
            mean += (velocity * velocity - mean) / (AVERAGE * rate);
            began |= mean > enough;
            if began {
                removed += mean / (mean + quiet) / (REMOVAL * rate);
            }
            if removed > 1.0 {
                first = Some(first.map_or(sample, |first| first.min(sample)));
                break;
            }
        }
    }
    Ok(first)
}

/// The signals of a test whose loop changes at a sample.
pub(super) fn switched(
    before: Vec<Signals>,
    after: Vec<Signals>,
    faded: &Faded,
    sample: usize,
) -> Result<Vec<Signals>> {
    let joined = |before, after| {
        let (before, after) = (faded.signal(before)?, faded.signal(after)?);
        faded.spectrum(before.take(sample).chain(after.skip(sample)).collect::<Vec<_>>())
    };
    before
        .into_iter()
        .zip(after)
        .map(|(before, after)| {
            Ok(Signals {
                missed_force: joined(before.missed_force, after.missed_force)?,
                missed_motion: joined(before.missed_motion, after.missed_motion)?,
                ..after
            })
        })
        .collect()
}

/// Root mean square (m) over a test of the motion by which an unstable loop grows until the guard acts and stops it, at least:
/// it must exceed the guard's threshold. 0 for a growth that a test (s) may not have time for. The growth rates (1/s) are those
/// before and after.
pub(super) fn swing(guarded: &Guarded, growth: f64, after: f64, duration: f64) -> f64 {
    if growth * duration < CERTAIN {
        return 0.0;
    }
    let by_filters = 1.0 + (guarded.angular / (TAU * LOW_PASS)).powi(2);
    let largest = QUIET * by_filters / guarded.angular * libm::exp((growth * GROWS_ON).min(ENDS));
    let time = 0.5 / growth - 0.5 / after.min(-0.5 / duration);
    largest * (time.min(duration) / duration).sqrt()
}
