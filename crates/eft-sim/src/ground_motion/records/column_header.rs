//! The names of the columns of a file: which is the time, which the acceleration, and their units.

use super::Unit;
use super::numbers::shown;
use super::text::{Fault, Line};
use crate::units;

/// Largest number of names listed when a column must be chosen.
const SHOWN_NAMES: usize = 12;

/// The columns of interest, counted from zero.
#[derive(Debug)]
pub(super) struct Columns {
    pub(super) time: Option<usize>,
    /// Length of the time column's unit, in s.
    pub(super) time_unit: f64,
    /// `None` if all fields belong to one series.
    pub(super) acceleration: Option<usize>,
    pub(super) unit: Option<Unit>,
}

impl Columns {
    /// Columns without names: two are time (s) and acceleration, any other number is one series.
    pub(super) fn unnamed(width: usize) -> Self {
        let pair = width == 2;
        Self { time: pair.then_some(0), time_unit: 1.0, acceleration: pair.then_some(1), unit: None }
    }

    /// Columns by the names of a header such as `t_s,ag_mps2` or `Time [s], Acceleration (g)`.
    pub(super) fn named(line: &Line<'_>, names: &[&str], width: usize) -> Result<Self, Fault> {
        if names.len() != width {
            let message = format!("{} names, but the first row below has {width} columns", names.len());
            return Err(Fault::at(line, message));
        }
        let time = names.iter().position(|name| is_time(name));
        let likely: Vec<usize> =
            (0..width).filter(|i| Some(*i) != time && is_acceleration(names[*i])).collect();
        let acceleration = match (likely.as_slice(), width, time) {
            ([only], ..) => *only,
            ([], 1, None) => 0,
            ([], 2, Some(time)) => 1 - time,
            ([], 2, None) => return Ok(Self::unnamed(width)),
            _ => return Err(Fault::at(line, no_choice(&likely, names))),
        };
        let other = names[acceleration];
        if likely.is_empty() && is_other_quantity(other) {
            return Err(Fault::at(line, format!("`{}` is not an acceleration", shown(other))));
        }
        let time_unit = time.map(|at| time_unit_of(names[at])).transpose();
        Ok(Self {
            time,
            time_unit: time_unit.map_err(|message| Fault::at(line, message))?.unwrap_or(1.0),
            acceleration: Some(acceleration),
            unit: unit_of(other),
        })
    }
}

/// Reason why no column could be chosen, with the candidate names.
fn no_choice(likely: &[usize], names: &[&str]) -> String {
    let listed = |candidates: &[&str]| {
        let mut short: Vec<String> = candidates.iter().take(SHOWN_NAMES).map(|name| shown(name)).collect();
        if candidates.len() > short.len() {
            short.push(format!("… {}", candidates.len()));
        }
        short.join(", ")
    };
    if likely.is_empty() {
        format!("none of the columns is named as acceleration ({}): name one `acceleration`", listed(names))
    } else {
        let candidates: Vec<&str> = likely.iter().map(|i| names[*i]).collect();
        format!("{} columns look like acceleration ({}): leave one", likely.len(), listed(&candidates))
    }
}

/// The words of a name that is in lower case.
fn words(lower: &str) -> Vec<&str> {
    let is_separator = |c: char| c.is_whitespace() || matches!(c, '_' | '(' | ')' | '[' | ']' | ',' | ':');
    lower.split(is_separator).filter(|word| !word.is_empty()).collect()
}

fn is_time(name: &str) -> bool {
    // `X_Value` is of LabVIEW.
    matches!(
        words(&name.to_lowercase())[..],
        ["t" | "time" | "times" | "s" | "sec", ..] | ["elapsed", "time", ..] | ["x", "value", ..]
    )
}

/// Whether a line states the units of the names above it: that of an acceleration, and of a time if there is one.
pub(super) fn is_unit_line(names: &[&str], units: &[&str]) -> bool {
    let pairs = || names.iter().zip(units);
    names.len() == units.len()
        && pairs().any(|(name, unit)| is_acceleration(name) && Unit::from_name(unit).is_some())
        && pairs().all(|(name, unit)| !is_time(name) || time_unit_of(&format!("{name} [{unit}]")).is_ok())
}

/// Length of the unit that a time column names after its first word, in s; 1 if it names none.
fn time_unit_of(name: &str) -> Result<f64, String> {
    let unit = words(&name.to_lowercase()).iter().skip(1).find_map(|word| units::factor(word, "s"));
    match (unit, in_brackets(name).next()) {
        (None, Some(unknown)) => {
            let unknown = shown(unknown);
            Err(format!("unit `{unknown}` of the time: must be one of {}", units::units_of("s")))
        }
        (unit, _) => Ok(unit.unwrap_or(1.0)),
    }
}

/// The texts in the brackets of a name.
fn in_brackets(name: &str) -> impl Iterator<Item = &str> {
    name.split(['(', '[']).skip(1).map(|rest| rest.split([')', ']']).next().unwrap_or_default().trim())
}

pub(super) fn is_acceleration(name: &str) -> bool {
    let names = ["a", "ag", "acc", "accel", "acceleration", "ground"];
    unit_of(name).is_some() || words(&name.to_lowercase()).first().is_some_and(|word| names.contains(word))
}

fn is_other_quantity(name: &str) -> bool {
    let quantities = ["vel", "disp", "force"];
    let is_other = |word: &&str| quantities.iter().any(|quantity| word.starts_with(quantity));
    words(&name.to_lowercase()).first().is_some_and(is_other)
}

/// The unit in the brackets of a name such as `Acceleration (m/s^2)`, else at its end as in `ag_g`, or the whole
/// name.
fn unit_of(name: &str) -> Option<Unit> {
    // The end of `acc (% g)` would be another unit.
    if let Some(end) = name.rfind([')', ']']) {
        return in_brackets(name).find_map(Unit::from_name).or_else(|| Unit::from_name(&name[end + 1..]));
    }
    let ends = name.char_indices().filter(|(_, c)| matches!(c, '_' | ' ' | ','));
    // No unit is longer, and a limit avoids quadratic time for a header of a megabyte.
    let tails = std::iter::once(0).chain(ends.map(|(at, _)| at + 1)).filter(|at| name.len() - at <= 20);
    tails.map(|at| &name[at..]).find_map(Unit::from_name)
}
