//! Decompressing a column.

use arrow_ipc::CompressionType;

/// Decompresses `bytes` to exactly `length` bytes, and never to more.
pub(crate) fn decompress(codec: CompressionType, bytes: &[u8], length: usize) -> Option<Vec<u8>> {
    match codec {
        CompressionType::ZSTD => zstd::bulk::decompress(bytes, length).ok(),
        CompressionType::LZ4_FRAME => plain_lz4(bytes, length).or_else(|| any_lz4(bytes, length)),
        _ => None,
    }
    .filter(|output| output.len() == length)
}

/// An LZ4 frame as Arrow's writers make it, of independent blocks without checksums:
/// block by block into its place. `None` for any other, good or bad.
fn plain_lz4(bytes: &[u8], length: usize) -> Option<Vec<u8>> {
    let (header, mut rest) = bytes.split_first_chunk::<7>()?;
    // The last byte is a checksum of the two before it.
    let largest_block = match header {
        [0x04, 0x22, 0x4d, 0x18, 0x60, 0x40, 0x82] => 1 << 16,
        [0x04, 0x22, 0x4d, 0x18, 0x60, 0x50, 0xfb] => 1 << 18,
        [0x04, 0x22, 0x4d, 0x18, 0x60, 0x60, 0x51] => 1 << 20,
        [0x04, 0x22, 0x4d, 0x18, 0x60, 0x70, 0x73] => 1 << 22,
        _ => return None,
    };
    let mut output = vec![0; length];
    let mut done = 0;
    loop {
        let (size, later) = rest.split_first_chunk::<4>()?;
        let size = u32::from_le_bytes(*size);
        if size == 0 {
            return (later.is_empty() && done == length).then_some(output);
        }
        let stored = size >> 31 == 1;
        let block = (size & (u32::MAX >> 1)) as usize;
        if block > largest_block || block > later.len() {
            return None;
        }
        let (block, later) = later.split_at(block);
        let end = length.min(done + largest_block);
        done += if stored {
            output.get_mut(done..done + block.len())?.copy_from_slice(block);
            block.len()
        } else {
            lz4_flex::block::decompress_into(block, &mut output[done..end]).ok()?
        };
        rest = later;
    }
}

/// Any LZ4 frame, through buffers of the decoder's own.
fn any_lz4(bytes: &[u8], length: usize) -> Option<Vec<u8>> {
    use std::io::Read;
    let mut output = Vec::with_capacity(length);
    let mut decoder = lz4_flex::frame::FrameDecoder::new(bytes).take(length as u64 + 1);
    decoder.read_to_end(&mut output).ok()?;
    Some(output)
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use lz4_flex::frame::{BlockMode, BlockSize, FrameEncoder, FrameInfo};

    use super::*;

    fn bytes(length: usize) -> Vec<u8> {
        (0..length).map(|i| (i / 5 * i / 700) as u8).collect()
    }

    fn frame(info: FrameInfo, bytes: &[u8]) -> Vec<u8> {
        let mut encoder = FrameEncoder::with_frame_info(info, Vec::new());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    #[test]
    fn both_ways_read_the_same() {
        let sizes = [BlockSize::Max64KB, BlockSize::Max256KB, BlockSize::Max1MB, BlockSize::Max4MB];
        for size in sizes {
            for length in [1, 70_000, 300_000] {
                let bytes = bytes(length);
                let plain = frame(FrameInfo::new().block_size(size), &bytes);
                assert!(plain_lz4(&plain, length).as_ref() == Some(&bytes));
                assert!(any_lz4(&plain, length).as_ref() == Some(&bytes));
                assert!(plain_lz4(&plain, length + 1).is_none());
                assert!(plain_lz4(&plain, length - 1).is_none());
            }
        }
        // Random bytes are stored as they are.
        let noise: Vec<u8> = (0..100_000_u64)
            .map(|i| (i.wrapping_mul(i.wrapping_mul(0x9e37_79b9)) >> 13) as u8)
            .collect();
        let plain = frame(FrameInfo::new().block_size(BlockSize::Max64KB), &noise);
        assert!(plain_lz4(&plain, noise.len()).as_ref() == Some(&noise));
    }

    #[test]
    fn other_frames_go_the_long_way() {
        let bytes = bytes(200_000);
        let infos = [
            FrameInfo::new().block_mode(BlockMode::Linked).block_size(BlockSize::Max64KB),
            FrameInfo::new().block_checksums(true),
            FrameInfo::new().content_checksum(true),
        ];
        for info in infos {
            let frame = frame(info, &bytes);
            assert!(plain_lz4(&frame, bytes.len()).is_none());
            let found = decompress(CompressionType::LZ4_FRAME, &frame, bytes.len());
            assert!(found.as_ref() == Some(&bytes));
        }
    }

    #[test]
    fn damage_is_no_panic() {
        let bytes = bytes(3000);
        let good = frame(FrameInfo::new(), &bytes);
        for at in 0..good.len() {
            for flip in [1, 0x80, 0xff] {
                let mut bad = good.clone();
                bad[at] ^= flip;
                let _ = decompress(CompressionType::LZ4_FRAME, &bad, bytes.len());
            }
            let cut = decompress(CompressionType::LZ4_FRAME, &good[..at], bytes.len());
            assert!(cut.is_none_or(|found| found == bytes), "{at}");
        }
    }
}
