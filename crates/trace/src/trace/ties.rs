//! Fragments that lie at one depth with others of their pixel.

use rayon::prelude::*;

use crate::error::Result;
use crate::tile::{TileGrid, TileId, TileMap};
use crate::trace::fragment::{DepthPlane, SampleMask};
use crate::trace::read::Trace;

/// Fragments that are held at a time: they take 24 bytes each.
const AT_A_TIME: u64 = 1 << 24;

/// What of a fragment decides whether it is tied: its place in the tile, where it lies and
/// what it covers.
type Row = (u8, DepthPlane, SampleMask);

/// How many fragments share a depth with another one: both cover a sample among the first
/// `samples`, and have the same 32-bit depth there or at the pixel's centre. Where depths
/// are the same at the sample, the drawing order alone says which lies in front; where they
/// are at the centre, designs that know a fragment by its depth there take the two for one.
///
/// Exact, for every sample. The trace is read once to count and then once for every 16
/// million fragments.
///
/// # Errors
/// As [`Trace::batch`] and [`crate::trace::SamplePattern::prefix`].
pub fn tied_fragments(trace: &Trace, samples: u32) -> Result<u64> {
    tied(trace, samples, AT_A_TIME)
}

fn tied(trace: &Trace, samples: u32, at_a_time: u64) -> Result<u64> {
    let header = trace.header();
    let grid = TileGrid::new(header.width, header.height);
    let positions = header.pattern.prefix(samples)?;
    let all = SampleMask::first(samples);
    let mut counts: TileMap<u64> = TileMap::new(grid);
    for batch in trace.batches() {
        let batch = batch?;
        for i in 0..batch.len() {
            let (x, y) = batch.pixel(i);
            *counts.get_or_insert_with(grid.tile(x, y), || 0) += 1;
        }
    }
    let mut tied = 0;
    let mut tiles = counts.touched();
    while !tiles.is_empty() {
        let (group, rest) = tiles.split_at(fitting(tiles, at_a_time));
        tiles = rest;
        let mut rows: TileMap<Vec<Row>> = TileMap::new(grid);
        for (tile, count) in group {
            rows.get_or_insert_with(*tile, || Vec::with_capacity(*count as usize));
        }
        for batch in trace.batches() {
            for f in batch?.iter() {
                let tile = grid.tile(f.x, f.y);
                let coverage = f.coverage & all;
                if coverage.is_empty() || rows.get(tile).is_none() {
                    continue;
                }
                let within = TileGrid::within(f.x, f.y) as u8;
                rows.get_or_insert_with(tile, Vec::new).push((within, f.depth, coverage));
            }
        }
        let of_tile = |(_, rows): (TileId, Vec<Row>)| tied_in_tile(rows, positions);
        tied += rows.into_touched().into_par_iter().map(of_tile).sum::<u64>();
    }
    Ok(tied)
}

/// How many of the first tiles hold `at_a_time` fragments at most; one at least.
fn fitting(tiles: &[(TileId, u64)], at_a_time: u64) -> usize {
    let mut held = 0;
    let fits = tiles.iter().take_while(|(_, count)| {
        held += count;
        held <= at_a_time
    });
    fits.count().max(1)
}

fn tied_in_tile(mut rows: Vec<Row>, positions: &[[i8; 2]]) -> u64 {
    rows.sort_by_key(|(within, ..)| *within);
    let mut tied = 0;
    for pixel in rows.chunk_by(|a, b| a.0 == b.0).filter(|p| p.len() > 1) {
        let mut is_tied = vec![false; pixel.len()];
        let mut depths = Vec::with_capacity(pixel.len());
        for (s, position) in positions.iter().enumerate() {
            for at in [*position, [0, 0]] {
                depths.clear();
                let here = pixel.iter().enumerate().filter(|(_, row)| row.2.contains(s));
                depths.extend(here.map(|(i, row)| (row.1.at(at), i)));
                depths.sort_unstable();
                for pair in depths.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
                    pair.iter().for_each(|(_, i)| is_tied[*i] = true);
                }
            }
        }
        tied += is_tied.iter().filter(|t| **t).count() as u64;
    }
    tied
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trace::{
        ColourFormat, Fragment, Header, SamplePattern, TraceWriter, Unorm32, WriteOptions,
    };

    /// Pixel, coverage, depth, and how far the depth rises in a pixel towards the second sample.
    type Placed = (u16, u64, u32, i32);

    /// The tied fragments of a list.
    fn of(list: &[Placed], samples: u32, at_a_time: u64) -> u64 {
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
        let options = WriteOptions { batch_rows: 3, ..WriteOptions::default() };
        let mut writer = TraceWriter::new(Vec::new(), "test", header, options).unwrap();
        for (i, (x, coverage, z, rise)) in list.iter().enumerate() {
            let depth = DepthPlane { z: Unorm32(*z), dzdx: -*rise, dzdy: 0 };
            let coverage = SampleMask(*coverage);
            let (primitive, object) = (i as u32, 0);
            let (colour, alpha) = ([1.0; 3], 0.5);
            let f = Fragment {
                x: *x,
                y: 1,
                coverage,
                depth,
                colour,
                alpha,
                primitive,
                object,
                ..Fragment::default()
            };
            writer.push(&f).unwrap();
        }
        let trace = Trace::from_bytes(writer.finish().unwrap().0, "test").unwrap();
        tied(&trace, samples, at_a_time).unwrap()
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
        for at_a_time in [1, 33, 1000] {
            assert_eq!(of(&list, 2, at_a_time), 40, "{at_a_time}");
        }
    }
}
