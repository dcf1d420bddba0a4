//! Channels that ended at the range of their sensor or converter.

use super::gaps::{Named, stretches};
use crate::{Result, checks};

/// Least length of a stay at the largest or least value, in samples. Below it a smooth peak may be left by a step.
const LEAST_STAY: usize = 5;
/// Least number of stays. A single one may be a piston at rest.
const LEAST_STAYS: usize = 2;
/// Least step into or out of a stay, in steps of the resolution. A smooth signal comes within one step of its peak.
const LEAST_STEP: f64 = 3.0;

/// Refuses signals that stay at their largest or least value several times, and reach or leave it by a step.
pub(super) fn check_unclipped(signals: &[Named<'_>]) -> Result<()> {
    for (name, signal) in signals {
        let finite = || signal.iter().copied().filter(|value| value.is_finite());
        let extremes = [finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max)];
        let stays = extremes.map(|extreme| stays(signal, extreme));
        let times = stays.iter().map(Vec::len).sum::<usize>();
        let samples: usize = stays.iter().flatten().map(ExactSizeIterator::len).sum();
        let [least, most] = extremes;
        let found =
            format!("{samples} samples at an end of its range, {least:.4e} to {most:.4e}, in {times} places");
        let allowed = "must not be clipped: use a larger range of the channel or a smaller test";
        checks::require(least >= most || times < LEAST_STAYS, name, found, allowed)?;
    }
    Ok(())
}

/// Stretches of a value that a neighbour reaches by a step.
fn stays(signal: &[f64], value: f64) -> Vec<std::ops::Range<usize>> {
    let mut stays = stretches(signal.len(), LEAST_STAY, |i| signal[i].total_cmp(&value).is_eq());
    let steps = signal.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > 0.0);
    let least = LEAST_STEP * steps.fold(f64::INFINITY, f64::min);
    let is_step = |beside: Option<&f64>| beside.is_some_and(|beside| (beside - value).abs() > least);
    stays.retain(|stay| is_step(signal[..stay.start].last()) || is_step(signal.get(stay.end)));
    stays
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A decaying oscillation, with a resolution if it is positive.
    fn vibration(resolution: f64) -> Vec<f64> {
        let value = |i: usize| {
            let t = i as f64 / 512.0;
            let value = 0.02 * (-0.3 * t).exp() * (9.9 * t).cos();
            if resolution > 0.0 { (value / resolution).round() * resolution } else { value }
        };
        (0..5000).map(value).collect()
    }

    #[test]
    fn a_clipped_signal_is_refused_and_a_coarse_one_is_not() {
        for resolution in [0.0, 4e-6, 5e-4] {
            let signal = vibration(resolution);
            check_unclipped(&[("x", &signal)]).unwrap();
            for limit in [0.005, 0.01, 0.015] {
                let clipped: Vec<f64> = signal.iter().map(|value| value.min(limit)).collect();
                let refused = check_unclipped(&[("y", &signal), ("x", &clipped)]);
                // With 0.5 mm, a slope of less than 1.5 mm a sample looks smooth.
                assert_eq!(refused.is_err(), resolution < 1e-4, "{resolution}, {limit}");
            }
        }
        let lower: Vec<f64> = vibration(4e-6).iter().map(|value| value.max(-0.01)).collect();
        let said = check_unclipped(&[("x", &lower)]).unwrap_err().to_string();
        assert!(
            said.contains("samples at an end of its range, -1.0000e-2 to 2.0000e-2")
                && said.contains("must not be clipped"),
            "{said}"
        );
    }

    #[test]
    fn rests_gaps_and_constants_are_not_clipped() {
        let mut signal = vibration(0.0);
        signal[..300].fill(0.03);
        signal[4000..4010].fill(f64::NAN);
        check_unclipped(&[("x", &signal), ("x", &[1.0; 50]), ("x", &[])]).unwrap();
    }
}
