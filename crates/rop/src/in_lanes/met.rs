//! A fragment of each of sixteen pixels.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, i32x16, mask32x16, u32x4, u32x16};

use crate::in_lanes::window::{ROOM, Row, Window};
use crate::in_lanes::{LANES, Wide};
use screendoor_trace::trace::{DepthPlane, Unorm32};

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

/// The depths of planes at offsets from the pixels' centres, in 1/16 pixel and at most half a
/// pixel along each axis: [`DepthPlane::at`].
#[inline(always)]
pub fn depth_at<S: Simd>(
    simd: S,
    z: u32x16<S>,
    [across, down]: [i32x16<S>; 2],
    [x, y]: [i32x16<S>; 2],
) -> u32x16<S> {
    let word = |word: u32| u32x16::splat(simd, word);
    let size = |x: i32x16<S>| x.abs().bitcast::<u32x16<S>>();
    let (wide, high) = (size(across), size(down));
    let reach = ((wide + high) >> 1) + word(1);
    let steep = (wide | high).simd_ge(word(1 << 27)) | z.simd_lt(reach) | (z + reach).simd_lt(z);
    if steep.any_true() {
        return steep_at(simd, z, [across, down], [x, y]);
    }
    z + ((across * x + down * y) >> 4).bitcast::<u32x16<S>>()
}

/// The same, one by one.
#[cold]
#[inline(never)]
fn steep_at<S: Simd>(
    simd: S,
    z: u32x16<S>,
    slopes: [i32x16<S>; 2],
    offset: [i32x16<S>; 2],
) -> u32x16<S> {
    let signed = |v: i32x16<S>| {
        let mut list = [0; LANES];
        v.store_slice(&mut list);
        list
    };
    let mut depths = [0; LANES];
    z.store_slice(&mut depths);
    let ([across, down], [x, y]) = (slopes.map(signed), offset.map(signed));
    for (i, depth) in depths.iter_mut().enumerate() {
        let plane = DepthPlane { z: Unorm32(*depth), dzdx: across[i], dzdy: down[i] };
        *depth = plane.at([x[i] as i8, y[i] as i8]).0;
    }
    u32x16::from_slice(simd, &depths)
}

/// In double precision.
#[inline(always)]
pub fn widened<S: Simd>(simd: S, x: f32x16<S>) -> Wide<S> {
    let (low, high) = simd.widen_f32x16(x);
    [low, high]
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
