//! Writing a trace, fragment by fragment, in bounded memory.

use std::io::Write;
use std::path::Path;

use arrow_ipc::CompressionType;
use arrow_ipc::writer::{FileWriter, IpcWriteOptions};
use arrow_schema::{ArrowError, SchemaRef};

use crate::error::{Error, Result};
use crate::output::OutputFile;
use crate::trace::batch::{BatchBuilder, MAX_BATCH_ROWS, schema};
use crate::trace::columns::ColumnId;
use crate::trace::content::ContentHasher;
use crate::trace::fragment::Fragment;
use crate::trace::header::Header;
use crate::trace::seal::{CHECKSUMS, CHECKSUMS_KIND, SealingWriter};

crate::options! {
    /// How the columns of a trace are stored.
    pub enum Compression {
        None = "none": "as they are: read without a copy",
        Lz4 = "lz4": "LZ4 frames: quick to write",
        Zstd = "zstd": "Zstandard: smallest, reads faster than LZ4",
    }
}

impl Compression {
    /// What files call it.
    pub(super) fn codec(self) -> Option<CompressionType> {
        match self {
            Compression::None => None,
            Compression::Lz4 => Some(CompressionType::LZ4_FRAME),
            Compression::Zstd => Some(CompressionType::ZSTD),
        }
    }
}

/// How a trace is stored; none of it changes the trace's content hash.
#[derive(Clone, Copy, Debug)]
pub struct WriteOptions {
    /// How the columns are stored.
    pub compression: Compression,
    /// Fragments per batch, 1 to [`MAX_BATCH_ROWS`].
    pub batch_rows: usize,
}

impl Default for WriteOptions {
    fn default() -> Self {
        WriteOptions { compression: Compression::None, batch_rows: 1 << 16 }
    }
}

/// Fragments that are added at a time: few enough that all columns find them in the nearest cache.
const NEAR: usize = 256;

/// What a finished writer has written.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Written {
    /// How many fragments.
    pub rows: u64,
    /// The content hash, BLAKE3 in hexadecimal.
    pub content: String,
    /// How many bytes the file's sealed blocks take.
    pub bytes: u64,
}

/// Writes a trace: fragments in, an Arrow IPC file out.
///
/// Memory is bounded by one batch. The file is a trace only after
/// [`TraceWriter::finish`].
pub struct TraceWriter<W: Write> {
    header: Header,
    schema: SchemaRef,
    batch_rows: usize,
    builder: BatchBuilder,
    content: ContentHasher,
    rows: u64,
    file: FileWriter<SealingWriter<W>>,
    place: String,
}

impl TraceWriter<OutputFile> {
    /// Begins the trace that will stand at `path` once [`TraceWriter::finish`]
    /// and [`OutputFile::commit`] have been called.
    ///
    /// # Errors
    /// As [`OutputFile::create`] and [`TraceWriter::new`].
    pub fn create(path: impl AsRef<Path>, header: Header, options: WriteOptions) -> Result<Self> {
        let file = OutputFile::create(&path)?;
        TraceWriter::new(file, &path.as_ref().display().to_string(), header, options)
    }
}

impl<W: Write> TraceWriter<W> {
    /// Begins a trace on `sink`; `place` names it in errors.
    ///
    /// # Errors
    /// [`Error::Config`] for a header or options that break a rule,
    /// [`Error::Io`] where the sink fails.
    pub fn new(sink: W, place: &str, header: Header, options: WriteOptions) -> Result<Self> {
        header.check()?;
        if !(1..=MAX_BATCH_ROWS).contains(&options.batch_rows) {
            return Err(Error::config(
                format_args!("a batch of {} fragments cannot be", options.batch_rows),
                format_args!("it holds 1 to {MAX_BATCH_ROWS}"),
            ));
        }
        let mut schema = schema(&header);
        let marked = std::sync::Arc::make_mut(&mut schema);
        marked.metadata.insert(CHECKSUMS.to_string(), CHECKSUMS_KIND.to_string());
        let ipc = IpcWriteOptions::default()
            .try_with_compression(options.compression.codec())
            .map_err(|e| arrow_error(place, e))?;
        let file = FileWriter::try_new_with_options(SealingWriter::new(sink), &schema, ipc);
        let mut file = file.map_err(|e| arrow_error(place, e))?;
        file.get_mut().end_block(0);
        Ok(TraceWriter {
            builder: BatchBuilder::new(&header)?,
            content: ContentHasher::new(
                &header.to_metadata(),
                ColumnId::ALL.into_iter().filter(|id| header.stores(*id)),
            ),
            header,
            schema,
            batch_rows: options.batch_rows,
            rows: 0,
            file,
            place: place.to_string(),
        })
    }

    /// The header it writes.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Adds one fragment.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a fragment that no trace may hold (it is found when
    /// its batch is full) or that breaks a declared constant, or has a value of an optional column that the
    /// header does not name; [`Error::Io`] where
    /// the sink fails.
    #[inline]
    pub fn push(&mut self, fragment: &Fragment) -> Result<()> {
        if let Err(column) = self.builder.push(fragment) {
            let place = format!("{}, row {}", self.place, self.rows + self.builder.len() as u64);
            let name = column.name();
            return Err(match self.header.has(column) {
                true => Error::invalid(
                    place,
                    format_args!("'{name}' is declared constant and is not"),
                    "declare only columns that are constant",
                ),
                false => Error::invalid(
                    place,
                    format_args!("it has a value of '{name}', which the header does not name"),
                    "name it in the header's optional columns",
                ),
            });
        }
        if self.builder.len() == self.batch_rows {
            self.flush_batch()?;
        }
        Ok(())
    }

