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
#[derive(Clone, Copy, Debug)]
pub(crate) enum Background<'a> {
    Colour([f32; 3]),
    /// Colours of their own for the pixels.
    Picture(&'a Picture),
}

impl Background<'_> {
    /// The colour where there is but one, else black, which nothing shows.
    pub(crate) fn colour(&self) -> [f32; 3] {
        match self {
            Background::Colour(colour) => *colour,
            Background::Picture(_) => [0.0; 3],
        }
    }
}

/// The channels that a trace has, as it can have them.
pub(crate) fn rgb(colour: [f32; 4]) -> [f32; 3] {
    let held = |v: f32| if v.is_nan() { 0.0 } else { v.clamp(-65504.0, 65504.0) };
    [0, 1, 2].map(|i| held(colour[i]))
}

/// The background of what was chosen, where the capture has it.
///
/// # Errors
/// [`Error::Config`] where it has not.
pub(crate) fn background<'a>(
    chosen: &Chosen<'a>,
    plan: &Plan<'_>,
    format: &PixelFormat,
) -> Result<Background<'a>> {
    let submission = match plan.base {
        Base::Cleared(colour) => return Ok(Background::Colour(rgb(format.stored(colour)))),
        Base::Undefined => return Ok(Background::Colour([0.0; 3])),
        Base::Loaded { submission } => submission,
    };
    let picture = before(chosen, plan, submission).map_err(|why| {
        let number = chosen.number;
        Error::config(
            format_args!("what target #{number} held before the first draw is not known: {why}"),
            "give --background R,G,B, or capture from an earlier submission on",
        )
    })?;
    let Chosen { capture, place, .. } = *chosen;
    let (mut first, mut same) = (None, true);
    each_pixel(capture, picture, format, place, &mut |_, colour| {
        same &= *first.get_or_insert(rgb(colour)) == rgb(colour);
        Ok(())
    })?;
    Ok(match first {
        Some(first) if same => Background::Colour(first),
        _ => Background::Picture(picture),
    })
}

/// The picture of what a target held before the submission at a place, or why there is none.
pub(crate) fn before<'a>(
    chosen: &Chosen<'a>,
    plan: &Plan<'_>,
    submission: usize,
) -> Result<&'a Picture, &'static str> {
    let Chosen { capture, place, .. } = *chosen;
    if place.layer > 0 || place.level > 0 {
        return Err("pictures are of an image's first layer and level");
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
    latest.ok_or(match written {
        Some(_) => "it was written by a command that draws nothing",
        None => "its picture was not taken",
    })
}

/// Calls `each` with the picture's colours and their pixels, rows from the top.
///
/// # Errors
/// [`Error::Invalid`] where it is not as long as its image asks for.
pub(crate) fn each_pixel(
    capture: &DeviceCapture,
    picture: &Picture,
    format: &PixelFormat,
    place: Place,
    each: &mut dyn FnMut([u16; 2], [f32; 4]) -> Result<()>,
) -> Result<()> {
    let path = &capture.files.pictures;
    let [width, height] = capture.size(place);
    let row = width as usize * format.bytes();
    let bytes = row as u64 * u64::from(height);
    if bytes != picture.bytes {
        let what = format!(
            "the picture of image {} has {} bytes, not {bytes}",
            picture.image, picture.bytes
        );
        return Err(Error::invalid(path.display(), what, "capture anew"));
    }
    let fail = |e| Error::io("read", path, e);
    let mut file = File::open(path).map_err(fail)?;
    file.seek(SeekFrom::Start(picture.first)).map_err(fail)?;
    let mut row = vec![0; row];
    for y in 0..height {
        file.read_exact(&mut row).map_err(fail)?;
        for (x, pixel) in row.chunks_exact(format.bytes()).enumerate() {
            each([x as u16, y as u16], format.decode(pixel))?;
        }
    }
    Ok(())
}

/// The picture of an image after its last submission among `last`.
pub(crate) fn after(capture: &DeviceCapture, place: Place, last: u64) -> Option<&Picture> {
    if place.layer > 0 || place.level > 0 {
        return None;
    }
    capture.pictures.iter().find(|p| p.after && p.image == place.image && p.submission == last)
}
