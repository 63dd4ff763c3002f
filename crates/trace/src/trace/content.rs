//! The content hash: what a trace says, however it is stored.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::trace::columns::ColumnId;
use crate::trace::header::without_view;
use crate::trace::seal::CHECKSUMS;

/// Hashes a trace's content as its batches pass: BLAKE3 over the entries of the
/// schema's metadata, as they are spelt in the file, but for those of its view, and over
/// the BLAKE3 of each stored column's little-endian bytes. The same fragments give the same hash in
/// batches of any size and under any compression.
#[derive(Debug)]
pub(crate) struct ContentHasher {
    header: blake3::Hasher,
    columns: Vec<(ColumnId, blake3::Hasher)>,
}

impl ContentHasher {
    /// A hasher for a file with this metadata of the schema and these columns, in the
    /// file's order.
    pub(super) fn new(
        metadata: &BTreeMap<String, String>,
        columns: impl Iterator<Item = ColumnId>,
    ) -> Self {
        let mut entries = blake3::Hasher::new();
        // Whether a file is sealed is not part of what it says, nor is its view, which no
        // fragment depends on.
        for (key, value) in without_view(metadata).filter(|(key, _)| *key != CHECKSUMS) {
            entries.update(format!("{key}={value}\n").as_bytes());
        }
        let columns = columns.map(|id| (id, blake3::Hasher::new())).collect();
        ContentHasher { header: entries, columns }
    }

    /// Adds the next values of `column`, as they are stored.
    pub(super) fn update(&mut self, column: ColumnId, values: &[u8]) {
        if let Some((_, hasher)) = self.columns.iter_mut().find(|(id, _)| *id == column) {
            hasher.update(values);
        }
    }

    /// Adds the next values of all columns, as they are stored, in the file's order. Columns
    /// are hashed beside each other.
    pub(super) fn update_all(&mut self, columns: &[(ColumnId, &[u8])]) {
        assert!(columns.iter().map(|(id, _)| id).eq(self.columns.iter().map(|(id, _)| id)));
        self.columns.par_iter_mut().zip(columns).for_each(|((_, hasher), (_, values))| {
            hasher.update(values);
        });
    }

    pub(super) fn finish(mut self, rows: u64) -> String {
        self.header.update(format!("rows={rows}\n").as_bytes());
        for (id, hasher) in self.columns {
            let line = format!("{}={}\n", id.name(), hasher.finalize().to_hex());
            self.header.update(line.as_bytes());
        }
        self.header.finalize().to_hex().to_string()
    }
}
