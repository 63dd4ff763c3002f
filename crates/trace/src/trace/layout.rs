//! The layout of an Arrow IPC file, checked before anything is decoded.
//!
//! Arrow's own reader trusts offsets, lengths and types that a damaged file can
//! get wrong, and may then panic or allocate without bound. Here every number is
//! held against the file's true size and against the trace's schema first; what
//! is left for decoding are byte ranges known to lie in the file and lengths
//! known to fit them. Only the flatbuffer accessors, behind their verifier, are
//! Arrow's.

use std::collections::BTreeMap;
use std::ops::Range;

use arrow_buffer::Buffer;
use arrow_ipc::{
    CompressionType, Endianness, KeyValue, MetadataVersion, root_as_footer, root_as_message,
};

use crate::error::{Error, Result};
use crate::trace::batch::MAX_BATCH_ROWS;
use crate::trace::columns::ColumnId;
use crate::trace::decompress::decompress;
use crate::trace::other::refuse_other_formats;
use crate::trace::seal::damaged;
use crate::trace::stored::{Shape, StoredColumn, StoredColumns};
use crate::trace::stream;

const MAGIC: &[u8; 6] = b"ARROW1";
pub(crate) const CONTINUATION: [u8; 4] = [0xff; 4];
/// The magic at the end and the footer's length before it.
const TAIL_BYTES: usize = MAGIC.len() + 4;
/// Writers pad the head to at most this alignment.
const MAX_ALIGNMENT: usize = 64;

/// What the head and the footer of a file say.
#[derive(Debug)]
pub(crate) struct Layout {
    /// The schema's metadata.
    pub metadata: BTreeMap<String, String>,
    /// The columns that are stored.
    pub columns: StoredColumns,
    /// Where the first record batch begins.
    pub head_end: u64,
    /// The record batches: contiguous from `head_end`.
    pub blocks: Vec<Block>,
    /// The footer's own metadata; `None` for a stream, which has no footer.
    pub footer_metadata: Option<BTreeMap<String, String>>,
}

/// Where one record batch lies in the file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block {
    pub offset: u64,
    pub message_bytes: usize,
    pub body_bytes: usize,
}

impl Block {
    pub(super) fn bytes(&self) -> usize {
        self.message_bytes + self.body_bytes
    }

    pub(super) fn end(&self) -> u64 {
        self.offset + self.bytes() as u64
    }
}

pub(crate) fn not_a_trace(place: &str, what: impl std::fmt::Display) -> Error {
    Error::invalid(place, what, "give a trace written by 'screendoor capture'")
}

impl Layout {
    /// Reads the layout of the file whose bytes are `file`.
    pub(super) fn parse(file: &[u8], place: &str) -> Result<Self> {
        if file.starts_with(&CONTINUATION) {
            return stream::parse(file, place);
        }
        if !file.starts_with(MAGIC) {
            refuse_other_formats(file, place)?;
            return Err(not_a_trace(place, "it is not an Arrow IPC file"));
        }
        if file.len() < 2 * MAX_ALIGNMENT || &file[file.len() - MAGIC.len()..] != MAGIC {
            return Err(damaged(place, "its end is missing (truncated)"));
        }
        let Range { start: footer_start, end: footer_end } = footer_range(file)
            .filter(|range| range.start >= MAGIC.len())
            .ok_or_else(|| damaged(place, "its footer's length does not fit the file"))?;
        let footer = root_as_footer(&file[footer_start..footer_end])
            .map_err(|e| damaged(place, format_args!("its footer cannot be read ({e})")))?;
        check_version(footer.version(), place)?;
        let schema = footer.schema().ok_or_else(|| damaged(place, "its footer has no schema"))?;
        let (metadata, columns) = read_schema(schema, place)?;
        if footer.dictionaries().is_some_and(|d| !d.is_empty()) {
            return Err(not_a_trace(place, "it has dictionary-encoded columns"));
        }

        let (head, head_end) = read_head(file, footer_start, place)?;
        if read_schema(head, place)? != (metadata.clone(), columns.clone()) {
            return Err(damaged(place, "the schemas of its head and its footer differ"));
        }

        let mut blocks = Vec::new();
        let mut end = head_end as u64;
        for (i, block) in footer.recordBatches().iter().flatten().enumerate() {
            let sizes = (
                u64::try_from(block.offset()),
                usize::try_from(block.metaDataLength()),
                usize::try_from(block.bodyLength()),
            );
            let (Ok(offset), Ok(message_bytes), Ok(body_bytes)) = sizes else {
                return Err(damaged(place, format_args!("batch {i} has a negative extent")));
            };
            let limit = footer_start as u64;
            let fits = (message_bytes as u64)
                .checked_add(body_bytes as u64)
                .and_then(|n| offset.checked_add(n))
                .is_some_and(|e| e <= limit);
            if !fits || offset != end || message_bytes < 8 {
                return Err(damaged(
                    place,
                    format_args!("batch {i} does not begin where the one before it ends"),
                ));
            }
            let block = Block { offset, message_bytes, body_bytes };
            end = block.end();
            blocks.push(block);
        }
        // After the last batch stands the end-of-stream marker, or nothing.
        let rest = &file[end as usize..footer_start];
        let marker = [CONTINUATION, [0; 4]].concat();
        if !(rest.is_empty() || rest == [0; 4] || rest == marker) {
            return Err(damaged(place, "there are stray bytes after its last batch"));
        }
        let footer_metadata = Some(key_values(footer.custom_metadata().iter().flatten(), place)?);
        Ok(Layout { metadata, columns, head_end: head_end as u64, blocks, footer_metadata })
    }

