//! Which file a name leads to.

use std::fs;
use std::path::{Path, PathBuf};

/// The folder that a file of this name stands in.
pub(super) fn folder(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Where the file stands or would stand: links followed, even one that leads to
/// nothing yet, and the folder's canonical name where there is such a folder.
pub(super) fn destination(path: &Path) -> PathBuf {
    let mut path = path.to_path_buf();
    // Links that lead round in a circle end here.
    for _ in 0..40 {
        // A pipe behind /dev/stdout or /dev/fd has no name of its own.
        if fs::metadata(&path).is_ok_and(|m| !m.is_file() && !m.is_dir()) {
            return path;
        }
        if let Ok(place) = fs::canonicalize(&path) {
            return place;
        }
        let Ok(target) = fs::read_link(&path) else { break };
        path = folder(&path).join(target);
    }
    match (fs::canonicalize(folder(&path)), path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path,
    }
}

/// Whether both names lead to one regular file, which need not exist yet.
/// Devices and pipes can be read and written at once and are never the same.
pub fn same_file(a: impl AsRef<Path>, b: impl AsRef<Path>) -> bool {
    let (a, b) = (destination(a.as_ref()), destination(b.as_ref()));
    match (fs::metadata(&a), fs::metadata(&b)) {
        (Ok(m), Ok(n)) => m.is_file() && n.is_file() && (a == b || same_inode(&m, &n)),
        (Err(_), Err(_)) => a == b,
        _ => false,
    }
}

#[cfg(unix)]
fn same_inode(a: &fs::Metadata, b: &fs::Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    (a.dev(), a.ino()) == (b.dev(), b.ino())
}

#[cfg(not(unix))]
fn same_inode(_: &fs::Metadata, _: &fs::Metadata) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_one_file() {
        let place = tempfile::tempdir().unwrap();
        let at = |name: &str| place.path().join(name);
        fs::write(at("a"), "").unwrap();
        fs::write(at("b"), "").unwrap();
        fs::create_dir(at("sub")).unwrap();
        assert!(same_file(at("a"), at("sub/../a")));
        assert!(!same_file(at("a"), at("b")) && !same_file(at("a"), at("new")));
        assert!(same_file(at("new"), at("sub/../new")) && !same_file(at("new"), at("other")));
        #[cfg(unix)]
        {
            fs::hard_link(at("a"), at("hard")).unwrap();
            std::os::unix::fs::symlink("a", at("soft")).unwrap();
            std::os::unix::fs::symlink("new", at("dangling")).unwrap();
            assert!(same_file(at("a"), at("hard")) && same_file(at("a"), at("soft")));
            assert!(same_file(at("dangling"), at("new")));
            assert!(!same_file("/dev/null", "/dev/null"));
        }
    }
}
