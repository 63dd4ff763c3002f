//! Fragments that lie at one depth with others of their pixel.
//!
//! Tiles are looked at in groups that fit a limit of memory, and the trace is read once for
//! each group; a tile that is too large is cut into ranges of pixels, and of a pixel that is
//! too deep the depths are cut into parts (`deep.rs`).

mod deep;

use std::ops::Range;

use rayon::prelude::*;

use crate::error::Result;
use crate::tile::{TILE_PIXELS, TileGrid, TileId, TileMap};
use crate::trace::fragment::{DepthPlane, SampleMask};
use crate::trace::read::Trace;
use crate::trace::ties::deep::DeepPixel;

/// Bytes that finding ties may take where nobody says how many.
pub(super) const MEMORY: u64 = 512 << 20;

/// Fragments of each pixel, tile by tile.
pub(super) type Counts = TileMap<Box<[u32; TILE_PIXELS]>>;

/// What of a fragment decides whether it is tied: its place in the tile, where it lies and
/// what it covers.
type Row = (u8, DepthPlane, SampleMask);

/// What a fragment takes while its pixel is looked at: its row, its depth at a sample with
/// its place in the pixel, and whether it is tied.
const BYTES_PER_FRAGMENT: u64 = (size_of::<Row>() + size_of::<(u32, u32)>() + 1) as u64;

/// How many fragments share a depth with another one: both cover a sample among the first
/// `samples`, and have the same 32-bit depth there or at the pixel's centre. Where depths
/// are the same at the sample, the drawing order alone says which lies in front; where they
/// are at the centre, designs that know a fragment by its depth there take the two for one.
///
/// Exact, for every sample, in at most 512 MiB beside a KiB for each touched tile. The trace
/// is read once to count, and then once for every 16 million fragments; more often for pixels
/// that hold as many.
///
/// # Errors
/// As [`Trace::batch`] and [`crate::trace::SamplePattern::prefix`];
/// [`crate::error::Error::Config`] for a pixel of more than two billion fragments.
pub fn tied_fragments(trace: &Trace, samples: u32) -> Result<u64> {
    tied_fragments_within(trace, samples, MEMORY)
}

/// As [`tied_fragments`] in at most `memory` bytes.
///
/// # Errors
/// As [`tied_fragments`]; [`crate::error::Error::Config`] where a pixel needs more memory: a
/// quarter of a byte for each of its fragments.
pub fn tied_fragments_within(trace: &Trace, samples: u32, memory: u64) -> Result<u64> {
    let header = trace.header();
    let grid = TileGrid::new(header.width, header.height);
    let mut counts: Counts = TileMap::new(grid);
    for batch in trace.batches() {
        let batch = batch?;
        for i in 0..batch.len() {
            let (x, y) = batch.pixel(i);
            let tile = counts.get_or_insert_with(grid.tile(x, y), || Box::new([0; TILE_PIXELS]));
            let count = &mut tile[TileGrid::within(x, y)];
            *count = count.saturating_add(1);
        }
    }
    tied(trace, samples, &counts, memory, &mut |_, _| ())
}

