//! Margins of a sampled force loop, from its poles and its frequency response.

use std::f64::consts::{PI, TAU};

use nalgebra::Complex;

use super::GAINS;
use crate::Result;
use crate::design::held_piston::{Gains, Sampled};

/// Points of a frequency response, from 0.1 Hz to half the sample rate.
const FREQUENCIES: usize = 160;
/// Steps between two of them to the frequency of a margin, by bisection or by golden sections.
const REFINEMENTS: usize = 50;
const GOLDEN: f64 = 0.618_033_988_749_894_8;

impl Sampled {
    pub(super) fn gain_margin(&self, gains: Gains) -> Result<f64> {
        let between = self.last_stable(gains, f64::INFINITY)?;
        self.gain_margin_within(gains, between)
    }

    /// Whether the gain margin is at least so large.
    pub(super) fn has_gain_margin(&self, gains: Gains, least: f64) -> Result<bool> {
        match self.last_stable(gains, least)? {
            (low, _) if low >= least => Ok(true),
            (_, high) if high <= least => Ok(false),
            between => Ok(self.gain_margin_within(gains, between)? >= least),
        }
    }

    /// Two factors on the gains in the ratio 1.1: the first is stable, and the second unstable if the first is less
    /// than `enough`. Infinite if no factor is unstable.
    fn last_stable(&self, gains: Gains, enough: f64) -> Result<(f64, f64)> {
        let (mut low, mut high) = (1.0, 1.0);
        while low < enough && self.is_stable(gains.scaled(high))? {
            low = high;
            high *= 1.1;
            if high > GAINS.1 {
                return Ok((f64::INFINITY, f64::INFINITY));
            }
        }
        Ok((low, high))
    }

    /// The margin between a stable factor and an unstable one.
    fn gain_margin_within(&self, gains: Gains, (mut low, mut high): (f64, f64)) -> Result<f64> {
        if high == f64::INFINITY {
            return Ok(high);
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if self.is_stable(gains.scaled(middle))? { low = middle } else { high = middle }
        }
        Ok(low)
    }

    fn is_stable(&self, gains: Gains) -> Result<bool> {
        Ok(self.model(gains, true).growth_rate()? < 0.0)
    }

    /// The least delay (s) over all frequencies where the loop's gain crosses 1.
    pub(super) fn delay_margin(&self, gains: Gains) -> f64 {
        let at = |frequency: f64| self.open_loop_at(gains, frequency);
        let response = self.response(gains);
        let pairs = response.iter().zip(response.iter().skip(1));
        let crossings = pairs.filter(|(before, after)| (before.1.norm() > 1.0) != (after.1.norm() > 1.0));
        let delays = crossings.filter_map(|(before, after)| {
            let (mut low, mut high) = (before.0, after.0);
            for _ in 0..REFINEMENTS {
                let middle = (low * high).sqrt();
                let same = (at(middle)?.norm() > 1.0) == (before.1.norm() > 1.0);
                if same { low = middle } else { high = middle }
            }
            // Phase above −180°.
            let phase = (at(low)?.arg() + PI).rem_euclid(TAU);
            Some(phase / (TAU * low))
        });
        delays.fold(f64::INFINITY, f64::min)
    }

    /// The least coprime margin of all frequencies: that of the grid, then golden sections between its neighbours.
    pub(super) fn coprime_margin(&self, gains: Gains) -> f64 {
        let of = |l: Complex<f64>| (l + 1.0).norm() / (2.0 * (1.0 + l.norm_sqr())).sqrt();
        let at = |frequency: f64| self.open_loop_at(gains, frequency).map_or(f64::INFINITY, of);
        let response = self.response(gains);
        let margin = |i: usize| response.get(i).map_or(f64::INFINITY, |(_, l)| of(*l));
        let least = (0..response.len()).min_by(|&i, &j| margin(i).total_cmp(&margin(j))).unwrap_or(0);
        let frequency = |i: usize| response.get(i.min(response.len() - 1)).map_or(0.0, |(f, _)| *f);
        let (mut low, mut high) = (frequency(least.saturating_sub(1)), frequency(least + 1));
        for _ in 0..REFINEMENTS {
            let step = GOLDEN * (high - low);
            if at(high - step) < at(low + step) { high = low + step } else { low = high - step }
        }
        at(0.5 * (low + high)).min(margin(least))
    }

    /// Frequencies (Hz) and the open loop's gain there.
    fn response(&self, gains: Gains) -> Vec<(f64, Complex<f64>)> {
        let highest = 0.5 * self.rate;
        let frequency = |i: usize| 0.1 * libm::pow(highest / 0.1, i as f64 / (FREQUENCIES - 1) as f64);
        (0..FREQUENCIES)
            .map(frequency)
            .filter_map(|frequency| Some((frequency, self.open_loop_at(gains, frequency)?)))
            .collect()
    }

    pub(super) fn peak_sensitivity(&self, gains: Gains) -> f64 {
        self.response(gains).iter().map(|(_, l)| (l + 1.0).norm().recip()).fold(0.0, f64::max)
    }
}
