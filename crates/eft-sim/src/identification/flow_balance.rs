//! The flow balance of the actuator, from spool, velocity and force of a test of the whole rig.
//!
//! The load cell is behind the seals, so the oil carries `F + F_c·sgn(ẋ)`. The balance is
//! `A·ẋ(t + δ) + C_l·F/A = s₊·Q₊ + s₋·Q₋ − (K/A)·Ḟ(t + δ_F) − (K_a/A)·F_c·d(sgn ẋ)/dt`, with the flow `Q` of the configured
//! valve in each direction. It is linear in `s₊`, `s₋`, `δ`, `K`, `F_c` and `K·δ_F`, which least squares fit in a band of
//! frequencies.

use std::f64::consts::TAU;

use super::Estimate;
use super::clipping::check_unclipped;
use super::gaps::check_whole;
use super::least_squares::least_squares;
use crate::fourier::{Complex64, signal_of, spectrum};
use crate::plant::LoadFlow;
use crate::{Error, Result, RigConfig};

/// Least duration (s).
const LEAST_DURATION: f64 = 4.0;
/// Width of the smooth sign of the velocity, as a share of its rms within [`NEAR`] s and in deviations of its noise.
const WIDTH: (f64, f64) = (0.02, 2.0);
/// A sweep is much larger near the natural frequency than elsewhere, so the rms is that of a short time (s).
const NEAR: f64 = 0.25;
/// Frequency (Hz) above which the velocity's noise hides its sign.
const SIGN_CORNER: f64 = 40.0;
/// Flows of the two directions over those of the configuration. Beyond them a unit or a sign is wrong.
const FLOWS: (f64, f64) = (0.3, 3.0);
/// Compressibility over the configured one. Three deviations beyond it the unit or the sign of the force is wrong.
const OILS: (f64, f64) = (1.0 / 30.0, 30.0);
/// Frequencies (Hz) at which the oil's compression takes much of the flow, and the force is known above its noise.
pub(super) const OIL_BAND: (f64, f64) = (15.0, 40.0);
/// Frequencies (Hz) where the force of a test has noise alone.
const NOISE_BAND: (f64, f64) = (60.0, 100.0);
/// Least [`excitation`] that shows the delay of the force.
pub(super) const LEAST_EXCITATION: f64 = 30.0;

const UNKNOWNS: usize = 6;

/// Measured signals of a moving rig, sample by sample.
#[derive(Debug, Clone, Copy)]
pub struct MotionSignals<'a> {
    /// Spool opening (1).
    pub spool: &'a [f64],
    /// Piston velocity (m/s).
    pub velocity: &'a [f64],
    /// Force (N).
    pub force: &'a [f64],
}

impl MotionSignals<'_> {
    /// Refuses signals of unequal or too short lengths, incomplete and clipped ones.
    pub(super) fn check(&self, sample_rate: f64) -> Result<()> {
        let least = (LEAST_DURATION * sample_rate).ceil() as usize;
        check_whole(&[("spool", self.spool), ("velocity", self.velocity), ("force", self.force)], least)?;
        check_unclipped(&[("velocity", self.velocity), ("force", self.force)])
    }
}

/// Spectral density of the force in the oil's band over that of its noise (1). It is infinite without noise, as at a sample
/// rate (Hz) below its frequencies, and NaN without a force.
pub(super) fn excitation(force: &[f64], sample_rate: f64) -> Result<f64> {
    let (spectrum, width) = (spectrum(force)?, sample_rate / force.len() as f64);
    let density = |(low, high): (f64, f64)| {
        let bins = (low / width) as usize..=((high / width) as usize).min(spectrum.len() - 1);
        let band = spectrum.get(bins).unwrap_or_default();
        band.iter().map(Complex64::norm_sqr).sum::<f64>() / band.len().max(1) as f64
    };
    Ok(density(OIL_BAND) / density(NOISE_BAND))
}

/// The flow balance in the frequencies of a band.
pub(super) struct FlowBalance {
    /// At each frequency the derivatives with respect to the unknowns, and the flow (m³/s) of motion and leakage.
    rows: Vec<([Complex64; UNKNOWNS], Complex64)>,
    /// Configured compressibility of oil and attachment over that of the oil.
    oil: f64,
}

