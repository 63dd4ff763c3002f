//! A trace's file, read in pieces into memory that nobody else can change.
//!
//! A memory map would save the copy, but shows what other programs write to the file, also
//! after it was checked. Buffers are used again, so that their pages are there already.

use std::fs::{File, Metadata};
use std::io;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

use bytes::Bytes;

use crate::error::{Error, Result};

/// An open file.
#[derive(Debug)]
pub(super) struct StoredFile {
    file: File,
    /// Its length, and when it was last written to, where the system tells.
    was: (u64, Option<SystemTime>),
    idle: Arc<Mutex<Idle>>,
}

/// Bytes of buffers that are kept for the next pieces, at most: batches of usual size for two
/// dozen readers. What a command takes beside its limit of memory contains them.
const MOST_IDLE: usize = 64 << 20;

/// Buffers that nobody reads.
#[derive(Debug, Default)]
struct Idle {
    list: Vec<Vec<u8>>,
    bytes: usize,
}

impl Idle {
    fn take(&mut self) -> Option<Vec<u8>> {
        let buffer = self.list.pop()?;
        self.bytes -= buffer.capacity();
        Some(buffer)
    }

    fn put(&mut self, buffer: Vec<u8>) {
        if self.bytes + buffer.capacity() <= MOST_IDLE {
            self.bytes += buffer.capacity();
            self.list.push(buffer);
        }
    }
}

fn state(metadata: &Metadata) -> (u64, Option<SystemTime>) {
    (metadata.len(), metadata.modified().ok())
}

/// The error about a file that was written to while it was read.
pub(super) fn changed(place: &str) -> Error {
    Error::invalid(
        place,
        "another program has changed or cut it while it was read",
        "leave it as it is meanwhile",
    )
}

impl StoredFile {
    /// `file`, as its `metadata` were when it was opened.
    pub(super) fn new(file: File, metadata: &Metadata) -> Self {
        StoredFile { file, was: state(metadata), idle: Arc::default() }
    }

    /// The file.
    pub(super) fn file(&self) -> &File {
        &self.file
    }

    /// Whether it was written to since it was opened.
    pub(super) fn has_changed(&self) -> bool {
        self.file.metadata().is_ok_and(|now| state(&now) != self.was)
    }

    /// The `length` bytes at `offset`.
    ///
    /// # Errors
    /// [`Error::Io`] where they cannot be read; [`Error::Invalid`] where they are not there
    /// any more.
    pub(super) fn bytes(&self, place: &str, offset: u64, length: usize) -> Result<Bytes> {
        let idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner).take();
        let mut buffer = idle.unwrap_or_default();
        // What is in it is written over; only what it grows by is cleared.
        buffer.resize(length, 0);
        match read_exact_at(&self.file, &mut buffer, offset) {
            Ok(()) => Ok(Bytes::from_owner(Lent { buffer, idle: Arc::clone(&self.idle) })),
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => Err(changed(place)),
            Err(e) => Err(Error::io("read", place, e)),
        }
    }
}

#[cfg(unix)]
fn read_exact_at(file: &File, buffer: &mut [u8], offset: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, buffer, offset)
}

#[cfg(windows)]
fn read_exact_at(file: &File, mut buffer: &mut [u8], mut offset: u64) -> io::Result<()> {
    use std::os::windows::fs::FileExt;
    while !buffer.is_empty() {
        match file.seek_read(buffer, offset) {
            Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(n) => (buffer, offset) = (&mut buffer[n..], offset + n as u64),
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(())
}

/// A buffer that goes back when nobody reads it any more.
struct Lent {
    buffer: Vec<u8>,
    idle: Arc<Mutex<Idle>>,
}

impl AsRef<[u8]> for Lent {
    fn as_ref(&self) -> &[u8] {
        &self.buffer
    }
}

impl Drop for Lent {
    fn drop(&mut self) {
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        idle.put(std::mem::take(&mut self.buffer));
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn pieces_stay_as_they_were_read() {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(&[1; 100]).unwrap();
        let open = File::open(file.path()).unwrap();
        let stored = StoredFile::new(open, &file.as_file().metadata().unwrap());
        let piece = stored.bytes("a", 10, 50).unwrap();
        assert!(!stored.has_changed());
        std::fs::write(file.path(), [2; 60]).unwrap();
        assert_eq!(piece[..], [1; 50]);
        assert!(stored.has_changed());
        assert_eq!(stored.bytes("a", 10, 50).unwrap()[..], [2; 50]);
        let error = stored.bytes("a", 11, 50).unwrap_err().to_string();
        assert!(error.starts_with("a: another program has changed or cut it"), "{error}");
        drop(piece);
        // A buffer that held more before gives no more than is asked for.
        assert_eq!(stored.bytes("a", 0, 3).unwrap()[..], [2; 3]);
    }

    #[test]
    fn few_bytes_are_kept_for_later() {
        let mut idle = Idle::default();
        assert_eq!(idle.take(), None);
        for _ in 0..100 {
            idle.put(Vec::with_capacity(1 << 20));
        }
        idle.put(Vec::with_capacity(1 << 30));
        let held = |idle: &Idle| idle.list.iter().map(Vec::capacity).sum::<usize>();
        assert_eq!((idle.list.len(), held(&idle)), (64, idle.bytes));
        idle.take();
        assert_eq!(held(&idle), idle.bytes);
    }
}
