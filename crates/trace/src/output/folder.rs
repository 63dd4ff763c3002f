//! Folders that are there while something is made.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::output::partial::Partial;
use crate::output::place;

/// A folder for what other programs write while a file is made of it. It is removed with all
/// that is in it when it is dropped, and when the process is told to end ([`super::abandon_all`]).
#[derive(Debug)]
pub struct TemporaryFolder {
    path: PathBuf,
    partial: Option<Partial>,
    _lock: File,
}

impl TemporaryFolder {
    /// Makes one beside `path`, in the folder where a file of that name would stand.
    ///
    /// # Errors
    /// [`Error::Io`] where that folder is not there or cannot be written.
    pub fn beside(path: impl AsRef<Path>) -> Result<Self> {
        let destination = place::destination(path.as_ref());
        let within = place::folder(&destination);
        let fail = |e| Error::io("make a temporary folder in", within, e);
        // Other programs may have another working folder.
        let within = fs::canonicalize(within).map_err(fail)?;
        let (path, lock, partial) = Partial::folder(&within).map_err(fail)?;
        Ok(TemporaryFolder { path, partial: Some(partial), _lock: lock })
    }

    /// Where it is, from the root on.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for TemporaryFolder {
    fn drop(&mut self) {
        drop(self.partial.take());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_of_it_goes() {
        let place = tempfile::tempdir().unwrap();
        let folder = TemporaryFolder::beside(place.path().join("t.arrow")).unwrap();
        assert!(folder.path().is_absolute() && folder.path().parent().unwrap().is_absolute());
        fs::create_dir(folder.path().join("sub")).unwrap();
        fs::write(folder.path().join("sub/a"), b"a").unwrap();
        drop(folder);
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0);
        let error = TemporaryFolder::beside(place.path().join("none/t.arrow")).unwrap_err();
        assert!(error.to_string().contains("none"), "{error}");
    }
}
