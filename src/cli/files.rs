//! The files of a command: inputs that stay as they are, and outputs that are
//! begun before the work.

use std::io;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::cli::console::Console;
use crate::error::{Error, Result};
use crate::output::{OutputFile, same_file};
use crate::picture::{Layer, Picture, PictureFile};
use crate::scene::Scene;
use crate::trace::Trace;

/// Refuses a folder in place of an input, and an output that is an input or
/// another output: writing it would destroy what was read or written before.
pub(super) fn check(inputs: &[&Path], outputs: &[&Path]) -> Result<()> {
    if let Some(input) = inputs.iter().find(|i| i.is_dir()) {
        let why = io::Error::new(io::ErrorKind::IsADirectory, "it is a folder; name a file");
        return Err(Error::io("read", input, why));
    }
    for (i, output) in outputs.iter().enumerate() {
        if let Some(input) = inputs.iter().find(|input| same_file(input, output)) {
            return Err(Error::config(
                format_args!(
                    "the output {} would overwrite the input {}",
                    output.display(),
                    input.display()
                ),
                "name another file",
            ));
        }
        if let Some(other) = outputs[..i].iter().find(|other| same_file(other, output)) {
            return Err(Error::config(
                format_args!(
                    "the outputs {} and {} are one file",
                    other.display(),
                    output.display()
                ),
                "give each a file of its own",
            ));
        }
    }
    Ok(())
}

/// Refuses an output that is one of the files that a scene was read from: those that
/// its own file names are known only then. Outputs are still under construction.
pub(super) fn check_scene(scene: &Scene, outputs: &[&Path]) -> Result<()> {
    let files: Vec<&Path> = scene.files.iter().map(|file| &**file).collect();
    check(&files, outputs)
}

/// Writes a picture to each of `files`: a PNG shows it, an EXR holds it in layers
/// with the reference and the error, where there is a reference.
pub(super) fn write_pictures(
    files: &mut [PictureFile],
    picture: &Picture,
    reference: Option<&Picture>,
) -> Result<()> {
    let error = reference.map(|reference| picture.minus(reference));
    let mut layers = vec![Layer { name: "colour", picture }];
    if let (Some(reference), Some(error)) = (reference, &error) {
        layers.push(Layer { name: "reference", picture: reference });
        layers.push(Layer { name: "error", picture: error });
    }
    files.iter_mut().try_for_each(|file| file.write(&layers))
}

/// Opens a trace; warns of one without checksums.
pub(super) fn open_trace(path: &Path, console: &Console) -> Result<Trace> {
    let trace = Trace::open(path)?;
    if !trace.is_sealed() {
        console.warn(&format!("{}: written without checksums by another program", trace.place()));
    }
    Ok(trace)
}

/// Where a command's JSON goes, open from the start.
pub(super) enum Json {
    /// Standard output.
    Standard,
    /// A file.
    File(OutputFile),
}

impl Json {
    /// The path of the file that --json names; none for standard output.
    pub fn path(argument: &Option<PathBuf>) -> Option<&Path> {
        argument.as_deref().filter(|path| *path != Path::new("-"))
    }

    /// Opens what --json names.
    pub fn open(argument: &Option<PathBuf>) -> Result<Option<Self>> {
        match (argument, Self::path(argument)) {
            (None, _) => Ok(None),
            (Some(_), None) => Ok(Some(Json::Standard)),
            (Some(_), Some(path)) => Ok(Some(Json::File(OutputFile::create(path)?))),
        }
    }
}

/// Writes `value` as JSON where that is asked for, and otherwise calls `text`: it
/// is called too where the file cannot be written, so that no work is lost.
pub(super) fn report(
    json: Option<Json>,
    value: &impl Serialize,
    console: &Console,
    text: impl FnOnce() -> Result<()>,
) -> Result<()> {
    let Some(json) = json else { return text() };
    let mut bytes = serde_json::to_vec_pretty(value)
        .map_err(|e| Error::io("write", "the JSON", io::Error::other(e)))?;
    bytes.push(b'\n');
    match json {
        Json::Standard => console.write(&bytes),
        Json::File(mut file) => {
            let written = file.write_bytes(&bytes).and_then(|()| file.commit());
            if written.is_err() {
                text()?;
            }
            written
        }
    }
}
