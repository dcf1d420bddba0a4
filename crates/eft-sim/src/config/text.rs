//! TOML in and out.

use std::fmt::Write as _;
use std::io::Read as _;
use std::path::Path;

use toml::{Table, Value};

use super::{KEYS, tree};
use crate::{Error, Result};
use eft_core::Short;

/// A rig file of the whole schema is 5 kB; what is larger by far is another file.
const LARGEST_FILE: u64 = 1 << 20;

/// Parses TOML text; the error carries line and column.
pub(super) fn parse(text: &str) -> Result<Table> {
    text.parse::<Table>().map_err(|error| {
        let message = match error.message() {
            // The only whole numbers that are of no valid type.
            message if message.starts_with("invalid type: integer") => {
                "a whole number must fit 64 bits".into()
            }
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
    let io = |source| Error::Io { path: path.into(), source };
    let file = std::fs::File::open(path).map_err(io)?;
    let mut bytes = Vec::new();
    file.take(LARGEST_FILE + 1).read_to_end(&mut bytes).map_err(io)?;
    if bytes.len() as u64 > LARGEST_FILE {
        return Err(Error::File {
            path: path.into(),
            message: "larger than 1 MiB, which no rig file is".into(),
        });
    }
    String::from_utf8(bytes).map_err(|error| Error::File {
        path: path.into(),
        message: format!("not UTF-8 text at byte {}", error.utf8_error().valid_up_to()),
    })
}

/// Writes a complete tree in the order of the schema, with the meaning of each key if wanted.
pub(super) fn write(whole: &Table, commented: bool) -> String {
    let mut text = String::new();
    let mut open = "";
    for row in KEYS {
        let (section, name) = row.key.split_once('.').unwrap_or(("", row.key));
        let value = tree::get(whole, row.key);
        if value.is_none() && !commented {
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
    text
}

fn show(value: &Value) -> String {
    match value {
        Value::Float(number) => {
            let text = Short(*number).to_string();
            // TOML tells floats from whole numbers by their look.
            if text.contains(['.', 'e']) { text } else { text + ".0" }
        }
        Value::Array(items) => format!("[{}]", items.iter().map(show).collect::<Vec<_>>().join(", ")),
        other => other.to_string(),
    }
}
