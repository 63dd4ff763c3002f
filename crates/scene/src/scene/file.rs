//! Reading the files that a scene consists of.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use screendoor_trace::error::{Error, Result};

/// The largest file that is read whole, in bytes: as long as a GLB can be.
const MAX_BYTES: u64 = 1 << 32;

/// Opens a regular file; the second value is its length in bytes. Anything else
/// (a pipe, a device) may never end, and a pipe would not even open.
///
/// # Errors
/// [`Error::Io`] where it cannot be opened or is no regular file.
pub(super) fn open(path: &Path) -> Result<(File, u64)> {
    let fail = |e| Error::io("read", path, e);
    let mut options = File::options();
    options.read(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, NO_WAITING);
    regular(options.open(path).map_err(fail)?).map_err(fail)
}

/// With these flags a pipe opens at once, and a terminal does not become the program's.
#[cfg(unix)]
pub(super) const NO_WAITING: i32 = libc::O_NONBLOCK | libc::O_NOCTTY;

/// The file with its length, where it is a regular one. What is asked is the open file, which
/// nobody can exchange.
pub(super) fn regular(file: File) -> io::Result<(File, u64)> {
    let metadata = file.metadata()?;
    if metadata.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder: name a file"));
    }
    if !metadata.is_file() {
        return Err(io::Error::other("it is no regular file: name one"));
    }
    Ok((file, metadata.len()))
}

/// Reads a regular file whole.
///
/// # Errors
/// As [`open`], and where it is longer than 4 GiB.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>> {
    whole(open(path)?, path)
}

/// All bytes of an open file of that length.
///
/// # Errors
/// [`Error::Io`] where it cannot be read, or is longer than 4 GiB.
pub(super) fn whole((file, length): (File, u64), path: &Path) -> Result<Vec<u8>> {
    let fail = |e| Error::io("read", path, e);
    if length > MAX_BYTES {
        return Err(fail(io::Error::other("it is longer than 4 GiB: split it")));
    }
    let mut bytes = Vec::new();
    file.take(MAX_BYTES).read_to_end(&mut bytes).map_err(fail)?;
    Ok(bytes)
}
