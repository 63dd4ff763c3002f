//! Reading a trace, batch by batch.

use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use arrow_buffer::Buffer;
use bytes::Bytes;
use memmap2::MmapOptions;
use rayon::prelude::*;
use serde::Serialize;

use crate::error::{Error, Result};
use crate::param::Options;
use crate::trace::batch::Batch;
use crate::trace::bins::Kept;
use crate::trace::cells::Source;
use crate::trace::column::ValueType;
use crate::trace::columns::ColumnId;
use crate::trace::content::ContentHasher;
use crate::trace::header::{Header, SPACE};
use crate::trace::layout::{BatchLayout, Block, Layout};
use crate::trace::seal::{CHECKSUMS, CHECKSUMS_KIND, Seal, damaged};
use crate::trace::stored::StoredColumns;
use crate::trace::stored_file::{self, StoredFile};
use crate::trace::write::Compression;

/// A trace that is open for reading. Cloning shares it.
///
/// Opening reads the head and the footer; batches are read and checked when they are
/// asked for, so that memory is bounded by the batches in use. What was checked is a
/// copy: another program that writes to the file meanwhile, or cuts it, causes an error
/// and never a wrong value.
#[derive(Clone, Debug)]
pub struct Trace {
    inner: Arc<Inner>,
}

#[derive(Debug)]
struct Inner {
    place: String,
    storage: Storage,
    header: Header,
    /// The schema's metadata as it is spelt in the file.
    metadata: BTreeMap<String, String>,
    /// How the columns are stored.
    stored: StoredColumns,
    /// As what they are read.
    columns: Vec<(ColumnId, ValueType)>,
    blocks: Vec<Block>,
    block_rows: Vec<u64>,
    rows: u64,
    seal: Option<Seal>,
    /// Whether there is an opaque fragment, once somebody asked.
    opaque: OnceLock<bool>,
    kept: Arc<Kept>,
}

/// What a trace's checksums cover.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Checksums {
    /// There are none: another program wrote it.
    None,
    /// The head and every batch, and what the footer says of them; not all of the
    /// footer's bytes. Seals were so before `screendoor.tail`.
    Batches,
    /// Every byte of the file.
    All,
}

#[derive(Debug)]
enum Storage {
    File(StoredFile),
    Memory(Bytes),
}

impl Storage {
    /// The bytes at `offset`: shared, or read into memory of our own, which no other program
    /// can change after they have been checked.
    fn bytes(&self, place: &str, offset: u64, length: usize) -> Result<Bytes> {
        match self {
            Storage::Memory(bytes) => {
                let start = offset as usize;
                Ok(bytes.slice(start..start + length))
            }
            Storage::File(_) if length == 0 => Ok(Bytes::new()),
            Storage::File(file) => file.bytes(place, offset, length),
        }
    }

    /// The error about a file that was written to since it was opened, where it was.
    fn changed(&self, place: &str) -> Option<Error> {
        match self {
            Storage::Memory(_) => None,
            Storage::File(file) => file.has_changed().then(|| stored_file::changed(place)),
        }
    }
}

