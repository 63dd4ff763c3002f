//! What a user wants to know first about a trace.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::tile::{TILE_PIXELS, TileGrid, TileMap};
use crate::trace::read::Trace;
use crate::trace::ties::{self, Counts};

/// Objects beyond this many are counted as one remainder.
const MAX_OBJECTS: usize = 1 << 16;
/// Bins of the alpha histogram over [0, 1].
pub(super) const ALPHA_BINS: usize = 10;

/// A trace in numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Statistics {
    /// How many fragments.
    pub fragments: u64,
    /// How many pixels at least one fragment touches.
    pub covered_pixels: u64,
    /// How many fragments cover all samples of their pixel.
    pub whole_fragments: u64,
    /// How many covered pixels hold only such fragments: no edge crosses them.
    pub interior_pixels: u64,
    /// Fragments per covered pixel.
    pub depth_complexity: Distribution,
    /// Fragments that cover a sample, on average over the samples of the covered pixels.
    pub layers: f64,
    /// How many fragments share a depth with another one at a sample that both cover
    /// ([`tied_fragments`](crate::trace::tied_fragments)): designs that tell fragments apart by their depths see them at
    /// one place.
    pub tied_fragments: u64,
    /// Alphas.
    pub alpha: AlphaStatistics,
    /// Nearest and furthest depth at a pixel centre, as shares of the depth range.
    pub depth: Option<[f64; 2]>,
    /// How many objects, and how many fragments each of the largest ones has.
    pub objects: Objects,
    /// One more than the highest primitive number.
    pub primitives: u64,
}

/// The distribution of a count over pixels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Distribution {
    /// Mean.
    pub mean: f64,
    /// Median.
    pub median: u32,
    /// The count that 95 % of the pixels do not exceed.
    pub p95: u32,
    /// Largest count.
    pub max: u32,
    /// How many pixels have counts of 1, 2, 3–4, 5–8, …: bin `i` > 0 holds
    /// 2^(i−1) < count ≤ 2^i.
    pub histogram: Vec<u64>,
}

/// The alphas of a trace.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AlphaStatistics {
    /// Smallest, over fragments.
    pub min: f32,
    /// Mean over fragments.
    pub mean: f64,
    /// Largest.
    pub max: f32,
    /// Fragments with an alpha of exactly 0.
    pub zero: u64,
    /// Fragments with an alpha of exactly 1.
    pub opaque: u64,
    /// Fragments per tenth of [0, 1]; the last bin includes 1.
    pub histogram: [u64; ALPHA_BINS],
}

/// The objects of a trace.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Objects {
    /// How many; a lower bound where `more` is set.
    pub count: usize,
    /// Whether there are more than could be told apart.
    pub more: bool,
    /// Object number and fragments of the largest ones, largest first.
    pub largest: Vec<(u32, u64)>,
}

impl Distribution {
    fn new(pixels_by_count: &BTreeMap<u32, u64>) -> Self {
        let pixels: u64 = pixels_by_count.values().sum();
        let total: u64 = pixels_by_count.iter().map(|(c, n)| u64::from(*c) * n).sum();
        let quantile = |share: f64| {
            let rank = (share * pixels as f64).ceil() as u64;
            let mut seen = 0;
            let hit = pixels_by_count.iter().find(|(_, n)| {
                seen += **n;
                seen >= rank
            });
            hit.map_or(0, |(c, _)| *c)
        };
        let mut histogram = Vec::new();
        for (count, n) in pixels_by_count {
            let bin = count.next_power_of_two().trailing_zeros() as usize;
            histogram.resize(histogram.len().max(bin + 1), 0);
            histogram[bin] += n;
        }
        Distribution {
            mean: if pixels == 0 { 0.0 } else { total as f64 / pixels as f64 },
            median: quantile(0.5),
            p95: quantile(0.95),
            max: pixels_by_count.keys().next_back().copied().unwrap_or(0),
            histogram,
        }
    }
}

/// As [`statistics_within`], in 512 MiB; `progress` is told how many fragments were read.
///
/// # Errors
/// As [`statistics_within`].
pub fn statistics(trace: &Trace, mut progress: impl FnMut(u64)) -> Result<Statistics> {
    statistics_within(trace, ties::MEMORY, |done, _| progress(done))
}

