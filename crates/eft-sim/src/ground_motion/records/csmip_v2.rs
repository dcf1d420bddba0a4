//! CSMIP's Volume 2: `… points of accel data equally spaced at … sec, in cm/sec2. (8f10.5)`, then rows.

use super::numbers::{field_width, number};
use super::text::{Fault, Line, find_phrase};
use super::{Draft, Unit, block};

const MARK: &str = "points of accel data equally spaced at";

/// Whether a line has CSMIP's words for acceleration data.
pub(super) fn recognises(lines: &[Line<'_>]) -> bool {
    lines.iter().any(|line| line.has(MARK))
}

/// All channels of the file, in its order.
pub(super) fn parse(lines: &[Line<'_>]) -> Result<Vec<Draft>, Fault> {
    let mut channels = Vec::new();
    let mut header_start = 0;
    for (at, line) in lines.iter().enumerate() {
        let Some(position) = find_phrase(line.text, MARK) else { continue };
        let points = block::declared(line, &line.text[..position])?;
        let tail = &line.text[position + MARK.len()..];
        let (dt, unit) = step_and_unit(line, tail)?;
        let width = field_width(tail);
        let (values, consumed) = block::read(line, points, &lines[at + 1..], width)?;
        let name = name_of(&lines[header_start..at]);
        channels.push(Draft { name, values, dt: Some(dt), unit: Some(unit), column: None });
        header_start = at + 1 + consumed;
    }
    Ok(channels)
}

/// Step (s) and unit from ` 0.010 sec, in cm/sec2. (8f10.5)`.
fn step_and_unit(line: &Line<'_>, tail: &str) -> Result<(f64, Unit), Fault> {
    let dt = tail.split_whitespace().next().unwrap_or_default();
    let dt = number(dt).map_err(|message| Fault::at(line, format!("step: {message}")))?;
    if dt <= 0.0 {
        return Err(Fault::at(line, format!("step = {dt}: must be positive, in s")));
    }
    let after = find_phrase(tail, " in ").map_or("", |at| &tail[at + 4..]);
    let unit = after.split('(').next().unwrap_or_default().trim().trim_end_matches(['.', ',']);
    Ok((dt, Unit::known(unit, line, "")?))
}

/// Place and channel: the place is the line after the station's number, the channel begins its own line.
fn name_of(header: &[Line<'_>]) -> Option<String> {
    let station = header.iter().position(|line| line.has("station no"));
    // Agency and kind of data follow the place after a gap.
    let place = station.and_then(|at| header.get(at + 1)?.text.trim_start().split("  ").next());
    let channel = header.iter().find(|line| find_phrase(line.text, "chan") == Some(0));
    block::joined([place, channel.map(|line| line.text)])
}