impl Trace {
    /// Opens the trace at `path`.
    ///
    /// # Errors
    /// [`Error::Io`] where it cannot be read, [`Error::Invalid`] where it is
    /// damaged or no trace, [`Error::Unsupported`] for a newer format.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path: PathBuf = path.as_ref().to_path_buf();
        let fail = |source| Error::io("read", &path, source);
        let metadata = std::fs::metadata(&path).map_err(fail)?;
        if !metadata.is_file() {
            let why = "it is no regular file; name a trace";
            return Err(fail(io::Error::new(io::ErrorKind::InvalidInput, why)));
        }
        let file = File::open(&path).map_err(fail)?;
        let length = usize::try_from(metadata.len()).map_err(|_| {
            Error::unsupported(path.display(), "the file is too large", "use a 64-bit machine")
        })?;
        let file = StoredFile::new(file, &metadata);
        Self::read(path.display().to_string(), Storage::File(file), length)
    }

    /// Reads the trace whose file's bytes are `bytes`; `place` names it in errors.
    ///
    /// # Errors
    /// As [`Trace::open`].
    pub fn from_bytes(bytes: impl Into<Bytes>, place: &str) -> Result<Self> {
        let bytes = bytes.into();
        let length = bytes.len();
        Self::read(place.to_string(), Storage::Memory(bytes), length)
    }

    fn read(place: String, storage: Storage, length: usize) -> Result<Self> {
        let file = match &storage {
            Storage::Memory(bytes) => bytes.clone(),
            // Only the head and the footer are touched.
            Storage::File(_) if length == 0 => Bytes::new(),
            Storage::File(file) => {
                // SAFETY: the map is read-only and goes before this returns. Another process
                // that changes the file could change bytes behind the slice meanwhile; what
                // of them is kept is copied, and held against the batches when they are read.
                let map = unsafe { MmapOptions::new().len(length).map(file.file()) };
                Bytes::from_owner(map.map_err(|e| Error::io("read", &place, e))?)
            }
        };
        let layout = Layout::parse(&file, &place)?;
        let mut header = Header::from_metadata(&layout.metadata, &place)?;
        let columns = layout.columns.complete(&mut header, &place)?;

        let seal = match layout.metadata.get(CHECKSUMS).map(String::as_str) {
            Some(CHECKSUMS_KIND) => {
                let entries = layout.footer_metadata.as_ref().filter(|map| Seal::is_in(map));
                let Some(entries) = entries else {
                    return Err(Error::invalid(
                        &place,
                        "it is damaged: it says that it is sealed and has no seal",
                        format_args!(
                            "restore a copy; where another program wrote it anew on purpose, \
                             let it leave the metadata '{CHECKSUMS}' out"
                        ),
                    ));
                };
                let seal = Seal::from_metadata(entries, &place)?;
                let ends =
                    std::iter::once(layout.head_end).chain(layout.blocks.iter().map(Block::end));
                if !ends.eq(seal.blocks.iter().map(|b| b.end)) {
                    return Err(damaged(&place, "its batches do not lie where its seal says"));
                }
                let head = &file[..layout.head_end as usize];
                check_crc(head, seal.blocks[0].crc, &format!("{place}, head"))?;
                seal.check_tail(&file[layout.blocks_end() as usize..], &place)?;
                Some(seal)
            }
            Some(other) => {
                return Err(Error::unsupported(
                    &place,
                    format_args!("checksums of kind '{other}' are unknown"),
                    format_args!("write the file with {CHECKSUMS}={CHECKSUMS_KIND} or without"),
                ));
            }
            None => None,
        };
        let block_rows = match &seal {
            Some(seal) => seal.blocks[1..].iter().map(|b| b.rows).collect(),
            // Another program's file: the batches' own messages say.
            None => {
                let mut rows = Vec::with_capacity(layout.blocks.len());
                for (i, block) in layout.blocks.iter().enumerate() {
                    let bytes = &file[block.offset as usize..][..block.message_bytes];
                    let place = batch_place(&place, i, block);
                    rows.push(
                        BatchLayout::parse(bytes, block, &layout.columns, &place)?.rows as u64,
                    );
                }
                rows
            }
        };
        let rows = block_rows.iter().sum();
        let inner = Inner {
            place,
            storage,
            header,
            metadata: layout.metadata,
            stored: layout.columns,
            columns,
            blocks: layout.blocks,
            block_rows,
            rows,
            seal,
            opaque: OnceLock::new(),
            kept: Arc::default(),
        };
        Ok(Trace { inner: Arc::new(inner) })
    }

    /// What the trace says about itself.
    pub fn header(&self) -> &Header {
        &self.inner.header
    }

    /// The file's name, or the name given to [`Trace::from_bytes`].
    pub fn place(&self) -> &str {
        &self.inner.place
    }

    /// The columns that are stored, in the file's order, and the types as which they are
    /// read; the others are constant, or optional and absent.
    pub fn columns(&self) -> &[(ColumnId, ValueType)] {
        &self.inner.columns
    }

    /// How many fragments it holds.
    pub fn rows(&self) -> u64 {
        self.inner.rows
    }

    /// Whether its blocks carry checksums; only files of other programs do not.
    pub fn is_sealed(&self) -> bool {
        self.inner.seal.is_some()
    }

    /// What its checksums cover.
    pub fn checksums(&self) -> Checksums {
        match &self.inner.seal {
            None => Checksums::None,
            Some(Seal { tail: None, .. }) => Checksums::Batches,
            Some(Seal { tail: Some(_), .. }) => Checksums::All,
        }
    }

    /// Name and type of the columns that no trace has: they are passed over.
    pub fn extra_columns(&self) -> &[(String, String)] {
        &self.inner.stored.extra
    }

    /// The keys of its metadata that are not the format's, but other programs' or a later
    /// version's.
    pub fn extra_metadata(&self) -> impl Iterator<Item = &str> {
        let own = self.inner.header.to_metadata();
        let keys = self.inner.metadata.keys().map(String::as_str);
        // What is meant where it is not said may be said.
        keys.filter(move |key| ![CHECKSUMS, SPACE].contains(key) && !own.contains_key(*key))
    }

    /// The columns that are stored in another type than they are read as: name, the type in
    /// the file, the type read.
    pub fn converted_columns(&self) -> impl Iterator<Item = (&'static str, String, ValueType)> {
        let pairs = self.inner.stored.list.iter().zip(&self.inner.columns);
        pairs
            .filter(|(column, (_, read))| !column.is(*read))
            .map(|(column, (id, read))| (id.name(), column.stored.to_string(), *read))
    }

    /// The content hash that it was written with; `None` where it is not sealed.
    pub fn content(&self) -> Option<&str> {
        self.inner.seal.as_ref().map(|s| s.content.as_str())
    }

    /// Bytes of a fragment's stored columns, before compression, as they are read.
    pub fn bytes_per_row(&self) -> u64 {
        self.columns().iter().map(|(_, value_type)| value_type.bytes() as u64).sum()
    }

    /// How many batches it holds.
    pub fn batch_count(&self) -> usize {
        self.inner.blocks.len()
    }

    /// How many fragments batch `i` holds.
    ///
    /// # Panics
    /// Where `i` is not below [`Trace::batch_count`].
    pub fn batch_rows(&self, i: usize) -> u64 {
        self.inner.block_rows[i]
    }

    /// Batch `i`: its checksum is checked, then its structure, then its values.
    ///
    /// # Errors
    /// [`Error::Invalid`] where any of it is damaged, [`Error::Io`] where it
    /// cannot be read.
    ///
    /// # Panics
    /// Where `i` is not below [`Trace::batch_count`].
    pub fn batch(&self, i: usize) -> Result<Batch> {
        self.read_batch(i, |_, _| ())
    }

    /// As [`Trace::batch`]; `stored` is told each stored column's bytes, as they are in the
    /// file once decompressed.
    fn read_batch(&self, i: usize, mut stored: impl FnMut(ColumnId, &[u8])) -> Result<Batch> {
        let inner = &*self.inner;
        let (layout, bytes, place) = self.stored_batch(i)?;
        let message_bytes = inner.blocks[i].message_bytes;
        let bytes = Buffer::from(bytes);
        let batch = Batch::assemble(layout.rows, |id| {
            let values = layout.values(id, &bytes, message_bytes, &place)?;
            let read = inner.columns.iter().find(|(column, _)| *column == id);
            Ok(match values.zip(read) {
                Some(((column, values), (_, value_type))) => {
                    stored(id, &values[..layout.rows * column.stored.bytes()]);
                    let values = column.convert(*value_type, values, layout.rows, &place)?;
                    Some(Source::Bytes(*value_type, values))
                }
                // An optional column is neither, where the trace lacks it.
                None => inner.header.constants.get(&id).copied().map(Source::Constant),
            })
        })?;
        batch.check(&inner.header, &place)?;
        Ok(batch)
    }

    /// Batch `i` as it is in the file, its checksum and structure checked: what its message says,
    /// its bytes, and where it is.
    fn stored_batch(&self, i: usize) -> Result<(BatchLayout, Bytes, String)> {
        let inner = &*self.inner;
        let block = &inner.blocks[i];
        let place = batch_place(&inner.place, i, block);
        let bytes = inner.storage.bytes(&inner.place, block.offset, block.bytes())?;
        match &inner.seal {
            Some(seal) => check_crc(&bytes, seal.blocks[i + 1].crc, &place)
                .map_err(|damage| inner.storage.changed(&inner.place).unwrap_or(damage))?,
            // Nothing else would tell.
            None => inner.storage.changed(&inner.place).map_or(Ok(()), Err)?,
        }
        let layout = BatchLayout::parse(&bytes, block, &inner.stored, &place)?;
        if layout.rows as u64 != inner.block_rows[i] {
            return Err(damaged(&place, "its row count differs from the seal's"));
        }
        Ok((layout, bytes, place))
    }

    /// How its columns are stored: as those of its first batch are.
    ///
    /// # Errors
    /// As [`Trace::batch`].
    pub fn compression(&self) -> Result<Compression> {
        if self.batch_count() == 0 {
            return Ok(Compression::None);
        }
        let codec = self.stored_batch(0)?.0.compression;
        let known = Compression::ALL.iter().copied().find(|known| known.codec() == codec);
        Ok(known.unwrap_or(Compression::None))
    }

    /// Where its bins are kept.
    pub(super) fn kept(&self) -> &Arc<Kept> {
        &self.inner.kept
    }

    /// Refuses a file that was written to since it was opened.
    pub(super) fn check_unchanged(&self) -> Result<()> {
        self.inner.storage.changed(&self.inner.place).map_or(Ok(()), Err)
    }

    /// All batches in order.
    pub fn batches(&self) -> impl Iterator<Item = Result<Batch>> + '_ {
        (0..self.batch_count()).map(|i| self.batch(i))
    }

    /// Whether any fragment is opaque: has an alpha of 1. Found once, in a pass that ends at
    /// the first such batch; where alpha is constant, in none.
    ///
    /// # Errors
    /// As [`Trace::batch`].
    pub fn has_opaque(&self) -> Result<bool> {
        if let Some(known) = self.inner.opaque.get() {
            return Ok(*known);
        }
        let has = match self.inner.header.constants.get(&ColumnId::Alpha) {
            Some(_) if self.rows() == 0 => false,
            Some(_) => self.batch(0)?.has_opaque(),
            // In parallel, as it may be all that reads the trace before it is drawn.
            None => (0..self.batch_count())
                .into_par_iter()
                .map(|i| Ok(self.batch(i)?.has_opaque()))
                .find_first(|found| !matches!(found, Ok(false)))
                .unwrap_or(Ok(false))?,
        };
        Ok(*self.inner.opaque.get_or_init(|| has))
    }

    /// Reads the whole trace and compares its content with the hash it was
    /// written with. Returns the hash.
    ///
    /// # Errors
    /// As [`Trace::batch`]; [`Error::Invalid`] where the hashes differ.
    pub fn verify(&self, mut progress: impl FnMut(u64)) -> Result<String> {
        let columns = self.inner.columns.iter().map(|(id, _)| *id);
        let mut hasher = ContentHasher::new(&self.inner.metadata, columns);
        for i in 0..self.batch_count() {
            let batch = self.read_batch(i, |id, values| hasher.update(id, values))?;
            progress(batch.len() as u64);
        }
        let hash = hasher.finish(self.rows());
        match self.content() {
            Some(written) if written != hash => Err(damaged(
                self.place(),
                format_args!("its content's hash is {hash} and was {written} when written"),
            )),
            _ => Ok(hash),
        }
    }
}

fn batch_place(place: &str, i: usize, block: &Block) -> String {
    format!("{place}, batch {i} (bytes {}..{})", block.offset, block.end())
}

fn check_crc(bytes: &[u8], stored: u32, place: &str) -> Result<()> {
    let found = crc32fast::hash(bytes);
    if found == stored {
        return Ok(());
    }
    let what =
        format_args!("its checksum is {found:08x} and was {stored:08x} when written").to_string();
    Err(damaged(place, what))
}
