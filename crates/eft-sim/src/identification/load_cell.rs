//! Gain of the load cell, from a test of the whole rig against the specimen's inertia.
//!
//! Well above its natural frequency a specimen of known mass moves by `V = (F + a + b/s)/Z` with `Z = m·s + c + k/s`,
//! and the displacement is `X = (V + d + e/s)/s`. The real numbers `a`, `b` and `d` are the changes of momentum, spring
//! force and displacement over a record that does not end as it began, and `e` the drift of the velocity's sensor.
//! Least squares give the ratios of the gains of force, velocity and displacement. All three gains have the same
//! tolerance. The load cell's gain is the mean of those that leave all three within it.

use std::f64::consts::{PI, TAU};

use super::Estimate;
use super::clipping::check_unclipped;
use super::gaps::check_whole;
use super::least_squares::least_squares;
use crate::config::{MotionAt, RigConfig, StructureKind};
use crate::fourier::{Complex64, spectrum};
use crate::{Error, Result, checks};

/// Least duration (s).
const LEAST_DURATION: f64 = 4.0;
/// The inertia's band: from this multiple of the natural frequency, where the stiffness takes 6 % of the force, and at
/// least from the first frequency (Hz) to the second, which few sensors attenuate.
const ABOVE_RESONANCE: f64 = 4.0;
const INERTIA_BAND: (f64, f64) = (8.0, 35.0);
/// Frequencies (Hz) at which displacement and velocity are both known well.
const MOTION_BAND: (f64, f64) = (0.5, 10.0);
/// Ratios of two gains beyond which a unit or a sign is wrong.
const RATIOS: (f64, f64) = (0.7, 1.4);
/// Largest uncertainty of a ratio; with more the test lacks the frequencies.
const LARGEST_UNCERTAINTY: f64 = 0.05;
/// Least sample rate (Hz), for the band.
const LEAST_RATE: f64 = 80.0;
/// Steps of the delay between two signals.
const ITERATIONS: usize = 4;
/// Width of a tolerance's limits over the tolerance (1): it is a round number, not the edge of what occurs.
const WIDTH_OF_LIMITS: f64 = 0.1;
/// Largest gain over the tolerance (1), and the standard deviations of a ratio within which a gain explains it (1).
const FURTHEST: f64 = 1.2;
const DEVIATIONS: f64 = 3.0;
/// Numbers on each side of the middle for the distribution of a gain, and the largest over the tolerance (1). Beyond
/// `FURTHEST` it has room for the limits' softness.
const GRID: (i32, f64) = (140, 2.1);

/// Gains of the sensors, from each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadCellEstimate {
    /// Reading over force (1) of the load cell.
    pub gain: Estimate,
    /// Gain of the load cell over that of the velocity sensor (1), for the configured mass.
    pub force_over_velocity: Estimate,
    /// Gain of the velocity sensor over that of the displacement sensor (1).
    pub velocity_over_displacement: Estimate,
}

/// Measured signals of a moving specimen, sample by sample.
#[derive(Debug, Clone, Copy)]
pub struct SpecimenSignals<'a> {
    /// Displacement (m).
    pub displacement: &'a [f64],
    /// Velocity (m/s).
    pub velocity: &'a [f64],
    /// Force (N).
    pub force: &'a [f64],
}

