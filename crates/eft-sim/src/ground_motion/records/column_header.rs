//! Information in a column file: header names, and `key = value` notes in comments.

use super::Unit;
use super::numbers::{number, shown};
use super::text::{Fault, Line};
use crate::units;

/// Largest relative difference between a stated step and the step of the times.
const STEP_TOLERANCE: f64 = 1e-3;
/// The same for the whole length of the record, in steps: print rounding affects a short record.
const LENGTH_TOLERANCE: f64 = 0.1;

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

/// Information in comments: the step, the number of points and the unit.
#[derive(Debug, Default)]
pub(super) struct Declared {
    /// The last line with such information.
    pub(super) line: Option<usize>,
    dt: Option<f64>,
    npts: Option<(usize, u64)>,
    unit: Option<Unit>,
    unknown_unit: Option<(usize, String)>,
}

impl Declared {
    /// Reads `dt = 0.02 s`, `npts=3000` and `units: m/s^2` from a line.
    pub(super) fn note(&mut self, line: &Line<'_>) -> Result<(), Fault> {
        for (key, value, after) in assignments(line.text) {
            match key.to_ascii_lowercase().as_str() {
                "dt" => {
                    let bare = value.trim_end_matches(char::is_alphabetic);
                    let dt = number(bare).map_err(|message| Fault::at(line, format!("dt: {message}")))?;
                    let unit = &value[bare.len()..];
                    let length = if unit.is_empty() {
                        // The next word may be a remark.
                        units::factor(after, "s").unwrap_or(1.0)
                    } else {
                        units::factor(unit, "s").ok_or_else(|| {
                            let allowed = units::units_of("s");
                            let (value, unit) = (shown(value), shown(unit));
                            Fault::at(line, format!("dt = {value}: `{unit}` must be one of {allowed}"))
                        })?
                    };
                    let dt = dt * length;
                    if dt <= 0.0 {
                        return Err(Fault::at(line, format!("dt = {dt}: must be positive, in s")));
                    }
                    self.dt = Some(dt);
                }
                "npts" => {
                    let wrong = || format!("npts = `{}`: must be a whole number above zero", shown(value));
                    let npts = value.parse().map_err(|_| Fault::at(line, wrong()))?;
                    self.npts = Some((line.number, npts));
                }
                "unit" | "units" => match Unit::from_name(value) {
                    Some(unit) => self.unit = Some(unit),
                    // `units: s, g` may be less specific than the header's names, but it must not be ignored.
                    None => self.unknown_unit = Some((line.number, shown(value))),
                },
                _ => continue,
            }
            self.line = Some(line.number);
        }
        Ok(())
    }

    pub(super) fn check_count(&self, found: usize) -> Result<(), Fault> {
        match self.npts {
            Some((number, npts)) if npts != found as u64 => {
                let line = Line { number, text: "" };
                Err(Fault::at(&line, format!("npts is {npts}, but {found} values follow")))
            }
            _ => Ok(()),
        }
    }

    /// The step in s. A stated step is exact; a step from printed times is rounded.
    pub(super) fn reconcile_dt(&self, from_times: Option<f64>, points: usize) -> Result<Option<f64>, Fault> {
        let tolerance = STEP_TOLERANCE.max(LENGTH_TOLERANCE / points as f64);
        match (self.dt, from_times) {
            (Some(stated), Some(found)) if (stated - found).abs() > tolerance * found => {
                Err(Fault::new(format!("states dt = {stated} s, but its times are {found} s apart")))
            }
            (stated, found) => Ok(stated.or(found)),
        }
    }

    pub(super) fn reconcile_unit(&self, from_header: Option<Unit>) -> Result<Option<Unit>, Fault> {
        match (self.unit, from_header) {
            (Some(stated), Some(named)) if stated != named => {
                Err(Fault::new("the comment and the header name different units"))
            }
            (None, None) => match &self.unknown_unit {
                Some((number, name)) => {
                    let message = format!("units `{name}`: not a known unit of acceleration");
                    Err(Fault::at(&Line { number: *number, text: "" }, message))
                }
                None => Ok(None),
            },
            (stated, named) => Ok(stated.or(named)),
        }
    }
}

/// The pairs `key=value` or `key: value` of a line, each with the word after it that is not the next key.
fn assignments(text: &str) -> impl Iterator<Item = (&str, &str, &str)> {
    let separator = |c: char| c.is_whitespace() || matches!(c, ',' | ';' | '#' | '(' | ')');
    // Elsewhere `%` may be part of a unit: 1 % of g is not g.
    let text = text.trim_start().trim_start_matches('%');
    let mut parts = text.split(['=', ':']).peekable();
    let mut left = parts.next().unwrap_or_default();
    std::iter::from_fn(move || {
        let right = parts.next()?;
        let key = left.split(separator).rfind(|word| !word.is_empty());
        let words: Vec<_> = right.split(separator).filter(|word| !word.is_empty()).collect();
        let own = words.len() - usize::from(parts.peek().is_some() && words.len() > 1);
        left = right;
        Some(
            key.zip(words.first().copied())
                .map(|(key, value)| (key, value, words[..own].get(1).copied().unwrap_or_default())),
        )
    })
    .flatten()
}

fn words(name: &str) -> Vec<String> {
    let separator = |c: char| c.is_whitespace() || matches!(c, '_' | '(' | ')' | '[' | ']' | ',' | ':');
    name.split(separator).filter(|word| !word.is_empty()).map(str::to_lowercase).collect()
}

fn is_time(name: &str) -> bool {
    let words = words(name);
    let pair = |first: &str, second: &str| words.len() > 1 && words[0] == first && words[1] == second;
    words.first().is_some_and(|word| matches!(word.as_str(), "t" | "time" | "times" | "s" | "sec"))
        || pair("elapsed", "time")
        // Of LabVIEW.
        || pair("x", "value")
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
    let unit = words(name).iter().skip(1).find_map(|word| units::factor(word, "s"));
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
    unit_of(name).is_some()
        || words(name).first().is_some_and(|word| {
            matches!(word.as_str(), "a" | "ag" | "acc" | "accel" | "acceleration" | "ground")
        })
}

fn is_other_quantity(name: &str) -> bool {
    let starts_other = |word: &String| ["vel", "disp", "force"].iter().any(|other| word.starts_with(other));
    words(name).first().is_some_and(starts_other)
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
