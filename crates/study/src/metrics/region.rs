//! Parts of a frame over which errors are taken.

use bitvec::array::BitArray;
use bitvec::order::Lsb0;

use screendoor_trace::error::Result;
use screendoor_trace::tile::{TILE_PIXELS, TileGrid, TileId, TileMap};
use screendoor_trace::trace::{SampleMask, Trace};

/// A set of pixels of a frame.
#[derive(Clone, Debug)]
pub struct Region {
    grid: TileGrid,
    /// One bit a pixel of the touched tiles; `None` is the whole frame.
    bits: Option<TileMap<TileBits>>,
    pixels: u64,
}

/// One bit a pixel of a tile.
pub(super) type TileBits = BitArray<[u64; TILE_PIXELS / 64], Lsb0>;

impl Region {
    /// The whole frame.
    pub fn frame(grid: TileGrid) -> Self {
        let pixels = u64::from(grid.width()) * u64::from(grid.height());
        Region { grid, bits: None, pixels }
    }

    fn of(grid: TileGrid, bits: TileMap<TileBits>) -> Self {
        let pixels = bits.touched().iter().map(|(_, b)| b.count_ones() as u64).sum();
        Region { grid, bits: Some(bits), pixels }
    }

    /// The pixels for which `has` holds.
    #[cfg(test)]
    pub(super) fn of_pixels(grid: TileGrid, has: impl Fn(u32, u32) -> bool) -> Self {
        let mut bits: TileMap<TileBits> = TileMap::new(grid);
        for (x, y) in (0..grid.height()).flat_map(|y| (0..grid.width()).map(move |x| (x, y))) {
            if has(x, y) {
                let tile = bits.get_or_insert_with(grid.tile(x as u16, y as u16), Default::default);
                tile.set(TileGrid::within(x as u16, y as u16), true);
            }
        }
        Region::of(grid, bits)
    }

    /// How many pixels it has.
    pub fn pixels(&self) -> u64 {
        self.pixels
    }

    /// Which pixels of `tile` it has.
    pub(super) fn of_tile(&self, tile: TileId) -> TileBits {
        match &self.bits {
            Some(bits) => bits.get(tile).copied().unwrap_or_default(),
            None => {
                let mut held = TileBits::default();
                for within in 0..TILE_PIXELS {
                    held.set(within, self.grid.contains(self.grid.pixel(tile, within)));
                }
                held
            }
        }
    }

    /// Whether it has the pixel at place `within` of `tile`.
    pub fn holds(&self, tile: TileId, within: usize) -> bool {
        match &self.bits {
            None => self.grid.contains(self.grid.pixel(tile, within)),
            Some(bits) => bits.get(tile).is_some_and(|b| b[within]),
        }
    }
}

/// A trace's pixels by what lies in them.
#[derive(Clone, Debug)]
pub struct PixelClasses {
    /// Pixels with at least one fragment.
    pub covered: Region,
    /// Covered pixels in which every fragment covers all samples: no edge of a
    /// primitive crosses them.
    pub interior: Region,
    /// The other covered pixels.
    pub edges: Region,
}

impl PixelClasses {
    /// Sorts the pixels of `trace`, seen with its first `samples` samples.
    ///
    /// # Errors
    /// As [`Trace::batch`].
    pub fn of(trace: &Trace, samples: u32) -> Result<Self> {
        let header = trace.header();
        let grid = TileGrid::new(header.width, header.height);
        let all = SampleMask::first(samples);
        let mut covered: TileMap<TileBits> = TileMap::new(grid);
        let mut edges: TileMap<TileBits> = TileMap::new(grid);
        for batch in trace.batches() {
            let batch = batch?;
            for i in 0..batch.len() {
                let coverage = batch.coverage(i) & all;
                if coverage.is_empty() {
                    continue;
                }
                let (x, y) = batch.pixel(i);
                let (tile, within) = (grid.tile(x, y), TileGrid::within(x, y));
                covered.get_or_insert_with(tile, TileBits::default).set(within, true);
                if coverage != all {
                    edges.get_or_insert_with(tile, TileBits::default).set(within, true);
                }
            }
        }
        let mut interior = covered.clone();
        for (tile, bits) in interior.touched_mut() {
            if let Some(edges) = edges.get(*tile) {
                *bits &= !*edges;
            }
        }
        Ok(PixelClasses {
            covered: Region::of(grid, covered),
            interior: Region::of(grid, interior),
            edges: Region::of(grid, edges),
        })
    }
}
