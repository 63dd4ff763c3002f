//! Writing pictures: EXR (linear, layers) and PNG (sRGB, 8 bits).

use std::io::{Cursor, Seek, Write};
use std::path::Path;

use exr::block::writer::ChunksWriter;
use exr::block::{BlockIndex, UncompressedBlock};
use exr::image::write::layers::{LayersWriter, WritableLayers};
use exr::prelude::{
    Encoding, Image, ImageAttributes, LayerAttributes, SpecificChannels, Text, Vec2, WritableImage,
};
use image::ImageEncoder;
use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::output::OutputFile;
use crate::picture::{Picture, srgb};
use crate::tile::TileGrid;

/// The most pixels of a picture that is written or read.
pub(super) const MAX_PIXELS: u64 = 1 << 28;

/// A named picture within an EXR file.
#[derive(Clone, Copy, Debug)]
pub struct Layer<'a> {
    /// Its name.
    pub name: &'a str,
    /// What it shows.
    pub picture: &'a Picture,
}

pub(super) fn check_size(path: &Path, width: u32, height: u32) -> Result<()> {
    if u64::from(width) * u64::from(height) <= MAX_PIXELS {
        return Ok(());
    }
    Err(Error::unsupported(
        path.display(),
        format_args!("a picture of {width}x{height} pixels is too large"),
        format_args!("pictures have at most {MAX_PIXELS} pixels"),
    ))
}

enum Format {
    Exr,
    Png,
}

/// A picture's file under construction: begun before the work that makes the
/// picture, so that a file that cannot be written is found out first.
pub struct PictureFile {
    file: OutputFile,
    format: Format,
}

impl PictureFile {
    /// Begins the file at `path`, whose ending says the format, for a picture of
    /// `width` × `height` pixels.
    ///
    /// # Errors
    /// [`Error::Config`] where it ends neither in .exr nor in .png,
    /// [`Error::Unsupported`] where it would have more than 2^28 pixels, and as
    /// [`OutputFile::create`].
    pub fn create(path: impl AsRef<Path>, width: u32, height: u32) -> Result<Self> {
        let path = path.as_ref();
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("");
        let format = match ending.to_ascii_lowercase().as_str() {
            "exr" => Format::Exr,
            "png" => Format::Png,
            _ => {
                return Err(Error::config(
                    format_args!("cannot write a picture as '{}'", path.display()),
                    "name a .exr or .png file",
                ));
            }
        };
        check_size(path, width, height)?;
        Ok(PictureFile { file: OutputFile::create(path)?, format })
    }

