//! What one thread has sorted: chunks of a tile's rows, bump-allocated in slabs.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use fearless_simd::Level;

use crate::tile::{TileGrid, TileId, TileMap};
use crate::trace::batch::Batch;
use crate::trace::bins::column::{Copies, Rows, STEP};
use crate::trace::bins::columns::BinnedColumns;
use crate::trace::bins::runs::for_each_run;
use crate::trace::bins::slabs::{RowNumber, Slabs};
use crate::trace::bins::{Tiles, Wanted};
use crate::trace::block::Block;

/// Rows of a tile's first chunk; each that follows holds twice as many, so that little is
/// wasted on tiles with few fragments and none of the others is in many pieces.
const FIRST_CHUNK: u32 = 32;
/// Rows of a chunk, at most.
pub(super) const LAST_CHUNK: u32 = 512;

/// A part of the rows, sorted into tiles. It is filled again and again: memory that has been
/// touched is cheaper than fresh memory.
#[derive(Debug)]
pub(super) struct Part {
    /// None before the first batch.
    columns: Option<BinnedColumns>,
    slabs: Slabs,
    /// Slabs that have been begun, and rows that are given away of the last of these.
    begun: usize,
    used: usize,
    lists: TileMap<List>,
    chunks: Vec<Chunk>,
    copies: Copies,
    within: Box<[u8; STEP]>,
}

/// A tile's rows.
#[derive(Clone, Debug)]
pub(super) struct List {
    pub rows: u64,
    /// The first and the last of its chunks.
    first: u32,
    last: u32,
    /// The last chunk's free rows.
    at: u32,
    end: u32,
}

/// Rows that lie one after the other.
#[derive(Clone, Copy, Debug)]
struct Chunk {
    start: u32,
    /// How many there is room for.
    room: u32,
    /// The tile's next one, or itself.
    next: u32,
}

/// Slabs that may be added to all parts together.
#[derive(Debug)]
pub(super) struct Budget(pub AtomicUsize);

impl Budget {
    fn take(&self) -> bool {
        self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| n.checked_sub(1)).is_ok()
    }
}

impl Part {
    /// An empty one, whose slabs hold so many rows.
    pub(super) fn new(grid: TileGrid, slab_rows: usize) -> Self {
        Part {
            columns: None,
            slabs: Slabs::new(slab_rows),
            begun: 0,
            used: 0,
            lists: TileMap::new(grid),
            chunks: Vec::new(),
            copies: Copies::default(),
            within: Box::new([0; STEP]),
        }
    }

    /// Removes all rows; their memory is kept.
    pub(super) fn clear(&mut self) {
        (self.begun, self.used) = (0, 0);
        self.lists.clear();
        self.chunks.clear();
    }

    /// How many slabs there are.
    pub(super) fn slabs(&self) -> usize {
        self.slabs.count()
    }

    /// Bytes that a row takes.
    pub(super) fn bytes_per_row(&self) -> usize {
        self.columns.as_ref().map_or(0, BinnedColumns::bytes)
    }

    /// Bytes that it takes.
    pub(super) fn bytes(&self) -> u64 {
        let row = self.bytes_per_row();
        let lists = size_of_val(self.lists.touched());
        (self.slabs.count() * self.slabs.rows() * row) as u64
            + (lists + self.chunks.capacity() * size_of::<Chunk>()) as u64
    }

    /// The tiles that it has rows of, as they were met.
    pub(super) fn lists(&self) -> &[(TileId, List)] {
        self.lists.touched()
    }

