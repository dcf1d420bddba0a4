//! The metrics of a test, force and motion: one table for a run, a batch and a study.

use super::norms::Norms;
use super::pair::not_silent;
use super::summary::Metrics;
use crate::closed_loop::{SimulateOptions, ideal_responses};
use crate::config::RigConfig;
use crate::error::Result;
use crate::ground_motion::excitation::Command;

/// One line of the [table](METRICS).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Metric {
    /// Its name in Rust, in Python and in files.
    pub name: &'static str,
    /// Its SI unit; empty for a dimensionless metric.
    pub unit: &'static str,
    /// Description.
    pub doc: &'static str,
    /// Whether it needs Fourier transforms or the ideal response, and so longer than the test.
    pub costly: bool,
}

const fn quick(name: &'static str, unit: &'static str, doc: &'static str) -> Metric {
    Metric { name, unit, doc, costly: false }
}

const fn costly(name: &'static str, unit: &'static str, doc: &'static str) -> Metric {
    Metric { name, unit, doc, costly: true }
}

/// Every metric of a test, in the order of tables and files.
pub const METRICS: [Metric; 14] = [
    quick("nrmse", "", "rms force error over rms command"),
    costly("nrmse_delay_removed", "", "the same without the delay"),
    quick("nrmse_bias_free", "", "the same without the offset"),
    quick("peak_error", "", "largest force error over the largest command"),
    costly("delay", "s", "delay of the force by cross-correlation, positive when it lags"),
    costly("fei_amplitude", "", "amplitude of the frequency-domain evaluation index"),
    costly("fei_delay", "s", "delay of the frequency-domain evaluation index"),
    costly("fei_frequency", "Hz", "equivalent frequency of the frequency-domain evaluation index"),
    costly("oscillation", "", "rms force error from 30 to 150 Hz, of the oil column, over rms command"),
    quick("tracking_indicator", "N²", "tracking indicator, negative when the force lags"),
    costly("displacement_error", "", "rms displacement error against the ideal response, over its rms"),
    quick("max_spool", "", "largest spool opening"),
    quick("drift", "m", "largest drift of the story"),
    quick("min_supply_pressure", "Pa", "smallest supply pressure"),
];

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

/// The metrics of one actuator's test. Rows are equal if all their bits are equal; undefined metrics are
/// equal.
#[derive(Debug, Clone)]
pub struct Row {
    /// In the order of the table; NaN for an undefined metric.
    values: [f64; METRICS.len()],
    /// Whether the costly metrics were computed.
    costly: bool,
}

impl PartialEq for Row {
    fn eq(&self, other: &Self) -> bool {
        self.costly == other.costly && self.values.map(f64::to_bits) == other.values.map(f64::to_bits)
    }
}

impl Row {
    /// Name and value of every computed metric; NaN for an undefined one.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, f64)> {
        let values = METRICS.iter().zip(self.values);
        let asked = self.costly;
        values.filter(move |(metric, _)| asked || !metric.costly).map(|(metric, value)| (metric.name, value))
    }

    /// The value of one metric; `None` if it was not computed.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.iter().find(|(known, _)| *known == name).map(|(_, value)| value)
    }

    fn set(&mut self, name: &str, value: f64) {
        if let Some(at) = METRICS.iter().position(|metric| metric.name == name) {
            self.values[at] = value;
        }
    }

    /// The row of a test without metrics of the force: there was no command, or the numbers left their range.
    fn without_force(sums: &Sums, costly: bool) -> Self {
        let mut row = Self { values: [f64::NAN; METRICS.len()], costly };
        row.set("max_spool", sums.max_spool);
        row.set("drift", sums.drift);
        row.set("min_supply_pressure", sums.min_supply_pressure);
        row
    }

    /// Computes the metrics from the sums, and optionally the costly ones with the ideal displacement (m).
    ///
    /// # Errors
    /// A command that is zero throughout; signals whose squares leave the range of `f64`.
    fn new(of: &Summed<'_>, sample_rate: f64, ideal: Option<&[f64]>) -> Result<Self> {
        let Summed { command, sums, whole: [force, displacement] } = of;
        not_silent(command)?;
        let quick = Metrics::of(&sums.norms, command)?;
        let mut row = Self::without_force(sums, ideal.is_some());
        let found = match ideal {
            None => quick,
            Some(ideal) => {
                row.set("displacement_error", displacement_error(displacement, ideal));
                quick.with_transforms(command, force, sample_rate)?
            }
        };
        for (name, value) in found.iter() {
            row.set(name, value);
        }
        Ok(row)
    }

    /// Of several floors, each metric of the floor with the largest absolute value.
    pub(crate) fn worst(rows: &[Self]) -> Self {
        let mut worst = Self { values: [f64::NAN; METRICS.len()], costly: rows.iter().any(|row| row.costly) };
        for row in rows {
            for (most, value) in worst.values.iter_mut().zip(row.values) {
                *most = worse(*most, value);
            }
        }
        worst
    }
}

/// The value with the largest absolute value, in its unit, such as of the floors of a building. NaN counts as
/// unknown; without a known value the answer is NaN.
pub fn worst(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(f64::NAN, worse)
}

fn worse(most: f64, value: f64) -> f64 {
    if most.is_nan() || value.abs() > most.abs() { value } else { most }
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
pub fn rows(rig: &RigConfig, sample_rate: f64, actuators: &[Actuator<'_>], costly: bool) -> Result<Vec<Row>> {
    crate::checks::sample_rate("sample_rate", sample_rate)?;
    for actuator in actuators {
        let length = actuator.command.len();
        for (name, signal) in
            [("force", actuator.force), ("displacement", actuator.displacement), ("spool", actuator.spool)]
        {
            crate::checks::signal(name, signal)?;
            if signal.len() != length {
                let allowed = format!("must have the command's {length} samples");
                return Err(crate::Error::value(name, format!("{} samples", signal.len()), allowed));
            }
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
) -> Result<Vec<Row>> {
    if actuators.iter().all(|one| not_silent(one.command).is_err()) {
        not_silent(&[])?;
    }
    let commands: Vec<_> = actuators.iter().map(|one| one.command).collect();
    let ideal = costly.then(|| ideal_displacements(rig, sample_rate, &commands));
    let row = |(i, one): (usize, &Summed<'_>)| {
        if not_silent(one.command).is_err() {
            return Ok(Row::without_force(&one.sums, costly));
        }
        match Row::new(one, sample_rate, ideal.as_ref().map(|ideal| ideal[i].as_slice())) {
            Err(_) if diverged => Ok(Row::without_force(&one.sums, costly)),
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

    fn value(row: &Row, name: &str) -> f64 {
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
    fn the_worst_value_is_the_largest_that_is_known() {
        assert_eq!(worst([1.0, f64::NAN, -3.0, 2.0]), -3.0);
        assert!(worst([f64::NAN]).is_nan() && worst([]).is_nan());
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
        let worst = Row::worst(&rows);
        assert_eq!((value(&worst, "drift"), value(&worst, "nrmse")), (0.015, 0.0));
        let alone = super::rows(&rig, 100.0, &floors[..1], true).unwrap();
        assert!(value(&alone[0], "drift").is_nan() && value(&alone[0], "displacement_error").is_nan());
        let silent = [floor(&zero, &motions[0]), floor(&zero, &motions[1])];
        assert!(super::rows(&rig, 100.0, &silent, false).is_err());
    }
}
