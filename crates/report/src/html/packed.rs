//! Data within a page: what a browser inflates and decodes without loss.
//!
//! A picture's channels are single precision, as in our EXR files. Their bits
//! are foretold from a neighbour, from the reference or from another channel,
//! whichever makes the picture smallest; what is left over is laid out byte by
//! byte and deflated.

use std::io::Write;

use base64::Engine as _;
use flate2::{Compression, write::DeflateEncoder};
use serde::Serialize;

use screendoor_trace::picture::Picture;

/// What a pixel's bits are foretold from.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Source {
    /// Nothing.
    Nothing,
    /// The pixel to the left, in the first column nothing.
    Left,
    /// The reference's pixel.
    Reference,
}

/// How a picture was foretold: which steps a reader undoes.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
pub(crate) struct Prediction {
    /// What a pixel is foretold from.
    pub from: Source,
    /// Whether, after that, green is foretold from red and blue from green.
    pub channels: bool,
}

/// All ways to foretell a picture, the plain one first.
const PREDICTIONS: [Prediction; 6] = [
    Prediction { from: Source::Nothing, channels: false },
    Prediction { from: Source::Nothing, channels: true },
    Prediction { from: Source::Left, channels: false },
    Prediction { from: Source::Left, channels: true },
    Prediction { from: Source::Reference, channels: false },
    Prediction { from: Source::Reference, channels: true },
];

/// A picture as text.
#[derive(Clone, Debug)]
pub(crate) struct PackedPicture {
    /// What a reader undoes.
    pub prediction: Prediction,
    /// The bytes, deflated, as base64.
    pub text: String,
}

/// Packs `picture`. `reference` is a picture of the same size that the reader
/// has; a reference itself has none.
///
/// # Panics
/// Where the sizes differ.
pub(crate) fn pack_picture(picture: &Picture, reference: Option<&Picture>) -> PackedPicture {
    let (words, width) = (words(picture), picture.width() as usize);
    let reference = reference.map(|r| {
        assert_eq!(r.grid(), picture.grid());
        self::words(r)
    });
    let usable = PREDICTIONS.iter().filter(|p| p.from != Source::Reference || reference.is_some());
    let laid_out = usable.map(|p| (*p, lay_out(&words, width, reference.as_deref(), *p)));
    let (prediction, bytes) = laid_out
        .min_by_key(|(_, bytes)| deflate(bytes, Compression::fast()).len())
        .expect("predictions");
    PackedPicture { prediction, text: pack(&bytes) }
}

/// `bytes`, deflated, as base64.
pub(crate) fn pack(bytes: &[u8]) -> String {
    base64::engine::general_purpose::STANDARD.encode(deflate(bytes, Compression::best()))
}

fn deflate(bytes: &[u8], level: Compression) -> Vec<u8> {
    let mut encoder = DeflateEncoder::new(Vec::new(), level);
    let written = encoder.write_all(bytes).and_then(|()| encoder.finish());
    written.expect("memory takes all that is written")
}

/// The bits of the pixels' amounts of light in single precision, row by row.
fn words(picture: &Picture) -> Vec<[u32; 3]> {
    let row = |y| (0..picture.width()).map(move |x| (x, y));
    let pixels = (0..picture.height()).flat_map(row);
    let bits = |c| (picture.space().to_linear(c) as f32).to_bits();
    pixels.map(|(x, y)| picture.get(x, y).map(bits)).collect()
}

