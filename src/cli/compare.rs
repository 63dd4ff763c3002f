//! `screendoor compare`.

use std::path::PathBuf;

use clap::Args;

use crate::cli::console::Console;
use crate::error::{Error, Result};
use crate::metrics::{Errors, Region, errors};
use crate::picture::{Layer, read, write_exr};

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
    /// Write the figures as JSON to a file, or to standard output for -
    #[arg(long, value_name = "FILE")]
    json: Option<String>,
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
    let e = errors(&a, &b, &Region::frame(a.grid()));
    let identical = a.hash() == b.hash();
    if let Some(path) = &arguments.output {
        let difference = a.zip(&b, |a, b| std::array::from_fn(|i| a[i] - b[i]));
        write_exr(path, &[Layer { name: "error", picture: &difference }])?;
    }
    if let Some(path) = &arguments.json {
        let document = Document {
            picture: arguments.picture.display().to_string(),
            reference: arguments.reference.display().to_string(),
            width: a.width(),
            height: a.height(),
            identical,
            errors: e,
        };
        return console.json(path, &document);
    }
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
}
