//! Values as OpenVDB packs them: with zlib, or as Blosc chunks.
//!
//! A block's length when unpacked is known before it is unpacked, and no more is
//! allocated, whatever the block claims. The formats: OpenVDB 11,
//! `openvdb/io/Compression.h`; C-Blosc 1.21, `README_CHUNK_FORMAT.rst`.

use flate2::{Decompress, FlushDecompress, Status};

use crate::scene::bytes::Bytes;
use screendoor_trace::error::Result;

/// How a grid's blocks are packed: OpenVDB's own flags.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Packing(u32);

impl Packing {
    const ZIP: u32 = 1;
    const ACTIVE_MASK: u32 = 2;
    const BLOSC: u32 = 4;

    /// `None` for flags that are not known.
    pub(super) fn from_flags(flags: u32) -> Option<Self> {
        (flags & !(Self::ZIP | Self::ACTIVE_MASK | Self::BLOSC) == 0).then_some(Packing(flags))
    }

    /// Whether only active values are stored.
    pub(super) fn active_only(self) -> bool {
        self.0 & Self::ACTIVE_MASK != 0
    }

    /// Reads a block of `length` bytes.
    pub(super) fn read(self, bytes: &mut Bytes, length: usize) -> Result<Vec<u8>> {
        if self.0 & (Self::BLOSC | Self::ZIP) == 0 {
            return Ok(bytes.take(length)?.to_vec());
        }
        let at = bytes.at();
        // How many bytes it takes; negative where they are not packed.
        let stored = bytes.i64()?;
        let Ok(count) = usize::try_from(stored.unsigned_abs()) else {
            return Err(bytes.bad(format_args!("its block at byte {at} claims {stored} bytes")));
        };
        let block = bytes.take(count)?;
        let unpacked = if stored <= 0 {
            (count == length).then(|| block.to_vec()).ok_or("it has another length")
        } else if self.0 & Self::BLOSC != 0 {
            blosc(block, length)
        } else {
            zip(block, length)
        };
        unpacked.map_err(|why| {
            bytes.bad(format_args!("its block at byte {at} cannot be unpacked ({why})"))
        })
    }
}

/// Why a block cannot be unpacked.
type Why = &'static str;

fn zip(block: &[u8], length: usize) -> Result<Vec<u8>, Why> {
    let mut unpacked = vec![0; length];
    let mut zlib = Decompress::new(true);
    match zlib.decompress(block, &mut unpacked, FlushDecompress::Finish) {
        Ok(Status::StreamEnd) if zlib.total_out() == length as u64 => Ok(unpacked),
        Ok(_) => Err("it has another length"),
        Err(_) => Err("it is no zlib stream"),
    }
}

/// Flags of a Blosc chunk: its bytes are shuffled, it is a plain copy, its bits are
/// shuffled, its blocks are not split.
const SHUFFLED: u8 = 1;
const COPY: u8 = 2;
const BITS_SHUFFLED: u8 = 4;
const WHOLE: u8 = 16;
/// Only blocks of elements of at most so many bytes are split, and only where each
/// part is as long at least.
const MAX_SPLITS: usize = 16;
const LEAST_SPLIT: usize = 128;
const HEADER: usize = 16;

fn blosc(chunk: &[u8], length: usize) -> Result<Vec<u8>, Why> {
    const SHORT: Why = "its Blosc chunk is cut off";
    let word = |at: usize| -> Result<usize, Why> {
        let bytes = at.checked_add(4).and_then(|end| chunk.get(at..end)).ok_or(SHORT)?;
        Ok(u32::from_le_bytes(bytes.try_into().expect("four bytes")) as usize)
    };
    let part = |at: usize, length: usize| {
        at.checked_add(length).and_then(|end| chunk.get(at..end)).ok_or(SHORT)
    };
    let [_, _, flags, element, ..] = *part(0, HEADER)? else { return Err(SHORT) };
    let (element, block) = (usize::from(element), word(8)?);
    if word(4)? != length || word(12)? != chunk.len() {
        return Err("its Blosc chunk has another length");
    }
    if flags & COPY != 0 {
        return Ok(part(HEADER, length)?.to_vec());
    }
    // 1 is LZ4, which is all that OpenVDB writes.
    if flags >> 5 != 1 || flags & BITS_SHUFFLED != 0 {
        return Err("its Blosc chunk is not of LZ4");
    }
    if block == 0 || element == 0 {
        return Err("its Blosc chunk has blocks of nothing");
    }
    let mut unpacked = vec![0; length];
    for (i, out) in unpacked.chunks_mut(block).enumerate() {
        // A last block that is shorter is never split.
        let split = flags & WHOLE == 0
            && element <= MAX_SPLITS
            && block / element >= LEAST_SPLIT
            && out.len() == block
            && block.is_multiple_of(element);
        let pieces = if split { element } else { 1 };
        let mut at = word(HEADER + 4 * i)?;
        for piece in out.chunks_mut(block.min(length) / pieces) {
            let packed = part(at.saturating_add(4), word(at)?)?;
            at += 4 + packed.len();
            if packed.len() == piece.len() {
                piece.copy_from_slice(packed);
            } else if lz4_flex::block::decompress_into(packed, piece).ok() != Some(piece.len()) {
                return Err("its LZ4 data is damaged");
            }
        }
        if flags & SHUFFLED != 0 && element > 1 {
            unshuffle(out, element);
        }
    }
    Ok(unpacked)
}

/// Puts the bytes of each element together again: stored are all first bytes, then
/// all second ones, and so on; what makes no whole element stands as it is.
fn unshuffle(bytes: &mut [u8], element: usize) {
    let shuffled = bytes.to_vec();
    let count = bytes.len() / element;
    for (i, whole) in bytes.chunks_exact_mut(element).enumerate() {
        for (k, byte) in whole.iter_mut().enumerate() {
            *byte = shuffled[k * count + i];
        }
    }
}
