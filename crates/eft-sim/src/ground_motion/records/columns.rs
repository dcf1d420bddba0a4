//! Columns of text: CSV with or without a header, `#` comments, preambles of testing machines, and rows of
//! acceleration only.

use super::Draft;
use super::column_header::{Columns, is_acceleration, is_unit_line};
use super::notes::Declared;
use super::numbers::{number, push_row, shown};
use super::text::{Fault, Line};

/// Largest difference of a time from the regular grid, in steps. A larger one is no print rounding but a
/// missing sample.
const TIME_TOLERANCE: f64 = 0.1;
/// Number of lines in which the names of the columns must be if a preamble stands above them.
const PREAMBLE: usize = 200;
/// Smallest number of rows whose first column counts as a time if it rises in each of them.
const RISING_ROWS: usize = 8;
/// Smallest number of rows above the names that count as another measurement and not as a preamble.
const EARLIER_ROWS: usize = 8;

/// Reads columns. Step and unit are `None` if the file states none.
pub(super) fn parse(lines: &[Line<'_>]) -> Result<Draft, Fault> {
    let mut declared = Declared::default();
    let named = named(lines);
    let (mut header, mut first) = (named.map(|(header, _)| lines[header]), named.map(|(_, first)| first));
    for (at, line) in lines.iter().enumerate().filter(|(_, line)| !line.is_blank()) {
        if is_comment(line) || named.is_some_and(|(header, _)| at <= header) {
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
    check_nothing_earlier(&lines[..first], width)?;
    let names = header.map(|line| names(&line, width)).unwrap_or_default();
    let above = lines[..first].iter().rfind(|line| is_content(line));
    let units = above.filter(|line| header.is_some_and(|header| header.number < line.number));
    let with_unit =
        |(name, unit): (&&str, &str)| format!("{name} [{}]", unit.trim_matches(['(', ')', '[', ']']));
    let joined: Vec<String> =
        units.map(|line| names.iter().zip(fields(line)).map(with_unit).collect()).unwrap_or_default();
    let names = if joined.is_empty() { names } else { joined.iter().map(String::as_str).collect() };
    let columns = match &header {
        // A header such as `dt=0.01` names no columns.
        Some(line) if declared.line != Some(line.number) => Columns::named(line, &names, width)?,
        _ => Columns::unnamed(width),
    };
    let (values, step) = match columns.acceleration {
        None => {
            check_no_time(rows, width)?;
            (series(rows)?, None)
        }
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
    let column = match columns.acceleration {
        None => "the values".to_owned(),
        Some(at) if names.len() == width => format!("column `{}`", shown(names[at])),
        Some(at) => format!("column {}", at + 1),
    };
    Ok(Draft { name: None, values, dt, unit, column: Some(column) })
}

/// Places of the line that names an acceleration above a row of numbers, and of that row. A line of units may stand
/// between the two, and a preamble above.
fn named(lines: &[Line<'_>]) -> Option<(usize, usize)> {
    let places: Vec<usize> = (0..lines.len()).filter(|at| is_content(&lines[*at])).take(PREAMBLE).collect();
    (0..places.len()).find_map(|at| {
        let header = &lines[places[at]];
        let begins = |below: usize| {
            let first = *places.get(at + below)?;
            let row = fields(&lines[first]);
            let names = names(header, row.len());
            let holds = |(name, field): (&&str, &&str)| {
                is_acceleration(name) && number(&field.replace(',', ".")).is_ok()
            };
            let fits = names.len() == row.len() && names.iter().zip(&row).any(holds);
            (fits && (below == 1 || is_unit_line(&names, &fields(&lines[places[at + 1]])))).then_some(first)
        };
        let first = is_header(header).then(|| begins(1).or_else(|| begins(2))).flatten();
        first.map(|first| (places[at], first))
    })
}

/// Refuses rows of numbers above the names: of two measurements in one file only the second would be read.
fn check_nothing_earlier(lines: &[Line<'_>], width: usize) -> Result<(), Fault> {
    let is_row = |line: &&Line<'_>| {
        let row = fields(line);
        row.len() == width && row.iter().all(|field| number(&field.replace(',', ".")).is_ok())
    };
    match Rows(lines).iter().filter(is_row).nth(EARLIER_ROWS - 1) {
        Some(row) => Err(Fault::at(
            row,
            "rows of numbers stand above the names of the columns; a file must hold one measurement",
        )),
        None => Ok(()),
    }
}

/// The rows of numbers among some lines. A vector of them would take megabytes of a large file.
#[derive(Clone, Copy)]
struct Rows<'a>(&'a [Line<'a>]);

impl<'a> Rows<'a> {
    fn iter(self) -> impl Iterator<Item = &'a Line<'a>> {
        self.0.iter().filter(|line| is_content(line))
    }
}

fn is_content(line: &Line<'_>) -> bool {
    !line.is_blank() && !is_comment(line)
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

/// The names of a header over rows of `width` fields. Names may contain single blanks.
fn names<'a>(line: &Line<'a>, width: usize) -> Vec<&'a str> {
    let mut names = fields(line);
    // LabVIEW names a column of comments that its rows leave out.
    if names.len() == width + 1 && names.last() == Some(&"Comment") {
        names.pop();
    }
    if names.len() == width || line.text.trim().contains([';', ',', '\t']) {
        return names;
    }
    let apart = line.text.split("  ").map(str::trim).filter(|name| !name.is_empty());
    match width {
        1 => vec![line.text.trim()],
        _ if apart.clone().count() == width => apart.collect(),
        _ => names,
    }
}

/// Whether the commas of a row are decimal marks: each stands between digits, blanks or tabs separate the fields,
/// and there is no point.
fn has_decimal_commas(text: &str) -> bool {
    let bytes = text.as_bytes();
    let between_digits = |at: usize| {
        let digit = |place: Option<&u8>| place.is_some_and(u8::is_ascii_digit);
        digit(bytes.get(at.wrapping_sub(1))) && digit(bytes.get(at + 1))
    };
    text.contains(',')
        && text.contains(char::is_whitespace)
        && !text.contains(['.', ';'])
        && text.match_indices(',').all(|(at, _)| between_digits(at))
}

/// The fields of a row: separated by semicolons, else commas, else tabs or blanks. With decimal commas only
/// semicolons, tabs or blanks separate.
fn fields<'a>(line: &Line<'a>) -> Vec<&'a str> {
    let text = line.text.trim_matches(|c: char| c.is_whitespace() || c == '\u{1a}');
    let clean = |field: &'a str| field.trim().trim_matches('"').trim();
    let comma = if has_decimal_commas(text) { '\t' } else { ',' };
    let mut fields: Vec<&str> = match [';', comma, '\t'].into_iter().find(|c| text.contains(*c)) {
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
        // A date also contains points, and is no number.
        let has_point = |other: &&str| other.contains('.') && (*other == field || number(other).is_ok());
        if field.contains(',') && fields.iter().any(has_point) {
            return Err(Fault::at(row, "both `.` and `,` in it; one must be the decimal mark"));
        }
        // A field contains commas only if they are decimal points.
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
        if has_decimal_commas(row.text.trim()) {
            let text = row.text.replace(',', ".");
            push_row(&Line { number: row.number, text: &text }, None, &mut values)?;
        } else {
            push_row(row, None, &mut values)?;
        }
    }
    Ok(values)
}

/// Refuses several columns without names whose first one rises in every row: a time would become acceleration.
fn check_no_time(rows: Rows<'_>, width: usize) -> Result<(), Fault> {
    let value = |row: &Line<'_>| {
        let first = fields(row).first().copied().unwrap_or_default().replace(',', ".");
        number(&first).unwrap_or(f64::NAN)
    };
    let rising =
        width > 1 && rows.iter().zip(rows.iter().skip(1)).all(|(above, row)| value(row) > value(above));
    if rising && rows.iter().count() >= RISING_ROWS {
        return Err(Fault::new(format!(
            "the first of {width} columns rises in every row, as a time does: name the columns in a header, as in \
             `time (s),acceleration (g)`"
        )));
    }
    Ok(())
}

/// The fault of times that do not rise evenly, at the step that differs most from the median.
fn uneven(rows: Rows<'_>, times: &[f64], mean: f64) -> Fault {
    let mut sorted: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    sorted.sort_by(f64::total_cmp);
    let median = sorted[sorted.len() / 2];
    let off = |pair: &[f64]| (pair[1] - pair[0] - median).abs();
    let mut worst: Option<(&[f64], &Line<'_>)> = None;
    for (pair, row) in times.windows(2).zip(rows.iter().skip(1)) {
        if worst.is_none_or(|(least, _)| off(pair) > off(least)) {
            worst = Some((pair, row));
        }
    }
    let allowed = "must increase by even steps";
    match worst {
        Some((pair, row)) => {
            let step = pair[1] - pair[0];
            let message = format!(
                "time is {}, {step:.4e} after the one before, the mean step is {mean:.4e}: {allowed}",
                pair[1]
            );
            Fault::at(row, message)
        }
        None => Fault::new(format!("time {allowed}")),
    }
}

/// The step of times, which must rise evenly; `None` for a single time.
fn step_of(rows: Rows<'_>, times: &[f64]) -> Result<Option<f64>, Fault> {
    let [first, .., last] = times else { return Ok(None) };
    let step = (last - first) / (times.len() - 1) as f64;
    if step <= 0.0 || !step.is_finite() {
        return Err(Fault::new(format!("the time column runs from {first} to {last}: it must increase")));
    }
    let regular = |(i, time): (usize, &f64)| (time - first - i as f64 * step).abs() <= TIME_TOLERANCE * step;
    if !times.iter().enumerate().all(regular) {
        return Err(uneven(rows, times, step));
    }
    // Subtraction causes rounding errors in the last digits (0.019999999999999997).
    Ok(Some(format!("{step:.11e}").parse().unwrap_or(step)))
}
