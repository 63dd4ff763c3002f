//! Reading the files that a scene consists of.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

use crate::error::{Error, Result};

/// The largest file that is read whole, in bytes: as long as a GLB can be.
const MAX_BYTES: u64 = 1 << 32;

/// Opens a regular file; the second value is its length in bytes. Anything else
/// (a pipe, a device) may never end, and a pipe would not even open.
///
/// # Errors
/// [`Error::Io`] where it cannot be opened or is no regular file.
pub(super) fn open(path: &Path) -> Result<(File, u64)> {
    let fail = |e| Error::io("read", path, e);
    let metadata = fs::metadata(path).map_err(fail)?;
    if !metadata.is_file() {
        return Err(fail(io::Error::other("it is no regular file: name one")));
    }
    Ok((File::open(path).map_err(fail)?, metadata.len()))
}

/// Reads a regular file whole.
///
/// # Errors
/// As [`open`], and where it is longer than 4 GiB.
pub(super) fn read(path: &Path) -> Result<Vec<u8>> {
    let fail = |e| Error::io("read", path, e);
    let (file, length) = open(path)?;
    if length > MAX_BYTES {
        return Err(fail(io::Error::other("it is longer than 4 GiB: split it")));
    }
    let mut bytes = Vec::new();
    file.take(MAX_BYTES).read_to_end(&mut bytes).map_err(fail)?;
    Ok(bytes)
}
