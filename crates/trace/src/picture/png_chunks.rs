//! The parts of a PNG file that its pixels need.

use std::borrow::Cow;

const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";
/// A chunk's length, type and checksum.
const AROUND: usize = 12;

/// The file without the chunks that say nothing of its pixels: colour profiles and texts are
/// compressed, and decoders unpack them to any size before they reach the first pixel. What
/// is damaged stays as it is, for the decoder to tell.
pub fn necessary_chunks(bytes: &[u8]) -> Cow<'_, [u8]> {
    let mut kept: Vec<&[u8]> = Vec::new();
    let mut rest = bytes;
    if let Some(chunks) = bytes.strip_prefix(SIGNATURE) {
        kept.push(SIGNATURE);
        rest = chunks;
    }
    let mut dropped = false;
    while let (false, Some((length, after))) = (kept.is_empty(), rest.split_first_chunk::<4>()) {
        let length = u32::from_be_bytes(*length) as usize;
        let Some(kind) = after.first_chunk::<4>() else { break };
        let Some((chunk, others)) = rest.split_at_checked(length.saturating_add(AROUND)) else {
            break;
        };
        // A capital first letter: no decoder can do without it. `tRNS` is transparency.
        if kind[0].is_ascii_uppercase() || kind == b"tRNS" {
            kept.push(chunk);
        } else {
            dropped = true;
        }
        rest = others;
    }
    if !dropped {
        return Cow::Borrowed(bytes);
    }
    kept.push(rest);
    Cow::Owned(kept.concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
        [&(data.len() as u32).to_be_bytes()[..], kind, data, b"crc!"].concat()
    }

    #[test]
    fn only_what_pixels_need_is_kept() {
        let [head, profile, alpha, data] =
            [(b"IHDR", "h"), (b"iCCP", "pp"), (b"tRNS", "t"), (b"IDAT", "dd")]
                .map(|(kind, data)| chunk(kind, data.as_bytes()));
        let all = [SIGNATURE, &head, &profile, &alpha, &data].concat();
        let wanted = [SIGNATURE, &head, &alpha, &data].concat();
        assert_eq!(*necessary_chunks(&all), wanted);
        assert!(matches!(necessary_chunks(&wanted), Cow::Borrowed(_)));
        // What is cut off stays.
        let cut = [&all[..], &profile[..7]].concat();
        assert_eq!(*necessary_chunks(&cut), [&wanted[..], &profile[..7]].concat());
        assert_eq!(*necessary_chunks(b"GIF89a"), *b"GIF89a");
    }
}
