//! The flow balance of the actuator, from spool, velocity and force of a test of the whole rig.
//!
//! The load cell is behind the seals, so the oil carries `F + F_c·sgn(ẋ)`. With the configured valve's flow `Q` in
//! each direction the balance is
//! `A·ẋ₊ + C_l·F₊/A = s₊·Q₊ + s₋·Q₋ − (K/A)·Ḟ₊ − (K_a/A)·F_c·d(sgn ẋ₊)/dt`.
//! The velocity `ẋ₊` is that at `t + δ`, without its sensor's offset and drift. The force `F₊` is that at
//! `t + δ_F`.
//! Gauss–Newton steps fit `s₊`, `s₋`, `δ`, `K`, `F_c`, `δ_F`, offset and drift in a band of frequencies.
//!
//! All terms are faded at both ends, because a record may end in motion. What friction adds to leakage and load
//! pressure is left to `s₊` and `s₋`: with it, an error of the flow curve would look like friction.

use std::f64::consts::{PI, TAU};

use super::Estimate;
use super::clipping::check_unclipped;
use super::gaps::{check_whole, detrend};
use super::least_squares::least_squares;
use crate::fourier::{Complex64, signal_of, spectrum};
use crate::plant::LoadFlow;
use crate::{Error, Result, RigConfig, checks};

/// Least duration (s).
const LEAST_DURATION: f64 = 4.0;
/// Width of the smooth sign of the velocity, as a share of its rms within [`NEAR`] s and in deviations of its noise.
const WIDTH: (f64, f64) = (0.005, 2.0);
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

/// Duration (s) of the fade at either end. A rate is that of the faded signal without the fade's own.
const FADE: f64 = 0.5;
/// Most steps of the two delays.
const ITERATIONS: usize = 30;
/// A step (s) of a delay after which it is known, and one that is small enough where noise slows the steps down.
const STEPS: (f64, f64) = (1e-10, 1e-6);
/// Fits, each with the delay of the load pressure from the one before.
const PASSES: usize = 3;
/// Position of the force's delay among the unknowns.
const LATE: usize = 7;
/// Largest delay (s) behind the spool.
const LARGEST_DELAY: f64 = 0.1;

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

/// Spectral density of the force in the oil's band over that of its noise (1). It is infinite without noise, as at a
/// sample rate (Hz) below its frequencies, and NaN without a force.
pub(super) fn excitation(force: &[f64], sample_rate: f64) -> Result<f64> {
    let (spectrum, width) = (spectrum(force)?, sample_rate / force.len() as f64);
    let density = |(low, high): (f64, f64)| {
        let bins = (low / width) as usize..=((high / width) as usize).min(spectrum.len() - 1);
        let band = spectrum.get(bins).unwrap_or_default();
        band.iter().map(Complex64::norm_sqr).sum::<f64>() / band.len().max(1) as f64
    };
    Ok(density(OIL_BAND) / density(NOISE_BAND))
}

/// The first `N` unknowns: flow factors (1) of both directions, delay (s) of the velocity behind the spool,
/// compressibility over the configured one (1), friction (N), offset and drift (m/s) of the velocity, and delay (s) of
/// the force behind the spool. The last is zero without its unknown.
///
/// # Errors
/// Signals that do not determine them, flows of another size than those of the configured valve, a force whose
/// compression of the oil is of another size or sign than the configured one, or a delay beyond 0.1 s.
pub(super) fn fitted<const N: usize>(
    rig: &RigConfig,
    signals: MotionSignals<'_>,
    sample_rate: f64,
    band: (f64, f64),
) -> Result<[Estimate; N]> {
    let mut late = 0.0;
    let passes = if N > LATE { PASSES } else { 1 };
    for _ in 1..passes {
        let found = FlowBalance::new(rig, signals, sample_rate, band, late)?.fitted::<N>()?;
        late = found[LATE].value;
    }
    FlowBalance::new(rig, signals, sample_rate, band, late)?.fitted::<N>()
}

/// The flow balance in the frequencies of a band.
struct FlowBalance {
    terms: Vec<Terms>,
    /// Configured compressibility of oil and attachment over that of the oil.
    oil: f64,
}

