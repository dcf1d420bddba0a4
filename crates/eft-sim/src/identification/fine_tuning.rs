//! Fine tuning of compensation level and response delay from a test (Fig. 11 of the paper), as numbers.
//!
//! A wrong level makes the force too small or too large at the natural frequency. A wrong delay causes a peak
//! and a valley near it. Both follow from spool openings. The opening that the compensation needs is
//! `f⁻¹(A·ẋ/√…)`, from the measured velocity. The opening that it produced is that of the actuator's flow
//! balance minus that of the force error, Eqs. (1), (6) and (7). Near the natural frequency the ratio of the
//! two is `p·(1 − jωδ)`, where `p` is the error of the level and `δ` the remaining delay.

use std::f64::consts::TAU;

use super::Estimate;
use super::clipping::check_unclipped;
use super::gaps::{check_whole, detrend};
use crate::analysis::linear::valve_response;
use crate::config::{Mode, Realization, RigConfig, StructureKind};
use crate::fourier::{Complex64, signal_of, spectrum};
use crate::{Result, checks};

/// Bins with less than this share of the motion's largest power in the band are not used.
const LEAST_POWER: f64 = 1e-3;
/// Least number of bins that distinguishes level from delay.
const LEAST_BINS: usize = 8;
/// Least spool opening (1) of a motion.
const LEAST_OPENING: f64 = 1e-3;
/// Largest opening (1) for the linear scheme. Beyond it the curve bends, and no single level is correct.
const LINEAR_OPENING: f64 = 0.15;
/// Largest factor between force and command. Beyond it one of them has another unit, or the force does not
/// follow.
const LARGEST_FACTOR: f64 = 5.0;
/// Range of the velocity over that of the specimen under the force. Beyond it one of them has another unit.
const VELOCITY_RATIO: (f64, f64) = (0.1, 10.0);
/// Frequencies about the natural one at which the motion depends on damping and amplitude, relative to it.
const RESONANCE: (f64, f64) = (0.5, 2.0);
/// Smallest radicand of the load-pressure correction, as in the controller.
const FLOOR: f64 = 0.05;
/// Range for peak and valley, relative to the natural frequency.
const PEAK_RANGE: (f64, f64) = (0.75, 1.3);

/// Level and delay from a test.
#[derive(Debug, Clone, PartialEq)]
pub struct FineTuning {
    /// The compensation level (1) that compensates the motion exactly.
    pub level: Estimate,
    /// The response delay (s) that compensates the delay exactly.
    pub response_delay: Estimate,
    /// Frequency (Hz) of the largest motion.
    pub natural_frequency: f64,
    /// |FFT(force)|/|FFT(command)| at that frequency (1); below 1 the test was undercompensated.
    pub force_ratio: f64,
    /// Frequency (Hz) of the largest ratio near it. If the peak is below the valley, the delay was
    /// undercompensated.
    pub peak: f64,
    /// Frequency (Hz) of the smallest ratio near it.
    pub valley: f64,
}

/// Signals of a test, sample by sample.
#[derive(Debug, Clone, Copy)]
pub struct TestSignals<'a> {
    /// Force command (N).
    pub command: &'a [f64],
    /// Measured force (N).
    pub force: &'a [f64],
    /// Measured velocity (m/s).
    pub velocity: &'a [f64],
}