    /// A tile's rows, in order.
    pub(super) fn chunks(&self, tile: TileId) -> Option<Chunks<'_>> {
        let list = self.lists.get(tile)?;
        Some(Chunks { part: self, next: Some(list.first), last: list.last, at: list.at })
    }

    /// Copies rows to a block's end, of the tile with this `corner`.
    pub(super) fn append(
        &self,
        level: Level,
        rows: Rows,
        to: &mut Block,
        corner: (u32, u32),
        wanted: Wanted,
    ) {
        let columns = self.columns.as_ref().expect("it has rows");
        columns.append(level, (&self.slabs, rows), to, corner, wanted);
    }

    /// Sorts those rows of `batch` that belong to `tiles`. Tells the row before which it
    /// stopped: there was no more room, and `budget` gave none.
    pub(super) fn sort(
        &mut self,
        level: Level,
        batch: &Batch,
        rows: Range<usize>,
        tiles: &Tiles,
        budget: &Budget,
    ) -> Option<usize> {
        self.columns.get_or_insert_with(|| BinnedColumns::like(batch));
        for first in rows.clone().step_by(STEP) {
            let some = first..rows.end.min(first + STEP);
            let full = self.find(level, batch, some.clone(), tiles, budget);
            let columns = self.columns.as_ref().expect("it is there");
            let to = (&mut self.slabs, &self.copies);
            columns.copy(level, batch, some, to, &mut self.within);
            if full.is_some() {
                return full;
            }
        }
        None
    }

    /// Finds where rows go.
    fn find(
        &mut self,
        level: Level,
        batch: &Batch,
        rows: Range<usize>,
        tiles: &Tiles,
        budget: &Budget,
    ) -> Option<usize> {
        self.copies.clear();
        let grid = self.lists.grid();
        let mut full = None;
        for_each_run(level, batch, rows, |(x, y), run| {
            let tile = grid.tile(x, y);
            if full.is_some() {
                return;
            }
            match tiles {
                Tiles::All => full = self.add(tile, run, budget),
                Tiles::Range(some) if some.contains(&tile.0) => {
                    full = self.add(tile, run, budget);
                }
                Tiles::Part(only, within) if tile == *only => {
                    let held = |row: &usize| {
                        let (x, y) = batch.pixel(*row);
                        within.contains(&TileGrid::within(x, y))
                    };
                    let mut held = run.filter(held);
                    full = held.find_map(|row| self.add(tile, row..row + 1, budget));
                }
                _ => {}
            }
        });
        full
    }

    /// Finds where rows of one tile go.
    #[inline]
    fn add(&mut self, tile: TileId, rows: Range<usize>, budget: &Budget) -> Option<usize> {
        let slot = match self.lists.slot(tile) {
            Some(slot) => slot,
            None => {
                let Some(chunk) = self.chunk(FIRST_CHUNK, budget) else { return Some(rows.start) };
                self.lists.touch(tile, || {
                    let Chunk { start, room, .. } = self.chunks[chunk as usize];
                    List { rows: 0, first: chunk, last: chunk, at: start, end: start + room }
                })
            }
        };
        let mut from = rows.start;
        while from < rows.end {
            let list = &mut self.lists.touched_mut()[slot].1;
            if list.at == list.end {
                let last = list.last;
                let twice = (2 * self.chunks[last as usize].room).min(LAST_CHUNK);
                let Some(chunk) = self.chunk(twice, budget) else { return Some(from) };
                self.chunks[last as usize].next = chunk;
                let Chunk { start, room, .. } = self.chunks[chunk as usize];
                let list = &mut self.lists.touched_mut()[slot].1;
                (list.last, list.at, list.end) = (chunk, start, start + room);
                continue;
            }
            let count = ((rows.end - from) as u32).min(list.end - list.at);
            self.copies.add(from, RowNumber(list.at), count);
            list.at += count;
            list.rows += u64::from(count);
            from += count as usize;
        }
        None
    }

    /// A new chunk; none where there is no more room.
    #[cold]
    fn chunk(&mut self, room: u32, budget: &Budget) -> Option<u32> {
        // A slab's end that is too short stays empty.
        if self.begun == 0 || self.used + room as usize > self.slabs.rows() {
            let count = self.slabs.count();
            if self.begun == count {
                // A first slab is always there to go on with.
                let may = count < Slabs::MOST && (count == 0 || budget.take());
                if !may {
                    return None;
                }
                let columns = self.columns.as_ref().expect("there is a batch");
                self.slabs.add(columns.bytes());
            }
            (self.begun, self.used) = (self.begun + 1, 0);
        }
        let chunk = self.chunks.len() as u32;
        let start = RowNumber::new(self.begun - 1, self.used).0;
        self.chunks.push(Chunk { start, room, next: chunk });
        self.used += room as usize;
        Some(chunk)
    }
}

/// A tile's rows in one part, chunk by chunk.
#[derive(Debug)]
pub(super) struct Chunks<'a> {
    part: &'a Part,
    next: Option<u32>,
    last: u32,
    /// Where the last one's rows end.
    at: u32,
}

impl Iterator for Chunks<'_> {
    type Item = Rows;

    fn next(&mut self) -> Option<Rows> {
        let this = self.next?;
        let chunk = self.part.chunks[this as usize];
        let is_last = this == self.last;
        self.next = (!is_last).then_some(chunk.next);
        let count = if is_last { self.at - chunk.start } else { chunk.room };
        Some(Rows {
            slab: RowNumber(chunk.start).slab(),
            start: RowNumber(chunk.start).place(),
            count: count as usize,
        })
    }
}
