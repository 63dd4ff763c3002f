//! Which files a scene's own files may name: one rule for all formats.
//!
//! A scene may come from a stranger. What it names is opened only in or below the folder
//! of the scene's file: neither absolute paths nor `..`, links, drives or network paths lead
//! out of it. The operating system resolves the path beneath the open folder (`cap-std`), so
//! that nothing can be exchanged between a check and its use.
//!
//! Exporters write paths of the machine they ran on. A name that is not there, or leads out,
//! is looked for by its last parts inside the folder, whatever the case of its letters; the
//! user is told which file was taken.

use std::cell::{Cell, OnceCell, RefCell};
use std::collections::{BTreeSet, HashMap};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use cap_std::ambient_authority;
use cap_std::fs::{Dir, OpenOptions};

use crate::scene::{Scene, file, file_name};
use screendoor_trace::error::{Error, Result, one_line};

/// How deep below the folder names are looked for.
const MAX_DEPTH: usize = 4;
/// How many entries of folders are read, and how many are looked at, for all names together.
const MAX_ENTRIES: usize = 1 << 17;
const MAX_LOOKED_AT: usize = 1 << 25;

/// The folder of a scene's file, through which all other files are opened.
pub(super) struct Folder {
    /// The scene's file, for warnings.
    source: String,
    path: PathBuf,
    allow_outside: bool,
    /// The folder, open; only scenes that name files need it.
    dir: OnceCell<Dir>,
    /// The entries of folders below, by their paths from here.
    listings: RefCell<HashMap<PathBuf, Rc<Vec<Entry>>>>,
    /// How many more entries are read, and looked at.
    left: Cell<[usize; 2]>,
    notes: RefCell<BTreeSet<String>>,
}

/// An entry of a folder.
struct Entry {
    name: String,
    /// In small letters.
    lower: String,
    is_dir: bool,
}

/// A file that a scene names, open.
pub(super) struct Found {
    /// Where it is.
    pub path: PathBuf,
    file: (File, u64),
}

impl Found {
    /// The file and its length in bytes.
    pub(super) fn into_file(self) -> (File, u64) {
        self.file
    }

    /// All of its bytes.
    ///
    /// # Errors
    /// As [`file::read`].
    pub(super) fn read(self) -> Result<Vec<u8>> {
        file::whole(self.file, &self.path)
    }
}

impl Folder {
    /// The folder of the scene's file at `scene`.
    pub(super) fn of(scene: &Path, allow_outside: bool) -> Self {
        Folder {
            source: file_name(scene),
            path: scene.parent().unwrap_or(Path::new("")).to_path_buf(),
            allow_outside,
            dir: OnceCell::new(),
            listings: RefCell::default(),
            left: Cell::new([MAX_ENTRIES, MAX_LOOKED_AT]),
            notes: RefCell::default(),
        }
    }

    /// Opens the regular file that the scene calls `name`: with slashes of either kind, in
    /// quotes or not, with a comment behind it or not.
    ///
    /// # Errors
    /// [`Error::Io`] where there is none, [`Error::Invalid`] where the name leads out of the
    /// folder and nothing inside is called so.
    pub(super) fn open(&self, name: &str) -> Result<Found> {
        let spellings = spellings(name);
        let mut first = None;
        for spelling in &spellings {
            match self.open_exactly(spelling) {
                Ok(found) => return Ok(found),
                Err(e) if is_elsewhere(&e) => first = first.or(Some(e)),
                Err(e) => return Err(self.failed(spelling, e)),
            }
        }
        let plain = &spellings[spellings.len() - 1];
        if let Some(found) = self.search(plain) {
            let (source, name) = (&self.source, shown(name));
            let inside = found.path.strip_prefix(&self.path).unwrap_or(&found.path).display();
            let note = format!(
                "{source}: '{name}' is not there or leads out of the scene's folder; \
                 '{}' in it is used",
                one_line(inside)
            );
            self.notes.borrow_mut().insert(note);
            return Ok(found);
        }
        let error = first.unwrap_or_else(|| io::ErrorKind::NotFound.into());
        if is_escape(&error) || (leads_out(plain) && !self.allow_outside) {
            return Err(Error::invalid(
                format_args!("'{}'", shown(name)),
                "it leads out of the scene's folder, and nothing in it is called so",
                "put the file beside the scene, or capture with --allow-outside",
            ));
        }
        Err(self.failed(&spellings[0], error))
    }

