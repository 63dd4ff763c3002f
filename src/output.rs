//! Output files that appear whole or not at all.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::error::{Error, Result};

/// A file under construction: written beside its final place under a temporary
/// name, and renamed over it by [`OutputFile::commit`]. Dropped without a
/// commit it vanishes, and what stood in its place before stays as it was.
///
/// A destination that exists and is no regular file (`/dev/null`, a pipe) is
/// written directly, since renaming over it would replace it.
#[derive(Debug)]
pub struct OutputFile {
    path: PathBuf,
    target: Target,
}

#[derive(Debug)]
enum Target {
    Beside { file: BufWriter<NamedTempFile>, destination: PathBuf },
    Direct(BufWriter<File>),
}

const BUFFER_BYTES: usize = 1 << 18;

impl OutputFile {
    /// Begins the file that will stand at `path`.
    ///
    /// # Errors
    /// [`Error::Io`] where its folder does not exist or cannot be written.
    pub fn create(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let fail = |source| Error::io("create", path, source);
        // Renaming onto a symbolic link would replace the link: write where it leads.
        let destination = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        let target = match fs::metadata(&destination) {
            Ok(m) if m.is_dir() => {
                return Err(Error::config(
                    format_args!("cannot write {}: it is a folder", path.display()),
                    "name a file",
                ));
            }
            Ok(m) if !m.is_file() => {
                let file = File::options().write(true).open(&destination).map_err(fail)?;
                Target::Direct(BufWriter::with_capacity(BUFFER_BYTES, file))
            }
            _ => {
                let folder = match destination.parent() {
                    Some(p) if !p.as_os_str().is_empty() => p,
                    _ => Path::new("."),
                };
                let mut builder = tempfile::Builder::new();
                builder.prefix(".screendoor-").suffix(".partial");
                #[cfg(unix)]
                {
                    use std::os::unix::fs::PermissionsExt;
                    // The process's umask applies, as to any new file.
                    builder.permissions(fs::Permissions::from_mode(0o666));
                }
                let file = builder.tempfile_in(folder).map_err(fail)?;
                Target::Beside { file: BufWriter::with_capacity(BUFFER_BYTES, file), destination }
            }
        };
        Ok(OutputFile { path: path.to_path_buf(), target })
    }

    /// Where the file will stand, as the caller named it.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Puts the finished file in its place.
    ///
    /// # Errors
    /// [`Error::Io`] where the last bytes cannot be written (a full disk) or the
    /// rename fails; the place then holds what it held before.
    pub fn commit(self) -> Result<()> {
        let path = self.path;
        let fail = |source| Error::io("write", &path, source);
        match self.target {
            Target::Direct(file) => {
                file.into_inner().map_err(|e| fail(e.into_error()))?;
            }
            Target::Beside { file, destination } => {
                let file = file.into_inner().map_err(|e| fail(e.into_error()))?;
                file.as_file().sync_data().map_err(fail)?;
                file.persist(&destination).map_err(|e| fail(e.error))?;
            }
        }
        Ok(())
    }

    /// Writes `bytes` as the whole of the file at `path`.
    ///
    /// # Errors
    /// As [`OutputFile::create`] and [`OutputFile::commit`].
    pub fn put(path: impl AsRef<Path>, bytes: &[u8]) -> Result<()> {
        let mut file = OutputFile::create(path)?;
        if let Err(source) = file.write_all(bytes) {
            return Err(Error::io("write", file.path(), source));
        }
        file.commit()
    }
}

impl Write for OutputFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.target {
            Target::Beside { file, .. } => file.write(bytes),
            Target::Direct(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.target {
            Target::Beside { file, .. } => file.flush(),
            Target::Direct(file) => file.flush(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_abandoned_file_leaves_the_old_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        OutputFile::put(&path, b"old").unwrap();
        let mut file = OutputFile::create(&path).unwrap();
        file.write_all(b"new").unwrap();
        drop(file);
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        OutputFile::put(&path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    #[cfg(unix)]
    fn links_and_devices_survive() {
        let folder = tempfile::tempdir().unwrap();
        let (real, link) = (folder.path().join("real"), folder.path().join("link"));
        OutputFile::put(&real, b"old").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        OutputFile::put(&link, b"new").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&real).unwrap(), b"new");
        OutputFile::put("/dev/null", b"gone").unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
    }

    #[test]
    fn a_missing_folder_is_one_clear_error() {
        let error = OutputFile::put("/no/such/folder/a.txt", b"").unwrap_err().to_string();
        assert!(error.starts_with("cannot create /no/such/folder/a.txt: "), "{error}");
    }
}
