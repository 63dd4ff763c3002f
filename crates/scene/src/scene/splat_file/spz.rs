//! Niantic's SPZ, versions 1 to 4: a header, then for all splats one array after the other,
//! of positions, alphas, colours, scales, rotations and harmonics. All of it is one gzip
//! stream, or from version 4 on each array a Zstandard frame of its own.
//!
//! The format: `nianticlabs/spz`, `load-spz.cc`.

use std::io::{self, Read};

use flate2::bufread::GzDecoder;
use half::f16;
use zstd::stream::read::Decoder;

use super::{Cloud, Stored};
use crate::scene::bytes::Bytes;
use screendoor_trace::error::Result;

const MAGIC: &[u8] = b"NGSP";
const GZIP: &[u8] = &[0x1f, 0x8b];
/// Coordinates are divided by this scale of colours to become the constant's coefficients.
const COLOUR_SCALE: f64 = 0.15;
/// The most splats that are read.
const MAX_SPLATS: usize = 1 << 26;
/// The most bytes of extension records, which are skipped.
const MAX_EXTENSIONS: u64 = 1 << 26;
/// Flags of the header.
const ANTIALIASED: u8 = 1;
const EXTENDED: u8 = 2;

/// What the header says.
struct Head {
    version: u32,
    splats: usize,
    degree: u32,
    /// Binary digits after the point of positions.
    fraction: u8,
    flags: u8,
}

impl Head {
    /// Reads what all versions begin with; a byte follows whose meaning they differ in. `length`
    /// is the file's.
    fn read(bytes: &mut Bytes<'_>, length: usize) -> Result<Self> {
        if bytes.left() < 16 || bytes.take(4)? != MAGIC {
            return Err(bytes.bad("it is no SPZ file: it does not begin with 'NGSP'"));
        }
        let (version, splats) = (bytes.u32()?, bytes.u32()? as usize);
        let (degree, fraction, flags) = (u32::from(bytes.u8()?), bytes.u8()?, bytes.u8()?);
        if !(1..=4).contains(&version) {
            let what = format_args!("it is of SPZ version {version}, and 1 to 4 are read");
            return Err(bytes.unsupported(what, "save it as version 4"));
        }
        let most = if version < 4 { 3 } else { 4 };
        if degree > most {
            let what =
                format_args!("its harmonics have the degree {degree}, and {most} is the most");
            return Err(bytes.bad(what));
        }
        if fraction > 24 {
            let what = format_args!("its positions have {fraction} of 24 bits after the point");
            return Err(bytes.bad(what));
        }
        // No packing makes less of a splat than a byte, and files of few bytes claim much.
        if splats > MAX_SPLATS || splats > length {
            let what = format_args!("it claims {splats} splats in {length} bytes");
            return Err(bytes.bad(what));
        }
        Ok(Head { version, splats, degree, fraction, flags })
    }

    fn coefficients(&self) -> usize {
        ((self.degree + 1) * (self.degree + 1) - 1) as usize
    }

    /// Bytes of a splat in each array.
    fn sizes(&self) -> [usize; 6] {
        let position = if self.version == 1 { 6 } else { 9 };
        let rotation = if self.version < 3 { 3 } else { 4 };
        [position, 1, 3, 3, rotation, 3 * self.coefficients()]
    }
}

