//! Reading of a record from a path or bytes: recognition of the format, and options for missing information.

use super::text::{self, Fault, Line};
use super::{Draft, Record, Unit, at2, block, columns, cosmos_v2, csmip_v2, knet};
use crate::{Error, files, units};
use std::path::Path;

/// The largest file that is read, in bytes: 24 MiB, about two million points.
///
/// With [`MAX_LINES`] it limits the memory for reading, beyond the record itself, to 64 MiB.
pub const MAX_FILE_SIZE: u64 = 24 << 20;

/// The largest number of lines: an hour at 200 Hz with one point per line.
pub const MAX_LINES: usize = 750_000;

/// Largest relative difference between a given step and the file's own.
const STEP_TOLERANCE: f64 = 1e-6;

/// The longest name from a file, in characters; some headers have no line ends.
const NAME_LENGTH: usize = 120;

/// Largest number of channels listed when one must be chosen.
const SHOWN_CHANNELS: usize = 12;

/// Information that the file may lack.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ReadOptions {
    /// Step in s, for a file without one (columns of acceleration only).
    pub dt: Option<f64>,
    /// Unit of the values, for a column file that states none.
    pub unit: Option<Unit>,
    /// Which channel of a V2 file, counted from 1; required if there are several.
    pub channel: Option<usize>,
}

/// Reads a ground motion; acceleration in m/s², step in s.
///
/// The format is recognised by content, and by the suffix if the content is ambiguous. Columns without a unit
/// are refused, unless the options state one or the suffix is `.at2`, whose unit is g.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read. [`Error::File`], with the line if there is one, if it is a pipe
/// or a device, empty, larger than [`MAX_FILE_SIZE`], not text, or not valid in its format. Invalid are a
/// count that differs from the data, a value that is not a finite number, an unknown unit, uneven times, a
/// missing step, and several channels without a choice.
pub fn read_record(path: impl AsRef<Path>) -> Result<Record, Error> {
    read_record_with(path, &ReadOptions::default())
}

/// [`read_record`] with options for missing information.
///
/// # Errors
/// As [`read_record`], and if an option contradicts the file.
pub fn read_record_with(path: impl AsRef<Path>, options: &ReadOptions) -> Result<Record, Error> {
    let path = path.as_ref();
    let mut bytes = files::read(path, MAX_FILE_SIZE)?;
    text::make_utf8(&mut bytes);
    record(&bytes, path, options).map_err(|fault| fault.of(path))
}

/// A ground motion from the content of a file. `file_name` is used for messages, for the record's name and
/// for its suffix.
///
/// # Errors
/// [`Error::File`], as [`read_record`].
pub fn parse(bytes: &[u8], file_name: &str) -> Result<Record, Error> {
    parse_with(bytes, file_name, &ReadOptions::default())
}

/// [`parse`] with options for missing information.
///
/// # Errors
/// As [`parse`], and if an option contradicts the file.
pub fn parse_with(bytes: &[u8], file_name: &str, options: &ReadOptions) -> Result<Record, Error> {
    let path = Path::new(file_name);
    record(bytes, path, options).map_err(|fault| fault.of(path))
}

fn record(bytes: &[u8], path: &Path, options: &ReadOptions) -> Result<Record, Fault> {
    if bytes.len() as u64 > MAX_FILE_SIZE {
        return Err(Fault::new(format!("is larger than {} MiB", MAX_FILE_SIZE >> 20)));
    }
    let text = text::decode(bytes)?;
    let count = text::line_count(&text);
    if count > MAX_LINES {
        return Err(Fault::new(format!("has {count} lines, must have at most {MAX_LINES}")));
    }
    let lines = text::lines(&text);
    if lines.iter().all(Line::is_blank) {
        return Err(Fault::new("is empty"));
    }
    let suffix = path.extension().map(|suffix| suffix.to_string_lossy().to_lowercase()).unwrap_or_default();
    let mut channels = recognise(&lines, &suffix)?;
    for name in channels.iter_mut().filter_map(|draft| draft.name.as_mut()) {
        *name = name.chars().take(NAME_LENGTH).collect();
    }
    let draft = chosen_channel(channels, options.channel)?;
    let dt = agreed_dt(draft.dt, options.dt)?;
    let factor = agreed_unit(&draft, options.unit, &suffix)?.in_metres_per_second_squared();
    let acceleration = draft.values.iter().map(|value| value * factor).collect();
    let stem = || path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let name = draft.name.unwrap_or_else(stem);
    Record::new(name, acceleration, dt).map_err(|error| Fault::new(error.to_string()))
}

