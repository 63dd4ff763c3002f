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

mod colours;
mod comb;
mod depths;
mod draw;
mod held;
mod hits;
mod lists;
mod met;
mod one_by_one;
mod packed;
#[cfg(test)]
mod tests;
mod tracked;
mod window;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, u32x16};

pub use comb::{exchanged_teeth, white};
pub(super) use draw::{add, draw, picture};
pub(super) use hits::nested;
pub use met::{Abreast, Counted, Met, Source, gather};
pub use one_by_one::OneByOne;
pub use packed::{Ranks, STRIDE, bit, left_by};
use screendoor_trace::random::{GOLDEN, MIX};
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

/// [`screendoor_trace::random::hash_on`] of one word in lanes.
#[inline(always)]
pub fn hashed_on<S: Simd>(simd: S, before: u32x16<S>, word: u32x16<S>) -> u32x16<S> {
    mixed(simd, (before ^ word) + u32x16::splat(simd, GOLDEN))
}
