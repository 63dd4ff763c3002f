//! `screendoor compare`.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::cli::console::Console;
use crate::cli::files::{JsonArgument, check, report};
use crate::cli::kind::{Kind, check_input};
use crate::error::{Error, Result};
use crate::metrics::{Errors, Region, errors};
use crate::picture::{Layer, Picture, PictureFile, read};

/// Compare two pictures (EXR, or PNG as sRGB): the first minus the second
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The picture
    picture: PathBuf,
    /// What it is held against
    reference: PathBuf,
    /// The layer of both; the first where not given
    #[arg(long, value_name = "NAME")]
    layer: Option<String>,
    /// The layer of the second, where it has another
    #[arg(long, value_name = "NAME")]
    reference_layer: Option<String>,
    /// Write the difference as an EXR file
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    json: JsonArgument,
}

#[derive(serde::Serialize)]
struct Document {
    picture: String,
    reference: String,
    width: u32,
    height: u32,
    identical: bool,
    errors: Errors,
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let outputs: Vec<&Path> =
        arguments.output.as_deref().into_iter().chain(arguments.json.path()).collect();
    check(&[&arguments.picture, &arguments.reference], &outputs)?;
    check_input(&arguments.picture, Kind::Picture)?;
    check_input(&arguments.reference, Kind::Picture)?;
    if let Some(path) = &arguments.output {
        check_difference(path)?;
    }
    let layer = arguments.layer.as_deref();
    let a = read(&arguments.picture, layer)?;
    let b = read(&arguments.reference, arguments.reference_layer.as_deref().or(layer))?;
    if a.grid() != b.grid() {
        return Err(Error::config(
            format_args!(
                "the pictures differ in size: {} is {}x{}, {} is {}x{}",
                arguments.picture.display(),
                a.width(),
                a.height(),
                arguments.reference.display(),
                b.width(),
                b.height()
            ),
            "compare pictures of one size",
        ));
    }
    check_finite(&arguments.picture, &a)?;
    check_finite(&arguments.reference, &b)?;
    let create = |path| PictureFile::create(path, a.width(), a.height());
    let output = arguments.output.as_ref().map(create).transpose()?;
    let json = arguments.json.open()?;
    let e = errors(&a, &b, &Region::frame(a.grid()));
    let identical = a.hash() == b.hash();
    let saved = output.map_or(Ok(()), |mut file| {
        let difference = a.minus(&b);
        file.write(&[Layer { name: "error", picture: &difference }])?;
        file.commit()
    });
    let document = Document {
        picture: arguments.picture.display().to_string(),
        reference: arguments.reference.display().to_string(),
        width: a.width(),
        height: a.height(),
        identical,
        errors: e,
    };
    let reported = report(json, "screendoor.compare", &document, console, || {
        let line = |name: &str, value: f64| console.print(format_args!("{name:<22}{value:>12.4}"));
        console.print(format_args!("errors in 8-bit units over {} pixels", e.pixels))?;
        line("RMSE, linear", e.rmse)?;
        line("RMSE, sRGB-encoded", e.rmse_srgb)?;
        line("mean difference", e.mean)?;
        line("largest difference", e.max)?;
        if identical {
            console.print(format_args!("the pictures are identical, bit for bit"))?;
        }
        Ok(())
    });
    saved.and(reported)
}

/// A difference has values below 0, which a PNG cannot hold.
fn check_difference(path: &Path) -> Result<()> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
        return Ok(());
    }
    Err(Error::config(
        format_args!(
            "cannot write a difference, which has negative values, as '{}'",
            path.display()
        ),
        "name a .exr file",
    ))
}

/// Nothing can be said of the error of what is no number.
fn check_finite(path: &Path, picture: &Picture) -> Result<()> {
    match picture.not_finite() {
        0 => Ok(()),
        n => Err(Error::invalid(
            path.display(),
            format_args!(
                "{n} of its {} pixels are NaN or infinite",
                u64::from(picture.width()) * u64::from(picture.height())
            ),
            "compare pictures that are finite everywhere",
        )),
    }
}
