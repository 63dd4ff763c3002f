//! What was there before the first draw.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};

use screendoor_trace::error::{Error, Result};
use screendoor_vulkan_layer::log::Picture;

use crate::folder::DeviceCapture;
use crate::format::PixelFormat;
use crate::plan::{Base, Plan};
use crate::target::{Chosen, Place};

/// What is behind all that is drawn, in the numbers of the target.
#[derive(Debug)]
pub(crate) enum Background {
    Colour([f32; 3]),
    /// A colour for each pixel, rows from the top.
    Picture(Vec<[f32; 3]>),
}

impl Background {
    /// The colour where there is but one, else black, which nothing shows.
    pub(crate) fn colour(&self) -> [f32; 3] {
        match self {
            Background::Colour(colour) => *colour,
            Background::Picture(_) => [0.0; 3],
        }
    }
}

/// The background of what was chosen, where the capture has it.
///
/// # Errors
/// [`Error::Config`] where it has not.
pub(crate) fn background(
    chosen: &Chosen<'_>,
    plan: &Plan<'_>,
    format: &PixelFormat,
) -> Result<Background> {
    let finite = |v: f32| if v.is_finite() { v } else { 0.0 };
    let rgb = |colour: [f32; 4]| [0, 1, 2].map(|i| finite(colour[i]));
    let submission = match plan.base {
        Base::Cleared(colour) => return Ok(Background::Colour(rgb(format.stored(colour)))),
        Base::Undefined => return Ok(Background::Colour([0.0; 3])),
        Base::Loaded { submission } => submission,
    };
    let unknown = |why: &str| {
        let number = chosen.number;
        Error::config(
            format_args!("what target #{number} held before the first draw is not known: {why}"),
            "give --background R,G,B, or capture from an earlier submission on",
        )
    };
    let capture = chosen.capture;
    let place = chosen.place;
    if place.layer > 0 || place.level > 0 {
        return Err(unknown("pictures are of an image's first layer and level"));
    }
    let number = capture.submissions[submission].number;
    // What it held at the end of an earlier submission is what it held at the start of this one,
    // as long as nothing was written in between.
    let written = plan.written.map(|at| capture.submissions[at].number);
    let good = |p: &&Picture| {
        let before = if p.after { p.submission < number } else { p.submission <= number };
        let stale = match (written, p.after) {
            (Some(written), true) => p.submission < written,
            (Some(written), false) => p.submission <= written,
            (None, _) => false,
        };
        p.image == place.image && before && !stale
    };
    let latest = capture.pictures.iter().filter(good).max_by_key(|p| (p.submission, p.after));
    let Some(picture) = latest else {
        return Err(unknown(match written {
            Some(_) => "it was written by a command that draws nothing",
            None => "its picture was not taken",
        }));
    };
    let size = capture.size(place);
    let pixels: Vec<[f32; 3]> =
        pixels(capture, picture, format, size)?.into_iter().map(rgb).collect();
    Ok(match pixels.first() {
        Some(first) if pixels.iter().all(|p| p == first) => Background::Colour(*first),
        _ => Background::Picture(pixels),
    })
}

/// The pictures's colours, rows from the top.
///
/// # Errors
/// [`Error::Invalid`] where it is not as long as its image asks for.
pub(crate) fn pixels(
    capture: &DeviceCapture,
    picture: &Picture,
    format: &PixelFormat,
    size: [u32; 2],
) -> Result<Vec<[f32; 4]>> {
    let path = &capture.files.pictures;
    let count = u64::from(size[0]) * u64::from(size[1]);
    let bytes = count * format.bytes() as u64;
    if bytes != picture.bytes {
        return Err(Error::invalid(
            path.display(),
            format_args!(
                "the picture of image {} has {} bytes, not {bytes}",
                picture.image, picture.bytes
            ),
            "capture anew",
        ));
    }
    let fail = |e| Error::io("read", path, e);
    let mut file = File::open(path).map_err(fail)?;
    file.seek(SeekFrom::Start(picture.first)).map_err(fail)?;
    // There are so many, as the folder was read.
    let mut raw = Vec::new();
    file.take(bytes).read_to_end(&mut raw).map_err(fail)?;
    if raw.len() as u64 != bytes {
        return Err(Error::invalid(
            path.display(),
            "it was cut while it was read",
            "leave it alone",
        ));
    }
    Ok(raw.chunks_exact(format.bytes()).map(|pixel| format.decode(pixel)).collect())
}

/// The picture of an image after its last submission among `last`.
pub(crate) fn after(capture: &DeviceCapture, place: Place, last: u64) -> Option<&Picture> {
    if place.layer > 0 || place.level > 0 {
        return None;
    }
    capture.pictures.iter().find(|p| p.after && p.image == place.image && p.submission == last)
}
