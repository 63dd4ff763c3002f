//! Files under construction. Where the system has files without a name, they have none until
//! they are whole: a process that is killed leaves nothing. Elsewhere they have temporary
//! names, known to the whole process: one that is told to end removes them, and what one that
//! was killed has left is removed by the next that writes to the folder.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

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
        let _ = if path.is_dir() { remove_folder(path) } else { fs::remove_file(path) };
    }
    // Never unlocked, so that no other file appears.
    std::mem::forget(known);
}

/// What a file under construction is called; removed when dropped.
#[derive(Debug)]
pub(super) enum Partial {
    /// It has no name yet.
    #[cfg(target_os = "linux")]
    Unnamed,
    /// A temporary one; `None` once it is renamed.
    Named(Option<TempPath>),
    /// It is a folder.
    Folder(PathBuf),
}

/// The file in a folder under construction whose lock says that its process lives.
const LOCK: &str = "lock";

/// Removes a folder with all that is in it. Others may still write there.
fn remove_folder(path: &Path) -> io::Result<()> {
    let removed = || fs::remove_dir_all(path);
    removed().or_else(|_| removed()).or_else(|_| removed())
}

fn builder<'a>() -> tempfile::Builder<'a, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    builder
}

impl Partial {
    /// Begins a file in `folder`.
    pub(super) fn create(folder: &Path) -> io::Result<(File, Partial)> {
        sweep_once(folder);
        #[cfg(target_os = "linux")]
        if let Some(file) = unnamed::create(folder) {
            return Ok((file, Partial::Unnamed));
        }
        Partial::named(folder)
    }

    fn named(folder: &Path) -> io::Result<(File, Partial)> {
        // Locked from before it exists until it is known.
        let mut known = known();
        // Opened here: the crate's own way wraps the system's errors, and makes files that
        // their owner alone may read.
        let open = |path: &Path| File::options().read(true).write(true).create_new(true).open(path);
        let (file, path) = builder().make_in(folder, open)?.into_parts();
        // Says that this process lives. Some file systems have no locks.
        let _ = file.try_lock();
        known.push(path.to_path_buf());
        Ok((file, Partial::Named(Some(path))))
    }

    /// Makes a folder in `within`: its path, and the file whose lock says that it is in use.
    pub(super) fn folder(within: &Path) -> io::Result<(PathBuf, File, Partial)> {
        sweep_once(within);
        let mut known = known();
        let path = builder().tempdir_in(within).map(tempfile::TempDir::keep)?;
        known.push(path.clone());
        let partial = Partial::Folder(path.clone());
        drop(known);
        let lock = File::create(path.join(LOCK))?;
        let _ = lock.try_lock();
        Ok((path, lock, partial))
    }

    /// Gives the finished `file` its name `destination`, in the folder that it was begun in.
    pub(super) fn persist(mut self, file: &File, destination: &Path) -> io::Result<()> {
        match &mut self {
            // It has its name, and is not kept.
            Partial::Folder(_) => Ok(()),
            #[cfg(target_os = "linux")]
            Partial::Unnamed => {
                // A process that was told to end gives no more names.
                let _known = known();
                match unnamed::link(file, destination) {
                    Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                    linked => return linked,
                }
                // Only a rename replaces a file at once.
                let folder = destination.parent().unwrap_or(Path::new("."));
                let temporary = builder().make_in(folder, |path| unnamed::link(file, path));
                let path = temporary?.into_temp_path();
                path.persist(destination).map_err(|e| e.error)
            }
            Partial::Named(path) => {
                let _ = file;
                let Some(path) = path.take() else { return Ok(()) };
                let mut known = known();
                known.retain(|p| *p != *path);
                path.persist(destination).map_err(|e| e.error)
            }
        }
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        match self {
            #[cfg(target_os = "linux")]
            Partial::Unnamed => {}
            Partial::Named(path) => {
                if let Some(path) = path.take() {
                    let mut known = known();
                    known.retain(|p| *p != *path);
                    drop(path);
                }
            }
            Partial::Folder(path) => {
                let mut known = known();
                known.retain(|p| p != path);
                // What cannot be removed is in nobody's way.
                let _ = remove_folder(path);
            }
        }
    }
}

/// Files without a name (`O_TMPFILE`), which not all file systems have.
#[cfg(target_os = "linux")]
mod unnamed {
    use std::ffi::CString;
    use std::fs::File;
    use std::io;
    use std::os::fd::AsRawFd;
    use std::os::unix::ffi::OsStrExt;
    use std::os::unix::fs::OpenOptionsExt;
    use std::path::{Path, PathBuf};

    /// The name by which the process itself finds the file.
    fn own_name(file: &File) -> PathBuf {
        format!("/proc/self/fd/{}", file.as_raw_fd()).into()
    }

    /// One in `folder` that can be given a name; the process's umask applies.
    pub(super) fn create(folder: &Path) -> Option<File> {
        let mut options = File::options();
        options.read(true).write(true).mode(0o666).custom_flags(libc::O_TMPFILE);
        let file = options.open(folder).ok()?;
        own_name(&file).exists().then_some(file)
    }

