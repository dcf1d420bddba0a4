//! The flow balance of the actuator, from spool, velocity and force of a test of the whole rig.
//!
//! The load cell is behind the seals, so the oil carries `F + F_c·sgn(ẋ)`. The balance is
//! `A·ẋ(t + δ) + C_l·F/A = s₊·Q₊ + s₋·Q₋ − (K/A)·Ḟ(t + δ_F) − (K_a/A)·F_c·d(sgn ẋ)/dt`, with the flow `Q` of the configured
//! valve in each direction. It is linear in `s₊`, `s₋`, `δ`, `K`, `F_c` and `K·δ_F`, which least squares fit in a band of
//! frequencies. The valve's flow depends on the load pressure, which contains the
//! friction, so the fit is repeated with the friction and the delays that it found.
//!
//! The sensors' noise is also in the columns, and would make all factors too small. Its density is that of the highest
//! frequencies, and its squares are subtracted.

use std::f64::consts::{PI, TAU};
use std::ops::RangeInclusive;

use super::Estimate;
use super::gaps::check;
use super::least_squares::errors_in_variables;
use crate::checks;
use crate::config::RigConfig;
use crate::error::{Error, Result};
use crate::fourier::{Complex64, signal_of, spectrum};
use crate::plant::LoadFlow;

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

/// Frequencies (Hz) that the valve no longer follows, where the signals have the white noise of their sensors alone.
const QUIET_BAND: (f64, f64) = (200.0, 400.0);
/// Half a difference of openings (1) that gives a derivative.
const SMALL: f64 = 1e-4;
/// Length (s) of the fading at either end.
const RAMP: f64 = 1.0;
/// Steps of the delays and of the friction.
const ITERATIONS: usize = 3;

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
    /// Refuses signals of unequal or too short lengths, and incomplete ones.
    pub(super) fn check(&self, sample_rate: f64) -> Result<()> {
        let least = (LEAST_DURATION * sample_rate).ceil() as usize;
        check(("spool", "velocity"), (self.spool.len(), self.velocity.len()), least)?;
        check(("spool", "force"), (self.spool.len(), self.force.len()), least)?;
        for (name, signal) in [("spool", self.spool), ("velocity", self.velocity), ("force", self.force)] {
            checks::signal(name, signal)?;
        }
        Ok(())
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
pub(super) struct FlowBalance<'a> {
    rig: &'a RigConfig,
    spool: &'a [f64],
    valve: LoadFlow<f64>,
    motion: Vec<Complex64>,
    force: Vec<Complex64>,
    /// Standard deviations of the noise in a bin of spool, velocity and force.
    noise: [f64; 3],
    /// Distance (Hz) of two bins.
    width: f64,
    bins: RangeInclusive<usize>,
}

/// Corrections of the signals by what a fit has found.
#[derive(Default)]
struct Found {
    /// Delays (s) of velocity and force behind the spool.
    delays: [f64; 2],
    /// Friction (N).
    friction: f64,
}

impl<'a> FlowBalance<'a> {
    /// From checked signals, in a band (Hz).
    pub(super) fn new(
        rig: &'a RigConfig,
        signals: MotionSignals<'a>,
        sample_rate: f64,
        band: (f64, f64),
    ) -> Result<Self> {
        let MotionSignals { spool, velocity, force } = signals;
        let width = sample_rate / spool.len() as f64;
        let (motion, force) = (spectrum(velocity)?, spectrum(force)?);
        let noise = [&spectrum(spool)?, &motion, &force].map(|spectrum| deviation(spectrum, width));
        let bins = ((band.0 / width).ceil() as usize).max(1)
            ..=((band.1 / width).floor() as usize).min(motion.len() - 1);
        Ok(Self { rig, spool, valve: LoadFlow::pack(&|_| rig)?, motion, force, noise, width, bins })
    }