/// The splats of the file with these bytes.
pub(in crate::scene) fn cloud(place: &str, content: &[u8]) -> Result<Cloud> {
    let file = Bytes::new(place, content);
    if !content.starts_with(GZIP) {
        let mut bytes = Bytes::new(place, content);
        let head = Head::read(&mut bytes, content.len())?;
        if head.version < 4 {
            let what = format_args!("it is of version {} and not compressed by gzip", head.version);
            return Err(file.unsupported(what, "compress it (gzip), or save it as version 4"));
        }
        return streams(&head, bytes);
    }
    let mut unpacked = GzDecoder::new(content);
    let mut start = [0; 16];
    let fail = |e| file.bad(format_args!("it cannot be decompressed: {e}"));
    unpacked.read_exact(&mut start).map_err(fail)?;
    let head = Head::read(&mut Bytes::new(place, &start), content.len())?;
    if head.version == 4 {
        return Err(file.bad("it is of version 4 within a gzip stream"));
    }
    let length = head.splats * head.sizes().iter().sum::<usize>();
    let mut body = Vec::new();
    unpacked.by_ref().take(length as u64).read_to_end(&mut body).map_err(fail)?;
    if body.len() < length {
        let (splats, has) = (head.splats, body.len());
        let what = format_args!("its {splats} splats take {length} bytes, and it has {has}");
        return Err(file.bad(what));
    }
    // Extension records follow, if the header says so; nothing else does.
    let more = io::copy(&mut unpacked.by_ref().take(MAX_EXTENSIONS + 1), &mut io::sink());
    let more = more.map_err(fail)?;
    if more > 0 && head.flags & EXTENDED == 0 {
        return Err(file.bad("it goes on after its last array"));
    }
    if more > MAX_EXTENSIONS {
        let what = "its extension records take more than 64 MiB";
        return Err(file.unsupported(what, "save it without them"));
    }
    let after = unpacked.into_inner().len();
    if after > 0 {
        return Err(file.bad(format_args!("it has {after} bytes after its gzip stream")));
    }
    let mut rest = &body[..];
    let arrays = head.sizes().map(|size| {
        let (array, behind) = rest.split_at(size * head.splats);
        rest = behind;
        array
    });
    Ok(splats(place, &head, arrays))
}

/// The splats of a file of version 4 whose header is read but for its end.
fn streams(head: &Head, mut bytes: Bytes<'_>) -> Result<Cloud> {
    let count = usize::from(bytes.u8()?);
    let table = bytes.u32()?;
    bytes.seek(u64::from(table))?;
    let sizes = head.sizes().map(|size| size * head.splats);
    // What is empty has no stream.
    let wanted = sizes.iter().filter(|size| **size > 0).count();
    if count != wanted {
        let what = format_args!("it has {count} arrays, and its splats need {wanted}");
        return Err(bytes.bad(what));
    }
    let mut lengths = Vec::with_capacity(count);
    for size in sizes.iter().filter(|size| **size > 0) {
        let (packed, whole) = (bytes.u64()?, bytes.u64()?);
        if whole != *size as u64 {
            let what = format_args!("an array of it has {whole} bytes and needs {size}");
            return Err(bytes.bad(what));
        }
        lengths.push(packed);
    }
    let mut lengths = lengths.into_iter();
    let mut arrays: [Vec<u8>; 6] = Default::default();
    for (array, size) in arrays.iter_mut().zip(sizes).filter(|(_, size)| *size > 0) {
        let length = lengths.next().expect("one for each that is not empty");
        let packed = bytes.take(usize::try_from(length).unwrap_or(usize::MAX))?;
        let fail = |e| bytes.bad(format_args!("an array of it cannot be decompressed: {e}"));
        let decoder = Decoder::with_buffer(packed).map_err(fail)?;
        decoder.take(size as u64 + 1).read_to_end(array).map_err(fail)?;
        if array.len() != size {
            let found = if array.len() > size { "more" } else { "fewer" };
            return Err(bytes.bad(format_args!("an array of it has {found} bytes than {size}")));
        }
    }
    if bytes.left() > 0 {
        let what = format_args!("it has {} bytes after its last array", bytes.left());
        return Err(bytes.bad(what));
    }
    Ok(splats(bytes.place(), head, arrays.each_ref().map(Vec::as_slice)))
}