    /// Gives it the name `path`, under which nothing may stand.
    pub(super) fn link(file: &File, path: &Path) -> io::Result<()> {
        let from = CString::new(own_name(file).as_os_str().as_bytes())?;
        let to = CString::new(path.as_os_str().as_bytes())?;
        let (here, follow) = (libc::AT_FDCWD, libc::AT_SYMLINK_FOLLOW);
        // SAFETY: both are strings that end with a zero and live until the call returns.
        match unsafe { libc::linkat(here, from.as_ptr(), here, to.as_ptr(), follow) } {
            0 => Ok(()),
            _ => Err(io::Error::last_os_error()),
        }
    }
}

/// How long a file under construction may stand unlocked: between its making and its lock.
const GRACE: Duration = Duration::from_secs(60);

/// Removes what processes that were killed have left in `folder`, once for each folder.
fn sweep_once(folder: &Path) {
    static SWEPT: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    let mut swept = SWEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if swept.insert(folder.to_path_buf()) {
        sweep(folder, GRACE);
    }
}

fn sweep(folder: &Path, grace: Duration) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if !is_partial(&path) {
            continue;
        }
        // No pipe of that name, at which opening would wait.
        let Some(metadata) = entry.metadata().ok().filter(|m| m.is_file() || m.is_dir()) else {
            continue;
        };
        let age = metadata.modified().ok().and_then(|t| t.elapsed().ok());
        let is_old = age.is_some_and(|age| age >= grace);
        let lock = if metadata.is_dir() { path.join(LOCK) } else { path.clone() };
        // Who writes it holds its lock.
        if is_old && File::open(lock).is_ok_and(|file| file.try_lock().is_ok()) {
            // What cannot be removed is in nobody's way.
            let _ = if metadata.is_dir() { remove_folder(&path) } else { fs::remove_file(&path) };
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let name = |e: io::Result<fs::DirEntry>| e.unwrap().file_name().into_string().unwrap();
        fs::read_dir(folder).unwrap().map(name).collect()
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn where_there_are_files_without_names_nothing_shows_before_the_end() {
        let folder = tempfile::tempdir().unwrap();
        let (mut file, partial) = Partial::create(folder.path()).unwrap();
        if let Partial::Named(_) = partial {
            eprintln!("skipped: {} has no files without names", folder.path().display());
            return;
        }
        file.write_all(b"one").unwrap();
        assert!(names(folder.path()).is_empty());
        let place = folder.path().join("a");
        partial.persist(&file, &place).unwrap();
        assert_eq!(names(folder.path()), ["a"]);
        let (mut file, partial) = Partial::create(folder.path()).unwrap();
        file.write_all(b"two").unwrap();
        partial.persist(&file, &place).unwrap();
        assert_eq!(names(folder.path()), ["a"]);
        assert_eq!(fs::read(&place).unwrap(), b"two");
    }

    #[test]
    fn named_ones_are_replaced_and_removed() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("a");
        for text in ["one", "two"] {
            let (mut file, partial) = Partial::named(folder.path()).unwrap();
            file.write_all(text.as_bytes()).unwrap();
            assert!(names(folder.path()).iter().any(|name| is_partial(Path::new(name))));
            partial.persist(&file, &place).unwrap();
            assert_eq!(names(folder.path()), ["a"]);
            assert_eq!(fs::read_to_string(&place).unwrap(), text);
        }
        drop(Partial::named(folder.path()).unwrap());
        assert_eq!(names(folder.path()), ["a"]);
    }

    #[test]
    fn what_the_dead_have_left_goes_and_what_the_living_write_stays() {
        let folder = tempfile::tempdir().unwrap();
        let dead = folder.path().join(".screendoor-dead.partial");
        let other = folder.path().join(".screendoor-notes.txt");
        fs::write(&dead, b"half").unwrap();
        fs::write(&other, b"mine").unwrap();
        let emptied = folder.path().join(".screendoor-emptied.partial");
        fs::create_dir(&emptied).unwrap();
        fs::write(emptied.join(LOCK), b"").unwrap();
        let (_file, partial) = Partial::named(folder.path()).unwrap();
        let (living, _lock, _partial) = Partial::folder(folder.path()).unwrap();
        sweep(folder.path(), Duration::from_secs(3600));
        assert!(dead.exists() && emptied.exists(), "they may just have been made");
        sweep(folder.path(), Duration::ZERO);
        assert!(!dead.exists() && !emptied.exists() && other.exists() && living.exists());
        let Partial::Named(Some(path)) = &partial else { panic!("it has a name") };
        assert!(path.exists());
    }

    #[test]
    #[cfg(unix)]
    fn the_system_s_own_error_is_told() {
        let error = Partial::named(Path::new("/no/such/folder")).unwrap_err();
        assert_eq!(error.raw_os_error(), Some(libc::ENOENT));
    }
}
