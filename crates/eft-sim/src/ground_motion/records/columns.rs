//! Columns of text: CSV with or without a header, `#` comments, and rows of acceleration only.

use super::Draft;
use super::column_header::{Columns, Declared};
use super::numbers::{number, push_row, shown};
use super::text::{Fault, Line};

/// Largest difference of a time from the regular grid, in steps. A larger one is no print rounding but a
/// missing sample.
const TIME_TOLERANCE: f64 = 0.1;

/// Reads columns. Step and unit are `None` if the file states none.
pub(super) fn parse(lines: &[Line<'_>]) -> Result<Draft, Fault> {
    let mut declared = Declared::default();
    let (mut header, mut first) = (None, None);
    for (at, line) in lines.iter().enumerate().filter(|(_, line)| !line.is_blank()) {
        if is_comment(line) {
            declared.note(line)?;
        } else if first.is_none() && header.is_none() && is_header(line) {
            declared.note(line)?;
            header = Some(*line);
        } else if first.is_none() {
            first = Some(at);
        }
    }
    let Some(first) = first else {
        return Err(Fault::new("no rows of numbers"));
    };
    let (rows, width) = (Rows(&lines[first..]), fields(&lines[first]).len());
    let columns = match &header {
        // A header such as `dt=0.01` names no columns.
        Some(line) if declared.line != Some(line.number) => Columns::named(line, &fields(line), width)?,
        _ => Columns::unnamed(width),
    };
    let (values, step) = match columns.acceleration {
        None => (series(rows)?, None),
        Some(acceleration) => {
            let values = column_of(rows, acceleration, width)?;
            let times = columns.time.map(|time| column_of(rows, time, width)).transpose()?;
            let step = times.map(|times| step_of(rows, &times)).transpose()?.flatten();
            (values, step.map(|step| step * columns.time_unit))
        }
    };
    declared.check_count(values.len())?;
    let dt = declared.reconcile_dt(step, values.len())?;
    let unit = declared.reconcile_unit(columns.unit)?;
    let column = match (&header, columns.acceleration) {
        (_, None) => "the values".to_owned(),
        (Some(line), Some(at)) if fields(line).len() == width => {
            format!("column `{}`", shown(fields(line)[at]))
        }
        (_, Some(at)) => format!("column {}", at + 1),
    };
    Ok(Draft { name: None, values, dt, unit, column: Some(column) })
}

/// The rows of numbers among some lines. A vector of them would take megabytes of a large file.
#[derive(Clone, Copy)]
struct Rows<'a>(&'a [Line<'a>]);

impl<'a> Rows<'a> {
    fn iter(self) -> impl Iterator<Item = &'a Line<'a>> {
        self.0.iter().filter(|line| !line.is_blank() && !is_comment(line))
    }
}

fn is_comment(line: &Line<'_>) -> bool {
    line.text.trim_start().starts_with(['#', '%'])
}

/// Whether the first field is not a number, though it may start like one.
fn is_header(line: &Line<'_>) -> bool {
    let mut unused = Vec::new();
    let starts_number = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+');
    let first = fields(line).into_iter().next().unwrap_or_default();
    let not_finite = first.trim_start_matches(['-', '+']).parse::<f64>().is_ok_and(|v| !v.is_finite());
    !first.starts_with(starts_number) && !not_finite && push_row(line, None, &mut unused).is_err()
}

/// The fields of a row: separated by semicolons, else commas, else tabs or blanks.
fn fields<'a>(line: &Line<'a>) -> Vec<&'a str> {
    let text = line.text.trim_matches(|c: char| c.is_whitespace() || c == '\u{1a}');
    let clean = |field: &'a str| field.trim().trim_matches('"').trim();
    let mut fields: Vec<&str> = match [';', ',', '\t'].into_iter().find(|c| text.contains(*c)) {
        Some(separator) => text.split(separator).map(clean).collect(),
        None => text.split_whitespace().map(clean).collect(),
    };
    if fields.len() > 1 && fields.last().is_some_and(|field| field.is_empty()) {
        fields.pop();
    }
    fields
}

/// One column of rows that must all have as many fields as the first.
fn column_of(rows: Rows<'_>, column: usize, width: usize) -> Result<Vec<f64>, Fault> {
    let value = |row: &Line<'_>| {
        let fields = fields(row);
        if fields.len() != width {
            let message = format!("{} columns, but the first row has {width}", fields.len());
            return Err(Fault::at(row, message));
        }
        let field = fields.get(column).copied().unwrap_or_default();
        // A field contains commas only if semicolons separate the fields; the commas are then decimal points.
        let value = if field.contains(',') { number(&field.replace(',', ".")) } else { number(field) };
        value.map_err(|message| Fault::at(row, format!("column {}: {message}", column + 1)))
    };
    let mut values = Vec::with_capacity(rows.0.len());
    for row in rows.iter() {
        values.push(value(row)?);
    }
    Ok(values)
}

/// Rows of one series, read from left to right and from top to bottom.
fn series(rows: Rows<'_>) -> Result<Vec<f64>, Fault> {
    let mut values = Vec::new();
    for row in rows.iter() {
        push_row(row, None, &mut values)?;
    }
    Ok(values)
}

/// The step of times, which must rise evenly; `None` for a single time.
fn step_of(rows: Rows<'_>, times: &[f64]) -> Result<Option<f64>, Fault> {
    let (Some(first), Some(last)) = (times.first(), times.last()) else { return Ok(None) };
    if times.len() < 2 {
        return Ok(None);
    }
    let step = (last - first) / (times.len() - 1) as f64;
    if step <= 0.0 || !step.is_finite() {
        return Err(Fault::new(format!("the time column runs from {first} to {last}: it must increase")));
    }
    for (i, (time, row)) in times.iter().zip(rows.iter()).enumerate() {
        let regular = first + i as f64 * step;
        if (time - regular).abs() > TIME_TOLERANCE * step {
            let message = format!("time is {time}, but an even step of {step} leads to {regular}");
            return Err(Fault::at(row, message));
        }
    }
    // Subtraction causes rounding errors in the last digits (0.019999999999999997).
    Ok(Some(format!("{step:.11e}").parse().unwrap_or(step)))
}
