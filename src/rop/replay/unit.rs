//! Units of fragments: decoded and sorted by tile, each by one thread.

use std::ops::Range;

use crate::rop::design::Frame;
use crate::rop::replay::group::Group;
use crate::tile::TileId;
use crate::trace::{BLOCK, Batch, Decoder, DepthPlane, Footprints, Fragment, SampleMask, Unorm32};

/// Rows of a unit, at most: so many that a tile's fragments in it are worth a call,
/// so few that threads end a window at about the same time.
pub(super) const UNIT_ROWS: usize = 1 << 13;

/// A stretch of the trace, its fragments whole and sorted by tile. It is filled again
/// and again: memory that has been touched is cheaper than fresh memory.
#[derive(Default)]
pub(super) struct Unit {
    /// Fragments, tile after tile, in API order within a tile; then what no tile has.
    fragments: Vec<Fragment>,
    /// Tiles in the order in which they were met, and where their fragments end.
    tiles: Vec<(TileId, u32)>,
}

/// What a thread needs to sort a unit.
pub(super) struct Sorter {
    /// By tile, zero between units: the number of its fragments, then the place of the
    /// next. The last entry is for fragments that are left out.
    cursors: Vec<u32>,
    /// Tile and length of each run of fragments in one tile. Primitives are drawn row by
    /// row, so that runs are much fewer than fragments.
    runs: Vec<(u32, u32)>,
    /// Each fragment's place in the sorted unit, and room for a run's worth more.
    places: Vec<u32>,
}

impl Sorter {
    pub fn new(frame: &Frame) -> Self {
        let cursors = vec![0; frame.grid.count() + 1];
        Sorter { cursors, runs: Vec::new(), places: Vec::new() }
    }
}

/// Rows of a batch.
pub(super) struct Part {
    pub batch: Batch,
    pub rows: Range<usize>,
}

impl Part {
    fn blocks(&self) -> impl Iterator<Item = Range<usize>> {
        let end = self.rows.end;
        self.rows.clone().step_by(BLOCK).map(move |start| start..end.min(start + BLOCK))
    }
}

/// What stands in a unit's memory before it is first filled.
const NOTHING: Fragment = Fragment {
    x: 0,
    y: 0,
    coverage: SampleMask::NONE,
    depth: DepthPlane { z: Unorm32::NEAR, dzdx: 0, dzdy: 0 },
    colour: [0.0; 3],
    alpha: 0.0,
    primitive: 0,
    object: 0,
};

impl Unit {
    /// Fills it with those fragments of `parts`, at most [`UNIT_ROWS`], that cover a
    /// sample of the frame and belong to the group: a counting sort, stable.
    pub fn fill(&mut self, parts: &[Part], frame: &Frame, group: &Group, sorter: &mut Sorter) {
        let mask = SampleMask::first(frame.samples());
        let rows = sorter.count(parts, frame, group, mask, &mut self.tiles);
        sorter.place(rows, &mut self.tiles);
        if self.fragments.len() < rows {
            self.fragments.resize(rows, NOTHING);
        }
        let mut places = &sorter.places[..rows];
        for part in parts {
            let mut decoder = Decoder::new(&part.batch);
            for rows in part.blocks() {
                let (block, later) = places.split_at(rows.len());
                places = later;
                decoder.fragments(&rows, |i, mut fragment| {
                    fragment.coverage = fragment.coverage & mask;
                    self.fragments[block[i] as usize] = fragment;
                });
            }
        }
    }

    /// Its tiles, and where in [`Unit::fragments`] their fragments stand.
    pub fn tiles(&self) -> impl Iterator<Item = (TileId, Range<u32>)> {
        let mut start = 0;
        self.tiles.iter().map(move |(tile, end)| (*tile, std::mem::replace(&mut start, *end)..*end))
    }

    /// Fragments of one tile, in API order.
    #[inline]
    pub fn fragments(&self, range: Range<u32>) -> &[Fragment] {
        &self.fragments[range.start as usize..range.end as usize]
    }
}

impl Sorter {
    /// Counts the fragments of each tile, which `tiles` then names as they were met, and
    /// notes the runs; tells how many rows there are.
    fn count(
        &mut self,
        parts: &[Part],
        frame: &Frame,
        group: &Group,
        mask: SampleMask,
        tiles: &mut Vec<(TileId, u32)>,
    ) -> usize {
        let mut total = 0;
        tiles.clear();
        self.runs.clear();
        let mut tile_of_row = [0; BLOCK];
        for part in parts {
            let mut decoder = Decoder::new(&part.batch);
            for rows in part.blocks() {
                find_tiles(decoder.footprints(&rows), frame, group, mask, &mut tile_of_row);
                let mut starts = [0_u32; BLOCK + 1];
                let n = find_runs(&tile_of_row[..rows.len()], &mut starts);
                for run in starts[..=n].windows(2) {
                    let (tile, length) = (tile_of_row[run[0] as usize], run[1] - run[0]);
                    let count = &mut self.cursors[tile as usize];
                    if *count == 0 {
                        tiles.push((TileId(tile), 0));
                    }
                    *count += length;
                    self.runs.push((tile, length));
                }
                total += rows.len();
            }
        }
        total
    }

