//! The document of a glTF or GLB file, checked as far as all of it must be.

use std::borrow::Cow;
use std::path::Path;

use super::extensions::{Treatment, treatment};
use super::json::{Asset, Root};
use screendoor_trace::error::{Error, Result, one_line};

/// The bytes before the first chunk of a GLB file.
const GLB_HEADER: usize = 12;
/// The types of a GLB's chunks.
const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BIN: u32 = u32::from_le_bytes(*b"BIN\0");

/// What says for which glTF a file was made.
#[derive(serde::Deserialize)]
struct Head {
    asset: Asset,
}

/// The document in the bytes of the file at `path`, and a GLB's binary chunk. What its
/// parts name by number is not looked up yet.
///
/// # Errors
/// [`Error::Invalid`] where it is damaged, [`Error::Unsupported`] where it asks
/// for another version or requires an extension that it cannot be drawn without.
pub(super) fn read<'a>(path: &Path, bytes: &'a [u8]) -> Result<(Root, Option<Cow<'a, [u8]>>)> {
    let bad = |what: &dyn std::fmt::Display| {
        let what = format_args!("it cannot be read as glTF: {what}");
        Error::invalid(path.display(), what, "export the file again")
    };
    let (text, blob) = if bytes.starts_with(b"glTF") {
        chunks(bytes).map_err(|what| bad(&what))?
    } else {
        (bytes, None)
    };
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    // Before the rest, which another version may say in another way.
    let head: Head = serde_json::from_slice(text).map_err(|e| bad(&e))?;
    check_version(path, &head.asset)?;
    let root: Root = serde_json::from_slice(text).map_err(|e| bad(&e))?;
    check_required(path, &root)?;
    Ok((root, blob.map(Cow::Borrowed)))
}

/// The JSON of a GLB file, and its binary chunk (glTF 2.0, section 4.4).
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), &'static str> {
    const SHORT: &str = "the header of the GLB is cut off, or claims to be";
    let word = |at: usize| {
        let word = bytes.get(at..at + 4).and_then(|b| b.try_into().ok());
        word.map(u32::from_le_bytes)
    };
    let (version, length) = (word(4).ok_or(SHORT)?, word(8).ok_or(SHORT)? as usize);
    if length < GLB_HEADER {
        return Err(SHORT);
    }
    if version != 2 {
        return Err("the GLB is not of version 2");
    }
    if length > bytes.len() {
        return Err("the GLB is cut off");
    }
    let (mut text, mut blob, mut at) = (None, None, GLB_HEADER);
    while let (Some(size), Some(kind)) = (word(at), word(at + 4))
        && at + 8 <= length
    {
        let end = (at + 8).checked_add(size as usize).filter(|end| *end <= length);
        let chunk = &bytes[at + 8..end.ok_or("a chunk of the GLB is cut off")?];
        match (kind, at) {
            (JSON, GLB_HEADER) => text = Some(chunk),
            (BIN, _) if blob.is_none() => blob = Some(chunk),
            // What extensions add.
            _ => {}
        }
        at += 8 + chunk.len().next_multiple_of(4);
    }
    Ok((text.ok_or("the GLB has no JSON")?, blob))
}

fn check_version(path: &Path, asset: &Asset) -> Result<()> {
    let parts = |text: &str| {
        let (major, minor) = text.split_once('.')?;
        Some((major.parse::<u32>().ok()?, minor.parse::<u32>().ok()?))
    };
    let version = parts(&asset.version).is_some_and(|(major, _)| major == 2);
    let least = asset.min_version.as_deref().is_none_or(|v| parts(v) == Some((2, 0)));
    if version && least {
        return Ok(());
    }
    let wanted = asset.min_version.as_ref().filter(|_| version).unwrap_or(&asset.version);
    let what = format!("it wants glTF {}", shortened(wanted));
    Err(Error::unsupported(path.display(), what, "export it as glTF 2.0"))
}

fn check_required(path: &Path, root: &Root) -> Result<()> {
    for name in &root.extensions_required {
        let treatment = treatment(name);
        if matches!(treatment, Treatment::Packed(_) | Treatment::Unknown(_)) {
            let name = shortened(name);
            let what = format!("it requires {name}, and the extension is not supported");
            return Err(Error::unsupported(path.display(), what, treatment.hint()));
        }
    }
    Ok(())
}

/// The beginning of a text that may be anything, of any length.
pub(super) fn shortened(text: &str) -> String {
    one_line(text.chars().take(60).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
        let mut bytes = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
        for (kind, chunk) in chunks {
            bytes.extend((chunk.len() as u32).to_le_bytes());
            bytes.extend(*kind);
            bytes.extend(*chunk);
        }
        let length = (bytes.len() as u32).to_le_bytes();
        bytes[8..12].copy_from_slice(&length);
        bytes
    }

    #[test]
    fn chunks_of_a_glb() {
        let (json, bin): (&[u8], &[u8]) = (b"{}  ", b"abcd");
        let whole = glb(&[(b"JSON", json), (b"ACME", b"1234"), (b"BIN\0", bin)]);
        assert_eq!(chunks(&whole), Ok((json, Some(bin))));
        assert_eq!(chunks(&glb(&[(b"JSON", json)])), Ok((json, None)));
        assert_eq!(chunks(&glb(&[(b"BIN\0", bin), (b"JSON", json)])), Err("the GLB has no JSON"));
        let mut longer = whole.clone();
        longer[12] = 200;
        assert_eq!(chunks(&longer), Err("a chunk of the GLB is cut off"));
        assert_eq!(chunks(&whole[..whole.len() - 1]), Err("the GLB is cut off"));
    }
}
