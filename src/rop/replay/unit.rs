//! Units of fragments: decoded and sorted by tile, each by one thread.

use std::ops::Range;

use crate::rop::design::Frame;
use crate::rop::replay::group::Group;
use crate::tile::TileId;
use crate::trace::{BLOCK, Batch, Decoder, DepthPlane, Footprints, Fragment, SampleMask};

/// Rows of a unit, at most.
pub(super) const UNIT_ROWS: usize = 1 << 14;

/// A stretch of the trace, its fragments whole and sorted by tile. It is filled again
/// and again: memory that has been touched is cheaper than fresh memory.
#[derive(Default)]
pub(super) struct Unit {
    /// Fragments, tile after tile, in API order within a tile; then what no tile has.
    fragments: Vec<Fragment>,
    /// Tiles in the order in which they were met, and where their fragments end.
    tiles: Vec<(TileId, u32)>,
    /// Each row's tile, between the passes.
    tile_of_row: Vec<u32>,
}

/// Fragments by tile while a unit is sorted: their number, then the place of the next.
/// All zero between units. The last entry is for fragments that are left out.
pub(super) struct Cursors(Vec<u32>);

impl Cursors {
    pub fn new(frame: &Frame) -> Self {
        Cursors(vec![0; frame.grid.count() + 1])
    }
}

/// Rows of a batch.
#[derive(Clone)]
pub(super) struct Part<'a> {
    pub batch: &'a Batch,
    pub rows: Range<usize>,
}

impl Part<'_> {
    fn blocks(&self) -> impl Iterator<Item = Range<usize>> {
        let end = self.rows.end;
        self.rows.clone().step_by(BLOCK).map(move |start| start..end.min(start + BLOCK))
    }
}

const NOTHING: Fragment = Fragment {
    x: 0,
    y: 0,
    coverage: SampleMask::NONE,
    depth: DepthPlane { z: crate::trace::Unorm32::NEAR, dzdx: 0, dzdy: 0 },
    colour: [0.0; 3],
    alpha: 0.0,
    primitive: 0,
    object: 0,
};

impl Unit {
    /// Fills it with those fragments of `parts`, at most [`UNIT_ROWS`], that cover a
    /// sample of the frame and belong to the group: a counting sort, stable.
    pub fn fill(&mut self, parts: &[Part<'_>], frame: &Frame, group: &Group, cursors: &mut Cursors) {
        let mask = SampleMask::first(frame.samples());
        let cursors = &mut cursors.0;
        let left_out = cursors.len() - 1;
        self.tiles.clear();
        self.tile_of_row.clear();

        let mut tiles = [0; BLOCK];
        for part in parts {
            let mut decoder = Decoder::new(part.batch);
            for rows in part.blocks() {
                let n = rows.len();
                find_tiles(decoder.footprints(rows), frame, group, mask, &mut tiles);
                for tile in &tiles[..n] {
                    let count = &mut cursors[*tile as usize];
                    if *count == 0 {
                        self.tiles.push((TileId(*tile), 0));
                    }
                    *count += 1;
                }
                self.tile_of_row.extend_from_slice(&tiles[..n]);
            }
        }

        // What is left out stands last: written like the rest, so that no branch has to
        // be foretold, and not looked at.
        let out = self.tiles.iter().position(|(tile, _)| tile.0 as usize == left_out);
        let dropped = out.map(|place| self.tiles.remove(place));
        let mut end = 0;
        for (tile, tile_end) in &mut self.tiles {
            let cursor = &mut cursors[tile.0 as usize];
            end += std::mem::replace(cursor, end);
            *tile_end = end;
        }
        if dropped.is_some() {
            cursors[left_out] = end;
        }
        if self.fragments.len() < self.tile_of_row.len() {
            self.fragments.resize(self.tile_of_row.len(), NOTHING);
        }

        let mut tile_of_row = &self.tile_of_row[..];
        for part in parts {
            let mut decoder = Decoder::new(part.batch);
            for rows in part.blocks() {
                let (tiles, later) = tile_of_row.split_at(rows.len());
                tile_of_row = later;
                decoder.fragments(rows, |i, mut fragment| {
                    fragment.coverage = fragment.coverage & mask;
                    let cursor = &mut cursors[tiles[i] as usize];
                    self.fragments[*cursor as usize] = fragment;
                    *cursor += 1;
                });
            }
        }
        for (tile, _) in &self.tiles {
            cursors[tile.0 as usize] = 0;
        }
        cursors[left_out] = 0;
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
        let held = coverage & mask.0 != 0;
        *tile = if held { frame.grid.tile(*x, *y).0 } else { left_out };
    }
    if *group != Group::Everything {
        for (tile, (x, y)) in tiles.iter_mut().zip(pixels) {
            if !group.holds(TileId(*tile), *x, *y) {
                *tile = left_out;
            }
        }
    }
}