/// The splats of whole arrays.
fn splats(place: &str, head: &Head, arrays: [&[u8]; 6]) -> Cloud {
    let mut cloud = Cloud::new(place, head.degree, head.splats);
    let sizes = head.sizes();
    let mut harmonics = Vec::new();
    for i in 0..head.splats {
        let [position, alpha, colour, scale, rotation, rest] =
            [0, 1, 2, 3, 4, 5].map(|k| &arrays[k][i * sizes[k]..(i + 1) * sizes[k]]);
        let three = |of: &[u8]| [of[0], of[1], of[2]].map(f64::from);
        harmonics.clear();
        harmonics.push(three(colour).map(|c| ((c / 255.0 - 0.5) / COLOUR_SCALE) as f32));
        let signed = |b: &u8| (f32::from(*b) - 128.0) / 128.0;
        harmonics.extend(rest.chunks_exact(3).map(|c| [0, 1, 2].map(|k| signed(&c[k]))));
        let splat = Stored {
            mean: std::array::from_fn(|axis| coordinate(head, position, axis)),
            scale: three(scale).map(|s| libm::exp(s / 16.0 - 10.0)),
            rotation: match rotation {
                [x, y, z] => first_three([*x, *y, *z]),
                _ => smallest_three(u32::from_le_bytes(
                    rotation.try_into().expect("four bytes from version 3 on"),
                )),
            },
            opacity: f64::from(alpha[0]) / 255.0,
        };
        cloud.push(&splat, &harmonics);
    }
    if head.flags & EXTENDED != 0 {
        cloud.tell("its extension records are not read");
    }
    if head.flags & ANTIALIASED != 0 { cloud.antialiased() } else { cloud }
}

/// A coordinate: half precision in version 1, else 24 bits with a sign.
fn coordinate(head: &Head, position: &[u8], axis: usize) -> f64 {
    let size = position.len() / 3;
    match &position[axis * size..(axis + 1) * size] {
        [a, b] => f64::from(f16::from_le_bytes([*a, *b])),
        [a, b, c] => {
            // Into the upper bits, so that the sign goes along.
            let whole = i32::from_le_bytes([0, *a, *b, *c]) >> 8;
            f64::from(whole) / f64::from(1_u32 << head.fraction)
        }
        _ => unreachable!("two or three bytes"),
    }
}

/// A quaternion of which x, y and z are stored, and w is not negative.
fn first_three(stored: [u8; 3]) -> [f64; 4] {
    let [x, y, z] = stored.map(|b| f64::from(b) / 127.5 - 1.0);
    [(1.0 - (x * x + y * y + z * z)).max(0.0).sqrt(), x, y, z]
}

/// A quaternion whose greatest part, positive, is left out: two bits say which of x, y, z, w,
/// then follow the others from the lowest bits on, the last one first, in nine bits and a sign.
fn smallest_three(stored: u32) -> [f64; 4] {
    let greatest = (stored >> 30) as usize;
    let mut parts = [0.0; 4];
    let mut left = stored;
    let mut square = 0.0;
    for part in (0..4).rev().filter(|part| *part != greatest) {
        let magnitude = f64::from(left & 0x1ff) / 511.0 * std::f64::consts::FRAC_1_SQRT_2;
        let value = if left & 0x200 != 0 { -magnitude } else { magnitude };
        parts[part] = value;
        square += value * value;
        left >>= 10;
    }
    parts[greatest] = (1.0 - square).max(0.0).sqrt();
    let [x, y, z, w] = parts;
    [w, x, y, z]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_are_unpacked() {
        // Next to no turn: 127 and 128 lie around 0.
        let [w, x, y, z] = first_three([128, 127, 128]);
        assert!(w > 0.9999 && [x, y, z].iter().all(|v| v.abs() < 0.005));
        // The greatest is w, x is a half, y is minus a half, z is 0.
        let half = (0.5 * std::f64::consts::SQRT_2 * 511.0) as u32;
        let packed = 3 << 30 | half << 20 | (half | 0x200) << 10;
        let turned = smallest_three(packed);
        let wanted = [0.5_f64.sqrt(), 0.5, -0.5, 0.0];
        assert!(turned.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 2e-3), "{turned:?}");
        // Parts beyond what fits into a unit quaternion, as in a damaged file.
        assert!(smallest_three(0x3fff_ffff).iter().all(|v| v.is_finite()));
    }

    #[test]
    fn coordinates_have_their_sign() {
        let head = Head { version: 2, splats: 1, degree: 0, fraction: 12, flags: 0 };
        let position = [0, 0x10, 0, 0xff, 0xff, 0xff, 0, 0xf0, 0xff];
        let found = [0, 1, 2].map(|axis| coordinate(&head, &position, axis));
        assert_eq!(found, [1.0, -1.0 / 4096.0, -1.0]);
    }
}