    /// Gives each row its place: tile after tile, and last what is left out, which is
    /// written like the rest, so that no branch has to be foretold, and not looked at.
    fn place(&mut self, rows: usize, tiles: &mut Vec<(TileId, u32)>) {
        let left_out = self.cursors.len() - 1;
        let met = tiles.iter().position(|(tile, _)| tile.0 as usize == left_out);
        let last = met.map(|place| tiles.remove(place));
        let mut end = 0;
        for (tile, tile_end) in tiles.iter_mut() {
            let cursor = &mut self.cursors[tile.0 as usize];
            end += std::mem::replace(cursor, end);
            *tile_end = end;
        }
        if last.is_some() {
            self.cursors[left_out] = end;
        }
        // Places are written a few at a time, beyond the run's end, and then again by
        // the next run: most runs take one step.
        const STEP: usize = 16;
        self.places.resize(self.places.len().max(rows + STEP), 0);
        let mut start = 0;
        for (tile, length) in &self.runs {
            let cursor = &mut self.cursors[*tile as usize];
            let (first, length) = (*cursor, *length as usize);
            *cursor += length as u32;
            for done in (0..length).step_by(STEP) {
                let places = &mut self.places[start + done..][..STEP];
                for (i, place) in places.iter_mut().enumerate() {
                    *place = first + (done + i) as u32;
                }
            }
            start += length;
        }
        for (tile, _) in tiles.iter() {
            self.cursors[tile.0 as usize] = 0;
        }
        self.cursors[left_out] = 0;
    }
}

/// Where the runs of equal tiles begin, and, after them, where the last one ends; tells how
/// many there are.
#[inline]
fn find_runs(tiles: &[u32], starts: &mut [u32; BLOCK + 1]) -> usize {
    let mut n = 0;
    let mut last = u32::MAX;
    for (i, tile) in tiles.iter().enumerate() {
        // Written always and kept where a run begins: no branch.
        starts[n.min(BLOCK)] = i as u32;
        n += usize::from(*tile != last);
        last = *tile;
    }
    starts[n.min(BLOCK)] = tiles.len() as u32;
    n.min(BLOCK)
}

/// The tile of each fragment; one past the frame's tiles for those that are left out.
#[inline]
fn find_tiles(
    footprints: Footprints<'_>,
    frame: &Frame,
    group: &Group,
    mask: SampleMask,
    tiles: &mut [u32; BLOCK],
) {
    let left_out = frame.grid.count() as u32;
    let Footprints { x, y, coverage } = footprints;
    let pixels = x.iter().zip(y);
    for ((tile, (x, y)), coverage) in tiles.iter_mut().zip(pixels.clone()).zip(coverage) {
        // Chosen by a mask: a branch would be mispredicted wherever coverage is mixed.
        let held = u32::from(coverage & mask.0 != 0).wrapping_neg();
        *tile = frame.grid.tile(*x, *y).0 & held | left_out & !held;
    }
    if *group != Group::Everything {
        for (tile, (x, y)) in tiles.iter_mut().zip(pixels) {
            if !group.holds(TileId(*tile), *x, *y) {
                *tile = left_out;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_begin_where_the_tile_changes() {
        let mut starts = [0; BLOCK + 1];
        let n = find_runs(&[4, 4, 4, 7, 4, 4, 9], &mut starts);
        assert_eq!((n, &starts[..=n]), (4, &[0, 3, 4, 6, 7][..]));
        assert_eq!(find_runs(&[], &mut starts), 0);
        let changing: Vec<u32> = (0..BLOCK as u32).collect();
        let n = find_runs(&changing, &mut starts);
        assert_eq!((n, starts[n]), (BLOCK, BLOCK as u32));
    }

    /// Tiles as they were met, what is left out behind them, rows of a tile in order;
    /// with a run longer than a step.
    #[test]
    fn places_are_a_stable_sort() {
        let left_out = 9;
        let tile_of_row: Vec<u32> =
            [vec![5; 3], vec![left_out; 2], vec![2; 40], vec![5; 1], vec![left_out], vec![2; 7]]
                .concat();
        let mut sorter =
            Sorter { cursors: vec![0; left_out as usize + 1], runs: vec![], places: vec![] };
        let mut tiles = Vec::new();
        for (first, tile) in tile_of_row.iter().enumerate() {
            if !tile_of_row[..first].contains(tile) {
                tiles.push((TileId(*tile), 0));
            }
            sorter.cursors[*tile as usize] += 1;
        }
        let run = |run: &[u32]| (run[0], run.len() as u32);
        sorter.runs = tile_of_row.chunk_by(|a, b| a == b).map(run).collect();
        sorter.place(tile_of_row.len(), &mut tiles);
        assert_eq!(tiles, [(TileId(5), 4), (TileId(2), 51)]);
        assert!(sorter.cursors.iter().all(|cursor| *cursor == 0));
        let rank = |tile: u32| [5, 2, left_out].iter().position(|t| *t == tile);
        let mut expected: Vec<usize> = (0..tile_of_row.len()).collect();
        expected.sort_by_key(|row| rank(tile_of_row[*row]));
        for (place, row) in expected.into_iter().enumerate() {
            assert_eq!(sorter.places[row] as usize, place);
        }
    }
}
