//! Files under construction, known to the whole process: one that is told to end
//! removes them.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::TempPath;

const PREFIX: &str = ".screendoor-";
const SUFFIX: &str = ".partial";

/// Whether a path is named as a file under construction is.
pub fn is_partial(path: &Path) -> bool {
    let name = path.file_name().and_then(|n| n.to_str()).unwrap_or("");
    name.starts_with(PREFIX) && name.ends_with(SUFFIX)
}

static PARTIAL: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn known() -> MutexGuard<'static, Vec<PathBuf>> {
    // A list of paths is whole after every step: a panic elsewhere cannot spoil it.
    PARTIAL.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes all files under construction in this process, which must end without
/// delay: whoever begins, finishes or abandons a file after that waits for ever.
/// For signal handlers that run in a thread of their own.
pub fn abandon_all() {
    let known = known();
    for path in known.iter() {
        // What cannot be removed stays: there is nobody left to tell.
        let _ = fs::remove_file(path);
    }
    // Never unlocked, so that no other file appears.
    std::mem::forget(known);
}

/// The temporary name of a file under construction; removed when dropped.
#[derive(Debug)]
pub(super) struct Partial(Option<TempPath>);

impl Partial {
    /// Begins a file in `folder`.
    pub fn create(folder: &Path) -> io::Result<(File, Partial)> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(PREFIX).suffix(SUFFIX);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // The process's umask applies, as to any new file.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        // Locked from before it exists until it is known.
        let mut known = known();
        let (file, path) = builder.tempfile_in(folder)?.into_parts();
        known.push(path.to_path_buf());
        Ok((file, Partial(Some(path))))
    }

    /// Renames it to `destination`.
    pub fn persist(mut self, destination: &Path) -> io::Result<()> {
        let Some(path) = self.0.take() else { return Ok(()) };
        let mut known = known();
        known.retain(|p| *p != *path);
        path.persist(destination).map_err(|e| e.error)
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        if let Some(path) = self.0.take() {
            let mut known = known();
            known.retain(|p| *p != *path);
            drop(path);
        }
    }
}