/// The terms of the balance (m³/s) at one frequency, as measured.
struct Terms {
    /// Laplace's variable (rad/s).
    s: Complex64,
    /// The configured valve's flow in the negative and in the positive direction.
    valve: [Complex64; 2],
    motion: Complex64,
    leakage: Complex64,
    /// Compression by the force, with the configured compressibility.
    compression: Complex64,
    /// Compression by a friction of 1 N.
    friction: Complex64,
    /// Flow of a constant velocity of 1 m/s, and of one from −0.5 to 0.5 m/s.
    offset: Complex64,
    drift: Complex64,
}

impl FlowBalance {
    /// From checked signals in a band (Hz), with a force that is late behind the spool (s).
    fn new(
        rig: &RigConfig,
        signals: MotionSignals<'_>,
        sample_rate: f64,
        band: (f64, f64),
        late: f64,
    ) -> Result<Self> {
        let MotionSignals { spool, velocity, force } = signals;
        let (area, supply) = (rig.actuator.piston_area, rig.supply.pressure);
        let valve = LoadFlow::<f64>::pack(&|_| rig)?;
        let width = sample_rate / spool.len() as f64;
        // Offset and drift of the sensor, with a weight to which a motion that does not end as it began is neither.
        let steady = detrend(velocity, |i| (PI * (i as f64 + 0.5) / velocity.len() as f64).sin().powi(2));
        let sign = signs(&spectrum(&steady)?, width, spool.len(), rig.actuator.friction_velocity)?;
        let flow = |side: f64| {
            let passed = |(i, x): (usize, &f64)| {
                let opening = x - rig.servovalve.null_bias;
                let pressure = at(force, i as f64 + late * sample_rate) / area;
                if side * opening > 0.0 { valve.flow_at(opening, pressure, supply).0 } else { 0.0 }
            };
            faded(&spool.iter().enumerate().map(passed).collect::<Vec<_>>(), sample_rate)
        };
        let ([back, _], [forth, _]) = (flow(-1.0)?, flow(1.0)?);
        let ones = vec![1.0; spool.len()];
        let line: Vec<f64> = (0..spool.len()).map(|i| i as f64 / spool.len() as f64 - 0.5).collect();
        let [motion, _] = faded(velocity, sample_rate)?;
        let ([ones, _], [line, _]) = (faded(&ones, sample_rate)?, faded(&line, sample_rate)?);
        let ([force, force_rate], [_, sign_rate]) = (faded(force, sample_rate)?, faded(&sign, sample_rate)?);
        let (compliance, leakage) = (rig.actuator.compressibility / area, rig.actuator.leakage / area);
        let (first, last) = ((band.0 / width).ceil() as usize, (band.1 / width).floor() as usize);
        let terms = |k: usize| Terms {
            s: Complex64::new(0.0, TAU * width * k as f64),
            valve: [back[k], forth[k]],
            motion: motion[k] * area,
            leakage: force[k] * leakage,
            compression: force_rate[k] * compliance,
            friction: sign_rate[k] * compliance,
            offset: ones[k] * area,
            drift: line[k] * area,
        };
        let oil = rig.measured_compressibility() / rig.actuator.compressibility;
        Ok(Self { terms: (first.max(1)..=last.min(motion.len() - 1)).map(terms).collect(), oil })
    }

    /// The unknowns of [`fitted`], with the valve's flow as it is.
    fn fitted<const N: usize>(&self) -> Result<[Estimate; N]> {
        let (mut velocity_delay, mut force_delay) = (0.0, 0.0);
        for iteration in 1..=ITERATIONS {
            let mut found = self.step::<N>(velocity_delay, force_delay)?;
            let oil = found[3].value;
            let mut steps = [found[2].value, 0.0];
            velocity_delay += steps[0];
            found[2].value = velocity_delay;
            if let Some(last) = found.get_mut(LATE) {
                let step = Estimate::new(last.value / oil, last.uncertainty / oil.abs());
                steps[1] = step.value;
                force_delay += step.value;
                *last = Estimate::new(force_delay, step.uncertainty);
            }
            self.check(&found)?;
            let enough = if iteration < ITERATIONS { STEPS.0 } else { STEPS.1 };
            if steps.iter().all(|step| step.abs() < enough) {
                return Ok(found);
            }
        }
        let allowed = "must follow the spool with one delay each: check that all signals are of one test";
        Err(Error::value("velocity, force", "delays that do not converge", allowed))
    }

