//! A block of numbers with a declared count, as in both V2 formats.

use super::numbers::{push_row, shown};
use super::text::{Fault, Line};

/// The count before a block's title.
pub(super) fn declared(line: &Line<'_>, before_title: &str) -> Result<u64, Fault> {
    let word = before_title.split_whitespace().next_back().unwrap_or_default();
    word.parse().ok().filter(|points| *points > 0).ok_or_else(|| {
        Fault::at(line, format!("`{}`: the number of points must be a whole number above zero", shown(word)))
    })
}

/// The values up to the next line of text, and their number of lines.
///
/// The used memory depends on the content of the file. The declared count is only compared with it
/// afterwards.
pub(super) fn read(
    title: &Line<'_>,
    declared: u64,
    rows: &[Line<'_>],
    width: Option<usize>,
) -> Result<(Vec<f64>, usize), Fault> {
    let mut values = Vec::new();
    let end = rows.iter().position(is_text).unwrap_or(rows.len());
    for row in &rows[..end] {
        push_row(row, width, &mut values)?;
    }
    if values.len() as u64 == declared {
        Ok((values, end))
    } else {
        Err(Fault::at(title, format!("{declared} points are declared, but {} values follow", values.len())))
    }
}

/// Whether a line is text, that is, contains a word. `NaN` and `Inf` are invalid numbers and not words.
pub(super) fn is_text(line: &Line<'_>) -> bool {
    let starts_text = |c: char| matches!(c, '|' | '/' | '#');
    line.text.trim_start().starts_with(starts_text)
        || line.text.split(|c: char| !c.is_ascii_alphabetic()).any(|word| {
            word.len() >= 3
                && !["nan", "inf", "infinity"].iter().any(|number| word.eq_ignore_ascii_case(number))
        })
}

/// The found parts of a name with single spaces, separated by a comma.
pub(super) fn joined(parts: [Option<&str>; 2]) -> Option<String> {
    let squeezed = |part: &str| part.split_whitespace().collect::<Vec<_>>().join(" ");
    let found: Vec<String> =
        parts.into_iter().flatten().map(squeezed).filter(|part| !part.is_empty()).collect();
    (!found.is_empty()).then(|| found.join(", "))
}