/// The gain of a rig's load cell from a test sampled at a rate (Hz), best a sweep from 0 to 40 Hz.
///
/// `gain_uncertainty` (1) is that of each sensor's gain before the test, `mass_uncertainty` (1) that of
/// `structure.mass`, both as standard deviations. The gains have a tolerance of about √3 times their uncertainty. Gains that
/// lie further apart than 4 times it, by more than three standard deviations of their ratio, are refused.
/// Configured bandwidths and attachment are allowed for. The structure must be elastic in the band.
///
/// # Errors
/// Unequal, too short or incomplete signals, a sample rate below 80 Hz, uncertainties out of range, a building, a power
/// damper, a play between piston and sensor, a natural frequency above 8.75 Hz, a test without these frequencies, or signals
/// that no gains near one, or within their tolerance, explain.
pub fn identify_load_cell(
    rig: &RigConfig,
    signals: SpecimenSignals<'_>,
    sample_rate: f64,
    gain_uncertainty: f64,
    mass_uncertainty: f64,
) -> Result<LoadCellEstimate> {
    check_signals(signals, sample_rate)?;
    let sound = gain_uncertainty > 0.0 && gain_uncertainty <= 1.0;
    checks::require(sound, "gain_uncertainty", gain_uncertainty, "must be above 0 and at most 1")?;
    let allowed = "must be from 0 to 1";
    checks::require((0.0..=1.0).contains(&mass_uncertainty), "mass_uncertainty", mass_uncertainty, allowed)?;
    let low = check_specimen(rig)?;
    let SpecimenSignals { displacement, velocity, force } = signals;
    let (structure, sensors) = (&rig.structure, &rig.sensors);
    let width = sample_rate / force.len() as f64;
    let displacement = spectrum_before_lag(displacement, sensors.displacement.bandwidth, width)?;
    let velocity = spectrum_before_lag(velocity, sensors.velocity.bandwidth, width)?;
    let force = spectrum_before_lag(force, sensors.force.bandwidth, width)?;
    // The mass between cell and piston is before the cell.
    let mass = structure.mass - sensors.cell_mass.unwrap_or(0.0);
    let mobility =
        |s: Complex64| (s * mass + structure.damping + Complex64::from(structure.stiffness) / s).inv();
    let attachment = match sensors.motion_at {
        MotionAt::Piston => rig.actuator.attachment_stiffness.map_or(0.0, f64::recip),
        MotionAt::Structure => 0.0,
    };
    let velocity_ratio = ratio("velocity", &velocity, width, (low, INERTIA_BAND.1), |k, s| {
        [force[k] * (mobility(s) + s * attachment), s, mobility(s), mobility(s) / s]
    })?;
    let displacement_ratio = ratio("displacement", &displacement, width, MOTION_BAND, |k, s| {
        [velocity[k] / s, s, s.inv(), (s * s).inv()]
    })?;
    let inverse = |one: Estimate| Estimate::new(1.0 / one.value, one.uncertainty / (one.value * one.value));
    let (force_over_velocity, velocity_over_displacement) =
        (inverse(velocity_ratio), inverse(displacement_ratio));
    let gain =
        within_tolerance(force_over_velocity, velocity_over_displacement, gain_uncertainty, mass_uncertainty)
            .ok_or_else(|| {
                let allowed = format!(
                    "must be larger: load cell over velocity is {:.4}, velocity over displacement {:.4}",
                    force_over_velocity.value, velocity_over_displacement.value
                );
                Error::value("gain_uncertainty", gain_uncertainty, allowed)
            })?;
    Ok(LoadCellEstimate { gain, force_over_velocity, velocity_over_displacement })
}

fn check_signals(signals: SpecimenSignals<'_>, sample_rate: f64) -> Result<()> {
    let SpecimenSignals { displacement, velocity, force } = signals;
    checks::sample_rate("sample_rate", sample_rate)?;
    let allowed = format!("must be at least {LEAST_RATE} Hz");
    checks::require(sample_rate >= LEAST_RATE, "sample_rate", sample_rate, allowed)?;
    let least = (LEAST_DURATION * sample_rate).ceil() as usize;
    let signals = [("force", force), ("velocity", velocity), ("displacement", displacement)];
    check_whole(&signals, least)?;
    check_unclipped(&signals)
}

/// The lowest frequency (Hz) of the inertia's band, for a structure that has one.
fn check_specimen(rig: &RigConfig) -> Result<f64> {
    let (structure, actuator) = (&rig.structure, &rig.actuator);
    let is_building = structure.kind == StructureKind::ShearBuilding;
    let allowed = "must have one story, whose mass the force accelerates alone";
    checks::require(!is_building, "structure.kind", "\"shear_building\"", allowed)?;
    let allowed = "must be absent, because its force is not proportional to the velocity";
    checks::require(structure.power_damper.is_none(), "structure.power_damper", "present", allowed)?;
    let play = actuator.attachment_play;
    let is_measured = play > 0.0 && rig.sensors.motion_at == MotionAt::Piston;
    let allowed = "must be 0 for a motion that is measured at the piston";
    checks::require(!is_measured, "actuator.attachment_play", play, allowed)?;
    let natural = (structure.stiffness / structure.mass).sqrt() / TAU;
    let low = INERTIA_BAND.0.max(ABOVE_RESONANCE * natural);
    let allowed = format!("must be below {} Hz for this test", INERTIA_BAND.1 / ABOVE_RESONANCE);
    checks::require(low < INERTIA_BAND.1, "natural frequency of the structure in Hz", natural, allowed)?;
    Ok(low)
}

/// The spectrum of a signal before the lag of its sensor (Hz).
fn spectrum_before_lag(signal: &[f64], bandwidth: Option<f64>, width: f64) -> Result<Vec<Complex64>> {
    let mut spectrum = spectrum(signal)?;
    if let Some(bandwidth) = bandwidth {
        for (k, bin) in spectrum.iter_mut().enumerate() {
            *bin *= Complex64::new(1.0, k as f64 * width / bandwidth);
        }
    }
    Ok(spectrum)
}

