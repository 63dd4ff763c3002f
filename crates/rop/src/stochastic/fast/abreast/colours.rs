//! The colours of the fragments that samples were written by.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, f32x16, f64x2, i32x4, u32x4, u32x16};

use crate::in_lanes::words as words_of;
use crate::lanes::{Count, Width};
use crate::resolve::box_filter;
use crate::stochastic::fast::abreast::lists::LANES;
use crate::stochastic::fast::abreast::window::{NOBODY, Window};
use crate::stochastic::fast::sampler::FastSampler;
use crate::stochastic::fast::state::FastTile;

/// [`box_filter`] of the colours of a pixel's winners.
#[inline(always)]
pub(super) fn mean<S: Simd, const N: usize>(
    simd: S,
    window: &Window,
    winners: &[[u32; LANES]; N],
    lane: usize,
) -> [f64; 3] {
    let colour = |s: usize| f32x4::from_slice(simd, window.colour(winners[s][lane]));
    let first = colour(0);
    let (mut sum, mut others) = (f32x4::splat(simd, 0.0), u32x4::splat(simd, 0));
    for s in 0..N {
        let colour = colour(s);
        others |= colour.bitcast::<u32x4<S>>() ^ first.bitcast::<u32x4<S>>();
        sum += colour;
    }
    let mean = sum / N as f32;
    // Sums of finite colours that are too large.
    if !mean.is_finite().all_true() {
        return slow_mean(window, winners, lane);
    }
    let same = others.simd_eq(u32x4::splat(simd, 0)).all_true();
    let mean = if same { first } else { mean };
    let mut channels = [0.0; 4];
    mean.store_slice(&mut channels);
    [channels[0], channels[1], channels[2]].map(f64::from)
}

#[cold]
#[inline(never)]
fn slow_mean<const N: usize>(
    window: &Window,
    winners: &[[u32; LANES]; N],
    lane: usize,
) -> [f64; 3] {
    let colours: [[f32; 3]; N] = std::array::from_fn(|s| {
        let [r, g, b, _] = *window.colour(winners[s][lane]);
        [r, g, b]
    });
    box_filter(&colours)
}

/// Gives samples the colours of the fragments that they were written by.
#[inline(always)]
pub(super) fn colour<S: Simd, F: FastSampler<N>, const N: usize>(
    simd: S,
    winner: &[u32x16<S>; N],
    tile: &mut FastTile<F, N>,
    window: &Window,
    pixels: &[u8; LANES],
) where
    Count<N>: Width,
{
    let mut winners = [[0; LANES]; N];
    for s in 0..N {
        winner[s].store_slice(&mut winners[s]);
    }
    for (lane, pixel) in pixels.iter().enumerate() {
        let colours = &mut tile.held[usize::from(*pixel)].colour;
        if N < 4 {
            for s in 0..N {
                if winners[s][lane] != NOBODY {
                    let colour = window.colour(winners[s][lane]);
                    for (row, channel) in colours.iter_mut().zip(colour) {
                        row.as_mut()[s] = channel.to_bits() as i32;
                    }
                }
            }
            continue;
        }
        for s in (0..N).step_by(4) {
            let who = [0, 1, 2, 3].map(
                #[inline(always)]
                |i| winners[s + i][lane],
            );
            let written = u32x4::simd_from(simd, who).simd_ne(u32x4::splat(simd, NOBODY));
            if written.any_true() {
                let channels = four(simd, window, who);
                for (row, new) in colours.iter_mut().zip(channels) {
                    let row: &mut [i32] = &mut row.as_mut()[s..s + 4];
                    written.select(new, i32x4::from_slice(simd, row)).store_slice(row);
                }
            }
        }
    }
}

/// Red, green and blue of four fragments.
#[inline(always)]
fn four<S: Simd>(simd: S, window: &Window, who: [u32; 4]) -> [i32x4<S>; 3] {
    let colour = |i: usize| f32x4::from_slice(simd, window.colour(who[i]));
    let [a, b, c, d] = [colour(0), colour(1), colour(2), colour(3)];
    let pairs = |x: f32x4<S>, y: f32x4<S>| {
        [x.zip_low(y), x.zip_high(y)].map(|pair| pair.bitcast::<f64x2<S>>())
    };
    let ([rg, b_], [rg_later, b_later]) = (pairs(a, b), pairs(c, d));
    [rg.zip_low(rg_later), rg.zip_high(rg_later), b_.zip_low(b_later)]
        .map(|channel| channel.bitcast::<i32x4<S>>())
}

/// Red, green and blue of sixteen fragments.
#[inline(always)]
pub(super) fn sixteen<S: Simd>(simd: S, window: &Window, who: u32x16<S>) -> [f32x16<S>; 3] {
    let who = words_of(who);
    let [a, b, c, d] = [0, 4, 8, 12].map(
        #[inline(always)]
        |first: usize| {
            let [a, b, c, d] = [first, first + 1, first + 2, first + 3].map(
                #[inline(always)]
                |i| f32x4::from_slice(simd, window.colour(who[i])),
            );
            simd.combine_f32x8(simd.combine_f32x4(a, b), simd.combine_f32x4(c, d))
        },
    );
    let (even, odd) = simd.deinterleave_f32x16(a, b);
    let (later_even, later_odd) = simd.deinterleave_f32x16(c, d);
    let (red, blue) = simd.deinterleave_f32x16(even, later_even);
    let (green, _) = simd.deinterleave_f32x16(odd, later_odd);
    [red, green, blue]
}
