//! Fragments that programs drew, recorded by a Vulkan layer, under the designs of this registry.

use std::io;
use std::path::{Path, PathBuf};

use crate::study::publications::experiment::{Lab, parse, studies};
use crate::study::results::Results;
use screendoor_trace::error::{Error, Result};

/// Where the traces lie in a checkout.
const FOLDER: &str = "traces/programs";

/// The folder of the traces: of the checkout that the current directory lies in.
///
/// # Errors
/// [`Error::Io`] where it lies in none.
pub fn recorded_programs() -> Result<PathBuf> {
    let found = std::env::current_dir().ok().and_then(|current| {
        current.ancestors().map(|parent| parent.join(FOLDER)).find(|folder| folder.is_dir())
    });
    found.ok_or_else(|| {
        let why = "the programs' traces are not there; call it within a checkout of screendoor";
        Error::io("read", Path::new(FOLDER), io::Error::new(io::ErrorKind::NotFound, why))
    })
}

/// Measures them.
///
/// # Errors
/// As [`recorded_programs`] and as [`Lab`] measures; where one of the traces is not there.
pub fn programs(lab: &Lab<'_>) -> Result<Results> {
    let folder = recorded_programs()?;
    let found = Lab { models: Some(&folder), ..*lab }.measure(parse(studies::PROGRAMS)?)?;
    match found.missing.first() {
        None => Ok(found.results),
        Some(lost) => Err(Error::io(
            "read",
            folder.join(lost),
            io::Error::new(io::ErrorKind::NotFound, "check it out again"),
        )),
    }
}