/// Level and response delay for a rig from a test with its present ones, by least squares over the frequencies of a
/// band (Hz) at which the structure moves. The rate (Hz) of the samples is that of a digital controller. A sweep
/// through the natural frequency is best.
///
/// The rig's flow curve, gains and valve must be correct; a wrong flow gain appears as a level.
///
/// # Errors
/// Compensation that is off, or that changes itself; unequal, too short or incomplete signals; a band outside 0 to half
/// the rate; a motion that is too small, or too large for the linear scheme; a structure that delivers power; a force
/// of another magnitude than the command.
pub fn fine_tune(
    rig: &RigConfig,
    signals: TestSignals<'_>,
    sample_rate: f64,
    band: (f64, f64),
) -> Result<FineTuning> {
    checks::sample_rate("sample_rate", sample_rate)?;
    let TestSignals { command, force, velocity } = signals;
    check_whole(&[("command", command), ("force", force), ("velocity", velocity)], 256)?;
    check_unclipped(&[("force", force), ("velocity", velocity)])?;
    let allowed = "must be on: there is nothing to tune";
    checks::require(rig.compensation.mode != Mode::Off, "compensation.mode", "\"off\"", allowed)?;
    for (key, on) in [("adaptive", rig.compensation.adaptive), ("guard", rig.compensation.guard)] {
        let allowed = "must be off in the test: it changes the level or the delay that would be tuned";
        checks::require(!on, &format!("compensation.{key}"), "true", allowed)?;
    }
    checks::band(band, sample_rate)?;
    // What the rig is believed to be; its truth is unknown in a laboratory.
    let configured = rig.without(&["truth"])?;
    let rig = &*configured.at_rate(sample_rate)?;
    let (low, high) = band;
    check_plausible(signals)?;
    check_motion(rig, signals, sample_rate, band)?;
    let spectra = Spectra::new(rig, signals, sample_rate, 4.0 * high)?;
    let width = sample_rate / command.len() as f64;
    let first = ((low / width).ceil() as usize).max(1);
    let last = ((high / width).floor() as usize).min(spectra.required.len() - 1);
    let most = (first..=last).map(|k| spectra.required[k].norm_sqr()).fold(0.0, f64::max);
    let largest = spectra.largest_opening;
    let found = format!("an opening of {largest:.1e} at most");
    let allowed = format!("must call for at least {LEAST_OPENING}");
    checks::require(largest >= LEAST_OPENING, "velocity", found, allowed)?;
    let bends = rig.compensation.mode == Mode::Linear && largest > LINEAR_OPENING;
    let allowed =
        format!("must stay within {LINEAR_OPENING}, where the compensation is linear: use a smaller force");
    checks::require(!bends, "velocity", format!("an opening of {largest:.2}"), allowed)?;
    let bins: Vec<usize> =
        (first..=last).filter(|k| spectra.required[*k].norm_sqr() > LEAST_POWER * most).collect();
    let found = format!("{} frequencies within {low} to {high} Hz", bins.len());
    let allowed = format!("must move at {LEAST_BINS} at least: use a longer test");
    checks::require(bins.len() >= LEAST_BINS, "velocity", found, allowed)?;
    let [gain, late] = regression(&spectra, &bins, width);
    let found = format!("a compensation {:.2} times the configured one", gain.value);
    let allowed = "must be that of this rig, compensated: check gains, units and signs";
    checks::require(gain.value > 0.2 && gain.value < 5.0, "velocity", found, allowed)?;
    let level = rig.compensation.level / gain.value;
    let delay = rig.compensation.response_delay + late.value;
    let [natural_frequency, force_ratio, peak, valley] = spectra.extremes(&bins, width);
    Ok(FineTuning {
        level: Estimate::new(level, level * gain.uncertainty / gain.value),
        response_delay: Estimate::new(delay.max(0.0), late.uncertainty),
        natural_frequency,
        force_ratio,
        peak,
        valley,
    })
}

/// Checks signs and units: the structure must absorb power, and the force must be of the size of its command.
fn check_plausible(signals: TestSignals<'_>) -> Result<()> {
    let TestSignals { command, force, velocity } = signals;
    // Offset and drift of the velocity are its sensor's.
    let power: f64 = force.iter().zip(detrend(velocity, |_| 1.0)).map(|(f, v)| f * v).sum();
    let resists = power <= 0.0 && velocity.iter().any(|v| *v != 0.0);
    let allowed = "must take power from the force: one of the two has the wrong sign";
    checks::require(!resists, "velocity", "against the force", allowed)?;
    let square = |signal: &[f64]| signal.iter().map(|x| x * x).sum::<f64>();
    let factor = (square(force) / square(command)).sqrt();
    let is_plausible = (1.0 / LARGEST_FACTOR..LARGEST_FACTOR).contains(&factor);
    let found = format!("{factor:.2e} times the command");
    checks::require(is_plausible, "force", found, "must be about the command: check the units of both")
}

