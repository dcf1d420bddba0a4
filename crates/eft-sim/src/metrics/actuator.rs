//! The metrics of a test, force and motion: the same for a run, a batch and a study.

use super::norms::Norms;
use super::pair::{not_silent, same_length};
use super::table::Metrics;
use crate::closed_loop::{SimulateOptions, ideal_responses};
use crate::ground_motion::excitation::Command;
use crate::{Result, RigConfig};

/// The signals of one actuator in a test.
#[derive(Debug, Clone, Copy)]
pub struct Actuator<'a> {
    /// Force command (N).
    pub command: &'a [f64],
    /// Force on the structure (N).
    pub force: &'a [f64],
    /// Displacement (m).
    pub displacement: &'a [f64],
    /// Spool opening (1).
    pub spool: &'a [f64],
    /// Smallest supply pressure (Pa).
    pub min_supply_pressure: f64,
}

/// Sums and extremes during a test.
#[derive(Clone, Copy)]
pub(crate) struct Sums {
    pub(crate) norms: Norms<f64>,
    /// Largest spool opening (1).
    pub(crate) max_spool: f64,
    /// Largest story drift (m).
    pub(crate) drift: f64,
    /// Smallest supply pressure (Pa).
    pub(crate) min_supply_pressure: f64,
}

/// The data for the metrics of one actuator: its command (N), the sums, and for the costly metrics the whole
/// force (N) and displacement (m).
pub(crate) struct Summed<'a> {
    pub(crate) command: &'a [f64],
    pub(crate) sums: Sums,
    pub(crate) whole: [&'a [f64]; 2],
}

/// The metrics of a test without those of the force: there was no command, or the numbers left their range.
fn without_force(sums: &Sums, costly: bool) -> Metrics {
    let mut metrics = Metrics::undefined(costly);
    metrics.set("max_spool", sums.max_spool);
    metrics.set("drift", sums.drift);
    metrics.set("min_supply_pressure", sums.min_supply_pressure);
    metrics
}

/// The metrics of a test, with the costly ones if there is an ideal displacement (m).
///
/// # Errors
/// Signals whose squares leave the range of `f64`.
fn with_force(of: &Summed<'_>, sample_rate: f64, ideal: Option<&[f64]>) -> Result<Metrics> {
    let Summed { command, sums, whole: [force, displacement] } = of;
    let mut metrics = without_force(sums, ideal.is_some());
    metrics.add_norms(&sums.norms, command)?;
    if let Some(ideal) = ideal {
        metrics.set("displacement_error", displacement_error(displacement, ideal));
        metrics.add_transforms(command, force, sample_rate)?;
    }
    Ok(metrics)
}

/// Rms error of a displacement (m) over the rms of the ideal one; NaN if that is zero.
fn displacement_error(displacement: &[f64], ideal: &[f64]) -> f64 {
    let pairs = displacement.iter().zip(ideal);
    let (error, whole) = pairs.fold((0.0, 0.0), |(error, whole), (x, ideal)| {
        (error + (x - ideal) * (x - ideal), whole + ideal * ideal)
    });
    let ratio = (error / whole).sqrt();
    if ratio.is_finite() { ratio } else { f64::NAN }
}

/// Displacements (m) of a rig's structure under exactly these commands (N), one per actuator. Empty if they
/// grow without bound, as for a structure too stiff for the step.
fn ideal_displacements(rig: &RigConfig, sample_rate: f64, commands: &[&[f64]]) -> Vec<Vec<f64>> {
    let options = SimulateOptions::default();
    let commands: Vec<_> =
        commands.iter().map(|values| Command { values: values.to_vec(), sample_rate }).collect();
    match ideal_responses(rig, &commands, &options) {
        Ok(responses) => responses.into_iter().map(|response| response.displacement).collect(),
        Err(_) => vec![Vec::new(); commands.len()],
    }
}

/// Computes the metrics of a test on a rig, one row per actuator, the ground floor's first. If the command of
/// an actuator is zero throughout, its metrics of the force are NaN. Drift and displacement error are NaN
/// without the data of all actuators of a building.
///
/// # Errors
/// Commands that are all zero throughout, signals that are not finite or of different lengths, or whose
/// squares leave the range of `f64`; a sample rate outside its range.
pub fn rows(
    rig: &RigConfig,
    sample_rate: f64,
    actuators: &[Actuator<'_>],
    costly: bool,
) -> Result<Vec<Metrics>> {
    crate::checks::sample_rate("sample_rate", sample_rate)?;
    for actuator in actuators {
        for (name, signal) in
            [("force", actuator.force), ("displacement", actuator.displacement), ("spool", actuator.spool)]
        {
            crate::checks::signal(name, signal)?;
            same_length(name, signal, actuator.command)?;
        }
    }
    judge(rig, sample_rate, &summed(rig, actuators), costly, false)
}

/// The data for the metrics of actuators, the ground floor's first.
pub(crate) fn summed<'a>(rig: &RigConfig, actuators: &[Actuator<'a>]) -> Vec<Summed<'a>> {
    let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, |most: f64, x| most.max(x.abs()));
    let all = actuators.len() == rig.structure.floors();
    let mut below: Option<&[f64]> = None;
    let of = |actuator: &Actuator<'a>| {
        let &Actuator { command, force, displacement, spool, min_supply_pressure } = actuator;
        let drift = match below {
            _ if !all => f64::NAN,
            None => largest(&mut displacement.iter().copied()),
            Some(below) => largest(&mut displacement.iter().zip(below).map(|(x, below)| x - below)),
        };
        below = Some(displacement);
        let max_spool = largest(&mut spool.iter().copied());
        let sums = Sums { norms: Norms::of(command, force), max_spool, drift, min_supply_pressure };
        Summed { command, sums, whole: [force, displacement] }
    };
    actuators.iter().map(of).collect()
}