    /// Whether there is a regular file of just that name.
    pub(super) fn has(&self, name: &str) -> bool {
        spellings(name).iter().any(|spelling| self.open_exactly(spelling).is_ok())
    }

    /// What the user should know of the files that were opened.
    pub(super) fn tell(&self, scene: &mut Scene) {
        scene.warnings.extend(self.notes.take());
    }

    fn failed(&self, name: &str, error: io::Error) -> Error {
        Error::io("read", self.path.join(one_line(name)), error)
    }

    fn dir(&self) -> io::Result<&Dir> {
        if let Some(dir) = self.dir.get() {
            return Ok(dir);
        }
        let here = self.path.as_os_str().is_empty();
        let path = if here { Path::new(".") } else { &self.path };
        let dir = Dir::open_ambient_dir(path, ambient_authority())?;
        Ok(self.dir.get_or_init(|| dir))
    }

    fn open_exactly(&self, name: &str) -> io::Result<Found> {
        if name.is_empty() {
            return Err(io::Error::other("the name is empty: name a file"));
        }
        let path = self.path.join(name);
        if self.allow_outside {
            return match file::open(&path) {
                Ok(file) => Ok(Found { path, file }),
                Err(Error::Io { source, .. }) => Err(source),
                Err(other) => Err(io::Error::other(other)),
            };
        }
        Ok(Found { file: open_in(self.dir()?, Path::new(name))?, path })
    }

    /// The file inside that has as many as possible of the name's last parts, or else
    /// its last one in some folder below.
    fn search(&self, name: &str) -> Option<Found> {
        let name = name.replace('\\', "/");
        let parts: Vec<&str> = name.split('/').filter(|p| !p.is_empty() && *p != ".").collect();
        let from = parts.iter().rposition(|p| *p == ".." || p.ends_with(':')).map_or(0, |i| i + 1);
        let parts = &parts[from..];
        let dir = self.dir().ok()?;
        let by_parts = (0..parts.len()).find_map(|skip| self.walk(dir, &parts[skip..]));
        let path = by_parts.or_else(|| self.below(dir, parts.last()?))?;
        let file = open_in(dir, &path).ok()?;
        Some(Found { path: self.path.join(path), file })
    }

    /// The entries of the folder at `path` from here, by name.
    fn entries(&self, dir: &Dir, path: &Path) -> Rc<Vec<Entry>> {
        if let Some(known) = self.listings.borrow().get(path) {
            return known.clone();
        }
        let [mut left, looks] = self.left.get();
        let mut entries = Vec::new();
        let read = if path.as_os_str().is_empty() { dir.entries() } else { dir.read_dir(path) };
        for entry in read.into_iter().flatten().flatten().take(left) {
            left -= 1;
            let is_dir = entry.file_type().is_ok_and(|kind| kind.is_dir());
            if let Ok(name) = entry.file_name().into_string() {
                entries.push(Entry { lower: name.to_lowercase(), name, is_dir });
            }
        }
        self.left.set([left, looks]);
        entries.sort_unstable_by(|a, b| a.name.cmp(&b.name));
        let entries = Rc::new(entries);
        self.listings.borrow_mut().insert(path.to_path_buf(), entries.clone());
        entries
    }

