//! Files of other formats, told by their first bytes.

use crate::error::{Error, Result};

/// A format: its first bytes, its name, and how a file of it becomes a trace.
struct Format {
    magic: &'static [u8],
    name: &'static str,
    hint: &'static str,
}

const FORMATS: [Format; 8] = [
    Format {
        magic: b"PAR1",
        name: "a Parquet file",
        // A seal does not survive it.
        hint: "convert it: python3 -c \"import pyarrow.parquet as p, pyarrow.feather as f; \
               t = p.read_table('FILE'); m = t.schema.metadata; \
               m.pop(b'screendoor.checksums', 0); \
               f.write_feather(t.replace_schema_metadata(m), 'NEW.arrow')\"",
    },
    Format {
        magic: b"FEA1",
        name: "a Feather file of version 1, which keeps no metadata",
        hint: "write it anew as an Arrow IPC file with the trace's metadata",
    },
    Format { magic: b"\x1f\x8b", name: "compressed (gzip)", hint: "unpack it with gunzip" },
    Format { magic: b"\x28\xb5\x2f\xfd", name: "compressed (zstd)", hint: "unpack it with unzstd" },
    Format { magic: b"\x04\x22\x4d\x18", name: "compressed (lz4)", hint: "unpack it with unlz4" },
    Format { magic: b"\xfd7zXZ", name: "compressed (xz)", hint: "unpack it with unxz" },
    Format { magic: b"BZh", name: "compressed (bzip2)", hint: "unpack it with bunzip2" },
    Format {
        magic: b"PK\x03\x04",
        name: "a ZIP archive",
        hint: "unpack it; an archive of NumPy arrays is written as a trace as \
               docs/TRACE_FORMAT.md shows",
    },
];

/// Refuses a file of a format that is known and not read here.
///
/// # Errors
/// [`Error::Unsupported`] with what to do.
pub(crate) fn refuse_other_formats(file: &[u8], place: &str) -> Result<()> {
    match FORMATS.iter().find(|format| file.starts_with(format.magic)) {
        None => Ok(()),
        Some(Format { name, hint, .. }) => {
            let what = format!("it is {name}, no Arrow IPC file");
            Err(Error::unsupported(place, what, hint))
        }
    }
}