/// As [`tied_fragments_within`] where `counts` are known. Tells `progress`
/// how many fragments were read, of how many.
///
/// # Errors
/// [`crate::error::Error::Config`] where a pixel needs more memory, with how much.
pub(super) fn tied(
    trace: &Trace,
    samples: u32,
    counts: &Counts,
    memory: u64,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<u64> {
    let positions = trace.header().pattern.prefix(samples)?;
    let Units { groups, deep } = Units::of(counts, memory / BYTES_PER_FRAGMENT);
    let deep: Vec<DeepPixel> = deep
        .into_iter()
        .map(|(tile, within, n)| {
            let site = counts.grid().pixel(tile, within);
            DeepPixel::new(site, u64::from(n), positions, memory)
        })
        .collect::<Result<_>>()?;
    let passes = groups.len() as u64 + deep.iter().map(DeepPixel::passes).sum::<u64>();
    let total = passes * trace.rows();
    let mut done = 0;
    let mut read = |rows: u64| {
        done += rows;
        progress(done, total);
    };
    let mut tied = 0;
    for group in &groups {
        tied += tied_in_group(trace, positions, counts, group, &mut read)?;
    }
    for pixel in deep {
        tied += pixel.tied(trace, &mut read)?;
    }
    Ok(tied)
}

/// Pixels of a tile that are looked at together.
type Part = (TileId, Range<usize>);

/// Groups of pixels that fit into memory, and those that alone do not.
struct Units {
    groups: Vec<Vec<Part>>,
    deep: Vec<(TileId, usize, u32)>,
}

impl Units {
    /// Of groups of at most `most` fragments.
    fn of(counts: &Counts, most: u64) -> Self {
        let mut units = Units { groups: Vec::new(), deep: Vec::new() };
        let (mut group, mut held) = (Vec::new(), 0);
        let mut add = |part: Part, n: u64| {
            if held + n > most && !group.is_empty() {
                units.groups.push(std::mem::take(&mut group));
                held = 0;
            }
            held += n;
            group.push(part);
        };
        for (tile, pixels) in counts.touched() {
            let whole: u64 = pixels.iter().map(|n| u64::from(*n)).sum();
            if whole <= most {
                add((*tile, 0..TILE_PIXELS), whole);
                continue;
            }
            for (within, n) in pixels.iter().enumerate().filter(|(_, n)| **n > 0) {
                if u64::from(*n) <= most {
                    add((*tile, within..within + 1), u64::from(*n));
                } else {
                    units.deep.push((*tile, within, *n));
                }
            }
        }
        if !group.is_empty() {
            units.groups.push(group);
        }
        units
    }
}

/// The tied fragments of a group's pixels, in one pass over the trace.
fn tied_in_group(
    trace: &Trace,
    positions: &[[i8; 2]],
    counts: &Counts,
    group: &[Part],
    read: &mut dyn FnMut(u64),
) -> Result<u64> {
    let grid = counts.grid();
    let all = SampleMask::first(positions.len() as u32);
    // Which of a tile's pixels are wanted, and their rows.
    let mut rows: TileMap<([bool; TILE_PIXELS], Vec<Row>)> = TileMap::new(grid);
    for (tile, within) in group {
        let (wanted, _) = rows.get_or_insert_with(*tile, || ([false; TILE_PIXELS], Vec::new()));
        wanted[within.clone()].fill(true);
    }
    for (tile, (wanted, rows)) in rows.touched_mut() {
        let pixels = counts.get(*tile).into_iter().flat_map(|pixels| pixels.iter());
        let held = pixels.zip(&*wanted).filter(|(_, wanted)| **wanted).map(|(n, _)| *n as usize);
        rows.reserve_exact(held.sum());
    }
    for batch in trace.batches() {
        let batch = batch?;
        for f in batch.iter() {
            let (tile, within) = (grid.tile(f.x, f.y), TileGrid::within(f.x, f.y));
            let coverage = f.coverage & all;
            if coverage.is_empty() || rows.get(tile).is_none_or(|(wanted, _)| !wanted[within]) {
                continue;
            }
            let (_, rows) = rows.get_or_insert_with(tile, || unreachable!("it is there"));
            rows.push((within as u8, f.depth, coverage));
        }
        read(batch.len() as u64);
    }
    let tiles = rows.into_touched().into_par_iter();
    Ok(tiles.map(|(_, (_, rows))| tied_in_tile(rows, positions)).sum())
}

fn tied_in_tile(mut rows: Vec<Row>, positions: &[[i8; 2]]) -> u64 {
    // In place: the order within a pixel decides nothing.
    rows.sort_unstable_by_key(|(within, ..)| *within);
    let mut tied = 0;
    for pixel in rows.chunk_by(|a, b| a.0 == b.0).filter(|p| p.len() > 1) {
        let mut is_tied = vec![false; pixel.len()];
        let mut depths = Vec::with_capacity(pixel.len());
        for (s, position) in positions.iter().enumerate() {
            for at in [*position, [0, 0]] {
                depths.clear();
                let here = pixel.iter().enumerate().filter(|(_, row)| row.2.contains(s));
                depths.extend(here.map(|(i, row)| (row.1.at(at).0, i as u32)));
                mark(&mut depths, |i| is_tied[i as usize] = true);
            }
        }
        tied += is_tied.iter().filter(|t| **t).count() as u64;
    }
    tied
}

/// Sorts fragments by their depths, calls `tied` for each that shares its own with another,
/// and keeps one of each depth.
fn mark(depths: &mut Vec<(u32, u32)>, mut tied: impl FnMut(u32)) {
    depths.sort_unstable();
    for pair in depths.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        pair.iter().for_each(|(_, i)| tied(*i));
    }
    depths.dedup_by_key(|(depth, _)| *depth);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trace::{
        ColourFormat, Fragment, Header, SamplePattern, TraceWriter, Unorm32, WriteOptions,
    };

    /// Pixel, coverage, depth, and how far the depth rises in a pixel towards the second sample.
    type Placed = (u16, u64, u32, i32);

    /// A trace of a list, `batch` fragments in a batch.
    fn trace(list: &[Placed], batch_rows: usize) -> Trace {
        let header = Header {
            width: 40,
            height: 4,
            pattern: SamplePattern {
                name: "two".into(),
                positions: vec![[0, 0], [-8, 0]],
                nested: true,
            },
            background: [0.0; 3],
            colour: ColourFormat::F16,
            source: "test".into(),
            camera: "none".into(),
            ..Header::default()
        };
        let options = WriteOptions { batch_rows, ..WriteOptions::default() };
        let mut writer = TraceWriter::new(Vec::new(), "test", header, options).unwrap();
        for (i, (x, coverage, z, rise)) in list.iter().enumerate() {
            let depth = DepthPlane { z: Unorm32(*z), dzdx: -*rise, dzdy: 0 };
            let coverage = SampleMask(*coverage);
            let (primitive, object) = (i as u32, 0);
            let (colour, alpha) = ([1.0; 3], 0.5);
            let optional = Default::default();
            let f = Fragment {
                x: *x,
                y: 1,
                coverage,
                depth,
                colour,
                alpha,
                primitive,
                object,
                optional,
            };
            writer.push(&f).unwrap();
        }
        Trace::from_bytes(writer.finish().unwrap().0, "test").unwrap()
    }

    fn counts(trace: &Trace) -> Counts {
        let grid = TileGrid::new(trace.header().width, trace.header().height);
        let mut counts: Counts = TileMap::new(grid);
        for f in trace.batches().flat_map(|batch| batch.unwrap().iter().collect::<Vec<_>>()) {
            let tile = counts.get_or_insert_with(grid.tile(f.x, f.y), || Box::new([0; 256]));
            tile[TileGrid::within(f.x, f.y)] += 1;
        }
        counts
    }

    /// The tied fragments of a trace where so many bytes are allowed, and in how many passes.
    fn within(trace: &Trace, samples: u32, memory: u64) -> (u64, u64) {
        let mut passes = 0;
        let found = tied(trace, samples, &counts(trace), memory, &mut |done, total| {
            assert!(done <= total);
            passes = total / trace.rows();
        });
        (found.unwrap(), passes)
    }

    /// The tied fragments of a list, with room for so many.
    fn of(list: &[Placed], samples: u32, at_a_time: u64) -> u64 {
        within(&trace(list, 3), samples, at_a_time * BYTES_PER_FRAGMENT).0
    }

    #[test]
    fn depths_are_shared_where_coverage_meets_and_nowhere_else() {
        let cases: [(&[Placed], u64); 9] = [
            (&[(0, 3, 5, 0), (0, 3, 6, 0)], 0),
            (&[(0, 3, 5, 0), (0, 2, 5, 0), (0, 1, 7, 0)], 2),
            // Pieces of one pixel, and pixels of one depth.
            (&[(0, 1, 5, 0), (0, 2, 5, 0)], 0),
            (&[(0, 3, 5, 0), (1, 3, 5, 0), (17, 3, 5, 0)], 0),
            // Planes that meet at the second sample alone.
            (&[(0, 3, 1000, 0), (0, 3, 900, 200)], 2),
            (&[(0, 3, 1000, 0), (0, 1, 900, 200)], 0),
            // The same at the centre, which is no sample that both cover.
            (&[(0, 2, 1000, 0), (0, 3, 1000, 160), (0, 1, 1000, 0)], 3),
            (&[(0, 2, 1000, 0), (0, 2, 1000, 160), (0, 1, 1001, 0)], 2),
            // Clamped to the near end of the range.
            (&[(0, 2, 5, -1000), (0, 2, 9, -1000), (0, 2, 10, 0)], 2),
        ];
        for (list, expected) in cases {
            assert_eq!(of(list, 2, 100), expected, "{list:?}");
        }
        assert_eq!(of(&[(0, 3, 1000, 0), (0, 3, 900, 200)], 1, 100), 0);
    }

    #[test]
    fn groups_of_tiles_add_up() {
        let list = (0..40).flat_map(|x| [(x, 3, 5, 0), (x, 3, 5 + u32::from(x % 2), 0)]);
        let list: Vec<_> = list.collect();
        for at_a_time in [2, 33, 1000] {
            assert_eq!(of(&list, 2, at_a_time), 40, "{at_a_time}");
        }
    }

    #[test]
    fn a_deep_pixel_is_counted_in_parts() {
        // Of all kinds: depths of one, of a few, of many fragments; planes that meet at one
        // sample alone; and neighbours that fit.
        let n = 40_000;
        let list: Vec<Placed> = (0..n)
            .map(|i: u32| {
                let z = match i % 4 {
                    0 => 7,
                    1 => 1_000_000 + i / 40,
                    2 => 10_000_000 + i * 8,
                    _ => 2_000_000_000 + (i.wrapping_mul(0x9e37_79b9) >> 19),
                };
                let x = if i.is_multiple_of(100) { 3 } else { 2 };
                (x, u64::from(1 + i % 3), z, (i % 5) as i32 * 32)
            })
            .collect();
        let trace = trace(&list, 1 << 12);
        let (expected, once) = within(&trace, 2, 1 << 30);
        assert!(once == 1 && expected > 20_000 && expected < u64::from(n), "{expected}, {once}");
        let mut most = 0;
        for memory in [1 << 20, 300_000, 100_000, 30_000] {
            let (found, passes) = within(&trace, 2, memory);
            assert_eq!(found, expected, "{memory}");
            most = most.max(passes);
        }
        assert!(most > 10, "{most}");
        let error = tied(&trace, 2, &counts(&trace), 5_000, &mut |_, _| ()).unwrap_err();
        let error = error.to_string();
        assert!(error.starts_with("pixel 2,1 alone holds 39600 fragments"), "{error}");
    }

    #[test]
    fn depths_that_are_all_alike_take_no_room() {
        let list: Vec<Placed> = (0..30_000).map(|_| (2, 3, 5, 0)).collect();
        assert_eq!(within(&trace(&list, 1 << 12), 2, 20_000).0, 30_000);
        let list: Vec<Placed> = (0..30_000).map(|i| (2, 3, 5 + i, 0)).collect();
        assert_eq!(within(&trace(&list, 1 << 12), 2, 20_000).0, 0);
    }
}