    /// The name among `entries` that is `wanted`, in other letters where there is none in these.
    fn same_name<'e>(&self, entries: &'e [Entry], wanted: &str) -> Option<&'e str> {
        let [reads, looks] = self.left.get();
        self.left.set([reads, looks.checked_sub(entries.len())?]);
        let lower = wanted.to_lowercase();
        let exact = entries.iter().find(|entry| entry.name == wanted);
        exact.or_else(|| entries.iter().find(|entry| entry.lower == lower)).map(|e| &*e.name)
    }

    /// The path of the regular file that `parts` name, whatever the case of letters.
    fn walk(&self, dir: &Dir, parts: &[&str]) -> Option<PathBuf> {
        let mut path = PathBuf::new();
        for part in parts {
            let entries = self.entries(dir, &path);
            path.push(self.same_name(&entries, part)?);
        }
        open_in(dir, &path).is_ok().then_some(path)
    }

    /// The path of a regular file of that name in some folder below, the nearest first.
    fn below(&self, dir: &Dir, name: &str) -> Option<PathBuf> {
        let mut level = vec![PathBuf::new()];
        for _ in 0..=MAX_DEPTH {
            let mut next = Vec::new();
            for folder in level {
                let entries = self.entries(dir, &folder);
                let found = self.same_name(&entries, name).map(|found| folder.join(found));
                if found.as_ref().is_some_and(|found| open_in(dir, found).is_ok()) {
                    return found;
                }
                let folders = entries.iter().filter(|entry| entry.is_dir);
                next.extend(folders.map(|entry| folder.join(&entry.name)));
            }
            level = next;
        }
        None
    }
}

/// Opens a regular file beneath `dir`.
fn open_in(dir: &Dir, path: &Path) -> io::Result<(File, u64)> {
    let mut options = OpenOptions::new();
    options.read(true);
    #[cfg(unix)]
    cap_std::fs::OpenOptionsExt::custom_flags(&mut options, file::NO_WAITING);
    file::regular(dir.open_with(path, &options)?.into_std())
}

/// What a name may stand for, the likeliest first and the barest last.
fn spellings(name: &str) -> Vec<String> {
    let name = name.trim();
    let bare = match name.split_once(" #") {
        Some((before, _)) => before.trim_end(),
        None => name,
    };
    let unquoted = |quote: char| bare.strip_prefix(quote)?.strip_suffix(quote);
    let bare = unquoted('"').or_else(|| unquoted('\'')).unwrap_or(bare).trim();
    let mut all = vec![name.to_string(), bare.to_string(), bare.replace('\\', "/")];
    all.dedup();
    all
}

/// Whether an error says that the file may be found by another name.
fn is_elsewhere(error: &io::Error) -> bool {
    use io::ErrorKind::{InvalidFilename, InvalidInput, NotADirectory, NotFound};
    is_escape(error)
        || matches!(error.kind(), NotFound | NotADirectory | InvalidInput | InvalidFilename)
}

/// Whether the path led out of the folder: what `cap-std` says has no system's number.
fn is_escape(error: &io::Error) -> bool {
    error.kind() == io::ErrorKind::PermissionDenied && error.raw_os_error().is_none()
}

/// Whether a name means a place that is no folder's inside: an absolute path, a drive, a
/// network's or a URL, or one that climbs out.
fn leads_out(name: &str) -> bool {
    let name = name.replace('\\', "/");
    let mut depth = 0_i64;
    let climbs = name.split('/').any(|part| {
        depth += match part {
            "" | "." => 0,
            ".." => -1,
            _ => 1,
        };
        depth < 0
    });
    let drive = name.as_bytes().get(1) == Some(&b':');
    climbs || drive || name.starts_with('/') || name.contains("://")
}

/// A name as messages show it.
fn shown(name: &str) -> String {
    one_line(name.chars().take(200).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_lead_out_are_known() {
        let out = ["/a", "\\\\server\\a", "C:\\a", "c:/a", "../a", "a/../../b", "..", "http://x/a"];
        let inside = ["a", "./a", "a/b", "a/../b", "a\\b", "a..b", "..a"];
        assert!(out.iter().all(|name| leads_out(name)));
        assert!(!inside.iter().any(|name| leads_out(name)));
    }

    #[test]
    fn a_name_is_spelt_without_quotes_comments_and_backslashes() {
        assert_eq!(spellings("a.png"), ["a.png"]);
        assert_eq!(spellings("\"a b.png\""), ["\"a b.png\"", "a b.png"]);
        assert_eq!(spellings("a\\b.png # leaf"), ["a\\b.png # leaf", "a\\b.png", "a/b.png"]);
    }
}
