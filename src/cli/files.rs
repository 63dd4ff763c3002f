//! The files of a command: inputs that stay as they are, and outputs that are
//! begun before the work.

use std::io;
use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use crate::cli::console::{Console, grouped, shown};
use crate::cli::kind::{Kind, check_input, check_output};
use crate::cli::signals::on_interrupt;
use crate::error::{Error, Result};
use crate::output::{OutputFile, same_file};
use crate::picture::{Layer, Picture, PictureFile};
use crate::scene::Scene;
use crate::trace::{Trace, Written};

/// Refuses a folder in place of an input, and an output that is an input or
/// another output: writing it would destroy what was read or written before.
pub(super) fn check(inputs: &[&Path], outputs: &[&Path]) -> Result<()> {
    if let Some(input) = inputs.iter().find(|i| i.is_dir()) {
        let of_study = input.join("study.toml").is_file();
        of_study.then(|| check_input(input, Kind::Trace)).transpose()?;
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
    console: &Console,
) -> Result<()> {
    let error = reference.map(|reference| picture.minus(reference));
    let mut layers = vec![Layer { name: "colour", picture }];
    if let (Some(reference), Some(error)) = (reference, &error) {
        layers.push(Layer { name: "reference", picture: reference });
        layers.push(Layer { name: "error", picture: error });
    }
    files.iter_mut().try_for_each(|file| write_picture(file, &layers, console))
}

/// Writes the layers of one picture, with a sign of life.
pub(super) fn write_picture(
    file: &mut PictureFile,
    layers: &[Layer<'_>],
    console: &Console,
) -> Result<()> {
    let progress = console.progress("writing the picture", "blocks");
    file.write(layers, &mut |done, total| progress.set(done, total))
}

/// Opens a trace; warns of one without checksums. What is plainly something else is refused
/// with what to do with it.
pub(super) fn open_trace(path: &Path, console: &Console) -> Result<Trace> {
    check_input(path, Kind::Trace)?;
    let trace = Trace::open(path)?;
    if !trace.is_sealed() {
        console.warn(&format!("{}: written without checksums by another program", trace.place()));
    }
    Ok(trace)
}

/// Puts a trace in its place. It stays there whatever comes after, which who interrupts the
/// program is told.
pub(super) fn keep_trace(file: OutputFile) -> Result<()> {
    let place = file.path().display().to_string();
    file.commit()?;
    on_interrupt(move || format!("{place} is whole and kept"));
    Ok(())
}

/// Prints what was written as a trace, of `before` fragments.
pub(super) fn print_trace(
    place: &str,
    written: &Written,
    before: u64,
    console: &Console,
) -> Result<()> {
    let of = match before {
        before if before == written.rows => String::new(),
        before => format!(" of {}", grouped(before)),
    };
    console.print(format_args!(
        "{}: {}{of} fragments, {:.1} MB, content {}",
        shown(place),
        grouped(written.rows),
        written.bytes as f64 / 1e6,
        &written.content[..16],
    ))
}

/// Where a command writes its figures as JSON; the same for every command.
#[derive(Debug, Args)]
pub(super) struct JsonArgument {
    /// Write the figures as JSON to a file, or to standard output for -
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

impl JsonArgument {
    /// The path of the file, if it is one; none for standard output.
    pub fn path(&self) -> Option<&Path> {
        self.json.as_deref().filter(|path| *path != Path::new("-"))
    }

    /// Opens it.
    pub fn open(&self) -> Result<Option<Json>> {
        match (&self.json, self.path()) {
            (None, _) => Ok(None),
            (Some(_), None) => Ok(Some(Json::Standard)),
            (Some(_), Some(path)) => {
                check_output(path, Kind::Json)?;
                Ok(Some(Json::File(OutputFile::create(path)?)))
            }
        }
    }
}

/// Where a command's JSON goes, open from the start.
pub(super) enum Json {
    /// Standard output.
    Standard,
    /// A file.
    File(OutputFile),
}

/// The name and the version of a document: a version goes up where a reader of the one
/// before would be misled.
#[derive(Clone, Copy, Serialize)]
struct Schema {
    name: &'static str,
    version: u32,
}

#[derive(Serialize)]
struct Versioned<'a, T> {
    schema: Schema,
    #[serde(flatten)]
    document: &'a T,
}

/// Writes `document` as JSON where that is asked for, with `schema` as its name, and otherwise
/// calls `text`: it is called too where the file cannot be written, so that no work is lost.
pub(super) fn report(
    json: Option<Json>,
    schema: &'static str,
    document: &impl Serialize,
    console: &Console,
    text: impl FnOnce() -> Result<()>,
) -> Result<()> {
    let Some(json) = json else { return text() };
    let mut bytes = serde_json::to_vec_pretty(&Versioned {
        schema: Schema { name: schema, version: 1 },
        document,
    })
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
