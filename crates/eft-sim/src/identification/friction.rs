//! Friction of the seals and compressibility of the oil, from spool, velocity and force of a test of the whole rig.
//!
//! The load cell is behind the seals, so the oil carries `F + F_c·sgn(ẋ)`. The flow balance of the actuator is
//! `A·ẋ(t + δ) + C_l·F/A = s₊·Q₊ + s₋·Q₋ − (K/A)·Ḟ − (K_a/A)·F_c·d(sgn ẋ)/dt`, with the flow `Q` of the configured valve
//! in each direction. It is linear in `s₊`, `s₋`, `δ`, `K` and `F_c`, which least squares fit in a band of frequencies.

use std::f64::consts::TAU;

use nalgebra::{SMatrix, SVector};

use super::Estimate;
use super::gaps::check;
use crate::checks;
use crate::config::RigConfig;
use crate::error::{Error, Result};
use crate::fourier::{Complex64, signal_of, spectrum};
use crate::plant::LoadFlow;

/// Frequencies (Hz) of the fit. Below them the drifts of the flows prevail, above them the sensors' noise.
const BAND: (f64, f64) = (0.5, 40.0);
/// Least duration (s).
const LEAST_DURATION: f64 = 4.0;
/// Width of the smooth sign, as a share of the velocity's rms.
const WIDTH: f64 = 0.06;
/// Neighbouring frequencies of one sum of the uncertainty, because their residuals depend on each other.
const NEIGHBOURS: usize = 16;
/// Flows of the two directions over those of the configuration. Beyond them a unit or a sign is wrong.
const FLOWS: (f64, f64) = (0.3, 3.0);

const UNKNOWNS: usize = 5;
type Unknowns = SVector<f64, UNKNOWNS>;
type Square = SMatrix<f64, UNKNOWNS, UNKNOWNS>;

/// The seals' friction with what is found beside it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionEstimate {
    /// Coulomb friction `F_c` (N) whose flow is the measured one at the configured compressibility.
    pub friction: Estimate,
    /// Compressibility of the oil `K` (m³/Pa).
    pub compressibility: Estimate,
    /// Flow over that of the configured valve (1), in the negative and in the positive direction.
    pub flow_factors: [Estimate; 2],
    /// Delay (s) of the velocity behind the spool, by their sensors.
    pub velocity_delay: Estimate,
}

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

/// The friction of a rig's seals from a test sampled at a rate (Hz). A sweep through the natural frequency is best: the
/// motion must change, so that the friction differs from a delay.
///
/// # Errors
/// Unequal, too short or incomplete signals, a motion without reversals, or flows of another size than those of the
/// configured valve.
pub fn identify_friction(
    rig: &RigConfig,
    signals: MotionSignals<'_>,
    sample_rate: f64,
) -> Result<FrictionEstimate> {
    checks::sample_rate("sample_rate", sample_rate)?;
    let MotionSignals { spool, velocity, force } = signals;
    let least = (LEAST_DURATION * sample_rate).ceil() as usize;
    check(("spool", "velocity"), (spool.len(), velocity.len()), least)?;
    check(("spool", "force"), (spool.len(), force.len()), least)?;
    for (name, signal) in [("spool", spool), ("velocity", velocity), ("force", force)] {
        checks::signal(name, signal)?;
    }
    let fit = Balance::new(rig, signals, sample_rate)?.fitted().ok_or_else(|| {
        let allowed = "must move to and fro at several frequencies, as in a sweep";
        Error::value("velocity", "hardly moves", allowed)
    })?;
    let [back, forth, delay, oil, friction] = fit;
    for factor in [back, forth] {
        if !(FLOWS.0..FLOWS.1).contains(&factor.value) {
            let found = format!("{:.2} times the flow of the configured valve", factor.value);
            let allowed = "must be those of this rig: check gains, units and signs";
            return Err(Error::value("spool and velocity", found, allowed));
        }
    }
    let compressibility = rig.actuator.compressibility;
    Ok(FrictionEstimate {
        friction,
        compressibility: Estimate {
            value: compressibility * oil.value,
            uncertainty: compressibility * oil.uncertainty,
        },
        flow_factors: [back, forth],
        velocity_delay: delay,
    })
}