    /// The first `N` unknowns: flow factors (1) of both directions, delay (s) of the velocity behind the spool,
    /// compressibility over the configured one (1), friction (N), and that compressibility times the delay (s) of the
    /// force behind the spool. The others are zero.
    ///
    /// # Errors
    /// Signals that do not determine them, flows of another size than those of the configured valve, or a force whose
    /// compression of the oil is of another size or sign than the configured one.
    pub(super) fn fitted<const N: usize>(&self) -> Result<[Estimate; N]> {
        let configured = self.rig.measured_compressibility() / self.rig.actuator.compressibility;
        let mut at = Found::default();
        let mut found = self.solved::<N>(&at)?;
        for _ in 0..ITERATIONS {
            // A compression within the noise is no divisor.
            let certain = found[3].value > 3.0 * found[3].uncertainty;
            let oil = if certain { found[3].value } else { configured };
            let late = found.get(5).map_or(0.0, |late| late.value / oil);
            at = Found { delays: [found[2].value, late], friction: found[4].value / oil };
            found = self.solved::<N>(&at)?;
            found[2].value += at.delays[0];
            if let [.., oil, _, late] = &mut found[..]
                && N == UNKNOWNS
            {
                late.value += at.delays[1] * oil.value;
            }
        }
        for factor in &found[..2] {
            if !(FLOWS.0..FLOWS.1).contains(&factor.value) {
                let found = format!("{:.2} times the flow of the configured valve", factor.value);
                let allowed = "must be those of this rig: check gains, units and signs";
                return Err(Error::value("spool and velocity", found, allowed));
            }
        }
        let oil = found[3].times(configured.recip());
        if oil.value + 3.0 * oil.uncertainty < OILS.0 || oil.value - 3.0 * oil.uncertainty > OILS.1 {
            let found = format!("of {:.3e} times the configured compressibility", oil.value);
            let allowed =
                "must compress the oil of this rig: check its unit and sign, and actuator.compressibility";
            return Err(Error::value("force", found, allowed));
        }
        Ok(found)
    }

    /// The unknowns, of which the delays are those that remain.
    fn solved<const N: usize>(&self, at: &Found) -> Result<[Estimate; N]> {
        let (actuator, length) = (&self.rig.actuator, self.spool.len());
        let area = actuator.piston_area;
        let [motion, force] = [(&self.motion, at.delays[0]), (&self.force, at.delays[1])]
            .map(|(spectrum, delay)| earlier(spectrum, delay, self.width, length));
        let signs = signs(&motion, self.width, length, actuator.friction_velocity)?;
        let signal = |spectrum| -> Result<Vec<f64>> {
            Ok(signal_of(spectrum, length)?.iter().map(|value| value / length as f64).collect())
        };
        let (velocity, force) = (signal(motion)?, signal(force)?);
        let carried: Vec<f64> = force.iter().zip(&signs).map(|(f, sign)| f + at.friction * sign).collect();
        let [(back, of_back), (forth, of_forth)] = [self.flow(-1.0, &carried), self.flow(1.0, &carried)];
        let [back, forth] = [self.faded(&back)?, self.faded(&forth)?];
        let rates = [self.faded_rate(&velocity)?, self.faded_rate(&force)?, self.faded_rate(&signs)?];
        let [motion, force, sign] = [self.faded(&velocity)?, self.faded(&force)?, self.faded(&signs)?];
        let (compliance, leakage) = (actuator.compressibility / area, actuator.leakage / area);
        // The fading takes a part of the noise's power: 3/8 of it is left within the ramps.
        let faded = (1.0 - 2.0 * (1.0 - 0.375) * self.ramp() / length as f64).sqrt();
        let [of_spool, of_motion, of_force] = self.noise.map(|noise| Complex64::from(faded * noise));
        let zero = Complex64::default();
        let rows = self.bins.clone().map(|k| {
            let s = Complex64::new(0.0, TAU * self.width * k as f64);
            // From flows, signals and their rates.
            let of = |[back, forth]: [Complex64; 2], [v, f, sign]: [Complex64; 3], rates: [Complex64; 3]| {
                let columns = [
                    back,
                    forth,
                    rates[0] * -area,
                    rates[1] * -compliance,
                    rates[2] * -compliance,
                    rates[1] * s * -compliance,
                ];
                (std::array::from_fn(|i| columns[i]), v * area + (f + sign * at.friction) * leakage)
            };
            let noise = [
                of([of_spool * of_back, zero], [zero; 3], [zero; 3]),
                of([zero, of_spool * of_forth], [zero; 3], [zero; 3]),
                of([zero; 2], [of_motion, zero, zero], [of_motion * s, zero, zero]),
                of([zero; 2], [zero, of_force, zero], [zero, of_force * s, zero]),
            ];
            (
                of([back[k], forth[k]], [motion[k], force[k], sign[k]], rates.each_ref().map(|rate| rate[k])),
                noise,
            )
        });
        errors_in_variables::<N, 4>(rows).ok_or_else(|| {
            let allowed = "must move to and fro at several frequencies, as in a sweep";
            Error::value("velocity", "hardly moves above the noise", allowed)
        })
    }

