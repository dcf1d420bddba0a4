//! Gaps, offsets and drifts of signals.

use crate::error::{Error, Result};

/// Refuses signals that differ in length or are too short.
pub(super) fn check(names: (&str, &str), lengths: (usize, usize), least: usize) -> Result<()> {
    if lengths.0 != lengths.1 {
        let allowed = format!("must have as many samples as {}, {}", names.0, lengths.0);
        return Err(Error::value(names.1, format!("{} samples", lengths.1), allowed));
    }
    if lengths.0 < least {
        return Err(Error::value(
            names.0,
            format!("{} samples", lengths.0),
            format!("must have at least {least}"),
        ));
    }
    Ok(())
}

/// Stretches of samples for which `valid` holds, at least `least` long.
pub(super) fn stretches(
    samples: usize,
    least: usize,
    valid: impl Fn(usize) -> bool,
) -> Vec<std::ops::Range<usize>> {
    let mut found = Vec::new();
    let mut start = None;
    for i in 0..=samples {
        match (i < samples && valid(i), start) {
            (true, None) => start = Some(i),
            (false, Some(from)) => {
                if i - from >= least {
                    found.push(from..i);
                }
                start = None;
            }
            _ => (),
        }
    }
    found
}

/// Removes offset and drift from the valid samples; the others become zero.
pub(super) fn detrend(signal: &[f64], valid: impl Fn(usize) -> bool) -> Vec<f64> {
    let middle = 0.5 * signal.len() as f64;
    let there = || signal.iter().enumerate().filter(|(i, _)| valid(*i)).map(|(i, v)| (i as f64 - middle, *v));
    let count = there().count().max(1) as f64;
    let (time, mean) = there().fold((0.0, 0.0), |(t, m), (i, v)| (t + i / count, m + v / count));
    let (product, square) =
        there().fold((0.0, 0.0), |(p, s), (i, v)| (p + (i - time) * (v - mean), s + (i - time) * (i - time)));
    let slope = if square > 0.0 { product / square } else { 0.0 };
    let rest = |(i, v): (usize, &f64)| {
        if valid(i) { v - mean - slope * (i as f64 - middle - time) } else { 0.0 }
    };
    let rest: Vec<f64> = signal.iter().enumerate().map(rest).collect();
    // The rounding error of a straight line is not a signal.
    let raw: f64 = there().map(|(_, v)| v * v).sum();
    let left: f64 = rest.iter().map(|v| v * v).sum();
    if left > 1e-24 * raw { rest } else { vec![0.0; signal.len()] }
}
