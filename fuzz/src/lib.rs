//! What every reader of ground motions must hold to, whatever the bytes.

use eft_sim::records::{ReadOptions, Unit, parse, parse_with};

/// Reads a file as the caller alone has it, and once more with everything that a caller may add.
pub fn a_record_is_sound_or_an_error(bytes: &[u8], file_name: &str) {
    let everything = ReadOptions { dt: Some(0.01), unit: Some(Unit::Gravity), channel: Some(1) };
    for answer in [parse(bytes, file_name), parse_with(bytes, file_name, &everything)] {
        match answer {
            Ok(record) => {
                assert!(record.validate().is_ok() && record.pga().is_finite());
                // A point takes at least one digit, so a file cannot promise more points than bytes.
                assert!(record.acceleration.len() <= bytes.len());
            }
            // A message repeats no more than a glimpse of the file; bytes that are no text become three each.
            Err(error) => assert!(error.to_string().chars().count() < 2000),
        }
    }
}
