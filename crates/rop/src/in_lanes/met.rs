//! A fragment of each of sixteen pixels.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, i32x16, mask32x16, u32x4, u32x16};

use crate::in_lanes::LANES;
use crate::in_lanes::window::{ROOM, Row, Window};

/// A fragment of each of sixteen pixels; of a pixel that has none the coverage is empty.
#[derive(Clone, Copy)]
pub struct Met<S: Simd> {
    /// The pixels: their columns, and their rows in the upper sixteen bits.
    pub pixel: u32x16<S>,
    /// Where there is a fragment.
    pub any: mask32x16<S>,
    /// The samples that are covered.
    pub coverage: u32x16<S>,
    /// The depths at the pixels' centres.
    pub z: u32x16<S>,
    /// What is added to depths by a pixel to the right, and by one downwards.
    pub slopes: [i32x16<S>; 2],
    /// Colours, not multiplied by alpha.
    pub colour: [f32x16<S>; 3],
    /// Opacities.
    pub alpha: f32x16<S>,
    /// The primitives' numbers.
    pub primitive: u32x16<S>,
}

impl<S: Simd> Met<S> {
    /// These rows of a window.
    #[inline(always)]
    pub(super) fn of(simd: S, window: &Window, numbers: &[u16; LANES], pixel: u32x16<S>) -> Self {
        let [z, across, down, coverage] = window.rows(simd, numbers);
        let [r, g, b, alpha] = window.paints(simd, numbers);
        Met {
            pixel,
            any: coverage.simd_ne(u32x16::splat(simd, 0)),
            coverage,
            z,
            slopes: [across.bitcast(), down.bitcast()],
            colour: [r.bitcast(), g.bitcast(), b.bitcast()],
            alpha: alpha.bitcast(),
            primitive: window.primitives(simd, numbers),
        }
    }
}

/// The first words of sixteen rows, the second ones, and so on.
#[inline(always)]
pub(super) fn transposed<S: Simd>(
    simd: S,
    numbers: &[u16; LANES],
    rows: &[Row; ROOM],
) -> [u32x16<S>; 4] {
    let (even, odd) =
        simd.deinterleave_u32x16(four(simd, numbers, rows, 0), four(simd, numbers, rows, 4));
    let (later_even, later_odd) =
        simd.deinterleave_u32x16(four(simd, numbers, rows, 8), four(simd, numbers, rows, 12));
    let (first, third) = simd.deinterleave_u32x16(even, later_even);
    let (second, fourth) = simd.deinterleave_u32x16(odd, later_odd);
    [first, second, third, fourth]
}

/// Four rows, one after the other.
#[inline(always)]
fn four<S: Simd>(simd: S, numbers: &[u16; LANES], rows: &[Row; ROOM], first: usize) -> u32x16<S> {
    let low =
        simd.combine_u32x4(one(simd, numbers, rows, first), one(simd, numbers, rows, first + 1));
    let high = simd
        .combine_u32x4(one(simd, numbers, rows, first + 2), one(simd, numbers, rows, first + 3));
    simd.combine_u32x8(low, high)
}

#[inline(always)]
fn one<S: Simd>(simd: S, numbers: &[u16; LANES], rows: &[Row; ROOM], i: usize) -> u32x4<S> {
    u32x4::from_slice(simd, &rows[usize::from(numbers[i]) % ROOM])
}
