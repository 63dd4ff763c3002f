//! Windows of fragments: read, binned by tile, drawn.

use arrayvec::ArrayVec;
use rayon::prelude::*;

use crate::error::Result;
use crate::rop::design::Frame;
use crate::rop::event::EventCounts;
use crate::rop::replay::engine::{Engine, TileState, Told};
use crate::rop::replay::group::Group;
use crate::tile::{TileId, TileMap};
use crate::trace::{Batch, Fragment, SampleMask, Trace};

/// Cuts a trace into windows of fragments.
pub(super) struct Windows<'a> {
    trace: &'a Trace,
    frame: &'a Frame,
    group: &'a Group,
    length: usize,
    next_batch: usize,
    /// What the last window left of its last batch.
    rest: Option<(Batch, usize)>,
    /// By tile, for counting: fragments in this window, then the place of the next.
    cursors: Vec<u32>,
}

/// A window's fragments, sorted into tiles.
pub(super) struct Window {
    /// Batches and the row at which each begins in this window.
    parts: Vec<Part>,
    /// How many fragments it was made of.
    pub rows: usize,
    /// Tiles with fragments, in rising order, and where theirs end in `rows_by_tile`.
    tiles: Vec<(TileId, u32)>,
    /// Window rows, tile after tile, in API order within a tile.
    rows_by_tile: Vec<u32>,
}

struct Part {
    batch: Batch,
    /// The batch's first row that belongs to the window.
    first: usize,
    /// That row's number in the window.
    start: usize,
    /// The number after the part's last row.
    end: usize,
}

impl<'a> Windows<'a> {
    pub fn new(trace: &'a Trace, frame: &'a Frame, group: &'a Group, length: usize) -> Self {
        let cursors = vec![0; frame.grid.count()];
        // Window rows are numbered in 32 bits.
        let length = length.min(1 << 30);
        Windows { trace, frame, group, length, next_batch: 0, rest: None, cursors }
    }

    /// The next window, or the error that reading it met; `None` at the end.
    pub fn next_binned(&mut self) -> Option<Result<Window>> {
        let mut parts: Vec<Part> = Vec::new();
        let mut rows = 0;
        while rows < self.length {
            let (batch, first) = match self.rest.take() {
                Some(rest) => rest,
                None if self.next_batch < self.trace.batch_count() => {
                    self.next_batch += 1;
                    match self.trace.batch(self.next_batch - 1) {
                        Ok(batch) => (batch, 0),
                        Err(e) => return Some(Err(e)),
                    }
                }
                None => break,
            };
            let taken = (batch.len() - first).min(self.length - rows);
            if first + taken < batch.len() {
                self.rest = Some((batch.clone(), first + taken));
            }
            parts.push(Part { batch, first, start: rows, end: rows + taken });
            rows += taken;
        }
        (rows > 0).then(|| Ok(self.bin(parts, rows)))
    }

    /// A counting sort by tile, stable in API order.
    fn bin(&mut self, parts: Vec<Part>, rows: usize) -> Window {
        let cursors = &mut self.cursors;
        let mut tiles: Vec<(TileId, u32)> = Vec::new();
        for_each_row(&parts, self.frame, self.group, |tile, _| {
            let count = &mut cursors[tile.0 as usize];
            if *count == 0 {
                tiles.push((tile, 0));
            }
            *count += 1;
        });
        tiles.sort_unstable();
        let mut end = 0;
        for (tile, tile_end) in &mut tiles {
            let cursor = &mut cursors[tile.0 as usize];
            let count = std::mem::replace(cursor, end);
            end += count;
            *tile_end = end;
        }
        let mut rows_by_tile = vec![0; end as usize];
        for_each_row(&parts, self.frame, self.group, |tile, row| {
            let cursor = &mut cursors[tile.0 as usize];
            rows_by_tile[*cursor as usize] = row;
            *cursor += 1;
        });
        for (tile, _) in &tiles {
            cursors[tile.0 as usize] = 0;
        }
        Window { parts, rows, tiles, rows_by_tile }
    }
}

/// Tells tile and window row of every fragment of a window that covers a sample
/// of the frame and belongs to the group.
#[inline]
fn for_each_row(parts: &[Part], frame: &Frame, group: &Group, mut each: impl FnMut(TileId, u32)) {
    let mask = SampleMask::first(frame.samples());
    for part in parts {
        for row in part.start..part.end {
            let i = row - part.start + part.first;
            if (part.batch.coverage(i) & mask).is_empty() {
                continue;
            }
            let (x, y) = part.batch.pixel(i);
            let tile = frame.grid.tile(x, y);
            if group.holds(tile, x, y) {
                each(tile, row as u32);
            }
        }
    }
}

/// Fragments that are decoded at a time: few enough for the nearest cache.
const CHUNK: usize = 64;

impl Window {
    /// Draws the window's fragments into the tiles' states, tiles in parallel; counts
    /// events where it is asked to.
    pub fn draw(
        &self,
        design: &dyn Engine,
        frame: &Frame,
        pass: u32,
        states: &mut TileMap<TileState>,
        count: bool,
    ) -> EventCounts {
        let mut work: Vec<(usize, TileId, &[u32])> = Vec::with_capacity(self.tiles.len());
        let mut start = 0;
        for (tile, end) in &self.tiles {
            let slot = states.touch(*tile, || design.clear(frame.grid, *tile));
            work.push((slot, *tile, &self.rows_by_tile[start..*end as usize]));
            start = *end as usize;
        }
        work.sort_unstable_by_key(|(slot, ..)| *slot);
        let mut tiles = Vec::with_capacity(work.len());
        let (mut rest, mut skipped) = (states.touched_mut(), 0);
        for (slot, _, rows) in work {
            let (tile, later) = rest[slot - skipped..].split_first_mut().expect("it is touched");
            tiles.push((&mut tile.1, rows));
            (rest, skipped) = (later, slot + 1);
        }
        let mask = SampleMask::first(frame.samples());
        let draw_tile = |(state, rows): (&mut TileState, &[u32])| {
            let mut counts = count.then(EventCounts::default);
            let mut decoder = Decoder { window: self, part: 0, mask };
            let mut fragments = ArrayVec::<Fragment, CHUNK>::new();
            for rows in rows.chunks(CHUNK) {
                fragments.clear();
                decoder.decode(rows, &mut fragments);
                let told = counts.as_mut().map_or(Told::Nobody, Told::Counts);
                design.draw(pass, state, &fragments, told);
            }
            counts.unwrap_or_default()
        };
        if count {
            let merge = |a: EventCounts, b: EventCounts| a.merged(&b);
            return tiles.into_par_iter().map(draw_tile).reduce(EventCounts::default, merge);
        }
        tiles.into_par_iter().for_each(|tile| {
            draw_tile(tile);
        });
        EventCounts::default()
    }
}

/// Reads a window's rows in rising order.
struct Decoder<'a> {
    window: &'a Window,
    /// The part that held the last row.
    part: usize,
    mask: SampleMask,
}

impl Decoder<'_> {
    fn decode(&mut self, rows: &[u32], fragments: &mut ArrayVec<Fragment, CHUNK>) {
        for row in rows {
            let row = *row as usize;
            while row >= self.window.parts[self.part].end {
                self.part += 1;
            }
            let part = &self.window.parts[self.part];
            let mut fragment = part.batch.fragment(row - part.start + part.first);
            fragment.coverage = fragment.coverage & self.mask;
            fragments.push(fragment);
        }
    }
}
