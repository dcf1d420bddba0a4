//! COSMOS V2: counted header blocks, then `… acceleration pts, …, units=cm/sec2(04), Format=(8F10.5)`.

use super::numbers::{field_width, push_row};
use super::text::{Fault, Line, find_phrase};
use super::{Draft, Unit, block};

const DATA: &str = "acceleration pts";
const REAL_HEADER: &str = "real-header values follow on";
/// Position of the sampling interval (s) among the real header values, counted from 1.
const STEP: usize = 34;

/// Whether a line has the words of COSMOS for data or a header.
pub(super) fn recognises(lines: &[Line<'_>]) -> bool {
    lines.iter().any(|line| line.has(DATA) || line.has(REAL_HEADER))
}

/// All channels of acceleration in the file, in its order.
pub(super) fn parse(lines: &[Line<'_>]) -> Result<Vec<Draft>, Fault> {
    let mut channels = Vec::new();
    let (mut header_start, mut step) = (0, None);
    for (at, line) in lines.iter().enumerate() {
        if line.has(REAL_HEADER) {
            step = Some(step_of(line, &lines[at + 1..])?);
        }
        let Some(position) = find_phrase(line.text, DATA) else { continue };
        // `End-of-data for Chan 1 acceleration` and titles do not begin with a count.
        if !line.text.trim_start().starts_with(|c: char| c.is_ascii_digit()) {
            continue;
        }
        let points = block::declared(line, &line.text[..position])?;
        let unit = unit_of(line)?;
        let width = field_width(line.text);
        let (values, consumed) = block::read(line, points, &lines[at + 1..], width)?;
        let name = name_of(&lines[header_start..at]);
        // A step belongs to one channel: a channel without a real header must not use the step of another.
        channels.push(Draft { name, values, dt: step.take(), unit: Some(unit), column: None });
        header_start = at + 1 + consumed;
    }
    Ok(channels)
}

/// The sampling interval in s, from the rows below the line that announces the real header.
fn step_of(line: &Line<'_>, rows: &[Line<'_>]) -> Result<f64, Fault> {
    let width = field_width(line.text);
    let mut values = Vec::new();
    for row in rows {
        if values.len() >= STEP || block::is_text(row) {
            break;
        }
        push_row(row, width, &mut values)?;
    }
    let wrong = match values.get(STEP - 1) {
        Some(dt) if *dt > 0.0 => return Ok(*dt),
        Some(dt) => {
            format!("real header value {STEP}, the sampling interval, is {dt}: must be positive, in s")
        }
        None => {
            format!("only {} values follow; value {STEP}, the sampling interval, is missing", values.len())
        }
    };
    Err(Fault::at(line, wrong))
}

fn unit_of(line: &Line<'_>) -> Result<Unit, Fault> {
    let after = find_phrase(line.text, "units=").map_or("", |at| &line.text[at + 6..]);
    let name = after.split(['(', ',']).next().unwrap_or_default().trim();
    Unit::known(name, line, "units=")
}

/// Station and channel from the lines `Statn No: … Code:CE-24514 …` and `Sta Chan 1: 360 deg (Rcrdr …`.
fn name_of(header: &[Line<'_>]) -> Option<String> {
    let after = |key: &str| header.iter().find_map(|line| Some(&line.text[find_phrase(line.text, key)?..]));
    let station = after("code:").map(|text| &text[5..]);
    let channel = after("chan ").and_then(|text| text.split('(').next());
    block::joined([station, channel])
}
