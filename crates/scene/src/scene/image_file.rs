//! Decoding pictures of textures within one budget of memory.
//!
//! What is allocated follows from the texels, never from what else a file says: of a PNG
//! only the chunks that its texels need are looked at, and a file that is too short for its
//! texels is refused before any are allocated.

use image::{DynamicImage, GrayImage, ImageBuffer, ImageDecoder, ImageFormat, ImageReader, Limits};

use screendoor_trace::error::{Error, Result};
use screendoor_trace::picture::{Rgba, can_hold, is_deep, necessary_chunks};

/// The largest side of a texture.
pub(super) const MAX_SIDE: u32 = 16384;
/// The most texels of a texture that is read: it takes 11 bytes a texel when
/// loaded, and at most 8 more while it is.
const MAX_TEXELS: u64 = 1 << 26;
/// The most memory that decoding may take, in bytes, whatever the format.
const MAX_DECODE_BYTES: u64 = 1 << 30;

/// The formats that are read.
const FORMATS: [ImageFormat; 5] =
    [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::WebP, ImageFormat::Bmp, ImageFormat::Tga];

/// Decodes a PNG, JPEG, WebP, BMP or TGA. `place` names it in errors, and says by its ending
/// that it is a TGA, which has no mark of its own.
///
/// # Errors
/// [`Error::Invalid`] where it cannot be decoded or is of another format,
/// [`Error::Unsupported`] where it has more than 16384 texels on a side or 64 Mi in all,
/// or decoding takes more than 1 GiB.
pub(super) fn decode(bytes: &[u8], place: &str) -> Result<DynamicImage> {
    let bad = |e: &dyn std::fmt::Display| {
        Error::invalid(place, format_args!("the texture cannot be decoded ({e})"), "replace it")
    };
    let format = format(bytes, place).map_err(|what| bad(&what))?;
    let bytes = match format {
        ImageFormat::Png => necessary_chunks(bytes),
        _ => bytes.into(),
    };
    let mut reader = ImageReader::with_format(std::io::Cursor::new(&*bytes), format);
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(MAX_DECODE_BYTES);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|e| bad(&e))?;
    let (width, height) = decoder.dimensions();
    if width == 0 || height == 0 {
        return Err(bad(&"it has no texels"));
    }
    let texels = u64::from(width) * u64::from(height);
    if width.max(height) > MAX_SIDE || texels > MAX_TEXELS {
        let what = format_args!(
            "the texture has {width} x {height} texels, and {MAX_SIDE} on a side and \
             {MAX_TEXELS} in all are the most"
        )
        .to_string();
        return Err(Error::unsupported(place, what, "scale it down"));
    }
    if !holds(format, &bytes, width, height) {
        let length = bytes.len();
        return Err(bad(&format_args!("{length} bytes hold no {width} x {height} texels")));
    }
    let needed = decoder.total_bytes() + texels * scratch(format) + bytes.len() as u64;
    if needed > MAX_DECODE_BYTES {
        let what = format!("decoding it takes {} MiB, and 1 GiB is the most", needed >> 20);
        return Err(Error::unsupported(place, what, "scale it down"));
    }
    DynamicImage::from_decoder(decoder).map_err(|e| bad(&e))
}

/// What a decoder keeps besides the texels that it gives, in bytes a texel.
fn scratch(format: ImageFormat) -> u64 {
    match format {
        // The coefficients of a progressive file, 16 bits for each of up to four components.
        ImageFormat::Jpeg => 8,
        // The planes of a lossy file, or the colours of a lossless one before its transformations.
        ImageFormat::WebP => 4,
        _ => 0,
    }
}

/// Whether so many bytes can stand for so many texels.
fn holds(format: ImageFormat, bytes: &[u8], width: u32, height: u32) -> bool {
    let texels = u64::from(width) * u64::from(height);
    let runs_of = |longest: u64| texels / longest <= bytes.len() as u64;
    match format {
        // A picture of one colour takes no bits a texel.
        ImageFormat::WebP => true,
        ImageFormat::Bmp => runs_of(255),
        ImageFormat::Tga => runs_of(128),
        _ => can_hold(bytes, width, height),
    }
}

/// The format of a file's bytes.
///
/// # Errors
/// What else they are.
fn format(bytes: &[u8], place: &str) -> Result<ImageFormat, String> {
    let read = "PNG, JPEG, WebP, BMP and TGA are read";
    if let Some(name) = other_format(bytes) {
        return Err(format!("it is a {name}; {read}"));
    }
    match image::guess_format(bytes) {
        Ok(format) if FORMATS.contains(&format) => Ok(format),
        Ok(other) => {
            let name = other.extensions_str().first().copied().unwrap_or("picture of another kind");
            Err(format!("it is a {}; {read}", name.to_uppercase()))
        }
        Err(_) if place.to_ascii_lowercase().ends_with(".tga") => Ok(ImageFormat::Tga),
        Err(_) => Err(format!("its format is not known; {read}")),
    }
}

/// Formats of textures that the library does not know.
fn other_format(bytes: &[u8]) -> Option<&'static str> {
    const MARKS: [(&[u8], &str); 3] =
        [(b"\xabKTX 11", "KTX"), (b"\xabKTX 20", "KTX2"), (b"8BPS", "PSD")];
    MARKS.iter().find(|(mark, _)| bytes.starts_with(mark)).map(|(_, name)| *name)
}

/// Which channel of a picture is an opacity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Channel {
    /// The alpha where there is one below 1, else the luminance.
    AlphaOrLuminance,
    /// One of red, green, blue and alpha, by its number.
    One(usize),
    /// The luminance of the numbers as they stand.
    Luminance,
}

/// A picture of one channel: the opacity that `channel` of `image` says.
pub(super) fn opacity(image: DynamicImage, channel: Channel) -> DynamicImage {
    let (width, height) = (image.width(), image.height());
    let rgba = Rgba::of(image);
    let channel = chosen(channel, rgba.is_transparent());
    let gray = |x, y| of(channel, rgba.get(x, y).map(f32::from)) as u16;
    match &rgba {
        Rgba::Sixteen(_) => {
            let gray = |x, y| [gray(x, y)].into();
            DynamicImage::ImageLuma16(ImageBuffer::from_fn(width, height, gray))
        }
        Rgba::Eight(_) => {
            let gray = |x, y| [gray(x, y) as u8].into();
            DynamicImage::ImageLuma8(GrayImage::from_fn(width, height, gray))
        }
    }
}

fn chosen(channel: Channel, has_alpha: bool) -> Channel {
    match channel {
        Channel::AlphaOrLuminance if has_alpha => Channel::One(3),
        Channel::AlphaOrLuminance => Channel::Luminance,
        other => other,
    }
}

/// A channel's value, to be rounded down.
fn of(channel: Channel, texel: [f32; 4]) -> f32 {
    match channel {
        Channel::One(i) => texel[i],
        // Rec. 709.
        _ => 0.2126 * texel[0] + 0.7152 * texel[1] + 0.0722 * texel[2] + 0.5,
    }
}

/// The picture without its alpha.
pub(super) fn colours(image: DynamicImage) -> DynamicImage {
    if !image.color().has_alpha() {
        image
    } else if is_deep(&image) {
        DynamicImage::ImageRgb16(image.into_rgb16())
    } else {
        DynamicImage::ImageRgb8(image.into_rgb8())
    }
}
