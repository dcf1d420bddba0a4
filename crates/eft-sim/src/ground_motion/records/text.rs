//! Numbered lines from bytes, and faults with a line number.

use crate::Error;
use std::borrow::Cow;
use std::path::Path;

/// A problem of a file, and its line.
#[derive(Debug)]
pub(super) struct Fault(String);

impl Fault {
    /// A fault of the file as a whole.
    pub(super) fn new(message: impl Into<String>) -> Self {
        Self(message.into())
    }

    /// A fault on one line, counted from 1.
    pub(super) fn at(line: &Line<'_>, message: impl AsRef<str>) -> Self {
        Self(format!("line {}: {}", line.number, message.as_ref()))
    }

    /// The error of the crate, for the file of this name.
    pub(super) fn of(self, file: &Path) -> Error {
        Error::File { path: file.to_path_buf(), message: self.0 }
    }
}

/// One line of a file without its end, counted from 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Line<'a> {
    pub(super) number: usize,
    pub(super) text: &'a str,
}

impl Line<'_> {
    /// Whether the line contains a phrase in any letter case; the phrase must be in lower case.
    pub(super) fn has(&self, phrase: &str) -> bool {
        find_phrase(self.text, phrase).is_some()
    }

    /// Whether the line is blank; an end-of-file mark of DOS counts as blank.
    pub(super) fn is_blank(&self) -> bool {
        self.text.trim_matches(|c: char| c.is_whitespace() || c == '\u{1a}').is_empty()
    }
}

/// Byte offset of a lower-case ASCII phrase in a text of any letter case.
pub(super) fn find_phrase(text: &str, phrase: &str) -> Option<usize> {
    let (text, phrase) = (text.as_bytes(), phrase.as_bytes());
    text.windows(phrase.len().max(1)).position(|window| window.eq_ignore_ascii_case(phrase))
}

/// Replaces each byte beyond ASCII by `?` if the bytes are not UTF-8 (accents in old headers). It works in
/// place, to avoid a second copy of the file.
pub(super) fn make_utf8(bytes: &mut [u8]) {
    if std::str::from_utf8(bytes).is_err() && !is_utf16(bytes) {
        // The superscript two of Latin-1 ends a unit.
        let plain = |byte| if byte == 0xb2 { b'2' } else { b'?' };
        bytes.iter_mut().filter(|byte| !byte.is_ascii()).for_each(|byte| *byte = plain(*byte));
    }
}

fn is_utf16(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff])
}

/// First bytes of binary files that may hold a ground motion.
const BINARY: [(&[u8], &str); 4] =
    [(b"PAR1", "a Parquet"), (b"\x89HDF", "an HDF5"), (b"MATLAB", "a MAT"), (b"PK", "a ZIP or Excel")];

/// The text of a file; bytes that are not UTF-8 (accents in old headers) become replacement characters.
pub(super) fn decode(bytes: &[u8]) -> Result<Cow<'_, str>, Fault> {
    if is_utf16(bytes) {
        return Err(Fault::new("is UTF-16 text: save it as UTF-8 or plain text"));
    }
    if bytes.contains(&0) {
        let kind = BINARY.iter().find(|(start, _)| bytes.starts_with(start));
        return Err(Fault::new(kind.map_or("is not a text file (it contains zero bytes)".into(), |(_, name)| {
            format!(
                "is {name} file, not text: read it by other means, and make the record of its values with \
                 `Record(acceleration, dt)`; in Python `eft.traces.read_traces` reads it"
            )
        })));
    }
    let bytes = bytes.strip_prefix(&[0xef, 0xbb, 0xbf]).unwrap_or(bytes);
    Ok(String::from_utf8_lossy(bytes))
}

/// The lines of a text with line ends of Unix, DOS or old Mac systems.
pub(super) fn lines(text: &str) -> Vec<Line<'_>> {
    let mut lines = Vec::with_capacity(line_count(text));
    let number = |(i, text)| Line { number: i + 1, text };
    if text.contains('\n') {
        lines.extend(text.lines().enumerate().map(number));
    } else {
        lines.extend(text.split('\r').enumerate().map(number));
    }
    lines
}

/// How many lines a text has, or one more.
pub(super) fn line_count(text: &str) -> usize {
    let ends = |end: u8| text.bytes().filter(|byte| *byte == end).count();
    let feeds = ends(b'\n');
    1 + if feeds > 0 { feeds } else { ends(b'\r') }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_line_ends_count_the_same() {
        for text in ["a\nb\n\nc\n", "a\r\nb\r\n\r\nc\r\n", "a\rb\r\rc\r"] {
            let lines = lines(text);
            assert_eq!((lines[3].number, lines[3].text), (4, "c"));
            assert!(lines[2].is_blank());
        }
    }

    #[test]
    fn a_unit_in_latin_1_keeps_its_square() {
        let mut bytes = b"Gr\xf6\xdfe (m/s\xb2)".to_vec();
        make_utf8(&mut bytes);
        assert_eq!(bytes, b"Gr??e (m/s2)");
        let mut bytes = "a (m/s²)".as_bytes().to_vec();
        make_utf8(&mut bytes);
        assert_eq!(bytes, "a (m/s²)".as_bytes());
    }

    #[test]
    fn binary_and_utf16_are_refused() {
        let refusal = |bytes| decode(bytes).unwrap_err().0;
        assert!(refusal(b"\x89PNG\r\n\x1a\n\0\0").starts_with("is not a text file"));
        let parquet = refusal(b"PAR1\x15\x04\0");
        assert!(
            parquet.starts_with("is a Parquet file, not text")
                && parquet.contains("`Record(acceleration, dt)`")
        );
        assert!(decode(b"\xff\xfe1\0").unwrap_err().0.contains("UTF-16"));
        assert_eq!(decode(b"\xef\xbb\xbfNPTS").unwrap(), "NPTS");
    }
}