/// Reads a trace and counts; reads it again to find fragments at one depth, as often as
/// `memory` bytes for them make necessary. A KiB for each touched tile comes to that.
/// `progress` is told how many fragments were read, of how many: of the first reading, then
/// of all others.
///
/// # Errors
/// As [`Trace::batch`]; [`crate::error::Error::Config`] where one pixel's fragments need more
/// memory: a quarter of a byte each.
pub fn statistics_within(
    trace: &Trace,
    memory: u64,
    mut progress: impl FnMut(u64, u64),
) -> Result<Statistics> {
    let header = trace.header();
    let samples = header.pattern.samples();
    let grid = TileGrid::new(header.width, header.height);
    // A pixel's fragments; the top bit says that an edge crosses it.
    const EDGE: u32 = 1 << 31;
    let mut counts: Counts = TileMap::new(grid);
    let mut whole_fragments = 0;
    let mut covered_samples = 0_u64;
    let mut alpha_sum = 0.0;
    let mut alpha = AlphaStatistics {
        min: f32::INFINITY,
        mean: 0.0,
        max: f32::NEG_INFINITY,
        zero: 0,
        opaque: 0,
        histogram: [0; ALPHA_BINS],
    };
    let mut depth: Option<[u32; 2]> = None;
    let mut objects: BTreeMap<u32, u64> = BTreeMap::new();
    let mut more = false;
    let mut primitives = 0;
    let mut done = 0;

    for batch in trace.batches() {
        let batch = batch?;
        for f in batch.iter() {
            let tile =
                counts.get_or_insert_with(grid.tile(f.x, f.y), || Box::new([0; TILE_PIXELS]));
            let pixel = &mut tile[TileGrid::within(f.x, f.y)];
            if *pixel & !EDGE < !EDGE {
                *pixel += 1;
            }
            let covered = f.coverage.count();
            if covered == samples {
                whole_fragments += 1;
            } else {
                *pixel |= EDGE;
            }
            covered_samples += u64::from(covered);
            alpha.min = alpha.min.min(f.alpha);
            alpha.max = alpha.max.max(f.alpha);
            alpha_sum += f64::from(f.alpha);
            alpha.zero += u64::from(f.alpha == 0.0);
            alpha.opaque += u64::from(f.alpha == 1.0);
            let bin = (f.alpha * ALPHA_BINS as f32) as usize;
            alpha.histogram[bin.min(ALPHA_BINS - 1)] += 1;
            let z = f.depth.z.0;
            depth = Some(depth.map_or([z, z], |[near, far]| [near.min(z), far.max(z)]));
            if let Some(n) = objects.get_mut(&f.object) {
                *n += 1;
            } else if objects.len() < MAX_OBJECTS {
                objects.insert(f.object, 1);
            } else {
                more = true;
            }
            primitives = primitives.max(u64::from(f.primitive) + 1);
        }
        done += batch.len() as u64;
        progress(done, trace.rows());
    }

    let mut pixels_by_count = BTreeMap::new();
    let mut interior_pixels = 0;
    let pixels = counts.touched_mut().iter_mut().flat_map(|(_, tile)| tile.iter_mut());
    for count in pixels.filter(|count| **count > 0) {
        interior_pixels += u64::from(*count & EDGE == 0);
        *count &= !EDGE;
        *pixels_by_count.entry(*count).or_insert(0) += 1;
    }
    let fragments = trace.rows();
    let covered_pixels: u64 = pixels_by_count.values().sum();
    if fragments == 0 {
        (alpha.min, alpha.max) = (0.0, 0.0);
    } else {
        alpha.mean = alpha_sum / fragments as f64;
    }
    let mut largest: Vec<(u32, u64)> = objects.iter().map(|(o, n)| (*o, *n)).collect();
    largest.sort_by_key(|(o, n)| (std::cmp::Reverse(*n), *o));
    largest.truncate(10);
    let share = |z: u32| f64::from(z) / f64::from(u32::MAX);
    Ok(Statistics {
        fragments,
        covered_pixels,
        whole_fragments,
        interior_pixels,
        depth_complexity: Distribution::new(&pixels_by_count),
        layers: if covered_pixels == 0 {
            0.0
        } else {
            covered_samples as f64 / (covered_pixels as f64 * f64::from(samples))
        },
        tied_fragments: ties::tied(trace, samples, &counts, memory, &mut progress)?,
        alpha,
        depth: depth.map(|d| d.map(share)),
        objects: Objects { count: objects.len(), more, largest },
        primitives,
    })
}