/// The real factor of a signal over a model of it, apart from a delay. At each frequency (its bin and rad/s) the model gives
/// itself, `s`, and the columns of the record's ends.
fn ratio<const N: usize>(
    name: &str,
    signal: &[Complex64],
    width: f64,
    (low, high): (f64, f64),
    model: impl Fn(usize, Complex64) -> [Complex64; N],
) -> Result<Estimate> {
    let bins = (low / width).ceil() as usize..=((high / width).floor() as usize).min(signal.len() - 1);
    let mut delay = 0.0;
    let mut found = None;
    for _ in 0..ITERATIONS {
        let rows = bins.clone().map(|k| {
            let mut columns = model(k, Complex64::new(0.0, TAU * width * k as f64));
            columns[0] *= (-columns[1] * delay).exp();
            columns[1] *= -columns[0];
            (columns, signal[k])
        });
        found = least_squares::<N>(rows);
        let Some(fitted) = found else { break };
        delay += fitted[1].value / fitted[0].value;
    }
    let is_clear = |one: &Estimate| one.uncertainty < LARGEST_UNCERTAINTY * one.value.abs();
    let Some(factor) = found.map(|fitted| fitted[0]).filter(is_clear) else {
        let allowed = format!("must move with the force from {low:.3} to {high} Hz: run a sweep to 40 Hz");
        return Err(Error::value(name, "without a clear motion", allowed));
    };
    let found = format!("{:.2} times as large as expected", factor.value);
    let allowed = "must be that of this rig: check gains, units, signs and the mass";
    checks::require((RATIOS.0..RATIOS.1).contains(&factor.value), name, found, allowed)?;
    Ok(factor)
}

