//! Sixteen pixels at once: a lane for each *pixel*, where [`kernel`](super::kernel) has one for
//! each sample of a pixel.
//!
//! There a fragment has to wait until the one before it in its pixel is done, and of its lanes
//! those are idle whose samples it does not cover. Here a round draws a fragment of each of
//! sixteen pixels, and what is done for a sample is done for sixteen at once. It takes many
//! fragments of a tile to find enough that can be drawn side by side, and the
//! comparisons that sort a fragment's samples grow as the square of their number:
//! [`worth_it`] says where it pays. The bits are the same.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over samples are unrolled into registers, several lists at a time"
)]

mod draw;
mod hits;
mod lists;
mod met;
mod packed;
#[cfg(test)]
mod tests;
mod tracked;
mod window;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, u32x16};

pub(super) use draw::{add, draw, picture};
pub(super) use hits::nested;
pub use met::{Abreast, Counted, Met, Source, gather};
pub use packed::{Ranks, STRIDE, bit, left_by};
use screendoor_trace::random::MIX;
pub use tracked::NumberedAbreast;
pub(super) use tracked::from_first;
pub(super) use window::Window;

/// The most samples of a pixel whose sorting pays in lanes of pixels: of 16, whose depths and
/// winners are more than there are registers, it took 1.3 to 1.6 times as long as in lanes of
/// samples.
pub(super) const MOST_SAMPLES: usize = 8;

/// Fragments of a tile that are looked at together, at most: with their lists they should
/// lie in the second-level cache.
pub(super) const MOST_ROWS: usize = 1 << 13;

/// Whether so many rows of a tile are enough.
pub(super) const fn worth_it(samples: usize, rows: usize) -> bool {
    samples <= MOST_SAMPLES && rows >= 350
}

/// [`screendoor_trace::random::mix`] in lanes.
#[inline(always)]
pub fn mixed<S: Simd>(simd: S, x: u32x16<S>) -> u32x16<S> {
    let word = |word: u32| u32x16::splat(simd, word);
    let x = x ^ (x >> 16);
    let x = x * word(MIX[0]);
    let x = x ^ (x >> 15);
    let x = x * word(MIX[1]);
    x ^ (x >> 16)
}

/// A sampler that has no lanes of pixels.
#[derive(Clone, Copy, Debug)]
pub struct OneByOne<K>(std::marker::PhantomData<fn() -> K>, Never);

#[derive(Clone, Copy, Debug)]
enum Never {}

impl<K, const N: usize> Abreast<N> for OneByOne<K> {
    type Kept = K;
    type Lanes<S: Simd> = ();

    fn source(&self) -> Source {
        match self.1 {}
    }
    fn load<S: Simd>(
        &self,
        _: S,
        _: &crate::stochastic::methods::Round,
        _: &[K; screendoor_trace::tile::TILE_PIXELS],
        _: &[u8; 16],
    ) {
        match self.1 {}
    }
    fn store<S: Simd>(
        &self,
        (): &(),
        _: &mut [K; screendoor_trace::tile::TILE_PIXELS],
        _: &[u8; 16],
    ) {
        match self.1 {}
    }
    fn choose<S: Simd, P: crate::contract::event::Probe>(
        &self,
        _: S,
        (): &mut (),
        _: &Met<'_, S, N>,
        _: &mut Counted<S, P>,
    ) -> [fearless_simd::mask32x16<S>; N] {
        match self.1 {}
    }
}
