//! The content hash: what a trace says, however it is stored.

use crate::trace::batch::Batch;
use crate::trace::column::ColumnId;
use crate::trace::header::Header;

/// Hashes a trace's content as its batches pass: BLAKE3 over the header's
/// entries and over the BLAKE3 of each stored column's little-endian bytes. The
/// same fragments give the same hash in batches of any size and under any
/// compression.
#[derive(Debug)]
pub(crate) struct ContentHasher {
    header: blake3::Hasher,
    columns: Vec<(ColumnId, blake3::Hasher)>,
}

impl ContentHasher {
    pub fn new(header: &Header) -> Self {
        let mut entries = blake3::Hasher::new();
        for (key, value) in header.to_metadata() {
            entries.update(format!("{key}={value}\n").as_bytes());
        }
        let columns = ColumnId::ALL
            .into_iter()
            .filter(|id| !header.constants.contains_key(id))
            .map(|id| (id, blake3::Hasher::new()))
            .collect();
        ContentHasher { header: entries, columns }
    }

    pub fn update(&mut self, batch: &Batch) {
        let buffers = batch.buffers();
        for (id, hasher) in &mut self.columns {
            if let Some((value_type, bytes)) = buffers[*id as usize].1 {
                hasher.update(&bytes.as_slice()[..batch.len() * value_type.bytes()]);
            }
        }
    }

    pub fn finish(mut self, rows: u64) -> String {
        self.header.update(format!("rows={rows}\n").as_bytes());
        for (id, hasher) in self.columns {
            let line = format!("{}={}\n", id.name(), hasher.finalize().to_hex());
            self.header.update(line.as_bytes());
        }
        self.header.finalize().to_hex().to_string()
    }
}