/// The content decides first; the suffix decides for a file without marks of a format.
fn recognise(lines: &[Line<'_>], suffix: &str) -> Result<Vec<Draft>, Fault> {
    let begins_with_text = lines
        .iter()
        .find(|line| !line.is_blank())
        .is_some_and(|line| block::is_text(line) && !line.text.trim_start().starts_with('#'));
    if csmip_v2::recognises(lines) {
        csmip_v2::parse(lines)
    } else if cosmos_v2::recognises(lines) {
        cosmos_v2::parse(lines)
    } else if knet::recognises(lines) {
        Ok(vec![knet::parse(lines)?])
    } else if at2::recognises(lines) || (suffix == "at2" && begins_with_text) {
        Ok(vec![at2::parse(lines)?])
    } else if matches!(suffix, "v2" | "v2c") && begins_with_text {
        Err(Fault::new("no line announces acceleration data in the words of CSMIP or COSMOS"))
    } else {
        Ok(vec![columns::parse(lines)?])
    }
}

fn chosen_channel(mut channels: Vec<Draft>, choice: Option<usize>) -> Result<Draft, Fault> {
    let count = channels.len();
    match choice {
        _ if count == 0 => Err(Fault::new("holds no acceleration")),
        None if count == 1 => Ok(channels.swap_remove(0)),
        Some(channel) if (1..=count).contains(&channel) => Ok(channels.swap_remove(channel - 1)),
        _ => {
            let name = |(i, draft): (usize, &Draft)| {
                format!("{} ({})", i + 1, draft.name.as_deref().unwrap_or("without a name"))
            };
            let mut names: Vec<String> = channels.iter().enumerate().take(SHOWN_CHANNELS).map(name).collect();
            if count > names.len() {
                names.push(format!("… {count}"));
            }
            let wrong = choice.map(|c| format!("channel = {c}: ")).unwrap_or_default();
            Err(Fault::new(format!("{wrong}choose one of the channels {}", names.join(", "))))
        }
    }
}

fn agreed_dt(found: Option<f64>, given: Option<f64>) -> Result<f64, Fault> {
    match (found, given) {
        (Some(found), Some(given)) if (found - given).abs() <= STEP_TOLERANCE * found => Ok(found),
        (Some(found), Some(given)) => {
            Err(Fault::new(format!("states a step of {found} s, but dt = {given} s is given")))
        }
        (Some(dt), None) | (None, Some(dt)) => Ok(dt),
        (None, None) => Err(Fault::new(
            "states no time step: give dt, or add a comment such as `# dt = 0.01` or a column of times",
        )),
    }
}

fn agreed_unit(draft: &Draft, given: Option<Unit>, suffix: &str) -> Result<Unit, Fault> {
    match (draft.unit, given) {
        (Some(found), Some(given)) if found != given => {
            Err(Fault::new(format!("is in {}, but the unit given is {}", found.name(), given.name())))
        }
        (Some(unit), _) | (None, Some(unit)) => Ok(unit),
        (None, None) if suffix == "at2" => Ok(Unit::GRAVITY),
        (None, None) => {
            let column = draft.column.as_deref().unwrap_or("the record");
            let none = if column.contains(['(', '[']) { "no known unit" } else { "no unit" };
            Err(Fault::new(format!(
                "{column} names {none}: give unit=\"g\" (`--unit g`), or write it after the name, as in \
                 `acceleration (g)`; allowed are {}",
                units::units_of("m/s2"),
            )))
        }
    }
}
