//! Properties of every reader of ground motions for any bytes.

use eft_sim::records::{ReadOptions, Unit, parse, parse_with};

/// Reads a file without options, and again with all options.
pub fn a_record_is_sound_or_an_error(bytes: &[u8], file_name: &str) {
    let everything = ReadOptions { dt: Some(0.01), unit: Some(Unit::GRAVITY), channel: Some(1) };
    for answer in [parse(bytes, file_name), parse_with(bytes, file_name, &everything)] {
        match answer {
            Ok(record) => {
                assert!(record.validate().is_ok() && record.pga().is_finite());
                // A point needs at least one digit, so a file cannot have more points than bytes.
                assert!(record.acceleration.len() <= bytes.len());
            }
            // A message contains only a short part of the file; each byte that is not text becomes three.
            Err(error) => assert!(error.to_string().chars().count() < 2000),
        }
    }
}
