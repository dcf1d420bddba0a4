//! K-NET's and KiK-net's ASCII: a header of keys in 18 columns, then counts to be multiplied by a factor in gal.

use super::numbers::{number, shown, values};
use super::text::{Fault, Line};
use super::{Draft, Unit, block};

/// The header has 17 lines.
const HEADER_LINES: usize = 20;
/// A key fills this many columns at most.
const KEY_WIDTH: usize = 18;
const RATE: &str = "sampling freq";
const FACTOR: &str = "scale factor";

/// Whether the first lines give a sampling frequency and a scale factor.
pub(super) fn recognises(lines: &[Line<'_>]) -> bool {
    find(lines, RATE).is_some() && find(lines, FACTOR).is_some()
}

/// The record without its mean, because the counts have an offset. K-NET's own peak is also without it.
pub(super) fn parse(lines: &[Line<'_>]) -> Result<Draft, Fault> {
    let rate = positive(lines, RATE, |text| text.trim_end_matches(|c: char| c.is_ascii_alphabetic()))?;
    let factor = factor(lines)?;
    let Some((last, _)) = find(lines, "memo") else {
        return Err(Fault::new("no line `Memo.` ends the header"));
    };
    let mut values = values(&lines[last + 1..])?;
    let expected = positive(lines, "duration time", |text| text)? * rate;
    // The header rounds the duration to whole seconds.
    if (values.len() as f64 - expected).abs() > rate {
        let message =
            format!("duration and sampling frequency make {expected} values, {} follow", values.len());
        return Err(Fault::new(message));
    }
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter_mut().for_each(|value| *value = (*value - mean) * factor);
    let text = |key| find(lines, key).map(|(_, text)| text);
    let name = block::joined([text("station code"), text("dir.")]);
    let unit = Unit::from_name("cm/s2");
    Ok(Draft { name, values, dt: Some(1.0 / rate), unit, column: None })
}

/// The line with a key among the first lines, and the text after the key.
fn find<'a>(lines: &[Line<'a>], key: &str) -> Option<(usize, &'a str)> {
    lines.iter().take(HEADER_LINES).enumerate().find_map(|(at, line)| {
        let begin = line.text.get(..key.len())?;
        let behind = line.text.get(KEY_WIDTH..).unwrap_or_default();
        begin.eq_ignore_ascii_case(key).then_some((at, behind.trim()))
    })
}

fn positive(lines: &[Line<'_>], key: &str, bare: impl Fn(&str) -> &str) -> Result<f64, Fault> {
    let Some((at, text)) = find(lines, key) else {
        return Err(Fault::new(format!("no line `{key}` in the header")));
    };
    match number(bare(text)) {
        Ok(value) if value > 0.0 => Ok(value),
        Ok(value) => Err(Fault::at(&lines[at], format!("{key} = {value}: must be positive"))),
        Err(message) => Err(Fault::at(&lines[at], format!("{key}: {message}"))),
    }
}

/// The size of a count in gal, from `7845(gal)/8223790`.
fn factor(lines: &[Line<'_>]) -> Result<f64, Fault> {
    let Some((at, text)) = find(lines, FACTOR) else {
        return Err(Fault::new("no line `scale factor` in the header"));
    };
    let parsed = text.split_once("(gal)/").and_then(|(size, counts)| {
        let factor = number(size).ok()? / number(counts).ok()?;
        (factor.is_finite() && factor > 0.0).then_some(factor)
    });
    parsed.ok_or_else(|| {
        let message = format!("scale factor `{}`: must be as in `7845(gal)/8223790`", shown(text));
        Fault::at(&lines[at], message)
    })
}
