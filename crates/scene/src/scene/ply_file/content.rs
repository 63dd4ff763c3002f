//! A PLY file's header, which is the library's to parse, and what it says of the rows.

use std::collections::HashSet;

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{DefaultElement, Encoding};

use super::elements::{Element, Encoded, MAX_NUMBERS, Numbers};
use crate::scene::bytes::Bytes;
use screendoor_trace::error::Result;

/// The longest header that is read, in bytes.
const MAX_HEADER: usize = 1 << 20;
/// What a PLY file holds.
pub(super) struct File<'a> {
    pub(super) elements: Vec<Element<'a>>,
    /// The textures that comments name, as MeshLab writes them.
    pub(super) textures: Vec<&'a str>,
}

impl<'a> File<'a> {
    /// Reads the PLY file that `content` holds.
    pub(super) fn read(place: &'a str, content: &'a [u8]) -> Result<Self> {
        File::within(place, content, MAX_NUMBERS)
    }

    /// The same, where no more than `most` numbers are held.
    fn within(place: &'a str, content: &'a [u8], most: usize) -> Result<Self> {
        let start = &content[..content.len().min(MAX_HEADER)];
        let mut reader = Reader::new(start);
        let header = Parser::<DefaultElement>::new().read_header(&mut reader);
        // `reader` has a part of the file only.
        let read = start.len() - reader.get_ref().len();
        let (text, rows) = content.split_at(read);
        let whole = Bytes::new(place, content);
        let header = header.map_err(|e| match e.line() {
            // Only what begins like a header can be too long a one.
            _ if start.len() < content.len() && start.starts_with(b"ply") && !ends(start) => {
                let hint = "export it with a shorter one";
                whole.unsupported("its PLY header is longer than 1 MiB", hint)
            }
            // The library's own words fill several lines.
            Some(line) => whole.bad(format_args!("line {line} of its PLY header cannot be read")),
            None => whole.bad("its PLY header cannot be read"),
        })?;
        // It was read, and so it is text.
        let text = std::str::from_utf8(text).unwrap_or("");
        check_names(text, &whole)?;
        let textures = text.lines().filter_map(|line| line.strip_prefix("comment TextureFile "));
        let from = match header.encoding {
            Encoding::Ascii => {
                let text = std::str::from_utf8(rows);
                let text = text.map_err(|e| {
                    whole.bad(format_args!("byte {} of it is no text", read + e.valid_up_to()))
                })?;
                Encoded::Text { place, words: text.split_ascii_whitespace() }
            }
            encoding => {
                let mut bytes = Bytes::new(place, content);
                bytes.seek(read as u64)?;
                Encoded::Bytes { bytes, big_endian: encoding == Encoding::BinaryBigEndian }
            }
        };
        let mut numbers = Numbers { from, left: most };
        let elements = header.elements.into_iter();
        let elements = elements
            .map(|(name, definition)| numbers.element(name, definition))
            .collect::<Result<Vec<_>>>()?;
        numbers.end()?;
        Ok(File { elements, textures: textures.map(str::trim).collect() })
    }
}

/// Whether a header ends in these bytes.
fn ends(start: &[u8]) -> bool {
    start.windows(10).any(|bytes| bytes == b"end_header")
}

/// Refuses elements and properties of one name, of which the library keeps the last, so that
/// the others' values would be taken for its own.
fn check_names(header: &str, whole: &Bytes<'_>) -> Result<()> {
    let (mut elements, mut properties) = (HashSet::new(), HashSet::new());
    let mut element = "";
    for line in header.lines() {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match words[..] {
            ["element", name, _] => {
                properties.clear();
                element = name;
                if !elements.insert(name) {
                    return Err(whole.bad(format_args!("it has two elements '{name}'")));
                }
            }
            ["property", .., name] if !properties.insert(name) => {
                let what = format_args!("its element '{element}' has two properties '{name}'");
                return Err(whole.bad(what));
            }
            _ => {}
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_is_held_than_is_allowed() {
        let header = "ply\nformat binary_little_endian 1.0\nelement face 2\n\
                      property list uchar uchar vertex_index\nend_header\n";
        let file = [header.as_bytes(), &[3, 0, 1, 2, 2, 0, 1]].concat();
        // Lengths of lists are held, too.
        let read = File::within("a.ply", &file, 7).unwrap();
        let lists: Vec<&[f64]> = read.elements[0].lists()[0].rows().collect();
        assert_eq!(lists, [&[0.0, 1.0, 2.0][..], &[0.0, 1.0]]);
        let error = File::within("a.ply", &file, 6).err().unwrap().to_string();
        assert!(error.contains("too many numbers") && error.contains("divide it"), "{error}");
        // What lies in the file as it is, is not held.
        let plain = file[..].to_vec();
        let text = String::from_utf8_lossy(&plain[..header.len()]).replace("list uchar ", "");
        let plain = [text.as_bytes(), &[1, 2]].concat();
        assert_eq!(File::within("a.ply", &plain, 0).unwrap().elements[0].count, 2);
    }
}
