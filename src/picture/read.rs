//! Reading pictures: EXR (linear, layers) and PNG (sRGB, 8 bits).

use std::path::Path;

use exr::prelude::{AnyChannels, FlatSamples, ReadChannels, ReadLayers, Text};
use image::ImageDecoder;

use crate::error::{Error, Result};
use crate::picture::write::{check_size, exr_error};
use crate::picture::{Picture, necessary_chunks, srgb};
use crate::tile::TileGrid;

/// Reads the picture in an EXR file (its layer `layer`, or the first) or in a
/// PNG (as sRGB).
///
/// # Errors
/// [`Error::Io`] where it cannot be read, [`Error::Invalid`] where it is no
/// such picture, [`Error::Config`] for a layer or format that is not there.
pub fn read(path: impl AsRef<Path>, layer: Option<&str>) -> Result<Picture> {
    let path = path.as_ref();
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    let bytes = std::fs::read(path).map_err(|e| Error::io("read", path, e))?;
    match ending.as_str() {
        "exr" => read_exr(path, &bytes, layer),
        "png" if layer.is_some() => {
            Err(Error::config("a PNG has no layers", "leave --layer out, or give an EXR file"))
        }
        "png" => read_png(path, &bytes),
        _ => Err(Error::config(
            format_args!("'{}' is no picture that can be read", path.display()),
            "give a .exr or .png file",
        )),
    }
}

fn read_png(path: &Path, bytes: &[u8]) -> Result<Picture> {
    let bad = |e: &dyn std::fmt::Display| {
        Error::invalid(path.display(), format_args!("it cannot be read as PNG ({e})"), "replace it")
    };
    let bytes = &*necessary_chunks(bytes);
    let mut reader = image::ImageReader::new(std::io::Cursor::new(bytes));
    reader.set_format(image::ImageFormat::Png);
    let mut limits = image::Limits::no_limits();
    limits.max_alloc = Some(crate::picture::write::MAX_PIXELS * 8);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|e| bad(&e))?;
    let (width, height) = decoder.dimensions();
    check_frame(path, width as usize, height as usize)?;
    if !can_hold(bytes, width, height) {
        return Err(overclaimed(path, format_args!("{width}x{height} pixels"), bytes));
    }
    let image = image::DynamicImage::from_decoder(decoder).map_err(|e| bad(&e))?.into_rgb8();
    Ok(Picture::from_fn(TileGrid::new(width, height), |x, y| {
        image.get_pixel(x, y).0.map(|v| srgb::decode(f64::from(v) / 255.0))
    }))
}

/// How many bytes one byte of a DEFLATE stream can stand for.
const DEFLATE: u64 = 1032;

/// Whether a PNG (or JPEG, which packs less) of so many bytes can hold so many pixels, each
/// of which takes a bit at least.
pub(crate) fn can_hold(bytes: &[u8], width: u32, height: u32) -> bool {
    u64::from(width) * u64::from(height) / 8 / DEFLATE <= bytes.len() as u64
}

/// The same of what EXR files are packed with, more than any of it does.
const EXR: u64 = 1 << 14;

/// A picture that so short a file cannot hold: it would be allocated before that is found
/// out.
fn overclaimed(path: &Path, claimed: std::fmt::Arguments<'_>, bytes: &[u8]) -> Error {
    let what = format!("it claims {claimed} and is {} bytes long", bytes.len());
    Error::invalid(path.display(), what, "it is damaged: replace it")
}

fn check_frame(path: &Path, width: usize, height: usize) -> Result<()> {
    if (1..=1 << 16).contains(&width) && (1..=1 << 16).contains(&height) {
        return check_size(path, width as u32, height as u32);
    }
    let what = format_args!("a picture of {width}x{height} pixels").to_string();
    Err(Error::unsupported(path.display(), what, "each side is 1 to 65536 pixels"))
}

