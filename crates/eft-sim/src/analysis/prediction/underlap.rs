//! The oscillation about null by an underlap that the controller does not know: there the valve has up to twice its gain.

use std::f64::consts::{SQRT_2, TAU};

use crate::Result;
use crate::analysis::linear::{Complex, disturbed};
use crate::analysis::prediction::signals::{Signals, Transform, responses};
use crate::config::{RigConfig, gain_within_limit};
use crate::state_space::AT_REST;

/// Bisections for a gain, each of which needs the poles of the loop, and for a share.
const GAIN_STEPS: i32 = 8;
const SHARE_STEPS: i32 = 24;
/// Time (s) within which an oscillation begins or ends.
const PART: f64 = 0.2;
/// Growth (1) from the noise to the whole oscillation.
const GROWTH: f64 = 5.0;

/// An oscillation of the whole rig.
#[derive(Debug, Clone)]
pub(super) struct Oscillation {
    /// The unknown underlap (1).
    underlap: f64,
    /// Gain (1) of the valve's flow over that of a large motion, beyond which the loop is unstable.
    pub(super) gain: f64,
    /// Growth rate (1/s) at null.
    growth: f64,
    /// In Hz.
    pub(super) frequency: f64,
    /// Amplitudes of force (N) and displacement (m) of each actuator.
    amplitudes: Vec<[f64; 2]>,
}

impl Oscillation {
    /// Of a rig with a stable loop at large motion; `None` if the loop is stable at null as well.
    pub(super) fn of(
        rig: &RigConfig,
        underlap: f64,
        actuators: usize,
        sample_rate: f64,
    ) -> Result<Option<Self>> {
        let model = |gain: f64| {
            let rig = rig.varied(|values| values.servovalve.flow_gain_scale *= gain);
            disturbed(&rig, sample_rate)
        };
        let growth = if underlap > 0.0 { model(2.0)?.growth_rate()? } else { 0.0 };
        if growth <= AT_REST || model(1.0)?.growth_rate()? > AT_REST {
            return Ok(None);
        }
        let gain = bisected([1.0, 2.0], GAIN_STEPS, |gain| Ok(model(gain)?.growth_rate()? > AT_REST))?;
        let marginal = model(gain)?;
        let modes = marginal.modes()?;
        let Some(fastest) = modes.iter().max_by(|a, b| a.pole.re.total_cmp(&b.pole.re)) else {
            return Ok(None);
        };
        let turn = Complex::from_polar(1.0, fastest.pole.im.abs() / sample_rate);
        let Some(shape) = responses(&marginal, &["force", "displacement", "spool"], &[0]).at(turn) else {
            return Ok(None);
        };
        // At its margin all commands excite the same mode.
        let of = |quantity: usize, actuator: usize| shape[(quantity * actuators + actuator, 0)].norm();
        let most = (0..actuators).map(|i| of(2, i)).fold(0.0, f64::max);
        // Harmonic balance: the gain of the valve for a sine of this amplitude, `underlap` over `share`.
        let share =
            bisected([0.0, 1.0], SHARE_STEPS, |share| Ok(1.0 + gain_within_limit(share, 1.0) > gain))?;
        let scale = underlap / share / most;
        let amplitudes = (0..actuators).map(|i| [scale * of(0, i), scale * of(1, i)]).collect();
        let frequency = fastest.pole.im.abs() / TAU;
        Ok(Some(Self { underlap, gain, growth, frequency, amplitudes }))
    }

    /// Root mean squares over a test of an actuator's force (N) and displacement (m). The oscillation lasts where the openings are
    /// so small that the mean gain exceeds that of the stable loop.
    pub(super) fn sizes(&self, actuator: usize, own: &Signals, transform: &Transform) -> Result<[f64; 2]> {
        let opening: Vec<f64> = transform.signal(own.opening.clone())?.collect();
        let parts = opening.chunks(((PART * transform.sample_rate) as usize).max(1));
        let count = parts.len() as f64;
        let small = |part: &[f64]| part.iter().filter(|x| x.abs() < self.underlap).count() as f64;
        let lasting = parts.filter(|part| 1.0 + small(part) / part.len() as f64 > self.gain).count() as f64;
        let share = lasting / count;
        if share * transform.duration() * self.growth < GROWTH {
            return Ok([0.0; 2]);
        }
        Ok(self.amplitudes[actuator].map(|amplitude| amplitude * share.sqrt() / SQRT_2))
    }
}

/// The largest argument between two for which a rising condition does not hold, about.
fn bisected([mut low, mut high]: [f64; 2], steps: i32, holds: impl Fn(f64) -> Result<bool>) -> Result<f64> {
    for _ in 0..steps {
        let middle = 0.5 * (low + high);
        if holds(middle)? {
            high = middle;
        } else {
            low = middle;
        }
    }
    Ok(0.5 * (low + high))
}
