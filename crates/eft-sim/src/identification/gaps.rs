//! Gaps, offsets, drifts and ends of signals.

use std::f64::consts::TAU;

use crate::{Result, checks};

/// A signal with its name.
pub(super) type Named<'a> = (&'a str, &'a [f64]);

/// Refuses signals that differ in length or are too short.
pub(super) fn check([first, other]: [Named<'_>; 2], least: usize) -> Result<()> {
    let [samples, others] = [first, other].map(|(_, signal)| signal.len());
    let allowed = format!("must have as many samples as {}, {samples}", first.0);
    checks::require(samples == others, other.0, format!("{others} samples"), allowed)?;
    let allowed = format!("must have at least {least}");
    checks::require(samples >= least, first.0, format!("{samples} samples"), allowed)
}

/// Refuses signals that differ in length from the first, are too short or have gaps.
pub(super) fn check_whole(signals: &[Named<'_>], least: usize) -> Result<()> {
    signals.iter().skip(1).try_for_each(|other| check([signals[0], *other], least))?;
    signals.iter().try_for_each(|(name, signal)| checks::signal(name, signal))
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

/// The signal with its short gaps, of at most `most` samples, bridged by straight lines.
pub(super) fn bridged(signal: &[f64], most: usize) -> Vec<f64> {
    let mut whole = signal.to_vec();
    let gaps = stretches(signal.len(), 1, |i| !signal[i].is_finite());
    for gap in gaps.into_iter().filter(|gap| gap.len() <= most && gap.start > 0 && gap.end < signal.len()) {
        let (from, to) = (signal[gap.start - 1], signal[gap.end]);
        let step = (to - from) / (gap.len() + 1) as f64;
        for (i, value) in whole[gap].iter_mut().enumerate() {
            *value = from + step * (i + 1) as f64;
        }
    }
    whole
}

/// Removes offset and drift, fitted with weights; samples without weight become zero.
pub(super) fn detrend(signal: &[f64], weight: impl Fn(usize) -> f64) -> Vec<f64> {
    let middle = 0.5 * signal.len() as f64;
    let there = || {
        let all = signal.iter().enumerate().map(|(i, v)| (weight(i), i as f64 - middle, *v));
        all.filter(|(weight, ..)| *weight > 0.0)
    };
    let count = there().map(|(w, ..)| w).sum::<f64>();
    let (time, mean) = there().fold((0.0, 0.0), |(t, m), (w, i, v)| (t + w * i / count, m + w * v / count));
    let (product, square) = there().fold((0.0, 0.0), |(p, s), (w, i, v)| {
        (p + w * (i - time) * (v - mean), s + w * (i - time) * (i - time))
    });
    let slope = if square > 0.0 { product / square } else { 0.0 };
    let rest = |(i, v): (usize, &f64)| {
        if weight(i) > 0.0 { v - mean - slope * (i as f64 - middle - time) } else { 0.0 }
    };
    let rest: Vec<f64> = signal.iter().enumerate().map(rest).collect();
    // The rounding error of a straight line is not a signal.
    let raw: f64 = there().map(|(_, _, v)| v * v).sum();
    let left: f64 = rest.iter().map(|v| v * v).sum();
    if left > 1e-24 * raw { rest } else { vec![0.0; signal.len()] }
}

/// The fading of both signals at gaps and at the ends of the recording. That of the command leads by a delay.
pub(super) struct Fade {
    /// First and last position of each stretch of the response, in samples.
    stretches: Vec<(f64, f64)>,
    /// Length of a raised cosine, in samples.
    ramp: f64,
    /// Delay (samples) of the response's fading behind that of the command.
    delay: f64,
    samples: usize,
}

impl Fade {
    pub(super) fn of(command: &[f64], response: &[f64], ramp: f64, delay: f64) -> Result<Self> {
        let samples = command.len();
        let there = |signal: &[f64], shift: f64| -> Vec<(f64, f64)> {
            let parts = stretches(samples, 1, |i| signal[i].is_finite());
            parts.into_iter().map(|part| (part.start as f64 + shift, (part.end - 1) as f64 + shift)).collect()
        };
        let (first, second) = (there(response, 0.0), there(command, delay));
        let (mut stretches, mut kept, least) = (Vec::new(), 0.0, 2.0 * ramp);
        let (mut i, mut j) = (0, 0);
        while let (Some(a), Some(b)) = (first.get(i), second.get(j)) {
            let both = (a.0.max(b.0), a.1.min(b.1));
            if both.1 - both.0 >= least {
                kept += both.1 - both.0 + 1.0;
                stretches.push(both);
            }
            if a.1 < b.1 {
                i += 1;
            } else {
                j += 1;
            }
        }
        let found = format!("{samples} samples");
        let allowed = format!("must have more than {least:.0}: four periods of the band's highest frequency");
        checks::require((samples - 1) as f64 >= least, "command", found, allowed)?;
        let found =
            format!("{kept:.0} of {samples} samples in stretches of more than {least:.0} without a gap");
        let allowed = "must be at least half";
        checks::require(2.0 * kept >= samples as f64, "command and response", found, allowed)?;
        Ok(Self { stretches, ramp, delay, samples })
    }

    /// Weight of each sample at a lead (samples).
    fn weights(&self, lead: f64) -> Vec<f64> {
        let mut weights = vec![0.0; self.samples];
        for (from, to) in self.stretches.iter().map(|(from, to)| (from - lead, to - lead)) {
            let last = (to.floor() as usize).min(self.samples - 1);
            for (i, weight) in weights.iter_mut().enumerate().take(last + 1).skip(from.ceil() as usize) {
                let near = (i as f64 - from).min(to - i as f64) / self.ramp;
                *weight = if near < 1.0 { 0.5 - 0.5 * (0.5 * TAU * near).cos() } else { 1.0 };
            }
        }
        weights
    }

    pub(super) fn of_command(&self, command: &[f64]) -> Vec<f64> {
        faded(command, &self.weights(self.delay))
    }

    pub(super) fn of_response(&self, response: &[f64]) -> Vec<f64> {
        faded(response, &self.weights(0.0))
    }

    /// Factor on the variance, because the fading makes neighbouring frequencies alike.
    pub(super) fn inflation(&self) -> f64 {
        let sum = |power: i32| self.weights(0.0).iter().map(|weight| weight.powi(power)).sum::<f64>();
        self.samples as f64 * sum(4) / sum(2).powi(2)
    }
}

fn faded(signal: &[f64], weights: &[f64]) -> Vec<f64> {
    let mut rest = detrend(signal, |i| weights[i]);
    rest.iter_mut().zip(weights).for_each(|(value, weight)| *value *= weight);
    rest
}