impl FlowBalance {
    /// From checked signals, in a band (Hz).
    pub(super) fn new(
        rig: &RigConfig,
        signals: MotionSignals<'_>,
        sample_rate: f64,
        band: (f64, f64),
    ) -> Result<Self> {
        let MotionSignals { spool, velocity, force } = signals;
        let (area, supply) = (rig.actuator.piston_area, rig.supply.pressure);
        let valve = LoadFlow::<f64>::pack(&|_| rig)?;
        let flow = |side: f64| {
            let passed = |x: &f64, f: &f64| {
                let opening = x - rig.servovalve.null_bias;
                if side * opening > 0.0 { valve.flow_at(opening, f / area, supply).0 } else { 0.0 }
            };
            spectrum(&spool.iter().zip(force).map(|(x, f)| passed(x, f)).collect::<Vec<_>>())
        };
        let (back, forth) = (flow(-1.0)?, flow(1.0)?);
        let width = sample_rate / spool.len() as f64;
        let (motion, force) = (spectrum(velocity)?, spectrum(force)?);
        let sign = spectrum(&signs(&motion, width, velocity.len(), rig.actuator.friction_velocity)?)?;
        let (compliance, leakage) = (rig.actuator.compressibility / area, rig.actuator.leakage / area);
        let (first, last) = ((band.0 / width).ceil() as usize, (band.1 / width).floor() as usize);
        let row = |k: usize| {
            let rate = Complex64::new(0.0, TAU * width * k as f64);
            let columns = [
                back[k],
                forth[k],
                motion[k] * rate * -area,
                force[k] * rate * -compliance,
                sign[k] * rate * -compliance,
                force[k] * rate * rate * -compliance,
            ];
            (columns, motion[k] * area + force[k] * leakage)
        };
        let oil = rig.measured_compressibility() / rig.actuator.compressibility;
        Ok(Self { rows: (first.max(1)..=last.min(motion.len() - 1)).map(row).collect(), oil })
    }

    /// The first `N` unknowns: flow factors (1) of both directions, delay (s) of the velocity behind the spool,
    /// compressibility over the configured one (1), friction (N), and that compressibility times the delay (s) of the
    /// force behind the spool. The others are zero.
    ///
    /// # Errors
    /// Signals that do not determine them, flows of another size than those of the configured valve, or a force whose
    /// compression of the oil is of another size or sign than the configured one.
    pub(super) fn fitted<const N: usize>(&self) -> Result<[Estimate; N]> {
        let rows = self.rows.iter().map(|(columns, taken)| (std::array::from_fn(|i| columns[i]), *taken));
        let found = least_squares::<N>(rows).ok_or_else(|| {
            let allowed = "must move to and fro at several frequencies, as in a sweep";
            Error::value("velocity", "hardly moves", allowed)
        })?;
        for factor in &found[..2] {
            if !(FLOWS.0..FLOWS.1).contains(&factor.value) {
                let found = format!("{:.2} times the flow of the configured valve", factor.value);
                let allowed = "must be those of this rig: check gains, units and signs";
                return Err(Error::value("spool and velocity", found, allowed));
            }
        }
        let oil = found[3].times(self.oil.recip());
        if oil.value + 3.0 * oil.uncertainty < OILS.0 || oil.value - 3.0 * oil.uncertainty > OILS.1 {
            let found = format!("of {:.3e} times the configured compressibility", oil.value);
            let allowed =
                "must compress the oil of this rig: check its unit and sign, and actuator.compressibility";
            return Err(Error::value("force", found, allowed));
        }
        Ok(found)
    }
}

/// The sign of the velocity without its high frequencies, smooth near its zeros as the friction of a rig is with the
/// velocity `least` (m/s).
fn signs(motion: &[Complex64], width: f64, length: usize, least: f64) -> Result<Vec<f64>> {
    let bins = |(low, high): (f64, f64)| {
        let within = move |(k, _): &(usize, &Complex64)| low < *k as f64 * width && *k as f64 * width <= high;
        motion.iter().enumerate().filter(within).map(|(_, bin)| bin.norm_sqr())
    };
    let kept = motion
        .iter()
        .enumerate()
        .map(|(k, bin)| if k > 0 && k as f64 * width <= SIGN_CORNER { *bin } else { Complex64::default() });
    let smooth: Vec<f64> = signal_of(kept.collect(), length)?.iter().map(|v| v / length as f64).collect();
    let quiet = bins(NOISE_BAND).sum::<f64>() / bins(NOISE_BAND).count().max(1) as f64;
    let noise = 2.0 * quiet * bins((0.0, SIGN_CORNER)).count() as f64 / (length as f64).powi(2);
    let sums = smooth.iter().scan(0.0, |sum, v| {
        *sum += v * v;
        Some(*sum)
    });
    let sums: Vec<f64> = std::iter::once(0.0).chain(sums).collect();
    let near = ((NEAR * width * length as f64) as usize).max(1);
    let sign = |(i, v): (usize, &f64)| {
        let (first, end) = (i.saturating_sub(near), (i + near).min(length));
        let square = (sums[end] - sums[first]) / (end - first) as f64;
        let (of_motion, of_noise) = WIDTH;
        let steep = of_motion.powi(2) * square + of_noise.powi(2) * noise + least * least;
        v / (v * v + steep).sqrt().max(f64::MIN_POSITIVE)
    };
    Ok(smooth.iter().enumerate().map(sign).collect())
}
