//! Reading pictures: EXR (linear, layers) and PNG (sRGB, 8 bits).

use std::path::Path;

use image::ImageDecoder;

use crate::error::{Error, Result};
use crate::picture::opened::Opened;
use crate::picture::write::check_size;
use crate::picture::{Picture, Rgba, exr_file, necessary_chunks, srgb};
use crate::tile::TileGrid;

/// Reads the picture in an EXR file (its layer or part `layer`, or the first that is a
/// picture) or in a PNG (as sRGB): the pixels of its data window.
///
/// # Errors
/// As [`open`].
pub fn read(path: impl AsRef<Path>, layer: Option<&str>) -> Result<Picture> {
    Ok(open(path, layer)?.picture)
}

/// As [`read`], with what the file says of the picture.
///
/// # Errors
/// [`Error::Io`] where it cannot be read, [`Error::Invalid`] where it is no
/// such picture, [`Error::Config`] for a layer or format that is not there.
pub fn open(path: impl AsRef<Path>, layer: Option<&str>) -> Result<Opened> {
    let path = path.as_ref();
    let (format, bytes) = bytes(path)?;
    match format {
        Format::Exr => exr_file::read(path, &bytes, layer),
        Format::Png if layer.is_some() => {
            Err(Error::config("a PNG has no layers", "leave --layer out, or give an EXR file"))
        }
        Format::Png => read_png(path, &bytes),
    }
}

/// The names of a file's layers and parts that are pictures; an empty one for what has no
/// name.
///
/// # Errors
/// As [`open`].
pub fn layers(path: impl AsRef<Path>) -> Result<Vec<String>> {
    let path = path.as_ref();
    let (format, bytes) = bytes(path)?;
    match format {
        Format::Exr => exr_file::layers(path, &bytes),
        Format::Png => Ok(vec![String::new()]),
    }
}

#[derive(Clone, Copy)]
enum Format {
    Exr,
    Png,
}

/// A file's format by its name, and its bytes.
fn bytes(path: &Path) -> Result<(Format, Vec<u8>)> {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    let bytes = std::fs::read(path).map_err(|e| Error::io("read", path, e))?;
    match ending.as_str() {
        "exr" => Ok((Format::Exr, bytes)),
        "png" => Ok((Format::Png, bytes)),
        _ => Err(Error::config(
            format_args!("'{}' is no picture that can be read", path.display()),
            "give a .exr or .png file",
        )),
    }
}

fn read_png(path: &Path, bytes: &[u8]) -> Result<Opened> {
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
        return Err(overclaimed(path, format_args!("{width}x{height} pixels"), bytes.len()));
    }
    let image = image::DynamicImage::from_decoder(decoder).map_err(|e| bad(&e))?;
    let has_alpha = image.color().has_alpha();
    let grid = TileGrid::new(width, height);
    let rgba = Rgba::of(image);
    let table = rgba.table(srgb::decode);
    let pixel = |x, y| {
        let [r, g, b, _] = rgba.get(x, y);
        [r, g, b].map(|v| table[usize::from(v)])
    };
    let mut opened = Opened::plain(Picture::from_fn(grid, pixel), has_alpha);
    for y in 0..height {
        let alphas: Vec<f32> = (0..width).map(|x| rgba.alpha(x, y)).collect();
        opened.put_alpha(0, y, &alphas);
    }
    Ok(opened)
}

/// How many bytes one byte of a DEFLATE stream can stand for.
const DEFLATE: u64 = 1032;

/// Whether a PNG (or JPEG, which packs less) of so many bytes can hold so many pixels, each
/// of which takes a bit at least.
pub fn can_hold(bytes: &[u8], width: u32, height: u32) -> bool {
    u64::from(width) * u64::from(height) / 8 / DEFLATE <= bytes.len() as u64
}

/// A picture that so short a file cannot hold: it would be allocated before that is found
/// out.
pub(super) fn overclaimed(path: &Path, claimed: std::fmt::Arguments<'_>, length: usize) -> Error {
    let what = format!("it claims {claimed} and is {length} bytes long");
    Error::invalid(path.display(), what, "it is damaged: replace it")
}

pub(super) fn check_frame(path: &Path, width: usize, height: usize) -> Result<()> {
    if (1..=1 << 16).contains(&width) && (1..=1 << 16).contains(&height) {
        return check_size(path, width as u32, height as u32);
    }
    let what = format_args!("a picture of {width}x{height} pixels").to_string();
    Err(Error::unsupported(path.display(), what, "each side is 1 to 65536 pixels"))
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
