//! PLY files of scalars, as far as splats need them.
//!
//! The header is the library's to parse; the rows are read in place, since the
//! library makes a map of each.

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{DefaultElement, Encoding, PropertyType, ScalarType};

use crate::scene::bytes::Bytes;
use screendoor_trace::error::Result;

/// The longest header that is read, in bytes.
const MAX_HEADER: usize = 1 << 20;

/// An element: rows of the same properties.
pub(super) struct Element<'a> {
    pub name: String,
    pub count: usize,
    stride: usize,
    rows: &'a [u8],
    columns: Vec<(String, ScalarType, usize)>,
}

impl Element<'_> {
    /// Where in a row a property of one type stands; `None` where it is not there.
    pub(super) fn column(&self, name: &str, scalar: &ScalarType) -> Option<usize> {
        self.columns.iter().find(|(n, s, _)| n == name && s == scalar).map(|(_, _, at)| *at)
    }

    /// The four bytes at `column` of row `row`.
    pub(super) fn word(&self, row: usize, column: usize) -> [u8; 4] {
        let at = row * self.stride + column;
        self.rows[at..at + 4].try_into().expect("four bytes")
    }
}

/// The elements of the PLY file that `content` holds.
pub(super) fn elements<'a>(place: &'a str, content: &'a [u8]) -> Result<Vec<Element<'a>>> {
    let mut reader = Reader::new(&content[..content.len().min(MAX_HEADER)]);
    let header = Parser::<DefaultElement>::new().read_header(&mut reader);
    // `reader` has a part of the file only.
    let read = content.len().min(MAX_HEADER) - reader.get_ref().len();
    let (_, rows) = content.split_at(read);
    let whole = Bytes::new(place, content);
    let header = header.map_err(|e| match e.line() {
        // The library's own words fill several lines.
        Some(line) => whole.bad(format_args!("line {line} of its PLY header cannot be read")),
        None => whole.bad("its PLY header cannot be read"),
    })?;
    if header.encoding != Encoding::BinaryLittleEndian {
        let what = format_args!("its numbers are stored as {}", header.encoding);
        return Err(whole.unsupported(what, "save it as binary_little_endian"));
    }

    let mut bytes = Bytes::new(place, rows);
    let mut elements = Vec::new();
    for (name, definition) in header.elements {
        let (mut stride, mut columns) = (0, Vec::new());
        for (name, property) in definition.properties {
            let PropertyType::Scalar(scalar) = property.data_type else {
                return Err(no_splats(&whole));
            };
            let size = match scalar {
                ScalarType::Char | ScalarType::UChar => 1,
                ScalarType::Short | ScalarType::UShort => 2,
                ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
                ScalarType::Double => 8,
            };
            columns.push((name, scalar, stride));
            stride += size;
        }
        let count = definition.count;
        let length = count.checked_mul(stride).filter(|length| *length <= bytes.left());
        let Some(length) = length else {
            let (left, what) = (bytes.left(), format!("{count} rows of {stride} bytes"));
            let what = format_args!("its element '{name}' has {what}, and {left} bytes are left");
            return Err(whole.bad(what));
        };
        elements.push(Element { name, count, stride, rows: bytes.take(length)?, columns });
    }
    if bytes.left() > 0 {
        let what = format_args!("it has {} bytes more than its header says", bytes.left());
        return Err(whole.bad(what));
    }
    Ok(elements)
}

/// The error that a PLY file is one of another kind.
pub(super) fn no_splats(bytes: &Bytes) -> screendoor_trace::error::Error {
    bytes.unsupported(
        "it holds no compressed Gaussian splats",
        "save splats as compressed PLY (SuperSplat does), and meshes as .obj or .glb",
    )
}
