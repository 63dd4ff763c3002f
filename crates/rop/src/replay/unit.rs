//! Units of fragments: stretches of rows in one tile, sorted by tile, each unit by one
//! thread. What the rows hold stays where it is until it is drawn.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, u16x32};

use crate::contract::frame::Frame;
use crate::replay::group::Group;
use screendoor_trace::tile::{TILE_SIDE, TileGrid, TileId};
use screendoor_trace::trace::{Batch, Column, STRETCH, Stretch};

/// Rows of a unit, at most: so many that a tile's stretches in it are worth a visit, so
/// few that threads end a window at about the same time.
const UNIT_ROWS: usize = 1 << 15;

/// Rows of a batch.
pub(super) struct Part {
    pub batch: Batch,
    pub rows: Range<usize>,
}

impl Part {
    /// The same rows, a unit's at a time.
    pub(super) fn cut(&self) -> impl Iterator<Item = Part> + '_ {
        let Part { batch, rows } = self;
        let starts = rows.clone().step_by(UNIT_ROWS);
        starts.map(|start| Part {
            batch: batch.clone(),
            rows: start..rows.end.min(start + UNIT_ROWS),
        })
    }
}

/// Stretches of a part's rows, sorted by tile. It is filled again and again: memory that
/// has been touched is cheaper than fresh memory.
#[derive(Default)]
pub(super) struct Unit {
    /// The rows' batch.
    batch: Option<Batch>,
    /// Stretches, tile after tile, in API order within a tile.
    stretches: Vec<Stretch>,
    /// Tiles in the order in which they were met, and where their stretches end.
    tiles: Vec<(TileId, u32)>,
}

/// What a thread needs to sort a unit.
pub(super) struct Sorter {
    level: Level,
    /// By tile, zero between units: the number of its stretches, then the place of the
    /// next.
    cursors: Vec<u32>,
    /// Stretches as they are met, with their tiles.
    met: Vec<(TileId, Stretch)>,
}

impl Unit {
    /// Fills it with those rows of `part` that belong to the group: a counting sort, stable.
    pub(super) fn fill(&mut self, part: &Part, frame: &Frame, group: &Group, sorter: &mut Sorter) {
        self.batch = Some(part.batch.clone());
        sorter.find(part, frame.grid, group, &mut self.tiles);
        sorter.place(&mut self.stretches, &mut self.tiles);
    }

    /// The rows' batch.
    pub(super) fn batch(&self) -> &Batch {
        self.batch.as_ref().expect("it has been filled")
    }

    /// Its tiles, and where in [`Unit::stretches`] they stand.
    pub(super) fn tiles(&self) -> impl Iterator<Item = (TileId, Range<u32>)> {
        let mut start = 0;
        self.tiles.iter().map(move |(tile, end)| (*tile, std::mem::replace(&mut start, *end)..*end))
    }

    /// Stretches of one tile, in API order.
    #[inline]
    pub(super) fn stretches(&self, range: Range<u32>) -> &[Stretch] {
        &self.stretches[range.start as usize..range.end as usize]
    }
}

impl Sorter {
    pub(super) fn new(frame: &Frame) -> Self {
        let cursors = vec![0; frame.grid.count()];
        Sorter { level: Level::new(), cursors, met: Vec::new() }
    }

    /// Finds the stretches, counts those of each tile, and names the tiles as they are met.
    fn find(&mut self, part: &Part, grid: TileGrid, group: &Group, tiles: &mut Vec<(TileId, u32)>) {
        tiles.clear();
        self.met.clear();
        let (met, cursors) = (&mut self.met, &mut self.cursors);
        let mut add = |tile: TileId, rows: Range<usize>| {
            let cursor = &mut cursors[tile.0 as usize];
            if *cursor == 0 {
                tiles.push((tile, 0));
            }
            for start in rows.clone().step_by(STRETCH) {
                met.push((tile, Stretch::new(start, STRETCH.min(rows.end - start))));
                *cursor += 1;
            }
        };
        for_each_run(self.level, part, |(x, y), rows| {
            let tile = grid.tile(x, y);
            match group {
                Group::Everything => add(tile, rows),
                Group::Tiles(range) => {
                    if range.contains(&tile.0) {
                        add(tile, rows);
                    }
                }
                Group::Part(only, within) => {
                    let held = |row: &usize| {
                        let (x, y) = part.batch.pixel(*row);
                        tile == *only && within.contains(&TileGrid::within(x, y))
                    };
                    rows.filter(held).for_each(|row| add(tile, row..row + 1));
                }
            }
        });
    }