fn read_exr(path: &Path, bytes: &[u8], layer: Option<&str>) -> Result<Picture> {
    let bad = |what: &str| {
        Error::invalid(path.display(), what, "give an EXR file with the channels R, G and B")
    };
    // The pixel count first, from the headers alone: nothing is allocated for a
    // size that a file merely claims.
    let meta = exr::meta::MetaData::read_from_buffered(std::io::Cursor::new(bytes), true)
        .map_err(|e| exr_error(path, "read", e))?;
    for header in &meta.headers {
        check_frame(path, header.layer_size.0, header.layer_size.1)?;
        let pixels = (header.layer_size.0 * header.layer_size.1) as u64;
        let claimed = pixels * header.channels.bytes_per_pixel as u64;
        if claimed / EXR > bytes.len() as u64 {
            return Err(overclaimed(path, format_args!("{claimed} bytes of pixels"), bytes));
        }
    }
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(std::io::Cursor::new(bytes))
        .map_err(|e| exr_error(path, "read", e))?;
    let name = |l: &exr::prelude::Layer<AnyChannels<FlatSamples>>| {
        l.attributes.layer_name.as_ref().map_or_else(String::new, Text::to_string)
    };
    let found = match layer {
        None => image.layer_data.first().ok_or_else(|| bad("it has no layers"))?,
        Some(wanted) => {
            let hit = image.layer_data.iter().find(|l| name(l) == wanted);
            hit.ok_or_else(|| {
                let names: Vec<String> = image.layer_data.iter().map(name).collect();
                Error::unknown(
                    &format!("layer of {}:", path.display()),
                    wanted,
                    names.iter().map(String::as_str),
                )
            })?
        }
    };
    let channel = |wanted: &str| {
        let hit = found.channel_data.list.iter().find(|c| c.name.eq(wanted));
        hit.map(|c| &c.sample_data).ok_or_else(|| bad(&format!("it has no channel '{wanted}'")))
    };
    let channels = [channel("R")?, channel("G")?, channel("B")?];
    let (width, height) = (found.size.0, found.size.1);
    Ok(Picture::from_fn(TileGrid::new(width as u32, height as u32), |x, y| {
        let index = y as usize * width + x as usize;
        channels.map(|c| f64::from(c.value_by_flat_index(index).to_f32()))
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::{Layer, write_exr, write_png};

    fn picture(scale: f64) -> Picture {
        Picture::from_fn(TileGrid::new(21, 18), |x, y| {
            [f64::from(x) * scale, f64::from(y) * scale, -1.5]
        })
    }

    #[test]
    fn exr_layers_round_trip() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let (colour, error) = (picture(0.25), picture(-2.0));
        let layers =
            [Layer { name: "colour", picture: &colour }, Layer { name: "error", picture: &error }];
        write_exr(&path, &layers).unwrap();
        assert_eq!(read(&path, None).unwrap().hash(), colour.hash());
        assert_eq!(read(&path, Some("colour")).unwrap().hash(), colour.hash());
        assert_eq!(read(&path, Some("error")).unwrap().hash(), error.hash());
        let message = read(&path, Some("eror")).unwrap_err().to_string();
        assert!(message.contains("did you mean 'error'?"), "{message}");
    }

    #[test]
    fn png_holds_srgb() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let ramp =
            Picture::from_fn(TileGrid::new(256, 1), |x, _| [srgb::decode(f64::from(x) / 255.0); 3]);
        write_png(&path, &ramp).unwrap();
        assert_eq!(read(&path, None).unwrap().hash(), ramp.hash());
    }

    #[test]
    fn truncated_pictures_are_errors() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.exr", "a.png"] {
            let path = folder.path().join(name);
            match name {
                "a.exr" => {
                    let picture = picture(0.1);
                    write_exr(&path, &[Layer { name: "colour", picture: &picture }]).unwrap();
                }
                _ => write_png(&path, &picture(0.01)).unwrap(),
            }
            let whole = std::fs::read(&path).unwrap();
            for length in [0, 3, whole.len() / 3, whole.len() - 1] {
                std::fs::write(&path, &whole[..length]).unwrap();
                let result = read(&path, None);
                assert!(result.is_err() || (name == "a.png" && length + 1 == whole.len()));
            }
        }
    }
}