/// The flow balance in the frequencies of the band.
struct Balance {
    /// Flow (m³/s) that the motion and the leakage take, at each frequency.
    taken: Vec<Complex64>,
    /// Its derivatives with respect to the unknowns.
    columns: Vec<[Complex64; UNKNOWNS]>,
}

impl Balance {
    fn new(rig: &RigConfig, signals: MotionSignals<'_>, sample_rate: f64) -> Result<Self> {
        let MotionSignals { spool, velocity, force } = signals;
        let (area, supply) = (rig.actuator.piston_area, rig.supply.pressure);
        let valve = LoadFlow::<f64>::pack(|_| rig)?;
        let flow = |side: f64| {
            let passed =
                |x: &f64, f: &f64| if side * x > 0.0 { valve.flow_at(*x, f / area, supply).0 } else { 0.0 };
            spectrum(&spool.iter().zip(force).map(|(x, f)| passed(x, f)).collect::<Vec<_>>())
        };
        let (back, forth) = (flow(-1.0)?, flow(1.0)?);
        let width = sample_rate / spool.len() as f64;
        let (motion, force) = (spectrum(velocity)?, spectrum(force)?);
        let sign = spectrum(&signs(&motion, width, velocity.len())?)?;
        let (compliance, leakage) = (rig.actuator.compressibility / area, rig.actuator.leakage / area);
        let (first, last) = ((BAND.0 / width).ceil() as usize, (BAND.1 / width).floor() as usize);
        let bins = first.max(1)..=last.min(motion.len() - 1);
        let rate = |k: usize| Complex64::new(0.0, TAU * width * k as f64);
        Ok(Self {
            taken: bins.clone().map(|k| motion[k] * area + force[k] * leakage).collect(),
            columns: bins
                .map(|k| {
                    [
                        back[k],
                        forth[k],
                        motion[k] * rate(k) * -area,
                        force[k] * rate(k) * -compliance,
                        sign[k] * rate(k) * -compliance,
                    ]
                })
                .collect(),
        })
    }

    /// The unknowns of the least squares, `None` where the signals do not determine them.
    fn fitted(&self) -> Option<[Estimate; UNKNOWNS]> {
        let product = |a: Complex64, b: Complex64| a.re * b.re + a.im * b.im;
        let mut normal = Square::zeros();
        let mut right = Unknowns::zeros();
        for (column, taken) in self.columns.iter().zip(&self.taken) {
            normal += Square::from_fn(|i, j| product(column[i], column[j]));
            right += Unknowns::from_fn(|i, _| product(column[i], *taken));
        }
        // Unit diagonal, because the columns have different units.
        let scale = normal.diagonal().map(|square| square.sqrt().recip());
        if !scale.iter().all(|one| one.is_finite()) {
            return None;
        }
        let scaled = Square::from_fn(|i, j| normal[(i, j)] * scale[i] * scale[j]);
        let inverse = scaled.try_inverse()?;
        let inverse = Square::from_fn(|i, j| inverse[(i, j)] * scale[i] * scale[j]);
        let found = inverse * right;
        let mut spread = Square::zeros();
        for (columns, taken) in self.columns.chunks(NEIGHBOURS).zip(self.taken.chunks(NEIGHBOURS)) {
            let mut sum = Unknowns::zeros();
            for (column, taken) in columns.iter().zip(taken) {
                let model: Complex64 = column.iter().zip(found.iter()).map(|(a, b)| a * b).sum();
                sum += Unknowns::from_fn(|i, _| product(column[i], taken - model));
            }
            spread += sum * sum.transpose();
        }
        let covariance = inverse * spread * inverse;
        let estimate = |i| Estimate { value: found[i], uncertainty: covariance[(i, i)].max(0.0).sqrt() };
        found.iter().all(|one| one.is_finite()).then(|| std::array::from_fn(estimate))
    }
}

