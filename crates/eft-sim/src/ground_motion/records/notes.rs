//! Notes in the comments of a column file, such as `dt = 0.02 s`.

use super::Unit;
use super::numbers::{number, shown};
use super::text::{Fault, Line};
use crate::units;

/// Largest relative difference between a stated step and the step of the times.
const STEP_TOLERANCE: f64 = 1e-3;
/// The same for the whole length of the record, in steps: print rounding affects a short record.
const LENGTH_TOLERANCE: f64 = 0.1;

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
        for_each_note(line.text, |key, value, after| {
            match key.to_ascii_lowercase().as_str() {
                "dt" => {
                    self.dt = Some(step(value, after).map_err(|message| Fault::at(line, message))?);
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
                _ => return Ok(()),
            }
            self.line = Some(line.number);
            Ok(())
        })
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

/// Calls `each` with key and value of each note `key = value` or `key: value` of a line, and the next word if it belongs
/// to the value, such as its unit. It ends with the first note that `each` refuses. A vector of notes could take twenty
/// times the memory of the file.
fn for_each_note(
    text: &str,
    mut each: impl FnMut(&str, &str, &str) -> Result<(), Fault>,
) -> Result<(), Fault> {
    let is_separator = |c: char| c.is_whitespace() || matches!(c, ',' | ';' | '#' | '(' | ')');
    // Elsewhere `%` may be part of a unit: 1 % of g is not g.
    let text = text.trim_start().trim_start_matches('%');
    let mut parts = text
        .split(['=', ':'])
        .map(|part| part.split(is_separator).filter(|word| !word.is_empty()).collect::<Vec<_>>())
        .peekable();
    let mut left = parts.next().unwrap_or_default();
    while let Some(right) = parts.next() {
        if let (Some(key), Some(value)) = (left.last(), right.first()) {
            // Before a further sign the last word is the next key.
            let next_keys = usize::from(parts.peek().is_some());
            let after = if right.len() > 1 + next_keys { right[1] } else { "" };
            each(key, value, after)?;
        }
        left = right;
    }
    Ok(())
}

/// The step in s, from the value of `dt` and the word after it.
fn step(value: &str, after: &str) -> Result<f64, String> {
    let bare = value.trim_end_matches(char::is_alphabetic);
    let unit = &value[bare.len()..];
    let dt = number(bare).map_err(|message| format!("dt: {message}"))?;
    let length = if unit.is_empty() {
        // The next word may be a remark.
        units::factor(after, "s").unwrap_or(1.0)
    } else {
        units::factor(unit, "s").ok_or_else(|| {
            format!("dt = {}: `{}` must be one of {}", shown(value), shown(unit), units::units_of("s"))
        })?
    };
    let dt = dt * length;
    if dt <= 0.0 { Err(format!("dt = {dt}: must be positive, in s")) } else { Ok(dt) }
}