    /// Where the last batch ends, or the head where there is none.
    pub(super) fn blocks_end(&self) -> u64 {
        self.blocks.last().map_or(self.head_end, Block::end)
    }
}

/// Where the footer lies in a file, or in its end.
pub(crate) fn footer_range(end: &[u8]) -> Option<Range<usize>> {
    let footer_end = end.len().checked_sub(TAIL_BYTES)?;
    let length = usize::try_from(read_i32(end, footer_end)).ok()?;
    Some(footer_end.checked_sub(length)?..footer_end)
}

/// The schema message at the file's head and the offset at which it ends.
fn read_head<'a>(
    file: &'a [u8],
    limit: usize,
    place: &str,
) -> Result<(arrow_ipc::Schema<'a>, usize)> {
    let bad = || damaged(place, "the schema at its head cannot be read");
    // The magic is padded with zeros to the writer's alignment.
    let start = (8..=MAX_ALIGNMENT)
        .step_by(8)
        .find(|at| file.get(*at..*at + 4) == Some(&CONTINUATION))
        .filter(|at| file[MAGIC.len()..*at].iter().all(|b| *b == 0))
        .ok_or_else(bad)?;
    let (message, end) = read_message(file, start, limit).ok_or_else(bad)?;
    let message = root_as_message(message).map_err(|_| bad())?;
    check_version(message.version(), place)?;
    Ok((message.header_as_schema().ok_or_else(bad)?, end))
}

/// The flatbuffer of the encapsulated message at `start` and where it ends.
pub(crate) fn read_message(file: &[u8], start: usize, limit: usize) -> Option<(&[u8], usize)> {
    if start + 8 > limit || file[start..start + 4] != CONTINUATION {
        return None;
    }
    let length = usize::try_from(read_i32(file, start + 4)).ok()?;
    let end = (start + 8).checked_add(length).filter(|end| *end <= limit)?;
    Some((&file[start + 8..end], end))
}

fn read_i32(bytes: &[u8], at: usize) -> i32 {
    i32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"))
}

pub(crate) fn check_version(version: MetadataVersion, place: &str) -> Result<()> {
    if version == MetadataVersion::V5 || version == MetadataVersion::V4 {
        return Ok(());
    }
    Err(Error::unsupported(
        place,
        format_args!("Arrow metadata version {version:?}"),
        "write it with version 4 or 5 of the Arrow format",
    ))
}

type Schema = (BTreeMap<String, String>, StoredColumns);

pub(crate) fn read_schema(schema: arrow_ipc::Schema<'_>, place: &str) -> Result<Schema> {
    if schema.endianness() != Endianness::Little {
        return Err(Error::unsupported(place, "it is big-endian", "write it little-endian"));
    }
    let metadata = key_values(schema.custom_metadata().iter().flatten(), place)?;
    let columns = StoredColumns::of(schema.fields().iter().flatten(), place)?;
    Ok((metadata, columns))
}

fn key_values<'a>(
    pairs: impl Iterator<Item = KeyValue<'a>>,
    place: &str,
) -> Result<BTreeMap<String, String>> {
    let mut map = BTreeMap::new();
    for pair in pairs {
        let (Some(key), Some(value)) = (pair.key(), pair.value()) else {
            return Err(damaged(place, "its metadata has an entry without key or value"));
        };
        if map.insert(key.to_string(), value.to_string()).is_some() {
            return Err(damaged(place, format_args!("its metadata has '{key}' twice")));
        }
    }
    Ok(map)
}

/// One record batch's message: where its columns' bytes lie within its body.
#[derive(Debug)]
pub(crate) struct BatchLayout {
    pub rows: usize,
    columns: Vec<(StoredColumn, Range<usize>)>,
    pub compression: Option<CompressionType>,
}