    /// One step of the least squares from delays (s): the unknowns, but the changes of the delays, the second times the
    /// compressibility.
    fn step<const N: usize>(&self, velocity_delay: f64, force_delay: f64) -> Result<[Estimate; N]> {
        let rows = self.terms.iter().map(|one| {
            let (motion_early, force_early) = ((one.s * velocity_delay).exp(), (one.s * force_delay).exp());
            let (motion, compression) = (one.motion * motion_early, one.compression * force_early);
            let friction = one.friction * motion_early;
            let columns = [
                one.valve[0],
                one.valve[1],
                -motion * one.s,
                -compression,
                -friction,
                one.offset,
                one.drift,
                -compression * one.s,
            ];
            (std::array::from_fn(|i| columns[i]), motion + one.leakage * force_early)
        });
        least_squares::<N>(rows).ok_or_else(|| {
            let allowed = "must move to and fro at several frequencies, as in a sweep";
            Error::value("velocity", "hardly moves", allowed)
        })
    }

    fn check<const N: usize>(&self, found: &[Estimate; N]) -> Result<()> {
        for factor in &found[..2] {
            let found = format!("{:.2} times the flow of the configured valve", factor.value);
            let allowed = "must be those of this rig: check gains, units and signs";
            let is_plausible = (FLOWS.0..FLOWS.1).contains(&factor.value);
            checks::require(is_plausible, "spool and velocity", found, allowed)?;
        }
        let oil = found[3].times(self.oil.recip());
        let differs =
            oil.value + 3.0 * oil.uncertainty < OILS.0 || oil.value - 3.0 * oil.uncertainty > OILS.1;
        let size = format!("of {:.3e} times the configured compressibility", oil.value);
        let allowed =
            "must compress the oil of this rig: check its unit and sign, and actuator.compressibility";
        checks::require(!differs, "force", size, allowed)?;
        for (name, delay) in [("velocity", found.get(2)), ("force", found.get(LATE))] {
            let delay = delay.map_or(0.0, |delay| delay.value);
            let allowed = format!("must be within {LARGEST_DELAY} s of it: check the times of the signals");
            let is_late = delay.abs() > LARGEST_DELAY;
            checks::require(!is_late, name, format!("{delay:.3} s behind the spool"), allowed)?;
        }
        Ok(())
    }
}

/// A signal at a position between its samples; its ends continue.
fn at(signal: &[f64], position: f64) -> f64 {
    let last = signal.len() - 1;
    let left = position.floor();
    let sample = |position: f64| signal[(position.max(0.0) as usize).min(last)];
    sample(left) + (position - left) * (sample(left + 1.0) - sample(left))
}

/// Spectrum of a signal that is faded at its ends, and that of its rate (1/s) faded likewise.
fn faded(signal: &[f64], sample_rate: f64) -> Result<[Vec<Complex64>; 2]> {
    let (length, fade) = (signal.len(), FADE * sample_rate);
    let weighted = |(i, value): (usize, &f64)| {
        let from_end = (i + 1).min(length - i) as f64;
        let (sin, cos) = (0.5 * PI * (from_end / fade).min(1.0)).sin_cos();
        let rise = if 2 * i < length { PI / FADE } else { -PI / FADE };
        (value * sin * sin, value * rise * sin * cos)
    };
    let (share, slope): (Vec<f64>, Vec<f64>) = signal.iter().enumerate().map(weighted).unzip();
    let (faded, of_fade) = (spectrum(&share)?, spectrum(&slope)?);
    let width = sample_rate / length as f64;
    let rate = faded.iter().zip(of_fade).enumerate();
    let rate = rate.map(|(k, (x, fade))| x * Complex64::new(0.0, TAU * width * k as f64) - fade).collect();
    Ok([faded, rate])
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
        .map(|(k, bin)| if k as f64 * width <= SIGN_CORNER { *bin } else { Complex64::default() });
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
