//! `screendoor compare`.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::cli::console::Console;
use crate::cli::files::{JsonArgument, check, report, write_picture};
use crate::cli::kind::{Kind, check_input};
use crate::error::{Error, Result};
use crate::metrics::{Errors, Region, errors};
use crate::picture::{
    AlphaDifference, Layer, Opened, Picture, PictureFile, Window, lay, layers, open,
};

/// Compare two pictures (EXR, or PNG as sRGB): the first minus the second
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The picture
    picture: PathBuf,
    /// What it is held against
    reference: PathBuf,
    /// The layer or part of both; the first that is a picture where not given. A picture whose
    /// only layer has no name is taken as it is
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
    /// Colours, alpha and data windows, bit for bit.
    identical: bool,
    errors: Errors,
    /// The layers that are compared; empty names where they have none.
    layers: [String; 2],
    /// Where the pictures' pixels lie in their files' planes.
    data_windows: [Window; 2],
    /// Over how many pixels alpha differs; null where neither picture has any. A picture
    /// without alpha counts as opaque.
    alpha: Option<AlphaDifference>,
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
    let files = [&*arguments.picture, &*arguments.reference];
    let [a, b] = open_both(files, arguments)?;
    let words = told(files, [&a, &b]);
    let document_layers = [a.layer.clone(), b.layer.clone()];
    let windows = [a.data, b.data];
    let Some(laid) = lay(a, b) else { return Err(different_sizes(files, windows)) };
    let [a, b] = laid.pictures;
    check_finite(&arguments.picture, &a)?;
    check_finite(&arguments.reference, &b)?;
    let create = |path| PictureFile::create(path, a.width(), a.height());
    let output = arguments.output.as_ref().map(create).transpose()?;
    let json = arguments.json.open()?;
    let e = errors(&a, &b, &Region::frame(a.grid()));
    let same_colours = a.hash() == b.hash();
    let same_alpha = laid.alpha.is_none_or(|alpha| alpha.pixels == 0);
    let identical = same_colours && same_alpha && windows[0] == windows[1];
    let saved = output.map_or(Ok(()), |mut file| {
        let difference = a.minus(&b);
        write_picture(&mut file, &[Layer { name: "error", picture: &difference }], console)?;
        file.commit()
    });
    let document = Document {
        picture: arguments.picture.display().to_string(),
        reference: arguments.reference.display().to_string(),
        width: a.width(),
        height: a.height(),
        identical,
        errors: e,
        layers: document_layers,
        data_windows: windows,
        alpha: laid.alpha,
    };
    let reported = report(json, "screendoor.compare", &document, console, || {
        let line = |name: &str, value: f64| console.print(format_args!("{name:<22}{value:>12.4}"));
        words.iter().try_for_each(|line| console.print(format_args!("{line}")))?;
        console.print(format_args!("errors in 8-bit units over {} pixels", e.pixels))?;
        line("RMSE, linear", e.rmse)?;
        line("RMSE, sRGB-encoded", e.rmse_srgb)?;
        line("mean difference", e.mean)?;
        line("largest difference", e.max)?;
        if let Some(alpha) = laid.alpha.filter(|alpha| alpha.pixels > 0) {
            let only = if same_colours { "only alpha differs" } else { "alpha differs, too" };
            let AlphaDifference { pixels, max } = alpha;
            console.print(format_args!("{only}: at {pixels} pixels, by {max:.4} at most"))?;
        }
        match (identical, same_colours) {
            (true, _) => console.print(format_args!("the pictures are identical, bit for bit")),
            (_, true) => console.print(format_args!("the colours are identical, bit for bit")),
            _ => Ok(()),
        }
    });
    saved.and(reported)
}

/// Opens both pictures. A layer's name that is given once is the name for both, but for a
/// picture whose only layer has none.
fn open_both(files: [&Path; 2], arguments: &Arguments) -> Result<[Opened; 2]> {
    let first = arguments.layer.as_deref();
    let second = arguments.reference_layer.as_deref();
    let [mut of_first, mut of_second] = [first, second.or(first)];
    if let (Some(wanted), None) = (first, second) {
        let [a, b] = [layers(files[0])?, layers(files[1])?];
        let is_nameless = |layers: &[String]| layers == [""];
        let (nameless, other) = match (is_nameless(&a), is_nameless(&b)) {
            (true, false) => (&mut of_first, files[1]),
            (false, true) => (&mut of_second, files[0]),
            _ => return Ok([open(files[0], Some(wanted))?, open(files[1], Some(wanted))?]),
        };
        *nameless = None;
        // Not before the other one is known to have it.
        open(other, Some(wanted))?;
    }
    Ok([open(files[0], of_first)?, open(files[1], of_second)?])
}

/// What is to be known of the files before the figures: which layer is compared where there
/// are others, and where the pictures lie in their planes.
fn told(files: [&Path; 2], opened: [&Opened; 2]) -> Vec<String> {
    let mut lines = Vec::new();
    for (file, opened) in files.iter().zip(opened) {
        if !opened.others.is_empty() {
            let name = if opened.layer.is_empty() { "(no name)" } else { &opened.layer };
            let others = opened.others.join("; ");
            lines.push(format!("{}: layer {name}; not compared: {others}", file.display()));
        }
    }
    let [a, b] = opened;
    if a.data != b.data {
        let [dx, dy] = [0, 1].map(|i| i64::from(a.data.origin[i]) - i64::from(b.data.origin[i]));
        let how = if a.data.size == b.data.size {
            format!("the data window is moved by ({dx},{dy})")
        } else {
            "the data windows differ".to_string()
        };
        lines.push(format!("{how}: {} against {}; black outside of each", a.data, b.data));
    }
    match (a.has_alpha(), b.has_alpha()) {
        (true, false) => lines.push(lacks_alpha(files[1])),
        (false, true) => lines.push(lacks_alpha(files[0])),
        _ => {}
    }
    lines
}

fn lacks_alpha(file: &Path) -> String {
    format!("{} has no alpha, which counts as opaque", file.display())
}

fn different_sizes(files: [&Path; 2], windows: [Window; 2]) -> Error {
    let [a, b] = files.map(Path::display);
    let [[aw, ah], [bw, bh]] = windows.map(|w| w.size);
    if windows[0].size == windows[1].size {
        let [of_a, of_b] = windows;
        return Error::config(
            format_args!("the pictures lie too far apart: {a} is {of_a}, {b} is {of_b}"),
            "write them with data windows that lie near each other",
        );
    }
    Error::config(
        format_args!("the pictures differ in size: {a} is {aw}x{ah}, {b} is {bw}x{bh}"),
        "compare pictures of one size",
    )
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
