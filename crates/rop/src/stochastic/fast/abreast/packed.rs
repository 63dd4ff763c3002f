//! Sets of a pixel's samples, or of their numbers, and what they have in order: a word a pixel,
//! sixteen pixels in a vector.
//!
//! Each of up to 8 samples has four bits of the word, of which a set uses the upper one: a rank
//! fits, so that a comparison that moves one sample up and another down is one addition.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, i32x16, mask32x16, u32x16};

/// Bits between a sample and the next.
pub const STRIDE: u32 = 4;

/// The bit of sample `i`, or of number `i`.
pub const fn bit(i: usize) -> u32 {
    8 << (STRIDE as usize * i)
}

/// All samples.
pub(super) const fn all(samples: usize) -> u32 {
    let (mut bits, mut i) = (0, 0);
    while i < samples {
        bits |= bit(i);
        i += 1;
    }
    bits
}

/// A mask, one bit a sample, as a packed word.
#[inline]
pub(super) fn pack(mask: u32) -> u32 {
    let x = (mask | mask << 12) & 0x000f_000f;
    let x = (x | x << 6) & 0x0303_0303;
    ((x | x << 3) & 0x1111_1111) << 3
}

/// The other way.
#[inline]
pub(super) fn unpack(packed: u32) -> u32 {
    let x = packed >> 3 & 0x1111_1111;
    let x = (x | x >> 3) & 0x0303_0303;
    let x = (x | x >> 6) & 0x000f_000f;
    (x | x >> 12) & 0xff
}

/// [`pack`] in lanes; bits beyond the samples' are left out.
#[inline(always)]
pub(super) fn packed<S: Simd, const N: usize>(simd: S, mask: u32x16<S>) -> u32x16<S> {
    let word = |word: u32| u32x16::splat(simd, word);
    let x = (mask | mask << 12) & word(0x000f_000f);
    let x = (x | x << 6) & word(0x0303_0303);
    ((x | x << 3) << 3) & word(all(N))
}

/// Shifted right by the other lane; nothing is left of a word that is shifted by 32 bits.
///
/// The instructions of AVX-512, AVX2 and NEON all have it so, which a test holds them to.
#[inline(always)]
pub(super) fn right_by<S: Simd>(simd: S, word: u32x16<S>, by: u32x16<S>) -> u32x16<S> {
    simd.shrv_u32x16(word, by)
}

/// Shifted left by the other lane; nothing is left of a word that is shifted by 32 to 60 bits.
#[inline(always)]
pub fn left_by<S: Simd>(simd: S, word: u32x16<S>, by: u32x16<S>) -> u32x16<S> {
    simd.shlv_u32x16(word, by)
}

/// How many there are of a set.
#[inline(always)]
pub(super) fn count<S: Simd>(simd: S, set: u32x16<S>) -> u32x16<S> {
    simd.count_ones_u32x16(set)
}

/// The places of up to 8 samples in an order, from 0: four bits each.
#[derive(Clone, Copy)]
pub struct Ranks<S: Simd, const N: usize>(u32x16<S>);

impl<S: Simd, const N: usize> Ranks<S, N> {
    /// The order of rising keys, of equal keys that of the samples; `after(i, j)` says whether
    /// sample `i` comes after sample `j`, which is the later one.
    #[inline(always)]
    pub fn by(simd: S, after: impl Fn(usize, usize) -> mask32x16<S>) -> Self {
        let word = |word: u32| u32x16::splat(simd, word);
        // As if none came after a later one. Two sums, so that an addition need not wait for the
        // one before.
        let mut sums = [word(0x7654_3210), word(0)];
        for i in 0..N {
            for j in i + 1..N {
                let move_up = word((1_u32 << (4 * i)).wrapping_sub(1 << (4 * j)));
                let sum = &mut sums[(i + j) % 2];
                *sum = after(i, j).select(*sum + move_up, *sum);
            }
        }
        Ranks(sums[0] + sums[1])
    }

    /// [`Ranks::by`] of signed keys.
    #[inline(always)]
    pub fn of(simd: S, keys: &[i32x16<S>; N]) -> Self {
        Self::by(
            simd,
            #[inline(always)]
            |i, j| keys[i].simd_gt(keys[j]),
        )
    }

    /// The order of the samples of a set as they stand.
    #[inline(always)]
    pub fn in_sample_order(simd: S, set: u32x16<S>) -> Self {
        // Each sample's four bits become the sum of those below.
        Ranks((set >> 3) * u32x16::splat(simd, 0x1111_1110))
    }

    /// For each sample whether it is among `among` and its number is among `hits`.
    #[inline(always)]
    pub fn picked(&self, simd: S, hits: u32x16<S>, among: u32x16<S>) -> [mask32x16<S>; N] {
        let word = |word: u32| u32x16::splat(simd, word);
        let none = word(0);
        let mut picked = [none.simd_gt(none); N];
        // A rank takes three of its four bits: with the fourth set where a sample is not among
        // them, its bit is shifted out of the word.
        let ranks = (self.0 | word(0x8888_8888)) ^ among;
        for i in 0..N {
            let by = if i == 0 { ranks << 2 } else { ranks >> (4 * i as u32 - 2) };
            let bit = left_by(simd, word(8), by & word(0x3c));
            picked[i] = (bit & hits).simd_gt(none);
        }
        picked
    }
}