/// The load cell's gain, in logarithms of the gains: its mean where all three are within their tolerance. None if two gains
/// lie further apart than that.
///
/// Before the test each gain has a rectangular distribution with inexactly known limits (JCGM 101:2008, 6.4.3), of standard
/// deviation `gain`.
fn within_tolerance(
    over_velocity: Estimate,
    velocity_over: Estimate,
    gain: f64,
    mass: f64,
) -> Option<Estimate> {
    let tolerance = gain * (3.0 / (1.0 + (PI * WIDTH_OF_LIMITS).powi(2))).sqrt();
    let in_logarithm =
        |ratio: Estimate, more: f64| (ratio.value.ln(), (ratio.uncertainty / ratio.value).hypot(more));
    let (first, second) = (in_logarithm(over_velocity, mass), in_logarithm(velocity_over, 0.0));
    let whole = (first.0 + second.0, first.1.hypot(second.1));
    let fits =
        |(apart, deviation): (f64, f64)| apart.abs() - DEVIATIONS * deviation <= 2.0 * FURTHEST * tolerance;
    if ![first, second, whole].into_iter().all(fits) {
        return None;
    }
    let step = GRID.1 * tolerance / f64::from(GRID.0);
    let gains: Vec<f64> = (-GRID.0..=GRID.0).map(|index| f64::from(index) * step).collect();
    let before: Vec<f64> = gains
        .iter()
        .map(|one| 1.0 / (1.0 + ((one.abs() / tolerance - 1.0) / WIDTH_OF_LIMITS).exp()))
        .collect();
    // The distribution of a gain, from that of another one and their ratio.
    let from = |others: &[f64], (middle, deviation): (f64, f64)| -> Vec<f64> {
        let deviation = deviation.max(step);
        let share = |one: f64| -> f64 {
            let density = |other: f64| (-0.5 * ((one - other - middle) / deviation).powi(2)).exp();
            gains.iter().zip(others).map(|(&other, weight)| weight * density(other)).sum()
        };
        gains.iter().zip(&before).map(|(&one, weight)| weight * share(one)).collect()
    };
    let force = from(&from(&before, second), first);
    let mean_of = |value: &dyn Fn(f64) -> f64| {
        let sum: f64 = gains.iter().zip(&force).map(|(&one, weight)| weight * value(one)).sum();
        sum / force.iter().sum::<f64>()
    };
    let mean = mean_of(&|one| one);
    let value = mean.exp();
    let uncertainty = value * mean_of(&|one| (one - mean).powi(2)).sqrt();
    uncertainty.is_finite().then_some(Estimate { value, uncertainty })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exact(value: f64) -> Estimate {
        Estimate { value, uncertainty: 0.0 }
    }

    #[test]
    fn the_gain_is_the_middle_of_those_within_the_tolerance() {
        // Gains of 1.02 (force), 1.00 (velocity) and 0.99 (displacement): the outer two bound the common error.
        let found = within_tolerance(exact(1.02), exact(1.0 / 0.99), 0.01, 0.0).expect("within");
        let middle = 1.02 / (1.02_f64 * 0.99).sqrt();
        assert!((found.value - middle).abs() < 1e-4, "{found:?} {middle}");
        // Its limits are half as far apart as the two gains leave of the tolerance, and soft.
        let left = 0.01 * 3.0_f64.sqrt() - 0.5 * (1.02_f64 / 0.99).ln();
        assert!(found.uncertainty > left / 3.0_f64.sqrt() && found.uncertainty < 3.5e-3, "{found:?} {left}");
    }

    #[test]
    fn equal_gains_leave_a_common_error_of_nearly_the_whole_tolerance() {
        let found = within_tolerance(exact(1.0), exact(1.0), 0.01, 0.0).expect("within");
        assert!((found.value - 1.0).abs() < 1e-9, "{found:?}");
        assert!(found.uncertainty > 8e-3 && found.uncertainty < 1e-2, "{found:?}");
    }

    #[test]
    fn an_unknown_mass_says_nothing_about_the_gain() {
        let found = within_tolerance(exact(1.02), exact(1.0), 0.01, 1e6).expect("within");
        assert!((found.value - 1.0).abs() < 1e-9 && (found.uncertainty - 0.01).abs() < 1e-4, "{found:?}");
    }

    #[test]
    fn gains_beyond_their_tolerance_have_no_common_error() {
        for (force, displacement) in [(1.3, 1.0), (1.06, 1.0), (1.028, 0.972), (1.0, 0.94), (0.96, 1.0)] {
            let found = within_tolerance(exact(force), exact(1.0 / displacement), 0.01, 0.0);
            assert_eq!(found, None, "{force} {displacement}");
        }
        // Neighbours are near enough to each other, the outer two are not.
        assert_eq!(within_tolerance(exact(1.021), exact(1.021), 0.01, 0.0), None);
    }

    #[test]
    fn the_noise_of_a_ratio_and_the_mass_allow_gains_further_apart() {
        let noisy = Estimate { value: 1.06, uncertainty: 0.01 };
        for (ratio, mass) in [(noisy, 0.0), (exact(1.06), 0.01)] {
            let found = within_tolerance(ratio, exact(1.0), 0.01, mass).expect("within");
            assert!(found.value > 1.01 && found.value < 1.02 && found.uncertainty > 2e-3, "{found:?}");
        }
        let less = Estimate { value: 1.06, uncertainty: 0.005 };
        assert_eq!(within_tolerance(less, exact(1.0), 0.01, 0.0), None);
    }

    #[test]
    fn gains_near_the_edge_of_their_tolerance_lie_within_two_stated_deviations() {
        // Half the largest difference that is not refused, which is 2.4 softened tolerances: 1.98 %.
        for half in [0.018_f64, 0.0195] {
            for [force, velocity, displacement] in
                [[1.0, 0.0, -1.0], [1.0, -1.0, -1.0], [1.0, 1.0, -1.0], [-1.0, 1.0, 1.0]]
            {
                let ratios =
                    [force - velocity, velocity - displacement].map(|apart| exact((half * apart).exp()));
                let found = within_tolerance(ratios[0], ratios[1], 0.01, 0.0).expect("within");
                let error = found.value.ln() - half * force;
                assert!(error.abs() < 2.0 * found.uncertainty, "{half} {force} {velocity} {found:?}");
                // The distribution itself, on all numbers: 0.15 to 0.22 softened tolerances.
                assert!(found.uncertainty > 2.4e-3 && found.uncertainty < 3.7e-3, "{found:?}");
            }
        }
    }

    #[test]
    fn the_error_of_drawn_gains_is_as_stated_and_smaller_than_that_of_their_mean() {
        let mut draws = (1..=200_u32).map(|index| {
            // An even sequence of the unit cube (Weyl, of the plastic number's kind for three dimensions).
            let part = |step: f64| 0.02 * (2.0 * (f64::from(index) * step).fract() - 1.0);
            [part(0.819_172_513), part(0.671_043_607), part(0.549_700_478)]
        });
        let sums = draws.try_fold([0.0; 3], |sums, [force, velocity, displacement]| {
            let (first, second) = (exact((force - velocity).exp()), exact((velocity - displacement).exp()));
            let found = within_tolerance(first, second, 0.02 / 3.0_f64.sqrt(), 0.0)?;
            let error = found.value.ln() - force;
            let mean = -(force + velocity + displacement) / 3.0;
            let stated = found.uncertainty / found.value;
            Some([sums[0] + error * error, sums[1] + mean * mean, sums[2] + stated * stated])
        });
        let [error, of_mean, stated] = sums.expect("within").map(|sum| 100.0 * (sum / 200.0).sqrt());
        assert!(
            error < 0.97 * of_mean && error < 1.02 * stated && error > 0.8 * stated,
            "{error} {of_mean} {stated}"
        );
    }
}
