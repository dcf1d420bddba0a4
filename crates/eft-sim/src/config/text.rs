//! TOML in and out.

use std::fmt::Write as _;
use std::path::Path;

use toml::{Table, Value};

use super::calibrations::CALIBRATION;
use super::schema::PLANT;
use super::{KEYS, tree};
use crate::{Error, Result, files};
use eft_core::Short;

/// A rig file with all keys is 5 kB; a far larger file is not a rig.
const LARGEST_FILE: u64 = 1 << 20;

/// Parses TOML text; the error carries line and column.
pub(super) fn parse(text: &str) -> Result<Table> {
    text.parse::<Table>().map_err(|error| {
        let message = match error.message() {
            // Whole numbers of this size have no valid type.
            message if message.starts_with("invalid type: integer") => {
                "a whole number must fit 64 bits".into()
            }
            "recursion limit" => "a key has too many parts".into(),
            message => message.lines().collect::<Vec<_>>().join("; "),
        };
        let Some(span) = error.span() else { return Error::Toml(message) };
        let before = text.get(..span.start).unwrap_or(text);
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
        Error::Toml(format!("line {line}, column {column}: {message}"))
    })
}

/// Reads a file of bounded size as UTF-8.
pub(super) fn read(path: &Path) -> Result<String> {
    String::from_utf8(files::read(path, LARGEST_FILE)?).map_err(|error| Error::File {
        path: path.into(),
        message: format!("not UTF-8 text at byte {}", error.utf8_error().valid_up_to()),
    })
}

/// Writes a complete tree in the order of the schema, optionally with the meaning of each key; the section
/// `truth` is last.
pub(super) fn write(whole: &Table, commented: bool) -> String {
    let mut text = String::new();
    let mut open = "";
    let each = whole.get(CALIBRATION).and_then(Value::as_array);
    for row in KEYS.iter() {
        let (section, name) = row.key.split_once('.').unwrap_or(("", row.key));
        let value = tree::get(whole, row.key);
        if value.is_none() && (!commented || each.is_some() && section == CALIBRATION) {
            continue;
        }
        if section != open {
            let _ = writeln!(text, "{}[{section}]", if text.is_empty() { "" } else { "\n" });
            open = section;
        }
        if commented {
            let _ = writeln!(text, "# {}: {}", row.doc, row.allowed());
        }
        match value {
            Some(value) => _ = writeln!(text, "{name} = {}", show(value)),
            None => _ = writeln!(text, "# {name} ="),
        }
    }
    for one in each.into_iter().flatten() {
        let _ = writeln!(text, "\n[[{CALIBRATION}]]");
        for row in KEYS.iter() {
            let name = row.key.strip_prefix(CALIBRATION).and_then(|rest| rest.strip_prefix('.'));
            let Some(name) = name else { continue };
            if let Some(value) = one.as_table().and_then(|one| tree::get(one, name)) {
                let _ = writeln!(text, "{name} = {}", show(value));
            }
        }
    }
    let truth = whole.get(tree::TRUTH).and_then(Value::as_table);
    if truth.is_some() || commented {
        let _ = writeln!(text, "\n[{}]", tree::TRUTH);
    }
    if commented {
        let sections = PLANT.join(", ");
        let _ = writeln!(text, "# true values of the plant, if they differ from the controller's:");
        let _ = writeln!(text, "# any key of {sections}, such as structure.mass");
    }
    for row in KEYS.iter() {
        if let Some(value) = truth.and_then(|truth| tree::get(truth, row.key)) {
            let _ = writeln!(text, "{} = {}", row.key, show(value));
        }
    }
    text
}

fn show(value: &Value) -> String {
    match value {
        Value::Float(number) => {
            let text = Short(*number).to_string();
            // In TOML a float needs a point or an exponent.
            if text.contains(['.', 'e']) { text } else { text + ".0" }
        }
        Value::Array(items) => format!("[{}]", items.iter().map(show).collect::<Vec<_>>().join(", ")),
        other => other.to_string(),
    }
}
