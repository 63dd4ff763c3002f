//! Numbers of sixteen pixels.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, i32x16, mask32x16, u32x16};

use crate::fast::hashed_on;
use crate::in_lanes::{LANES, Wide};
use screendoor_trace::random::GOLDEN;
use screendoor_trace::trace::{DepthPlane, Unorm32};

/// [`screendoor_trace::random::hash`].
#[inline(always)]
pub fn hashed<S: Simd, const N: usize>(simd: S, words: [u32x16<S>; N]) -> u32x16<S> {
    let mut h = u32x16::splat(simd, GOLDEN);
    for word in words {
        h = hashed_on(simd, h, word);
    }
    h
}

/// How many samples sets have.
#[inline(always)]
pub fn counted<S: Simd>(simd: S, sets: u32x16<S>) -> f32x16<S> {
    simd.cvt_f32_u32x16(simd.count_ones_u32x16(sets))
}

/// The words of a vector.
#[inline(always)]
pub fn words<S: Simd>(vector: u32x16<S>) -> [u32; LANES] {
    let mut words = [0; LANES];
    vector.store_slice(&mut words);
    words
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
    if reaches_ends(simd, z, [across, down]).any_true() {
        return steep_at(simd, z, [across, down], [x, y]);
    }
    z + ((across * x + down * y) >> 4).bitcast::<u32x16<S>>()
}

/// Where depths do not follow from 32 bits: of steep planes, and of those that may come to an end
/// of the depth range within the pixel.
#[inline(always)]
pub fn reaches_ends<S: Simd>(
    simd: S,
    z: u32x16<S>,
    [across, down]: [i32x16<S>; 2],
) -> mask32x16<S> {
    let word = |word: u32| u32x16::splat(simd, word);
    let (wide, high) = (across.abs().bitcast::<u32x16<S>>(), down.abs().bitcast::<u32x16<S>>());
    let reach = ((wide + high) >> 1) + word(1);
    (wide | high).simd_ge(word(1 << 27)) | z.simd_lt(reach) | (z + reach).simd_lt(z)
}

/// The same as [`depth_at`], one by one.
#[cold]
#[inline(never)]
fn steep_at<S: Simd>(
    simd: S,
    z: u32x16<S>,
    slopes: [i32x16<S>; 2],
    offset: [i32x16<S>; 2],
) -> u32x16<S> {
    let signed = |v: i32x16<S>| words(v.bitcast()).map(|word| word as i32);
    let mut depths = words(z);
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
