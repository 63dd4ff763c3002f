//! Bins: a trace's fragments sorted into tiles, in memory.
//!
//! One pass over the file copies each run of rows of a tile to the tile's chunks, column by
//! column in the types that the file has them in. From there a tile is drawn whole, by any
//! design at any of the trace's sample counts: all rows are there, and coverage is cut when
//! blocks are made of them.
//!
//! Parts of the rows, one after the other in the trace, are sorted by a thread each. A tile's
//! rows are those of the first part, then those of the second.

mod column;
mod columns;
mod fill;
mod kept;
mod part;
mod rows;
mod runs;
mod slabs;
#[cfg(test)]
mod tests;

use std::ops::Range;

use fearless_simd::Level;

use crate::tile::{TileGrid, TileId, TileMap};
use crate::trace::batch::Batch;
use crate::trace::columns::ColumnId;
use crate::trace::read::Trace;

pub use columns::Wanted;
pub use fill::RowPlace;
pub use rows::TileRows;

pub(super) use column::{Binned, BinnedColumn, Copies, Rows};
pub(super) use kept::Kept;
pub use kept::TraceMark;
pub(super) use slabs::Slabs;

use part::{LAST_CHUNK, Part};
use slabs::LARGE_PAGE;

/// Rows of a part, at least: with fewer there would be more chunks that are partly empty.
const PART_ROWS: u64 = 1 << 18;

/// Tiles whose fragments are sorted; those of others are passed over.
#[derive(Clone, PartialEq, Debug)]
pub enum Tiles {
    /// All.
    All,
    /// Those with numbers in a range.
    Range(Range<u32>),
    /// A range of one tile's pixels.
    Part(TileId, Range<usize>),
}

/// Fragments of a trace, sorted into tiles.
#[derive(Debug)]
pub struct Bins {
    level: Level,
    grid: TileGrid,
    /// Bytes that they may take, but for a slab a part.
    bytes: u64,
    /// What a row takes.
    row: u64,
    slab_rows: u64,
    parts: Vec<Part>,
    /// Tiles that have rows, as the trace meets them, and how many.
    tiles: TileMap<u64>,
    /// The batch within which the rows end.
    held: Option<(usize, Batch)>,
}

impl Bins {
    /// Empty ones for fragments of `trace`, at most `rows` at a time, which may take `bytes`.
    pub fn new(trace: &Trace, rows: u64, bytes: u64) -> Self {
        let row = Self::bytes_per_row(trace);
        let rows = rows.min(trace.rows()).max(1);
        let threads = rayon::current_num_threads() as u64;
        let fill = bytes / (8 * LARGE_PAGE as u64);
        let parts = threads.min(rows / PART_ROWS).min(fill).max(1);
        // A large page's worth, or less: a few for each part, as their last ones are partly
        // empty, and no more than there are rows.
        let most = (bytes / (4 * row * parts)).min(rows).min(LARGE_PAGE as u64 / row);
        let chunk = u64::from(LAST_CHUNK);
        let slab_rows = (most / chunk * chunk).clamp(chunk, Slabs::MOST_ROWS as u64);
        Self::of_parts(trace, parts as usize, slab_rows, bytes)
    }

    /// Empty ones of so many parts, for which slabs have so many rows.
    fn of_parts(trace: &Trace, parts: usize, slab_rows: u64, bytes: u64) -> Self {
        let grid = TileGrid::new(trace.header().width, trace.header().height);
        let part = |_| Part::new(grid, slab_rows as usize);
        Bins {
            level: Level::new(),
            grid,
            bytes,
            row: Self::bytes_per_row(trace),
            slab_rows,
            parts: (0..parts).map(part).collect(),
            tiles: TileMap::new(grid),
            held: None,
        }
    }

    /// What a row takes: its stored columns, with a byte for the pixel's place in its tile.
    pub fn bytes_per_row(trace: &Trace) -> u64 {
        let columns = trace.columns().iter();
        let other = columns.filter(|(id, _)| ![ColumnId::X, ColumnId::Y].contains(id));
        1 + other.map(|(_, value_type)| value_type.bytes() as u64).sum::<u64>()
    }

    /// How many rows are likely to fit into `bytes`: chunks are not all full.
    pub fn rows_within(trace: &Trace, bytes: u64) -> u64 {
        bytes / (Self::bytes_per_row(trace) * 9 / 8 + 1)
    }

    /// Bytes that they take.
    pub fn bytes(&self) -> u64 {
        self.parts.iter().map(Part::bytes).sum()
    }

    /// Tiles that have rows, in the order in which the trace meets them, and how many.
    pub fn tiles(&self) -> &[(TileId, u64)] {
        self.tiles.touched()
    }

    /// A tile's rows, in the order in which they stand in the trace.
    pub fn rows(&self, tile: TileId, wanted: Wanted) -> TileRows<'_> {
        TileRows::new(self, tile, wanted)
    }

    /// Removes all rows; their memory is kept.
    pub fn clear(&mut self) {
        self.parts.iter_mut().for_each(Part::clear);
        self.tiles.clear();
    }
}