/// What `prediction` leaves over: channel by channel the highest bytes of all
/// pixels, then the next lower ones.
fn lay_out(
    words: &[[u32; 3]],
    width: usize,
    reference: Option<&[[u32; 3]]>,
    prediction: Prediction,
) -> Vec<u8> {
    let foretold = |i: usize| match prediction.from {
        Source::Left if !i.is_multiple_of(width) => words[i - 1],
        Source::Reference => reference.expect("a reference")[i],
        _ => [0; 3],
    };
    let left_over = (0..words.len()).map(|i| {
        let before = foretold(i);
        let [r, g, b] = std::array::from_fn(|c| words[i][c].wrapping_sub(before[c]));
        let over =
            if prediction.channels { [r, g.wrapping_sub(r), b.wrapping_sub(g)] } else { [r, g, b] };
        let plain = prediction == PREDICTIONS[0];
        if plain { over } else { over.map(fold) }
    });
    let left_over: Vec<[u32; 3]> = left_over.collect();
    let mut bytes = Vec::with_capacity(words.len() * 12);
    for channel in 0..3 {
        for shift in [24, 16, 8, 0] {
            bytes.extend(left_over.iter().map(|w| (w[channel] >> shift) as u8));
        }
    }
    bytes
}

/// Differences near zero, of either sign, as small numbers: 0, −1, 1, −2, …
fn fold(difference: u32) -> u32 {
    (difference << 1) ^ ((difference as i32) >> 31) as u32
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;
    use screendoor_trace::tile::TileGrid;

    fn inflate(text: &str) -> Vec<u8> {
        let bytes = base64::engine::general_purpose::STANDARD.decode(text).unwrap();
        let mut out = Vec::new();
        flate2::read::DeflateDecoder::new(&*bytes).read_to_end(&mut out).unwrap();
        out
    }

    /// What `viewer.js` does.
    fn unpack(
        bytes: &[u8],
        width: usize,
        reference: &[[u32; 3]],
        prediction: Prediction,
    ) -> Vec<[u32; 3]> {
        let count = bytes.len() / 12;
        let mut words = vec![[0_u32; 3]; count];
        for i in 0..count {
            let mut word: [u32; 3] = std::array::from_fn(|c| {
                (0..4).fold(0, |w, p| w << 8 | u32::from(bytes[(c * 4 + p) * count + i]))
            });
            if prediction != PREDICTIONS[0] {
                word = word.map(|w| (w >> 1) ^ (w & 1).wrapping_neg());
            }
            if prediction.channels {
                word[1] = word[1].wrapping_add(word[0]);
                word[2] = word[2].wrapping_add(word[1]);
            }
            let before = match prediction.from {
                Source::Left if !i.is_multiple_of(width) => words[i - 1],
                Source::Reference => reference[i],
                _ => [0; 3],
            };
            words[i] = std::array::from_fn(|c| word[c].wrapping_add(before[c]));
        }
        words
    }

    #[test]
    fn every_bit_survives_every_prediction() {
        let grid = TileGrid::new(19, 5);
        let odd = [0.0, -0.0, 1e-40, -1.5, f64::NAN, f64::INFINITY, 0.1, 1e30];
        let picture = Picture::from_fn(grid, |x, y| {
            [odd[(x + y) as usize % 8], f64::from(x) * 0.37, odd[x as usize % 8] * 0.3]
        });
        let reference = Picture::from_fn(grid, |x, _| [f64::from(x) * 0.36; 3]);
        let (words, beside) = (words(&picture), words(&reference));
        for prediction in PREDICTIONS {
            let bytes = lay_out(&words, 19, Some(&beside), prediction);
            assert_eq!(unpack(&bytes, 19, &beside, prediction), words, "{prediction:?}");
        }
        let packed = pack_picture(&picture, Some(&reference));
        let bytes = inflate(&packed.text);
        assert_eq!(unpack(&bytes, 19, &beside, packed.prediction), words);
    }

    #[test]
    fn what_is_like_the_reference_is_small() {
        let grid = TileGrid::new(64, 64);
        let mut random = screendoor_trace::random::Stream::new([1, 2]);
        let reference =
            Picture::from_fn(grid, |_, _| std::array::from_fn(|_| random.unit().into()));
        let alone = pack_picture(&reference, None);
        let same = pack_picture(&reference, Some(&reference));
        assert_eq!(same.prediction.from, Source::Reference);
        assert!(same.text.len() * 100 < alone.text.len());
    }
}