    /// Adds fragments, the same as one after the other and in less time.
    ///
    /// # Errors
    /// As [`TraceWriter::push`].
    pub fn push_all(&mut self, mut fragments: &[Fragment]) -> Result<()> {
        while !fragments.is_empty() {
            let room = self.batch_rows - self.builder.len();
            let (now, later) = fragments.split_at(fragments.len().min(room).min(NEAR));
            if !self.builder.extend(now) {
                // One of them cannot be kept: the plain way says which.
                now.iter().try_for_each(|fragment| self.push(fragment))?;
            } else if self.builder.len() == self.batch_rows {
                self.flush_batch()?;
            }
            fragments = later;
        }
        Ok(())
    }

    fn flush_batch(&mut self) -> Result<()> {
        let batch = self.builder.take();
        batch.check(&self.header, &format!("{}, after row {}", self.place, self.rows))?;
        let buffers = batch.buffers();
        let stored = buffers.iter().filter_map(|(id, stored)| {
            let (value_type, bytes) = stored.as_ref()?;
            Some((*id, &bytes.as_slice()[..batch.len() * value_type.bytes()]))
        });
        self.content.update_all(&stored.collect::<Vec<_>>());
        let record_batch = batch.to_record_batch(&self.schema);
        self.file.write(&record_batch).map_err(|e| arrow_error(&self.place, e))?;
        drop(record_batch);
        self.file.get_mut().end_block(batch.len() as u64);
        self.rows += batch.len() as u64;
        self.builder.reuse(batch);
        Ok(())
    }

    /// Writes what is left and the footer; returns the sink and a summary.
    ///
    /// # Errors
    /// As [`TraceWriter::push`].
    pub fn finish(mut self) -> Result<(W, Written)> {
        if self.builder.len() > 0 {
            self.flush_batch()?;
        }
        let content = self.content.finish(self.rows);
        for (key, value) in self.file.get_mut().begin_tail(self.rows, content.clone()) {
            self.file.write_metadata(key, value);
        }
        let sink = self.file.into_inner().map_err(|e| arrow_error(&self.place, e))?;
        let (sink, bytes) = sink.finish().map_err(|e| Error::io("write", &self.place, e))?;
        Ok((sink, Written { rows: self.rows, content, bytes }))
    }
}

/// An error of the Arrow writer; in practice the sink's.
fn arrow_error(place: &str, error: ArrowError) -> Error {
    let source = match error {
        ArrowError::IoError(_, source) => source,
        other => std::io::Error::other(other),
    };
    Error::io("write", place, source)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;
    use crate::trace::{SampleMask, SamplePattern, Scalar};

    fn header() -> Header {
        let pattern = SamplePattern::standard(1).unwrap();
        let mut header = Header { width: 64, height: 64, pattern, ..Header::default() };
        header.constants.insert(ColumnId::Object, Scalar::Unsigned(3));
        header
    }

    fn fragments(count: usize) -> Vec<Fragment> {
        let mut random = Stream::new([7]);
        let mut fragment = || Fragment {
            x: random.below(64) as u16,
            y: random.below(64) as u16,
            coverage: SampleMask::first(1),
            colour: [0.0; 3].map(|_| random.word() as f32 / 1e5),
            alpha: random.word() as f32 / 4.3e9,
            primitive: random.word(),
            object: 3,
            ..Fragment::default()
        };
        (0..count).map(|_| fragment()).collect()
    }

    #[test]
    fn all_at_once_are_the_same_as_one_after_the_other() {
        for (count, batch_rows) in [(0, 5), (1, 1), (1000, 7), (1000, 256), (3000, 700)] {
            let options = WriteOptions { batch_rows, ..WriteOptions::default() };
            let writer = || TraceWriter::new(Vec::new(), "t", header(), options).unwrap();
            let (mut one, mut all) = (writer(), writer());
            let fragments = fragments(count);
            fragments.iter().for_each(|f| one.push(f).unwrap());
            // In parts of all lengths.
            let mut rest = &fragments[..];
            for length in 0.. {
                let (now, later) = rest.split_at(rest.len().min(length));
                all.push_all(now).unwrap();
                rest = later;
                if rest.is_empty() {
                    break;
                }
            }
            let (one, all) = (one.finish().unwrap(), all.finish().unwrap());
            assert_eq!(one.1, all.1);
            assert!(one.0 == all.0, "{count} in batches of {batch_rows}");
        }
    }

    #[test]
    fn what_cannot_be_kept_is_named_by_its_row() {
        let options = WriteOptions::default();
        let writer = || TraceWriter::new(Vec::new(), "t", header(), options).unwrap();
        let mut fragments = fragments(500);
        fragments[300].object = 4;
        let all = writer().push_all(&fragments).unwrap_err().to_string();
        let mut one = writer();
        let each = fragments.iter().try_for_each(|f| one.push(f)).unwrap_err().to_string();
        assert_eq!(all, each);
        assert!(all.contains("row 300"), "{all}");
    }
}