/// Computes the metrics from sums, one row per actuator. In a test that diverged, metrics with numbers too
/// large to square are undefined.
///
/// # Errors
/// Commands that are all zero throughout; signals whose squares leave the range of `f64`.
pub(crate) fn judge(
    rig: &RigConfig,
    sample_rate: f64,
    actuators: &[Summed<'_>],
    costly: bool,
    diverged: bool,
) -> Result<Vec<Metrics>> {
    if actuators.iter().all(|one| not_silent(one.command).is_err()) {
        not_silent(&[])?;
    }
    let commands: Vec<_> = actuators.iter().map(|one| one.command).collect();
    let ideal = costly.then(|| ideal_displacements(rig, sample_rate, &commands));
    let row = |(i, one): (usize, &Summed<'_>)| {
        if not_silent(one.command).is_err() {
            return Ok(without_force(&one.sums, costly));
        }
        match with_force(one, sample_rate, ideal.as_ref().map(|ideal| ideal[i].as_slice())) {
            Err(_) if diverged => Ok(without_force(&one.sums, costly)),
            judged => judged,
        }
    };
    actuators.iter().enumerate().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_loop::ideal_response;
    use crate::ground_motion::excitation::sine_sweep;
    use crate::metrics::METRICS;

    fn value(row: &Metrics, name: &str) -> f64 {
        row.get(name).unwrap()
    }

    #[test]
    fn the_motion_is_judged_against_the_ideal_one() {
        let rig = RigConfig::zhao2005();
        let command = sine_sweep(4000.0, 0.5, 4.0, 2.0, 1024.0).unwrap();
        let ideal = ideal_response(&rig, &command, &SimulateOptions::default()).unwrap().displacement;
        let displacement: Vec<f64> = ideal.iter().map(|x| 1.25 * x).collect();
        let spool = vec![-0.2; ideal.len()];
        let actuator = Actuator {
            command: &command.values,
            force: &command.values,
            displacement: &displacement,
            spool: &spool,
            min_supply_pressure: 1.8e7,
        };
        let row = rows(&rig, 1024.0, &[actuator], true).unwrap().remove(0);
        assert!((value(&row, "displacement_error") - 0.25).abs() < 1e-12);
        assert_eq!((value(&row, "nrmse"), value(&row, "max_spool")), (0.0, 0.2));
        let largest = displacement.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        assert_eq!((value(&row, "drift"), value(&row, "min_supply_pressure")), (largest, 1.8e7));
        assert_eq!(row.iter().count(), METRICS.len());
        let quick = rows(&rig, 1024.0, &[actuator], false).unwrap().remove(0);
        assert_eq!(quick.iter().count(), METRICS.iter().filter(|metric| !metric.costly).count());
        for (name, found) in quick.iter() {
            assert_eq!(found.to_bits(), value(&row, name).to_bits(), "{name}");
        }
        let short = Actuator { spool: &spool[1..], ..actuator };
        let error = rows(&rig, 1024.0, &[short], false).unwrap_err().to_string();
        assert!(error.starts_with("spool = 2047 samples: must have the command's 2048"), "{error}");
    }

    #[test]
    fn drift_is_the_displacement_relative_to_the_story_below() {
        let list = |value: f64| toml::Value::Array(vec![value.into(); 2]);
        let rig = RigConfig::zhao2005()
            .replace(&[
                ("structure.kind", "shear_building".into()),
                ("structure.stories.masses", list(7040.0)),
                ("structure.stories.dampings", list(4330.0)),
                ("structure.stories.stiffnesses", list(693.8e3)),
            ])
            .unwrap();
        let (zero, ones) = (vec![0.0; 8], vec![1.0; 8]);
        let floor = |command, displacement| Actuator {
            command,
            force: command,
            displacement,
            spool: &zero,
            min_supply_pressure: 1e7,
        };
        let motions = [vec![0.01; 8], vec![-0.005; 8]];
        let floors = [floor(&ones, &motions[0]), floor(&zero, &motions[1])];
        let rows = rows(&rig, 100.0, &floors, true).unwrap();
        assert_eq!((value(&rows[0], "drift"), value(&rows[1], "drift")), (0.01, 0.015));
        assert!(value(&rows[1], "nrmse").is_nan() && value(&rows[0], "nrmse") == 0.0);
        let worst = Metrics::worst(&rows);
        assert_eq!((value(&worst, "drift"), value(&worst, "nrmse")), (0.015, 0.0));
        let alone = super::rows(&rig, 100.0, &floors[..1], true).unwrap();
        assert!(value(&alone[0], "drift").is_nan() && value(&alone[0], "displacement_error").is_nan());
        let silent = [floor(&zero, &motions[0]), floor(&zero, &motions[1])];
        assert!(super::rows(&rig, 100.0, &silent, false).is_err());
    }
}