    /// Writes `layers`, pictures of one size. A PNG shows the first alone. Tells `progress` how
    /// many blocks of an EXR are written, of how many.
    ///
    /// # Errors
    /// [`Error::Io`] where they cannot be written.
    ///
    /// # Panics
    /// Where there are no layers or their sizes differ.
    pub fn write(
        &mut self,
        layers: &[Layer<'_>],
        progress: &mut dyn FnMut(u64, u64),
    ) -> Result<()> {
        match self.format {
            Format::Exr => encode_exr(&mut self.file, layers, progress),
            Format::Png => {
                let bytes = png_bytes(self.file.path(), layers[0].picture)?;
                self.file.write_bytes(&bytes)
            }
        }
    }

    /// Puts the file in its place.
    ///
    /// # Errors
    /// As [`OutputFile::commit`].
    pub fn commit(self) -> Result<()> {
        self.file.commit()
    }
}

/// Writes `layers`, pictures of one size, as an EXR file in single precision.
///
/// # Errors
/// [`Error::Io`] where it cannot be written, [`Error::Unsupported`] where it
/// would have more than 2^28 pixels.
///
/// # Panics
/// Where there are no layers or their sizes differ.
pub fn write_exr(path: impl AsRef<Path>, layers: &[Layer<'_>]) -> Result<()> {
    let mut file = OutputFile::create(path)?;
    encode_exr(&mut file, layers, &mut |_, _| ())?;
    file.commit()
}

/// Writes a picture as an 8-bit sRGB PNG.
///
/// # Errors
/// As [`write_exr`].
pub fn write_png(path: impl AsRef<Path>, picture: &Picture) -> Result<()> {
    OutputFile::put(&path, &png_bytes(path.as_ref(), picture)?)
}

/// Blocks of 16 lines that are made and packed at a time: some for each of many threads.
const BLOCKS_AT_A_TIME: usize = 64;

/// Writes an EXR file: its blocks are packed in parallel and stand there in order.
fn encode_exr(
    file: &mut OutputFile,
    layers: &[Layer<'_>],
    progress: &mut dyn FnMut(u64, u64),
) -> Result<()> {
    let path = file.path().to_path_buf();
    let (width, height) = (layers[0].picture.width(), layers[0].picture.height());
    check_size(&path, width, height)?;
    let size = Vec2(width as usize, height as usize);
    let layer_data: exr::prelude::Layers<_> = layers
        .iter()
        .map(|layer| {
            assert_eq!(layer.picture.grid(), TileGrid::new(width, height));
            // Pixel by pixel: all of them at once would take half as much as the picture.
            let channels = SpecificChannels::rgb(|Vec2(x, y): Vec2<usize>| {
                let space = layer.picture.space();
                let colour = layer.picture.get(x as u32, y as u32);
                let [r, g, b] = colour.map(|c| space.to_linear(c) as f32);
                (r, g, b)
            });
            exr::prelude::Layer::new(
                size,
                LayerAttributes::named(layer.name),
                Encoding::SMALL_LOSSLESS,
                channels,
            )
        })
        .collect();
    let mut attributes = ImageAttributes::new(exr::prelude::IntegerBounds::from_dimensions(size));
    let writer = format!("screendoor {}", env!("CARGO_PKG_VERSION"));
    attributes
        .other
        .insert(Text::from("writer"), exr::prelude::AttributeValue::Text(writer.as_str().into()));
    let image = Image { attributes, layer_data };
    let headers = image.write().infer_meta_data();
    let pixels = image.layer_data.create_writer(&headers);
    let total: u64 = headers.iter().map(|header| header.chunk_count as u64).sum();
    let mut write = |to: &mut dyn Sink| {
        exr::block::write(to, headers.clone(), true, |meta, writer| {
            let pack = |(place, index): (usize, BlockIndex)| {
                let data = pixels.extract_uncompressed_block(&meta.headers, index);
                let block = UncompressedBlock { index, data };
                Ok((place, block.compress_to_chunk(&meta.headers)?))
            };
            let mut blocks = meta.enumerate_ordered_header_block_indices();
            let mut done = 0;
            loop {
                let some: Vec<_> = blocks.by_ref().take(BLOCKS_AT_A_TIME).collect();
                if some.is_empty() {
                    return Ok(());
                }
                let packed: Vec<exr::error::Result<_>> = some.into_par_iter().map(pack).collect();
                for packed in packed {
                    let (place, chunk) = packed?;
                    writer.write_chunk(place, chunk)?;
                    done += 1;
                }
                progress(done, total);
            }
        })
    };
    // The encoder goes back to write where each block stands.
    if let Some(mut file) = file.seekable() {
        return write(&mut file).map_err(|e| exr_error(&path, "write", e));
    }
    let mut bytes = Cursor::new(Vec::new());
    write(&mut bytes).map_err(|e| exr_error(&path, "write", e))?;
    file.write_bytes(&bytes.into_inner())
}

/// What an EXR file is written to.
trait Sink: Write + Seek {}

impl<W: Write + Seek> Sink for W {}

/// The bytes of a PNG file; `path` names it in errors.
fn png_bytes(path: &Path, picture: &Picture) -> Result<Vec<u8>> {
    let (width, height) = (picture.width(), picture.height());
    check_size(path, width, height)?;
    let mut pixels = Vec::with_capacity(width as usize * height as usize * 3);
    for y in 0..height {
        for x in 0..width {
            let display = |c| srgb::to_8_bits(picture.space().to_encoded(c));
            pixels.extend(picture.get(x, y).map(display));
        }
    }
    let mut bytes = Vec::new();
    image::codecs::png::PngEncoder::new(&mut bytes)
        .write_image(&pixels, width, height, image::ExtendedColorType::Rgb8)
        .map_err(|e| Error::io("write", path, std::io::Error::other(e)))?;
    Ok(bytes)
}

pub(super) fn exr_error(path: &Path, action: &'static str, error: exr::error::Error) -> Error {
    match error {
        exr::error::Error::Io(source) => Error::io(action, path, source),
        other => Error::invalid(
            path.display(),
            format_args!("it cannot be read as EXR ({other})"),
            "give a whole EXR file",
        ),
    }
}