    /// Sorts what was found.
    fn place(&mut self, stretches: &mut Vec<Stretch>, tiles: &mut [(TileId, u32)]) {
        let mut end = 0;
        for (tile, tile_end) in tiles.iter_mut() {
            end += std::mem::replace(&mut self.cursors[tile.0 as usize], end);
            *tile_end = end;
        }
        stretches.clear();
        stretches.resize(self.met.len(), Stretch::new(0, 1));
        for (tile, stretch) in &self.met {
            let cursor = &mut self.cursors[tile.0 as usize];
            stretches[*cursor as usize] = *stretch;
            *cursor += 1;
        }
        for (tile, _) in tiles {
            self.cursors[tile.0 as usize] = 0;
        }
    }
}

/// Rows that are compared at a time.
const STEP: usize = 32;

/// Tells `each` the runs of rows in one tile, with the pixel of the first. Primitives are
/// drawn row by row, so that runs are much fewer than fragments.
fn for_each_run(level: Level, part: &Part, mut each: impl FnMut((u16, u16), Range<usize>)) {
    let Part { batch, rows } = part;
    let columns = batch.places().map(|column| match column {
        // Where all are in one column or row, nothing changes.
        Column::Constant(_) => &[],
        Column::Values(values) => &values[rows.clone()],
    });
    let mut start = rows.start;
    let mut next = |end: usize| {
        let run = std::mem::replace(&mut start, end)..end;
        each(batch.pixel(run.start), run);
    };
    dispatch!(level, simd => find_changes(simd, columns, rows.len(), |i| next(rows.start + i)));
    if !rows.is_empty() {
        next(rows.end);
    }
}

/// Tells `at` where a pixel lies in another tile than the one before it: pixels in columns
/// and rows, of which one may be left out.
#[inline(always)]
fn find_changes<S: Simd>(simd: S, columns: [&[u16]; 2], len: usize, mut at: impl FnMut(usize)) {
    const TILE: u16 = !(TILE_SIDE as u16 - 1);
    let given = || columns.into_iter().filter(|column| !column.is_empty());
    let (tile, none) = (u16x32::splat(simd, TILE), u16x32::splat(simd, 0));
    let mut i = 1;
    while i + STEP <= len {
        let mut changes = 0;
        for column in given() {
            let [before, here] = [i - 1, i].map(|i| u16x32::from_slice(simd, &column[i..i + STEP]));
            changes |= ((before ^ here) & tile).simd_gt(none).to_bitmask();
        }
        while changes != 0 {
            at(i + changes.trailing_zeros() as usize);
            changes &= changes - 1;
        }
        i += STEP;
    }
    for i in i..len {
        if given().any(|column| (column[i] ^ column[i - 1]) & TILE != 0) {
            at(i);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::levels;
    use screendoor_trace::random::Stream;

    /// Runs that end where a vector does, and elsewhere; one row or column for all.
    #[test]
    fn changes_are_where_the_tile_changes() {
        let mut random = Stream::new([5]);
        for len in [0, 1, 2, 31, 32, 33, 64, 65, 200] {
            for changing in [1, 3, 40] {
                let (mut x, mut y) = (0, 0);
                let mut step = |_| {
                    match random.below(changing) {
                        0 => x = random.below(40) as u16,
                        1 => y = random.below(40) as u16 * 1600,
                        _ => {}
                    }
                    (x, y)
                };
                let (x, y): (Vec<u16>, Vec<u16>) = (0..len).map(&mut step).unzip();
                for columns in [[&x[..], &y], [&x, &[]], [&[], &y], [&[], &[]]] {
                    let tile = |i: usize| columns.map(|c| c.get(i).map(|v| v / 16));
                    let expected: Vec<usize> =
                        (1..len).filter(|i| tile(*i) != tile(i - 1)).collect();
                    for (name, level) in levels() {
                        let mut found = Vec::new();
                        dispatch!(level, simd => {
                            find_changes(simd, columns, len, |i| found.push(i))
                        });
                        assert_eq!(found, expected, "{name}: {columns:?}");
                    }
                }
            }
        }
    }

    /// Tiles as they were met, stretches of a tile in order, long runs in pieces.
    #[test]
    fn stretches_are_sorted_by_tile() {
        let frame_tiles = 10;
        let mut sorter = Sorter { level: Level::new(), cursors: vec![0; frame_tiles], met: vec![] };
        let list = [(5, 0), (2, 3), (5, 9), (9, 11), (2, 12)];
        let mut tiles = Vec::new();
        for (tile, start) in list {
            if sorter.cursors[tile] == 0 {
                tiles.push((TileId(tile as u32), 0));
            }
            sorter.cursors[tile] += 1;
            sorter.met.push((TileId(tile as u32), Stretch::new(start, 1)));
        }
        let mut stretches = Vec::new();
        sorter.place(&mut stretches, &mut tiles);
        assert_eq!(tiles, [(TileId(5), 2), (TileId(2), 4), (TileId(9), 5)]);
        assert_eq!(stretches, [0, 9, 3, 12, 11].map(|start| Stretch::new(start, 1)));
        assert!(sorter.cursors.iter().all(|cursor| *cursor == 0));
    }
}
