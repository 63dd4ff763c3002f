//! Values in files of JSON, with a checksum of their own where they are what was measured.

use std::fs;
use std::io;
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::study::record::check_version;
use screendoor_trace::error::{Error, Result};
use screendoor_trace::output::OutputFile;

/// Writes a value as JSON.
///
/// # Errors
/// [`Error::Io`] where it cannot be written.
pub(super) fn put_json<T: Serialize>(path: &Path, value: &T) -> Result<()> {
    let mut bytes = serde_json::to_vec_pretty(value)
        .map_err(|e| Error::io("write", path, io::Error::other(e)))?;
    bytes.push(b'\n');
    OutputFile::put(path, &bytes)
}

/// The value in a file of JSON; `None` where there is no file.
///
/// # Errors
/// [`Error::Invalid`] for a damaged file; [`Error::Io`] where it cannot be read.
pub fn read_json<T: DeserializeOwned>(path: &Path) -> Result<Option<T>> {
    let bytes = match fs::read(path) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(Error::io("read", path, e)),
    };
    serde_json::from_slice(&bytes).map(Some).map_err(|e| damaged(path, &e.to_string()))
}

/// A value with the checksum of its text.
#[derive(Serialize)]
struct Sealed<'a, T> {
    #[serde(flatten)]
    value: &'a T,
    checksum: String,
}

const CHECKSUM: &str = "checksum";
const VERSION: &str = "version";

/// The BLAKE3 of a JSON object's text, whatever its spaces.
fn checksum(text: &str) -> serde_json::Result<String> {
    let value: serde_json::Value = serde_json::from_str(text)?;
    Ok(blake3::hash(&serde_json::to_vec(&value)?).to_hex().to_string())
}

/// Writes a value as JSON that bears a checksum of its own.
///
/// # Errors
/// As [`put_json`].
pub(super) fn put_sealed<T: Serialize>(path: &Path, value: &T) -> Result<()> {
    let fail = |e| Error::io("write", path, io::Error::other(e));
    // What is read again is what is hashed.
    let text = serde_json::to_string(value).map_err(fail)?;
    let sealed = Sealed { value, checksum: checksum(&text).map_err(fail)? };
    put_json(path, &sealed)
}

/// As [`read_json`], for a value that [`put_sealed`] wrote.
///
/// # Errors
/// As [`read_json`]; [`Error::Invalid`] where it bears no checksum or another one than its
/// text has, and where a later version wrote it.
pub(super) fn read_sealed<T: DeserializeOwned>(path: &Path) -> Result<Option<T>> {
    use serde_json::{Map, Value};
    let Some(mut fields) = read_json::<Map<String, Value>>(path)? else { return Ok(None) };
    let bad = |e: serde_json::Error| damaged(path, &e.to_string());
    let Some(Value::String(written)) = fields.remove(CHECKSUM) else {
        return Err(damaged(path, "it bears no checksum"));
    };
    let text = serde_json::to_string(&fields).map_err(bad)?;
    if checksum(&text).map_err(bad)? != written {
        return Err(damaged(path, "it was changed after it was written: its checksum differs"));
    }
    // Before its fields, of which a later version may have others.
    if let Some(Err(what)) = fields.get(VERSION).and_then(Value::as_u64).map(check_version) {
        let hint = "read it with that screendoor, or measure into another folder";
        return Err(Error::invalid(path.display(), what, hint));
    }
    serde_json::from_str(&text).map(Some).map_err(bad)
}

/// What is wrong with a file of a folder.
pub(super) fn damaged(path: &Path, what: &str) -> Error {
    Error::invalid(
        path.display(),
        what,
        "remove it to have it measured again, or begin in another folder where another version \
         of this program wrote this one",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::Estimate;
    use crate::study::analysis::made_up;
    use crate::study::record::Record;
    use serde_json::{Map, Value};

    /// A record's fields in a file of a folder, read again.
    fn reread(change: impl FnOnce(&mut Map<String, Value>)) -> Result<Option<Record>> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.json");
        let record = made_up::record("a", "lk", 8, Estimate::exactly(1.5));
        let Value::Object(mut fields) = serde_json::to_value(&record).unwrap() else { panic!() };
        change(&mut fields);
        put_sealed(&path, &fields).unwrap();
        read_sealed(&path)
    }

    #[test]
    fn records_of_older_folders_are_read_and_those_of_later_versions_refused_as_such() {
        let today = reread(|fields| assert!(!fields.contains_key(VERSION))).unwrap().unwrap();
        assert_eq!(today, made_up::record("a", "lk", 8, Estimate::exactly(1.5)));
        // What was not measured then is not there.
        let older = reread(|fields| {
            for metric in ["filtered", "flip", "flip_hdr", "spectrum"] {
                assert!(fields.remove(metric).is_some(), "{metric}");
            }
        });
        let older = older.unwrap().unwrap();
        assert_eq!((older.filtered.len(), older.flip, older.spectrum), (0, None, None));
        assert_eq!(older.covered, today.covered);
        let later = reread(|fields| {
            fields.insert(VERSION.into(), 7.into());
            fields.insert("of_tomorrow".into(), 1.into());
        });
        let said = later.unwrap_err().to_string();
        assert!(said.contains("record of version 7") && said.contains("up to version 1"), "{said}");
        // What makes a run what it is has no default.
        assert!(reread(|fields| drop(fields.remove("covered"))).is_err());
        assert!(reread(|fields| drop(fields.insert("of_tomorrow".into(), 1.into()))).is_err());
    }
}
