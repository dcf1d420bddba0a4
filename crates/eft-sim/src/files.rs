//! The content of a file that somebody else made.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::error::{Error, Result};

/// Reads an ordinary file of at most `largest` bytes; memory follows what the file holds.
pub(crate) fn read(path: &Path, largest: u64) -> Result<Vec<u8>> {
    let io = |source| Error::Io { path: path.to_path_buf(), source };
    let refused = |message: String| Error::File { path: path.to_path_buf(), message };
    // Before it is opened: the system waits for the other end of a pipe.
    let kind = std::fs::metadata(path).map_err(io)?.file_type();
    if !kind.is_file() && !kind.is_dir() {
        return Err(refused("is a pipe or a device, must be an ordinary file".into()));
    }
    let mut bytes = Vec::new();
    // One byte more than allowed shows a file that is too large, whatever size the system reports.
    File::open(path).map_err(io)?.take(largest + 1).read_to_end(&mut bytes).map_err(io)?;
    if bytes.len() as u64 > largest {
        return Err(refused(format!("is larger than {} MiB", largest >> 20)));
    }
    Ok(bytes)
}