/// Refuses a velocity that is not of the size of the specimen's under the force, away from its resonance.
fn check_motion(rig: &RigConfig, signals: TestSignals<'_>, sample_rate: f64, band: (f64, f64)) -> Result<()> {
    let structure = &rig.structure;
    if structure.kind == StructureKind::ShearBuilding {
        return Ok(());
    }
    let steady = |signal: &[f64]| spectrum(&detrend(signal, |_| 1.0));
    let (force, velocity) = (steady(signals.force)?, steady(signals.velocity)?);
    let natural = (structure.stiffness / structure.mass).sqrt() / TAU;
    let width = sample_rate / signals.force.len() as f64;
    let (mut product, mut square) = (0.0, 0.0);
    for (k, (force, velocity)) in force.iter().zip(&velocity).enumerate().skip(1) {
        let frequency = k as f64 * width;
        let near = (RESONANCE.0 * natural..RESONANCE.1 * natural).contains(&frequency);
        if near || !(band.0..=band.1).contains(&frequency) {
            continue;
        }
        let s = Complex64::new(0.0, TAU * frequency);
        let expected =
            force / (s * structure.mass + structure.damping + Complex64::from(structure.stiffness) / s);
        product += (velocity * expected.conj()).re;
        square += expected.norm_sqr();
    }
    let factor = product / square;
    // No number in a band that is all resonance.
    let is_plausible = factor.is_nan() || (VELOCITY_RATIO.0..VELOCITY_RATIO.1).contains(&factor);
    let allowed = "must be that of this specimen: check units and signs of force and velocity, and the mass";
    let found = format!("{factor:.2e} times as large as the force makes it");
    checks::require(is_plausible, "velocity", found, allowed)
}

/// Gain `p` (1) and delay `−q/p` (s) of the regression `produced = (p + jωq)·required`.
fn regression(spectra: &Spectra, bins: &[usize], width: f64) -> [Estimate; 2] {
    let omega = |k: usize| TAU * width * k as f64;
    // Real and imaginary part of opened/needed, weighted by |needed|²: two ordinary regressions.
    let (mut square, mut by_omega, mut real, mut imaginary) = (0.0, 0.0, 0.0, 0.0);
    for &k in bins {
        let cross = spectra.produced[k] * spectra.required[k].conj();
        let weight = spectra.required[k].norm_sqr();
        square += weight;
        by_omega += weight * omega(k) * omega(k);
        real += cross.re;
        imaginary += cross.im * omega(k);
    }
    let (gain, slope) = (real / square, imaginary / by_omega);
    let mut rest = 0.0;
    for &k in bins {
        let model = spectra.required[k] * Complex64::new(gain, omega(k) * slope);
        rest += (spectra.produced[k] - model).norm_sqr();
    }
    let variance = rest / (2 * bins.len() - 2) as f64;
    let delay = Estimate::new(-slope / gain, (variance / by_omega).sqrt() / gain);
    [Estimate::new(gain, (variance / square).sqrt()), delay]
}

struct Spectra {
    /// Opening that the compensation of the motion needs.
    required: Vec<Complex64>,
    /// Opening that the compensation produced.
    produced: Vec<Complex64>,
    command: Vec<Complex64>,
    force: Vec<Complex64>,
    largest_opening: f64,
}