    /// The spectrum of a signal with faded ends, because a record does not end as it began.
    fn faded(&self, signal: &[f64]) -> Result<Vec<Complex64>> {
        let ramp = self.ramp();
        let faded = signal.iter().enumerate().map(|(i, value)| value * fading(i, signal.len(), ramp).0);
        spectrum(&faded.collect::<Vec<_>>())
    }

    /// The spectrum of the signal's rate of change with the same fading: `w·ẋ = d(w·x)/dt − ẇ·x`.
    fn faded_rate(&self, signal: &[f64]) -> Result<Vec<Complex64>> {
        let (ramp, rate) = (self.ramp(), self.width * signal.len() as f64);
        let fades =
            signal.iter().enumerate().map(|(i, value)| value * rate * fading(i, signal.len(), ramp).1);
        let (fades, faded) = (spectrum(&fades.collect::<Vec<_>>())?, self.faded(signal)?);
        let of = |(k, (faded, fades)): (usize, (&Complex64, Complex64))| {
            faded * Complex64::new(0.0, TAU * self.width * k as f64) - fades
        };
        Ok(faded.iter().zip(fades).enumerate().map(of).collect())
    }

    fn ramp(&self) -> f64 {
        RAMP * self.width * self.spool.len() as f64
    }

    /// The configured valve's flow (m³/s) in a direction, with the force (N) that the oil carries, and the rms
    /// of its derivative with respect to the opening.
    fn flow(&self, side: f64, carried: &[f64]) -> (Vec<f64>, f64) {
        let (area, supply) = (self.rig.actuator.piston_area, self.rig.supply.pressure);
        let at = |opening: f64, f: &f64| self.valve.flow_at(opening, f / area, supply).0;
        let (mut flows, mut squares) = (Vec::with_capacity(carried.len()), 0.0);
        for (x, f) in self.spool.iter().zip(carried) {
            let opening = x - self.rig.servovalve.null_bias;
            let open = side * opening > 0.0;
            flows.push(if open { at(opening, f) } else { 0.0 });
            if open {
                squares += ((at(opening + SMALL, f) - at(opening - SMALL, f)) / (2.0 * SMALL)).powi(2);
            }
        }
        (flows, (squares / carried.len() as f64).sqrt())
    }
}

/// The fading (1) at a sample and its change per sample. A raised cosine of `ramp` samples is at either end.
fn fading(sample: usize, length: usize, ramp: f64) -> (f64, f64) {
    let (from, to) = (sample as f64, (length - 1 - sample) as f64);
    let phase = PI * (from.min(to) / ramp).min(1.0);
    (0.5 - 0.5 * phase.cos(), 0.5 * PI / ramp * phase.sin() * (to - from).signum())
}

/// The spectrum of a signal earlier by a time (s).
fn earlier(spectrum: &[Complex64], time: f64, width: f64, length: usize) -> Vec<Complex64> {
    let turned = |(k, bin): (usize, &Complex64)| {
        let turned = bin * Complex64::cis(TAU * width * k as f64 * time);
        // Half the sample rate has no phase.
        if 2 * k == length { turned.re.into() } else { turned }
    };
    spectrum.iter().enumerate().map(turned).collect()
}

/// Standard deviation of the noise in a bin: that of the highest frequencies.
fn deviation(spectrum: &[Complex64], width: f64) -> f64 {
    let end = spectrum.len().min((QUIET_BAND.1 / width) as usize);
    let first =
        ((QUIET_BAND.0 / width) as usize).min(3 * spectrum.len() / 4).max((OIL_BAND.1 / width) as usize);
    let quiet = spectrum.get(first..end).unwrap_or_default();
    (quiet.iter().map(Complex64::norm_sqr).sum::<f64>() / quiet.len().max(1) as f64).sqrt()
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
