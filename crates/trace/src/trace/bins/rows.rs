//! Blocks made of a tile's rows.

use crate::tile::TileId;
use crate::trace::bins::column::Rows;
use crate::trace::bins::part::Chunks;
use crate::trace::bins::{Bins, Wanted};
use crate::trace::block::{BLOCK, Block};

/// A tile's rows, in the order in which they stand in the trace.
#[derive(Debug)]
pub struct TileRows<'a> {
    bins: &'a Bins,
    tile: TileId,
    wanted: Wanted,
    /// The part of which chunks are read, and what is left of it.
    part: usize,
    chunks: Option<Chunks<'a>>,
    /// What is left of a chunk.
    chunk: Rows,
    left: u64,
}

impl<'a> TileRows<'a> {
    pub(super) fn new(bins: &'a Bins, tile: TileId, wanted: Wanted) -> Self {
        TileRows {
            bins,
            tile,
            wanted,
            part: 0,
            chunks: bins.parts[0].chunks(tile),
            chunk: Rows { slab: 0, start: 0, count: 0 },
            left: bins.tiles.get(tile).copied().unwrap_or_default(),
        }
    }

    /// How many rows have not been read.
    pub fn left(&self) -> u64 {
        self.left
    }

    /// Reads the next rows into `block`, as many as it holds; none are left where it is
    /// empty then.
    pub fn read(&mut self, block: &mut Block) {
        block.clear();
        while block.rows() < BLOCK && self.find_chunk() {
            let count = self.chunk.count.min(BLOCK - block.rows());
            let rows = Rows { count, ..self.chunk };
            let Bins { level, grid, parts, .. } = self.bins;
            let corner = grid.pixel(self.tile, 0);
            parts[self.part].append(*level, rows, block, corner, self.wanted);
            self.chunk.start += count;
            self.chunk.count -= count;
            self.left -= count as u64;
        }
    }

    /// Goes on to the next chunk where one is at its end; tells whether there are rows.
    fn find_chunk(&mut self) -> bool {
        while self.chunk.count == 0 {
            if let Some(chunk) = self.chunks.as_mut().and_then(Iterator::next) {
                self.chunk = chunk;
            } else if self.part + 1 < self.bins.parts.len() {
                self.part += 1;
                self.chunks = self.bins.parts[self.part].chunks(self.tile);
            } else {
                return false;
            }
        }
        true
    }
}