impl Spectra {
    fn new(rig: &RigConfig, signals: TestSignals<'_>, sample_rate: f64, cutoff: f64) -> Result<Self> {
        let n = signals.command.len();
        let width = sample_rate / n as f64;
        let fade_out = |k: usize| {
            // Frequencies above the band contain noise and are faded out by a raised cosine over an octave.
            let f = k as f64 * width;
            if f <= cutoff { 1.0 } else { 0.5 + 0.5 * (TAU * 0.5 * (f / cutoff - 1.0).min(1.0)).cos() }
        };
        let to_time = |mut spectrum: Vec<Complex64>| -> Result<Vec<f64>> {
            // The ends of a real signal's spectrum are real.
            spectrum[0].im = 0.0;
            if let (Some(last), 0) = (spectrum.last_mut(), n % 2) {
                last.im = 0.0;
            }
            let mut output = signal_of(spectrum, n)?;
            output.iter_mut().for_each(|value| *value /= n as f64);
            Ok(output)
        };
        let scaled = |spectrum: &[Complex64], factor: &dyn Fn(usize) -> Complex64| -> Vec<Complex64> {
            spectrum.iter().enumerate().map(|(k, value)| value * factor(k) * fade_out(k)).collect()
        };
        let one = |_: usize| Complex64::new(1.0, 0.0);
        let rate = |k: usize| Complex64::new(0.0, TAU * width * k as f64);

        let steady = |signal: &[f64]| detrend(signal, |_| 1.0);
        let command = spectrum(&steady(signals.command))?;
        let force = spectrum(&steady(signals.force))?;
        let velocity = spectrum(&steady(signals.velocity))?;
        let (smooth_force, smooth_velocity) =
            (to_time(scaled(&force, &one))?, to_time(scaled(&velocity, &one))?);
        let force_rate = to_time(scaled(&force, &rate))?;
        let (smooth_command, command_rate) =
            (to_time(scaled(&command, &one))?, to_time(scaled(&command, &rate))?);

        let table = rig.controller_curve().table()?;
        let actuator = &rig.actuator;
        let (area, stall) = (actuator.piston_area, actuator.piston_area * rig.supply.pressure);
        let further_flow =
            |force: f64, rate: f64| (actuator.leakage * force + actuator.compressibility * rate) / area;
        let opening = |flow: f64, force: f64| {
            let radicand = 1.0 - flow.signum() * force / stall;
            rig.add_overlap(table.opening(flow / radicand.max(FLOOR).sqrt()))
        };
        let feedforward = f64::from(u8::from(rig.compensation.feedforward));
        let (mut required, mut total) = (Vec::with_capacity(n), Vec::with_capacity(n));
        for i in 0..n {
            let (force, motion) = (smooth_force[i], area * smooth_velocity[i]);
            let commanded_flow = further_flow(smooth_command[i], command_rate[i]);
            required.push(opening(motion + feedforward * commanded_flow, force));
            total.push(opening(motion + further_flow(force, force_rate[i]), force));
        }
        let largest_opening = required.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let (required, total) = (spectrum(&required)?, spectrum(&total)?);
        let controller = &rig.controller;
        let hold = if controller.realization == Realization::Digital { 0.5 / sample_rate } else { 0.0 };
        let loop_gain = |k: usize| {
            let hold_delay = Complex64::from_polar(1.0, -(rate(k).im * hold));
            let mut law =
                Complex64::new(controller.proportional_gain, 0.0) + rate(k) * controller.derivative_gain;
            if controller.integrates() && k > 0 {
                // The sum of the earlier samples, which is half a sample late as well.
                law += hold_delay * controller.integral_gain / rate(k);
            }
            law * controller.force_sensitivity * valve_response(rig, k as f64 * width) * hold_delay
        };
        let produced = (0..total.len()).map(|k| total[k] - loop_gain(k) * (command[k] - force[k])).collect();
        Ok(Self { required, produced, command, force, largest_opening })
    }

    /// The extremes as in Fig. 11.
    fn extremes(&self, bins: &[usize], width: f64) -> [f64; 4] {
        let ratio = |k: usize| self.force[k].norm() / self.command[k].norm().max(f64::MIN_POSITIVE);
        let strongest =
            |a: &usize, b: &usize| self.required[*a].norm_sqr().total_cmp(&self.required[*b].norm_sqr());
        let natural = bins.iter().copied().max_by(strongest).unwrap_or(1);
        let end = self.command.len() - 1;
        let edge = |factor: f64| ((natural as f64 * factor).round() as usize).clamp(1, end);
        let near_natural = || edge(PEAK_RANGE.0)..=edge(PEAK_RANGE.1);
        let by_ratio = |a: &usize, b: &usize| ratio(*a).total_cmp(&ratio(*b));
        let frequency = |bin: Option<usize>| bin.unwrap_or(natural) as f64 * width;
        let (peak, valley) = (near_natural().max_by(by_ratio), near_natural().min_by(by_ratio));
        [frequency(None), ratio(natural), frequency(peak), frequency(valley)]
    }
}
