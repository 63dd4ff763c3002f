//! What is known of every pixel without noise, in one pass and in any order of fragments.

use screendoor_trace::error::{Error, Result};
use screendoor_trace::tile::{TILE_PIXELS, TileGrid, TileMap};
use screendoor_trace::trace::{SampleMask, Trace};

/// A pixel's guides.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Guide {
    /// Total alpha, 0 to 1: the mean over the samples of 1 − Π(1 − α).
    pub alpha: f64,
    /// The mean depth of what covers it, each fragment by its alpha and coverage, as a share of the
    /// range that these means have in the frame; 0 where nothing does.
    pub depth: f64,
    /// Whether any fragment lets light through: where none does there is no noise to be filtered.
    pub noisy: bool,
}

/// The guides of a frame.
#[derive(Clone, Debug)]
pub struct Guides {
    grid: TileGrid,
    tiles: TileMap<Box<[Guide; TILE_PIXELS]>>,
}

/// Sums of a pixel.
#[derive(Clone, Copy, Default)]
struct Sums {
    weight: f64,
    depth: f64,
    noisy: bool,
}

/// A tile while its fragments come: transmittances by pixel and sample, and sums.
struct Open {
    transmittance: Vec<f32>,
    sums: Vec<Sums>,
}

impl Guides {
    /// The guides of a trace at so many samples a pixel. `memory` is how many bytes may be taken
    /// meanwhile.
    ///
    /// # Errors
    /// As [`Trace::batch`]; [`Error::Config`] where the memory does not suffice.
    pub fn of(trace: &Trace, samples: u32, memory: u64) -> Result<Self> {
        let header = trace.header();
        let grid = TileGrid::new(header.width, header.height);
        let all = SampleMask::first(samples);
        let count = samples as usize;
        let bytes = TILE_PIXELS * (count * size_of::<f32>() + size_of::<Sums>());
        let mut tiles: TileMap<Open> = TileMap::new(grid);
        for batch in trace.batches() {
            for f in batch?.iter() {
                let coverage = f.coverage & all;
                if coverage.is_empty() {
                    continue;
                }
                let tile = tiles.get_or_insert_with(grid.tile(f.x, f.y), || Open {
                    transmittance: vec![1.0; TILE_PIXELS * count],
                    sums: vec![Sums::default(); TILE_PIXELS],
                });
                let within = TileGrid::within(f.x, f.y);
                for s in coverage.iter() {
                    tile.transmittance[within * count + s] *= 1.0 - f.alpha;
                }
                let weight = f64::from(f.alpha) * f64::from(coverage.count());
                let sums = &mut tile.sums[within];
                sums.weight += weight;
                sums.depth += weight * f64::from(f.depth.z.0) / f64::from(u32::MAX);
                sums.noisy |= f.alpha > 0.0 && f.alpha < 1.0;
            }
            if (tiles.touched().len() * bytes) as u64 > memory {
                return Err(Error::config(
                    format_args!(
                        "{}: the guides of post filters take more than {} MiB",
                        trace.place(),
                        memory >> 20
                    ),
                    "allow more memory, or leave the filters out",
                ));
            }
        }
        Ok(Guides::finished(grid, count, &tiles))
    }

    fn finished(grid: TileGrid, samples: usize, tiles: &TileMap<Open>) -> Self {
        let mean = |sums: &Sums| (sums.weight > 0.0).then(|| sums.depth / sums.weight);
        let depths = tiles.touched().iter().flat_map(|(_, tile)| tile.sums.iter().filter_map(mean));
        let (low, high) =
            depths.fold((1.0_f64, 0.0_f64), |(low, high), z| (low.min(z), high.max(z)));
        let range = if high > low { high - low } else { 1.0 };
        let mut finished: TileMap<Box<[Guide; TILE_PIXELS]>> = TileMap::new(grid);
        for (id, tile) in tiles.touched() {
            let own =
                finished.get_or_insert_with(*id, || Box::new([Guide::default(); TILE_PIXELS]));
            for ((guide, sums), transmittance) in
                own.iter_mut().zip(&tile.sums).zip(tile.transmittance.chunks(samples))
            {
                let through: f64 = transmittance.iter().map(|t| f64::from(*t)).sum();
                *guide = Guide {
                    alpha: 1.0 - through / samples as f64,
                    depth: mean(sums).map_or(0.0, |z| (z - low) / range),
                    noisy: sums.noisy,
                };
            }
        }
        Guides { grid, tiles: finished }
    }

    /// A pixel's.
    pub fn get(&self, x: u32, y: u32) -> Guide {
        let (x, y) = (x as u16, y as u16);
        let tile = self.tiles.get(self.grid.tile(x, y));
        tile.map_or(Guide::default(), |tile| tile[TileGrid::within(x, y)])
    }

    /// The frame that they are of.
    pub fn grid(&self) -> TileGrid {
        self.grid
    }
}