impl BatchLayout {
    /// Reads and checks the message of a block, whose bytes are `bytes`, against
    /// the file's `columns`.
    pub(super) fn parse(
        bytes: &[u8],
        block: &Block,
        columns: &StoredColumns,
        place: &str,
    ) -> Result<Self> {
        let bad = |what: &str| damaged(place, what);
        let (message, end) = read_message(bytes, 0, block.message_bytes)
            .ok_or_else(|| bad("its message is cut off"))?;
        if block.message_bytes - end >= MAX_ALIGNMENT {
            return Err(bad("its message is shorter than its block says"));
        }
        let message = root_as_message(message).map_err(|_| bad("its message cannot be read"))?;
        check_version(message.version(), place)?;
        if usize::try_from(message.bodyLength()).ok() != Some(block.body_bytes) {
            return Err(bad("its body's length differs from the footer's"));
        }
        let batch =
            message.header_as_record_batch().ok_or_else(|| bad("it is not a record batch"))?;
        let rows = usize::try_from(batch.length())
            .ok()
            .filter(|rows| *rows <= MAX_BATCH_ROWS)
            .ok_or_else(|| {
                Error::invalid(
                    place,
                    format_args!("it claims {} rows", batch.length()),
                    format_args!("a batch holds at most {MAX_BATCH_ROWS}: write smaller ones"),
                )
            })?;
        let compression = batch.compression().map(|c| c.codec());
        let nodes: Vec<_> = batch.nodes().iter().flatten().collect();
        let buffers: Vec<_> = batch.buffers().iter().flatten().collect();
        let views: Vec<usize> = batch
            .variadicBufferCounts()
            .iter()
            .flatten()
            .map(|count| usize::try_from(count).unwrap_or(usize::MAX))
            .collect();
        let all = &columns.all;
        if nodes.len() != all.nodes
            || views.len() != all.views
            || all.buffer(&views) != Some(buffers.len())
        {
            return Err(bad("it does not have the file's columns"));
        }
        let mut found = Vec::with_capacity(columns.list.len());
        for column in &columns.list {
            let StoredColumn { id, stored, place: Shape { nodes: i, .. } } = *column;
            let name = id.name();
            let bad = |what: &str| bad(&format!("its column '{name}' {what}"));
            if usize::try_from(nodes[i].length()).ok() != Some(rows) {
                return Err(bad("has another length"));
            }
            if nodes[i].null_count() != 0 {
                return Err(Error::invalid(
                    place,
                    format_args!("its column '{name}' has nulls among its values of {stored}"),
                    "fill them when writing, or leave out the rows that have them",
                ));
            }
            // Validity first; no array of a column of ours has other buffers.
            let first = column.place.buffer(&views).expect("no more than all have");
            let buffer = buffers[first + 1];
            let range = usize::try_from(buffer.offset())
                .ok()
                .zip(usize::try_from(buffer.length()).ok())
                .and_then(|(start, n)| Some(start..start.checked_add(n)?))
                .filter(|range| range.end <= block.body_bytes)
                .ok_or_else(|| bad("lies outside the batch"))?;
            if compression.is_none() && range.len() < rows * stored.bytes() {
                return Err(bad("is too short"));
            }
            found.push((*column, range));
        }
        Ok(BatchLayout { rows, columns: found, compression })
    }

    /// The bytes of `column`'s values, decompressed where they are compressed;
    /// `None` where the file does not store it. At least `rows` values long.
    pub(super) fn values(
        &self,
        column: ColumnId,
        block: &Buffer,
        message_bytes: usize,
        place: &str,
    ) -> Result<Option<(StoredColumn, Buffer)>> {
        let Some((found, range)) = self.columns.iter().find(|(c, _)| c.id == column) else {
            return Ok(None);
        };
        let stored = block.slice_with_length(message_bytes + range.start, range.len());
        let wanted = self.rows * found.stored.bytes();
        let bad =
            |what: &str| damaged(place, format_args!("its column '{}' {what}", column.name()));
        let Some(codec) = self.compression.filter(|_| wanted > 0) else {
            return Ok(Some((*found, stored)));
        };
        // A compressed buffer begins with its decompressed length, −1 for a buffer
        // that is stored as it is.
        let length = stored.get(..8).ok_or_else(|| bad("is too short"))?;
        let length = i64::from_le_bytes(length.try_into().expect("eight bytes"));
        let payload = stored.slice(8);
        let values = if length == -1 {
            payload
        } else {
            let fits = usize::try_from(length)
                .is_ok_and(|n| (wanted..wanted + MAX_ALIGNMENT).contains(&n));
            if !fits {
                return Err(bad("claims another length than its rows take"));
            }
            let bytes = decompress(codec, &payload, length as usize)
                .ok_or_else(|| bad("cannot be decompressed"))?;
            Buffer::from_vec(bytes)
        };
        if values.len() < wanted {
            return Err(bad("is too short"));
        }
        Ok(Some((*found, values)))
    }
}
