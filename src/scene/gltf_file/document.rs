//! The document of a glTF or GLB file, checked.

use std::borrow::Cow;
use std::path::Path;

use gltf::json::validation::{Checked, Error as Invalid};
use gltf::{Document, Semantic, json};

use crate::error::{Error, Result, one_line};

/// The bytes before the first chunk of a GLB file.
const GLB_HEADER: usize = 12;

/// What says for which glTF a file was made.
#[derive(serde::Deserialize)]
struct Head {
    asset: Asset,
}

#[derive(serde::Deserialize)]
#[serde(rename_all = "camelCase")]
struct Asset {
    version: String,
    min_version: Option<String>,
}

/// The document in the bytes of the file at `path`, and a GLB's binary chunk.
///
/// The library's own validation runs on a document only after the checks without
/// which it panics.
///
/// # Errors
/// [`Error::Invalid`] where it is damaged, [`Error::Unsupported`] where it asks
/// for another version or an extension that is not known.
pub(super) fn read<'a>(path: &Path, bytes: &'a [u8]) -> Result<(Document, Option<Cow<'a, [u8]>>)> {
    let place = path.display();
    let bad = |what: &dyn std::fmt::Display| {
        let what = format_args!("it cannot be read as glTF: {what}");
        Error::invalid(&place, what, "export the file again")
    };
    let (text, blob) = if bytes.starts_with(b"glTF") {
        let claimed = bytes.get(8..GLB_HEADER).and_then(|b| b.try_into().ok());
        if claimed.is_none_or(|b| (u32::from_le_bytes(b) as usize) < GLB_HEADER) {
            return Err(bad(&"the header of the GLB is cut off, or claims to be"));
        }
        let glb = gltf::Glb::from_slice(bytes).map_err(|e| bad(&e))?;
        (glb.json, glb.bin)
    } else {
        (Cow::Borrowed(bytes), None)
    };
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&text);
    let head: Head = serde_json::from_slice(text).map_err(|e| bad(&e))?;
    check_version(path, &head.asset)?;
    let root: json::Root = serde_json::from_slice(text).map_err(|e| bad(&e))?;
    for (m, mesh) in root.meshes.iter().enumerate() {
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let position = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
            if position.is_some_and(|index| index.value() >= root.accessors.len()) {
                let place = format!("{place}, mesh {m}, primitive {p}");
                let what = "its positions are an accessor that is not there";
                return Err(Error::invalid(place, what, "export the file again"));
            }
        }
    }
    match Document::from_json(root) {
        Ok(document) => Ok((document, blob)),
        Err(gltf::Error::Validation(found)) => Err(explain(path, &found)),
        Err(e) => Err(bad(&e)),
    }
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
    // The version is text of any kind, and any length.
    let wanted: String = wanted.chars().take(20).collect();
    let what = format!("it wants glTF {}", one_line(&wanted));
    Err(Error::unsupported(path.display(), what, "export it as glTF 2.0"))
}

/// The library's findings as an error: the first of them, and how many more.
fn explain(path: &Path, found: &[(json::Path, Invalid)]) -> Error {
    let Some((part, error)) = found.first() else {
        return Error::invalid(path.display(), "it is no valid glTF", "export the file again");
    };
    let place = format!("{}, {}", path.display(), one_line(part.as_str()));
    let what = match error {
        Invalid::IndexOutOfBounds => "it names what is not there",
        Invalid::Invalid => "its value is not one that glTF allows",
        Invalid::Missing => "it is missing",
        Invalid::Oversize => "it is larger than this machine can address",
        Invalid::Unsupported => {
            let hint = "export the file without the extension";
            return Error::unsupported(place, "the extension is not supported", hint);
        }
    };
    let more = match found.len() {
        1 => String::new(),
        n => format!(" (and {} more such findings)", n - 1),
    };
    Error::invalid(place, format_args!("{what}{more}"), "export the file again")
}