/// The sign of the velocity without its noise above the band, smooth near its zeros.
fn signs(motion: &[Complex64], width: f64, length: usize) -> Result<Vec<f64>> {
    let kept = motion
        .iter()
        .enumerate()
        .map(|(k, bin)| if k > 0 && k as f64 * width <= BAND.1 { *bin } else { Complex64::default() });
    let smooth: Vec<f64> = signal_of(kept.collect(), length)?.iter().map(|v| v / length as f64).collect();
    let rms = (smooth.iter().map(|v| v * v).sum::<f64>() / length as f64).sqrt();
    let steep = 1.0 / (WIDTH * rms).max(f64::MIN_POSITIVE);
    Ok(smooth.iter().map(|v| (v * steep).clamp(-1.0, 1.0)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: f64 = 1024.0;

    /// A motion with several frequencies, and the spool opening that its flow balance requires of a linear valve.
    fn test(friction: f64, oil: f64) -> (RigConfig, [Vec<f64>; 3]) {
        let table =
            crate::config::FlowCurve { openings: vec![-1.0, 0.0, 1.0], flows: vec![-0.02, 0.0, 0.02] };
        let rig = RigConfig::zhao2005().with(|rig| rig.servovalve.flow_table = table).unwrap();
        let (area, supply) = (rig.actuator.piston_area, rig.supply.pressure);
        let mut signals = [const { Vec::new() }; 3];
        for i in 0..8192 {
            let t = f64::from(i) / RATE;
            // Whole periods in the record.
            let wave = |f: f64, phase: f64| (TAU * f * t + phase).sin_cos();
            let (v, dv) = [(1.0, 0.0, 0.1), (2.5, 1.0, 0.05), (5.75, 2.0, 0.02)]
                .iter()
                .map(|(f, phase, a)| (a * wave(*f, *phase).0, a * TAU * f * wave(*f, *phase).1))
                .fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
            let (f, df) = (4000.0 * wave(1.5, 0.4).0, 4000.0 * TAU * 1.5 * wave(1.5, 0.4).1);
            // A friction as smooth as the sign of the fit: 6 % of the velocity's rms.
            let width = WIDTH * (0.5_f64 * (0.1 * 0.1 + 0.05 * 0.05 + 0.02 * 0.02)).sqrt();
            let rubbed = if v.abs() < width { friction * dv / width } else { 0.0 };
            let compliance = rig.actuator.compressibility / area;
            let flow = area * v + rig.actuator.leakage / area * f + compliance * (oil * df + rubbed);
            let root = (1.0 - flow.signum() * f / (area * supply)).sqrt();
            for (signal, value) in signals.iter_mut().zip([flow / root / 0.02, v, f]) {
                signal.push(value);
            }
        }
        (rig, signals)
    }

    fn found(rig: &RigConfig, signals: &[Vec<f64>; 3]) -> Result<FrictionEstimate> {
        let [spool, velocity, force] = signals;
        identify_friction(rig, MotionSignals { spool, velocity, force }, RATE)
    }

    #[test]
    fn friction_and_oil_of_a_known_balance_are_found() {
        for (friction, oil) in [(0.0, 1.0), (900.0, 1.3)] {
            let (rig, signals) = test(friction, oil);
            let found = found(&rig, &signals).unwrap();
            assert!((found.friction.value - friction).abs() < 20.0, "{found:?}");
            assert!(
                (found.compressibility.value / rig.actuator.compressibility - oil).abs() < 0.02,
                "{found:?}"
            );
            for factor in found.flow_factors {
                assert!((factor.value - 1.0).abs() < 0.002, "{found:?}");
            }
            assert!(found.velocity_delay.value.abs() < 2e-5, "{found:?}");
        }
    }

    #[test]
    fn a_late_velocity_is_a_delay_and_no_friction() {
        let (rig, mut signals) = test(900.0, 1.0);
        // The motion is periodic in the record.
        signals[1].rotate_right(2);
        let found = found(&rig, &signals).unwrap();
        assert!((found.velocity_delay.value - 2.0 / RATE).abs() < 2e-4, "{found:?}");
        assert!((found.friction.value - 900.0).abs() < 150.0, "{found:?}");
    }

    #[test]
    fn what_determines_nothing_is_refused() {
        let (rig, signals) = test(900.0, 1.0);
        let refused = |signals: &[Vec<f64>; 3]| found(&rig, signals).unwrap_err().to_string();
        let still = signals.each_ref().map(|signal| vec![0.0; signal.len()]);
        assert!(refused(&still).contains("hardly moves"));
        let mut reversed = signals.clone();
        reversed[0].iter_mut().for_each(|x| *x = -*x);
        assert!(refused(&reversed).contains("check gains, units and signs"));
        let mut short = signals.clone();
        short[2].pop();
        assert!(refused(&short).contains("force"));
        let mut gap = signals;
        gap[1][100] = f64::NAN;
        assert!(refused(&gap).contains("velocity"));
    }
}
