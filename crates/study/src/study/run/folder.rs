//! The folder that a study is to be measured in: whose it is, and that nobody else writes there.

use std::fs::{self, File, TryLockError};
use std::path::Path;

use crate::study::file::Study;
use screendoor_trace::error::{Error, Result};
use screendoor_trace::output::{OutputFile, is_partial};

/// The folders in a study's folder.
const FOLDERS: [&str; 7] =
    ["scenes", "traces", "shadows", "runs", "pictures", "explain", "verification"];
/// The study file in it.
pub(super) const STUDY: &str = "study.toml";
const LOCK: &str = ".lock";

/// Begins the folder of `study`, or goes on with it, and locks it.
///
/// # Errors
/// As [`super::Store::begin`].
pub(super) fn begin(folder: &Path, study: &Study) -> Result<File> {
    let create = |path: &Path| fs::create_dir_all(path).map_err(|e| Error::io("create", path, e));
    let path = folder.join(STUDY);
    look(folder, study)?;
    create(folder)?;
    let lock = lock(folder)?;
    // Who had the lock before may have begun a study or measured something.
    if look(folder, study)? == Found::Idle {
        clear(folder);
    }
    remove_partial(folder);
    for name in FOLDERS {
        create(&folder.join(name))?;
        remove_partial(&folder.join(name));
    }
    if !path.exists() {
        OutputFile::put(&path, study_text(study).as_bytes())?;
    }
    Ok(lock)
}

/// The study as its folder has it.
fn study_text(study: &Study) -> String {
    format!(
        "# The study whose results lie here, every default filled in; paths are seen from the\n\
         # folder of the file that it was read from. Written by screendoor {}.\n\n{}",
        env!("CARGO_PKG_VERSION"),
        study.to_toml()
    )
}

/// Removes what a program that was killed outright had begun to write.
fn remove_partial(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if is_partial(&entry.path()) {
            // What cannot be removed is in nobody's way.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// What stands in a folder that a study is to be measured in.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Found {
    Nothing,
    /// The same study.
    Same,
    /// Another study of which nothing is measured.
    Idle,
}

/// Looks into the folder.
///
/// # Errors
/// [`Error::Config`] where it is another study's or something else's, or another program is
/// just beginning one there; [`Error::Io`].
fn look(folder: &Path, study: &Study) -> Result<Found> {
    let path = folder.join(STUDY);
    let is_there = || path.try_exists().map_err(|e| Error::io("read", &path, e));
    if !is_there()? {
        let mut entries = fs::read_dir(folder).into_iter().flatten().flatten();
        if entries.all(|entry| is_begun(&entry)) {
            return Ok(Found::Nothing);
        }
        // A program that begins a study makes its folders first, under the lock.
        let held = File::options().write(true).open(folder.join(LOCK));
        if held.is_ok_and(|file| matches!(file.try_lock(), Err(TryLockError::WouldBlock))) {
            return Err(at_work(folder));
        }
        if !is_there()? {
            return Err(Error::config(
                format_args!("{} is not empty and holds no study", folder.display()),
                "name a new folder",
            ));
        }
    }
    match Study::read(&path)? == *study {
        true => Ok(Found::Same),
        false if holds_results(folder) => Err(another(folder)),
        false => Ok(Found::Idle),
    }
}

/// Whether an entry of a folder is what a program that was ended while it began a study may
/// have left there: its lock, files under construction, which begin with a dot as well, and
/// folders in which nothing is yet.
fn is_begun(entry: &fs::DirEntry) -> bool {
    let name = entry.file_name();
    let is_empty = || fs::read_dir(entry.path()).is_ok_and(|mut list| list.next().is_none());
    name.as_encoded_bytes().starts_with(b".")
        || FOLDERS.iter().any(|own| name == **own) && is_empty()
}

fn at_work(folder: &Path) -> Error {
    Error::config(
        format_args!("another screendoor is at work in {}", folder.display()),
        "wait for it to end, or name another folder",
    )
}

fn lock(folder: &Path) -> Result<File> {
    let path = folder.join(LOCK);
    let file = File::options().create(true).truncate(false).write(true).open(&path);
    let file = file.map_err(|e| Error::io("create", &path, e))?;
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(at_work(folder)),
        // Some file systems have no locks: files are whole there too.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(file),
    }
}

fn another(folder: &Path) -> Error {
    Error::config(
        format_args!("{} holds another study, of which runs are measured", folder.display()),
        "name another folder; a changed study is another one",
    )
}

/// Whether anything has been measured in a study's folder: a run, or a publication.
fn holds_results(folder: &Path) -> bool {
    ["runs", "verification"].iter().any(|name| {
        let entries = fs::read_dir(folder.join(name)).into_iter().flatten().flatten();
        entries.into_iter().any(|e| e.path().extension().is_some_and(|ending| ending == "json"))
    })
}

/// Removes from a study's folder what belongs to a study of which nothing was measured: scenes
/// that were drawn, and why runs failed.
fn clear(folder: &Path) {
    let own = [
        ("scenes", "json"),
        ("traces", "arrow"),
        ("shadows", "arrow"),
        ("runs", "failed"),
        ("explain", "json"),
        ("pictures", "exr"),
    ];
    for (name, ending) in own {
        for entry in fs::read_dir(folder.join(name)).into_iter().flatten().flatten() {
            if entry.path().extension().is_some_and(|found| found == ending) {
                // What stays is refused where it is of another scene.
                let _ = fs::remove_file(entry.path());
            }
        }
    }
    let _ = fs::remove_file(folder.join(STUDY));
}
