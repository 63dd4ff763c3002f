//! A triangle's coverage, row by row, a pixel's samples in vectors.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, i32x16};

use crate::capture::lanes::three;
use crate::capture::raster::Raster;
use crate::capture::samples::{MOST, VECTOR};
use crate::capture::setup::STEPS;
use screendoor_trace::trace::SampleMask;

/// Up to this many pixels in a row it is quicker to look at each than to find out, by
/// dividing, which of them the edges leave.
const SHORT: i64 = 6;
/// Edges whose extents along x and y add up to less change by less than 2^31 from a pixel's
/// centre to a sample.
const LONGEST: i64 = 1 << 24;

/// A pixel with a covered sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Covered {
    pub x: i64,
    pub coverage: SampleMask,
    /// The edges' values at the pixel's centre.
    pub values: [i64; 3],
}

/// What a triangle's edges change by from a pixel's centre to each sample.
pub(super) type Changes = [[i32; MOST]; 3];

/// A triangle with what its edges change by from a pixel's centre to each sample.
pub(super) struct Scan<'r, 'a> {
    raster: &'r Raster<'a>,
    changes: &'r Changes,
    /// Whether the changes fit into 32 bits; where they do not, coverage is found one sample at a time.
    fits: bool,
}

impl<'r, 'a> Scan<'r, 'a> {
    #[inline(always)]
    pub(super) fn new<S: Simd>(simd: S, raster: &'r Raster<'a>, room: &'r mut Changes) -> Self {
        let samples = raster.samples;
        for (edge, changes) in raster.edges.iter().zip(&mut *room) {
            for i in (0..samples.padded).step_by(VECTOR) {
                let x = i32x16::from_slice(simd, &samples.lanes[0][i..i + VECTOR]);
                let y = i32x16::from_slice(simd, &samples.lanes[1][i..i + VECTOR]);
                let change = x * edge.a as i32 + y * edge.b as i32;
                change.store_slice(&mut changes[i..i + VECTOR]);
            }
        }
        let fits = raster.edges.iter().all(|e| e.a.abs() + e.b.abs() < LONGEST);
        Scan { raster, changes: room, fits }
    }

    /// The samples of a pixel for whose centre the edges have these values.
    #[inline(always)]
    fn coverage<S: Simd>(&self, simd: S, values: [i64; 3]) -> SampleMask {
        if !self.fits {
            return self.raster.coverage(values);
        }
        // A sample is inside where the change is no less than what the value lacks of 0; what
        // does not fit into 32 bits is more, or less, than any change.
        let least = three(
            #[inline(always)]
            |k| (-values[k]).clamp(i32::MIN.into(), i32::MAX.into()) as i32,
        );
        let mut mask = 0;
        for i in (0..self.raster.samples.padded).step_by(VECTOR) {
            let [a, b, c] = three(
                #[inline(always)]
                |k| i32x16::from_slice(simd, &self.changes[k][i..i + VECTOR]).simd_ge(least[k]),
            );
            mask |= (a & b & c).to_bitmask() << i;
        }
        SampleMask(mask) & self.raster.samples.all()
    }

    /// Finds the pixels of row `y` that have a covered sample, from the left.
    #[inline(always)]
    pub(super) fn row<S: Simd>(&self, simd: S, y: i64, mut found: impl FnMut(Covered)) {
        let edges = &self.raster.edges;
        let centre_y = y * STEPS + STEPS / 2;
        let mut span = self.raster.bounds.columns;
        if span.1 - span.0 >= SHORT {
            for edge in edges {
                edge.narrow(&mut span, centre_y);
            }
        }
        let first = [span.0.saturating_mul(STEPS) + STEPS / 2, centre_y];
        let mut values = [edges[0].at(first), edges[1].at(first), edges[2].at(first)];
        for x in span.0..=span.1 {
            // No sign is set where all are positive or 0.
            let all_reach = |k: usize| {
                let at = |i: usize| values[i] + edges[i].spread[k];
                at(0) | at(1) | at(2) >= 0
            };
            if all_reach(1) {
                let inside = all_reach(0);
                let coverage =
                    if inside { self.raster.samples.all() } else { self.coverage(simd, values) };
                if !coverage.is_empty() {
                    found(Covered { x, coverage, values });
                }
            }
            for (value, edge) in values.iter_mut().zip(edges) {
                *value += edge.a * STEPS;
            }
        }
    }
}
