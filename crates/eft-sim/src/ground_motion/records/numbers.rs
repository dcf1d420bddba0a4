//! Rows of numbers in Fortran's formats.

use super::text::{Fault, Line};

/// Longest part of a faulty line in a message.
const SHOWN: usize = 24;

/// One finite number; Fortran's `D` exponent and a leading dot are allowed.
pub(super) fn number(text: &str) -> Result<f64, String> {
    let parsed = match text.parse::<f64>() {
        Ok(value) => Some(value),
        Err(_) => fortran(text),
    };
    match parsed {
        Some(value) if value.is_finite() => Ok(value),
        Some(_) => Err(format!("`{}` is not a finite number", shown(text))),
        None => Err(format!("`{}` is not a number", shown(text))),
    }
}

/// The numbers of all rows.
pub(super) fn values(rows: &[Line<'_>]) -> Result<Vec<f64>, Fault> {
    let mut values = Vec::new();
    rows.iter().try_for_each(|row| push_row(row, None, &mut values))?;
    Ok(values)
}

/// Appends the numbers of a row that are separated by blanks or commas, or by nothing but their signs.
///
/// If that fails and the field width is known, the row is split into fields of that width. Fortran writes no
/// blank before a number that fills its field.
pub(super) fn push_row(line: &Line<'_>, width: Option<usize>, values: &mut Vec<f64>) -> Result<(), Fault> {
    let start = values.len();
    let by_blanks = line
        .text
        .split(|c: char| c.is_whitespace() || c == ',' || c == '\u{1a}')
        .filter(|token| !token.is_empty())
        .try_for_each(|token| push_stuck(token, values));
    let Err(message) = by_blanks else { return Ok(()) };
    values.truncate(start);
    match width.filter(|_| line.text.is_ascii()) {
        Some(width) if push_fields(line.text, width, values).is_ok() => Ok(()),
        _ => {
            values.truncate(start);
            Err(Fault::at(line, message))
        }
    }
}

/// Width of one field by the Fortran format that ends a line: `(8F10.5)`, `(1E15.6)`, `(1F15.6E)`.
pub(super) fn field_width(line: &str) -> Option<usize> {
    let format = &line[line.rfind('(')?..];
    let letter = format.find(['F', 'f', 'E', 'e', 'G', 'g', 'I', 'i'])?;
    let digits = format[letter + 1..].split(|c: char| !c.is_ascii_digit()).next()?;
    digits.parse().ok().filter(|width| (1..=80).contains(width))
}

/// Splits `1.234-5.678` before each sign, except a sign after an exponent's letter.
fn push_stuck(token: &str, values: &mut Vec<f64>) -> Result<(), String> {
    if let Ok(value) = number(token) {
        values.push(value);
        return Ok(());
    }
    let bytes = token.as_bytes();
    let mut start = 0;
    for i in 1..=bytes.len() {
        let ends = i == bytes.len()
            || matches!(bytes[i], b'-' | b'+')
                && !matches!(bytes[i - 1], b'e' | b'E' | b'd' | b'D')
                && !is_bare_exponent(&bytes[i..]);
        if ends {
            // `get` instead of indexing, because there may be other than ASCII text between the ends.
            values.push(number(token.get(start..i).unwrap_or(token))?);
            start = i;
        }
    }
    Ok(())
}

/// A sign and exactly three digits, then a sign or the end: an exponent too long for its letter.
fn is_bare_exponent(rest: &[u8]) -> bool {
    rest.len() >= 4
        && rest[1..4].iter().all(u8::is_ascii_digit)
        && rest.get(4).is_none_or(|next| matches!(next, b'-' | b'+'))
}

fn push_fields(row: &str, width: usize, values: &mut Vec<f64>) -> Result<(), String> {
    for field in row.trim_end().as_bytes().chunks(width) {
        let field = std::str::from_utf8(field).map_err(|e| e.to_string())?;
        values.push(number(field.trim())?);
    }
    Ok(())
}

/// Number formats of Fortran only: `1.5D-03`, and `.1234567-100` without a letter.
fn fortran(text: &str) -> Option<f64> {
    let is_plain = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+' | 'd' | 'D');
    if !text.chars().all(is_plain) {
        return None;
    }
    if text.contains(['d', 'D']) {
        return text.replace(['d', 'D'], "e").parse().ok();
    }
    let split = text.len().checked_sub(4).filter(|split| *split > 0 && text.contains('.'))?;
    let (mantissa, exponent) = text.split_at(split);
    if !is_bare_exponent(exponent.as_bytes()) || !exponent.starts_with(['-', '+']) {
        return None;
    }
    format!("{mantissa}e{exponent}").parse().ok()
}

/// The beginning of a text for a message, because a faulty line may be a megabyte long.
pub(super) fn shown(text: &str) -> String {
    let mut short: String = text.chars().take(SHOWN).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    short
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(text: &str, width: Option<usize>) -> Result<Vec<f64>, String> {
        let mut values = Vec::new();
        let done = push_row(&Line { number: 7, text }, width, &mut values);
        done.map(|()| values).map_err(|e| format!("{e:?}"))
    }

    #[test]
    fn fortran_rows_are_read() {
        for (text, expected) in [
            ("   .9984852E-03  -.1E+01", vec![0.998_485_2e-3, -1.0]),
            ("1.234-5.678", vec![1.234, -5.678]),
            ("-1.5E-03-2.5E-03+3.", vec![-1.5e-3, -2.5e-3, 3.0]),
            ("1.5D-03 2d2", vec![1.5e-3, 200.0]),
            (".1234567-100-.7654321-100", vec![0.123_456_7e-100, -0.765_432_1e-100]),
            (".5-100.25", vec![0.5, -100.25]),
            ("1, 2,3", vec![1.0, 2.0, 3.0]),
            ("", vec![]),
        ] {
            assert_eq!(row(text, None).unwrap(), expected, "{text}");
        }
    }

    #[test]
    fn full_fields_need_their_width() {
        let text = "   1.000001000.00002-999.00000 123.45678";
        assert!(row(text, None).unwrap_err().contains("line 7"));
        assert_eq!(row(text, Some(10)).unwrap(), [1.0, 1000.00002, -999.0, 123.45678]);
        assert_eq!(field_width("(8F10.5)"), Some(10));
        assert_eq!(field_width("units=g (02), Format= (1E15.6)"), Some(15));
        assert_eq!(field_width("(10I8)"), Some(8));
        assert_eq!(field_width("(10)"), None);
        assert_eq!(field_width("(F99999999999999999999)"), None);
    }

    #[test]
    fn the_message_names_a_field_that_is_not_a_number() {
        for text in ["1.0 NaN", "inf", "1e999", "****", "1.2.3", "--1", "0.1x", "é-1", "1.0 é2.5-3é"] {
            let message = row(text, Some(10)).unwrap_err();
            assert!(message.contains("line 7") && message.contains("number"), "{text}: {message}");
        }
    }
}
