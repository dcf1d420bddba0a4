//! Reading of files from outside.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::{Error, Result};

/// Reads an ordinary file of at most `largest` bytes; the used memory is proportional to its size.
pub(crate) fn read(path: &Path, largest: u64) -> Result<Vec<u8>> {
    let io = |source| Error::Io { path: path.to_path_buf(), source };
    let refused = |message: String| Error::File { path: path.to_path_buf(), message };
    // Checked before opening, because opening a pipe waits for its other end.
    let about = std::fs::metadata(path).map_err(io)?;
    let kind = about.file_type();
    if !kind.is_file() && !kind.is_dir() {
        return Err(refused("is a pipe or a device, must be an ordinary file".into()));
    }
    // They call themselves ordinary, but a read can wait or fail.
    let real = path.canonicalize().map_err(io)?;
    if real.starts_with("/proc") || real.starts_with("/sys") {
        return Err(refused("is a file of the kernel, must be an ordinary file".into()));
    }
    let mut bytes = Vec::with_capacity(about.len().min(largest) as usize + 1);
    // One byte more than allowed shows a file that is too large, whatever size the system reports.
    File::open(path).map_err(io)?.take(largest + 1).read_to_end(&mut bytes).map_err(io)?;
    if bytes.len() as u64 > largest {
        return Err(refused(format!("is larger than {} MiB", largest >> 20)));
    }
    Ok(bytes)
}
