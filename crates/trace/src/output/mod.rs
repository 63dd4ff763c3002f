//! Output files that appear whole or not at all.

mod folder;
mod partial;
mod place;

use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};

pub use folder::TemporaryFolder;
pub use partial::{abandon_all, is_partial};
pub use place::same_file;

use crate::error::{Error, Result};
use crate::output::partial::Partial;

/// A file under construction: written beside its final place without a name (or
/// under a temporary one, where the system has no such files), which
/// [`OutputFile::commit`] gives it. Dropped without a commit it vanishes, and what stood in its place before stays as it was.
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
    Beside { file: BufWriter<File>, partial: Partial, destination: PathBuf },
    Direct(BufWriter<File>),
}

const BUFFER_BYTES: usize = 1 << 18;

impl OutputFile {
    /// Begins the file that will stand at `path`. It takes over the permissions of
    /// a file that stands there now.
    ///
    /// # Errors
    /// [`Error::Io`] where its folder does not exist or cannot be written, or
    /// where a folder or a write-protected file stands in its place.
    pub fn create(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let refuse =
            |action, kind, why: String| Err(Error::io(action, path, io::Error::new(kind, why)));
        if path.as_os_str().as_encoded_bytes().ends_with(b"/") && !path.is_dir() {
            let why = "that is a folder's name; name a file".to_string();
            return refuse("create", io::ErrorKind::InvalidInput, why);
        }
        // Renaming onto a symbolic link would replace the link: write where it leads.
        let destination = place::destination(path);
        let existing = fs::metadata(&destination).ok();
        if let Some(m) = existing.as_ref().filter(|m| !m.is_file()) {
            if m.is_dir() {
                let why = "it is a folder; name a file".to_string();
                return refuse("write", io::ErrorKind::IsADirectory, why);
            }
            let file = File::options().write(true).open(&destination);
            let file = file.map_err(|e| Error::io("create", path, e))?;
            let target = Target::Direct(BufWriter::with_capacity(BUFFER_BYTES, file));
            return Ok(OutputFile { path: path.to_path_buf(), target });
        }
        // A rename asks only for the folder's permission: the file's own is asked here.
        let protected = existing.as_ref().is_some_and(|m| {
            let open = || File::options().write(true).open(&destination);
            m.permissions().readonly()
                || open().is_err_and(|e| e.kind() == io::ErrorKind::PermissionDenied)
        });
        if protected {
            let why = "it is write-protected; name another file".to_string();
            return refuse("write", io::ErrorKind::PermissionDenied, why);
        }
        if destination.file_name().is_none() {
            let why = "that is no file's name; name a file".to_string();
            return refuse("create", io::ErrorKind::InvalidInput, why);
        }
        let folder = place::folder(&destination);
        if !folder.is_dir() {
            // As the caller named it, unless a link leads elsewhere.
            let named = Some(place::folder(path)).filter(|f| !f.is_dir()).unwrap_or(folder);
            let name = named.display();
            let why = if named.exists() {
                format!("{name} is no folder; name another place")
            } else {
                format!("the folder {name} does not exist; create it first")
            };
            return refuse("create", io::ErrorKind::NotFound, why);
        }
        let (file, partial) = match Partial::create(folder) {
            Ok(made) => made,
            Err(e) => return Err(Error::io("create", path, e)),
        };
        if let Some(m) = existing {
            // Not every file system has permissions to set.
            let _ = file.set_permissions(m.permissions());
        }
        let file = BufWriter::with_capacity(BUFFER_BYTES, file);
        let target = Target::Beside { file, partial, destination };
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
            Target::Beside { file, partial, destination } => {
                let file = file.into_inner().map_err(|e| fail(e.into_error()))?;
                file.sync_data().map_err(fail)?;
                partial.persist(&file, &destination).map_err(fail)?;
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
        file.write_bytes(bytes)?;
        file.commit()
    }

    /// The file where what was written can be gone back to and written over: not one that is
    /// written directly.
    pub(crate) fn seekable(&mut self) -> Option<impl Write + Seek> {
        match &mut self.target {
            Target::Beside { file, .. } => Some(file),
            Target::Direct(_) => None,
        }
    }

    /// Writes `bytes`, with an error that names the file.
    ///
    /// # Errors
    /// [`Error::Io`] where they cannot be written.
    pub fn write_bytes(&mut self, bytes: &[u8]) -> Result<()> {
        self.write_all(bytes).map_err(|e| Error::io("write", &self.path, e))
    }
}

impl Write for OutputFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.target {
            Target::Beside { file, .. } => file.write(up_to_full(file, bytes)),
            Target::Direct(file) => file.write(up_to_full(file, bytes)),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.target {
            Target::Beside { file, .. } => file.flush(),
            Target::Direct(file) => file.flush(),
        }
    }
}

/// As much of `bytes` as fills the buffer, so that it is written in whole buffers at
/// multiples of their size: the system then keeps the file in large pages, which take
/// less than half as long to map when it is read.
fn up_to_full<'a>(file: &BufWriter<File>, bytes: &'a [u8]) -> &'a [u8] {
    let room = file.capacity() - file.buffer().len();
    &bytes[..bytes.len().min(if room > 0 { room } else { file.capacity() })]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_of_any_size_come_out_in_order() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        let mut file = OutputFile::create(&path).unwrap();
        let mut expected = Vec::new();
        for (i, length) in [1, BUFFER_BYTES - 1, BUFFER_BYTES, 3, 3 * BUFFER_BYTES + 7, 0, 5]
            .into_iter()
            .enumerate()
        {
            let piece: Vec<u8> = (0..length).map(|at| (at * 31 + i) as u8).collect();
            file.write_all(&piece).unwrap();
            expected.extend(piece);
        }
        file.commit().unwrap();
        assert!(fs::read(&path).unwrap() == expected);
    }

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
        let says = "cannot create /no/such/folder/a.txt: the folder /no/such/folder does not exist";
        assert!(error.starts_with(says), "{error}");
        assert!(OutputFile::create("").is_err());
    }

    #[test]
    #[cfg(unix)]
    fn permissions_are_kept_and_honoured() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        OutputFile::put(&path, b"old").unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
        OutputFile::put(&path, b"new").unwrap();
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
        fs::set_permissions(&path, fs::Permissions::from_mode(0o444)).unwrap();
        let error = OutputFile::put(&path, b"newer").unwrap_err().to_string();
        assert!(error.contains("write-protected"), "{error}");
        assert_eq!(fs::read(&path).unwrap(), b"new");
    }
}
