//! PEER's AT2: a few header lines, one with NPTS and DT, then rows of acceleration in g.

use super::numbers::{number, shown, values};
use super::text::{Fault, Line, find_phrase};
use super::{Draft, Unit};

/// The header has four lines. More are allowed, because some files contain notes.
const HEADER_LINES: usize = 20;

/// Whether one of the first lines is the header's line with NPTS; comments do not count.
pub(super) fn recognises(lines: &[Line<'_>]) -> bool {
    count_line(lines).is_some()
}

pub(super) fn parse(lines: &[Line<'_>]) -> Result<Draft, Fault> {
    let Some(at) = count_line(lines) else {
        return Err(Fault::new("no line with NPTS among the first lines"));
    };
    let (header, counts) = (&lines[..at], &lines[at]);
    let (npts, dt) = counts_of(counts)?;
    let unit = unit_of(header)?;
    let values = values(&lines[at + 1..])?;
    if values.len() as u64 != npts {
        let message = format!("NPTS is {npts}, but {} values follow", values.len());
        return Err(Fault::at(counts, message));
    }
    // The second line names event, station and component; the first is the database's own title.
    let name = header.get(1).map(|line| line.text.trim().to_owned()).filter(|name| !name.is_empty());
    Ok(Draft { name, values, dt: Some(dt), unit: Some(unit), column: None })
}

fn count_line(lines: &[Line<'_>]) -> Option<usize> {
    let header = &lines[..lines.len().min(HEADER_LINES)];
    header.iter().position(|line| line.has("npts") && !line.text.trim_start().starts_with(['#', '%']))
}

/// NPTS and DT (s) from `NPTS=  5372, DT= .0100 SEC,` or `4000  0.0100  NPTS, DT`.
fn counts_of(line: &Line<'_>) -> Result<(u64, f64), Fault> {
    let words: Vec<&str> = line
        .text
        .split(|c: char| c.is_whitespace() || matches!(c, ',' | '=' | ':' | ';'))
        .filter(|word| !word.is_empty())
        .collect();
    let find = |key: &str| words.iter().position(|word| word.eq_ignore_ascii_case(key));
    let (Some(npts_at), Some(dt_at)) = (find("NPTS"), find("DT")) else {
        return Err(Fault::at(line, "must name both NPTS and DT"));
    };
    let leads = |at: usize| words.get(at + 1).copied().filter(|word| starts_number(word));
    let (npts, dt) = match (leads(npts_at), leads(dt_at)) {
        (Some(npts), Some(dt)) => (npts, dt),
        _ => {
            // The numbers come first, in the order of the names after them.
            let mut front = words.iter().copied().filter(|word| starts_number(word));
            let (Some(first), Some(second)) = (front.next(), front.next()) else {
                return Err(Fault::at(line, "must give a number for both NPTS and DT"));
            };
            if npts_at < dt_at { (first, second) } else { (second, first) }
        }
    };
    let npts = npts.parse::<u64>().ok().filter(|n| *n > 0);
    let npts = npts.ok_or_else(|| Fault::at(line, "NPTS must be a whole number above zero"))?;
    // The unit may follow the number without a space: `.0100SEC`.
    let bare = dt.trim_end_matches(|c: char| c.is_ascii_alphabetic() || c == '.');
    let follows = words.iter().skip_while(|word| **word != dt).nth(1).copied().unwrap_or_default();
    let glued = dt[bare.len()..].trim_start_matches('.');
    let unit = if glued.is_empty() { follows } else { glued };
    if unit.starts_with(['m', 'M']) {
        return Err(Fault::at(line, format!("DT = {bare} {}: must be in s", shown(unit))));
    }
    let dt = number(bare).map_err(|message| Fault::at(line, format!("DT: {message}")))?;
    if dt > 0.0 { Ok((npts, dt)) } else { Err(Fault::at(line, format!("DT = {dt}: must be positive, in s"))) }
}

fn starts_number(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+'))
}

/// The unit of `ACCELERATION TIME SERIES IN UNITS OF G`; g if no line names it.
fn unit_of(header: &[Line<'_>]) -> Result<Unit, Fault> {
    const PHRASE: &str = "units of";
    for line in header {
        let Some(at) = find_phrase(line.text, PHRASE) else { continue };
        for other in ["velocity", "displacement"] {
            if line.has(other) {
                return Err(Fault::at(line, format!("the file holds {other}, not acceleration")));
            }
        }
        let rest = line.text[at + PHRASE.len()..].trim();
        let word = rest.split([' ', ',', ';']).next().unwrap_or_default();
        return Unit::known(word, line, "");
    }
    Ok(Unit::GRAVITY)
}
