//! A trace's chunks as they lie sorted on the device: kept for its next replay there, with another
//! design or another seed.

use std::sync::{Arc, Mutex, PoisonError};

use crate::bin::Sorted;
use crate::chunk::Uploaded;
use screendoor_trace::error::Result;
use screendoor_trace::tile::TileId;
use screendoor_trace::trace::{ColumnSet, Trace, TraceMark};

/// A chunk on the device, sorted.
#[derive(Debug)]
pub(super) struct Ready {
    pub uploaded: Uploaded,
    pub sorted: Sorted,
}

impl Ready {
    /// Bytes that one of so many bytes of columns, rows and pixels takes on the device.
    pub(crate) fn bytes(columns: u64, rows: usize, pixels: usize) -> u64 {
        columns + 4 * rows as u64 + 8 * pixels as u64
    }
}

/// What chunks depend on.
#[derive(Clone, Debug)]
pub(super) struct Key {
    pub trace: TraceMark,
    pub samples: u32,
    /// The optional columns that were asked for.
    pub columns: ColumnSet,
    /// Rows of a chunk, at most.
    pub rows: u64,
}

/// All chunks of a trace.
#[derive(Clone, Debug)]
pub(super) struct Kept {
    pub key: Key,
    /// The touched tiles, in the order of their places.
    pub tiles: Vec<TileId>,
    pub chunks: Vec<Arc<Ready>>,
}

/// Where a device keeps them: of one trace at a time.
#[derive(Debug, Default)]
pub(super) struct Store(Mutex<Option<Kept>>);

impl Store {
    /// What is kept for `key`, of `trace`. What is of another goes: its memory is for what comes.
    ///
    /// # Errors
    /// As [`Trace::is_marked`].
    pub(crate) fn get(&self, trace: &Trace, key: &Key) -> Result<Option<Kept>> {
        let mut store = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |kept: &Key| {
            (kept.samples, kept.columns, kept.rows) == (key.samples, key.columns, key.rows)
        };
        if let Some(kept) = &*store
            && same(&kept.key)
            && trace.is_marked(&kept.key.trace)?
        {
            return Ok(Some(kept.clone()));
        }
        *store = None;
        Ok(None)
    }

    pub(crate) fn put(&self, kept: Kept) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(kept);
    }
}
