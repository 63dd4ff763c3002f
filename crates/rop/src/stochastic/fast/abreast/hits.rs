//! Which numbers of a surface pass the opacity test: of all values of a pixel one hash.
//!
//! For `N = 2^b` samples the values of figure 4 differ in their upper `b` bits, the stratum:
//! numbers are added there, and since every factor is even, what a stratum's bits do in a
//! multiplication stays among them. So all values of a pixel share their lower bits `L`,
//! which are hashed once, and of each number only its stratum `t` is followed: with
//! `y = L·c`, a round is `t ^= (top_b(y) + c·t) mod N`, `L = (L ^ y) mod 2^(32−b)`. A value
//! is less than `T` where `t < top_b(T)`, or `t = top_b(T)` and `L < T mod 2^(32−b)`.
//!
//! Strata of up to 8 samples take four bits of one word, those of 16 bytes of four words.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, mask32x16, u32x16};

use crate::stochastic::fast::abreast::packed::{all, bit};
use crate::stochastic::reference_value::LK2011;

/// Thresholds of sixteen pixels.
#[derive(Clone, Copy)]
pub(in crate::stochastic::fast) struct Limits<S: Simd> {
    /// Modulo 2^32.
    pub threshold: u32x16<S>,
    /// Where it is 2^32.
    pub opaque: mask32x16<S>,
}

impl<S: Simd> Limits<S> {
    /// Where a value lies below.
    #[inline(always)]
    pub(super) fn pass(&self, values: u32x16<S>) -> mask32x16<S> {
        values.simd_lt(self.threshold) | self.opaque
    }
}

/// A set of numbers from where each of them passes.
#[inline(always)]
pub(super) fn each<S: Simd, const N: usize>(
    simd: S,
    limits: &Limits<S>,
    mut value: impl FnMut(u32) -> u32x16<S>,
) -> u32x16<S> {
    let none = u32x16::splat(simd, 0);
    let mut hits = none;
    for n in 0..N {
        let hit = values_bit::<S, N>(simd, n);
        hits |= limits.pass(value(n as u32)).select(hit, none);
    }
    hits
}

#[inline(always)]
fn values_bit<S: Simd, const N: usize>(simd: S, n: usize) -> u32x16<S> {
    u32x16::splat(simd, bit(N, n))
}

/// Strata as they lie in words.
struct Fields<const N: usize>;

impl<const N: usize> Fields<N> {
    /// Bits of a stratum.
    const BITS: u32 = N.trailing_zeros();
    const WORDS: usize = if N <= 8 { 1 } else { N / 4 };
    const WIDTH: u32 = if N <= 8 { 4 } else { 8 };
    /// The lowest bit of each field.
    const ONES: u32 = if N <= 8 { 0x1111_1111 } else { 0x0101_0101 };
    const UPPER: u32 = Self::ONES << (Self::WIDTH - 1);
    const STRATA: u32 = (N as u32 - 1) * Self::ONES;

    /// The number whose stratum is in field `field` of word `word`.
    const fn number(word: usize, field: usize) -> usize {
        field * Self::WORDS + word
    }

    /// Where numbers are added: their bits in reverse.
    const fn first(word: usize) -> u32 {
        let (mut bits, mut field) = (0, 0);
        while field < 32 / Self::WIDTH as usize {
            let number = (Self::number(word, field) % N) as u32;
            bits |= (number.reverse_bits() >> (32 - Self::BITS)) << (Self::WIDTH * field as u32);
            field += 1;
        }
        bits
    }
}

/// `top_b(y) + factor·t` in each field, but for what lies above a stratum's bits.
#[inline(always)]
fn added<S: Simd, const N: usize>(
    simd: S,
    strata: u32x16<S>,
    top: u32x16<S>,
    factor: u32,
) -> u32x16<S> {
    let word = |word: u32| u32x16::splat(simd, word);
    let factor = factor % N as u32;
    // The bits of a field that are left of it, shifted.
    let shifted = |by: u32| {
        let kept = ((N as u32 - 1) << by & (N as u32 - 1)) * Fields::<N>::ONES;
        (strata << by) & word(kept)
    };
    let less = (N as u32 - factor) % N as u32;
    if factor == 0 {
        top
    } else if !factor.is_power_of_two() && less.is_power_of_two() {
        // With the upper bit of each field, nothing is borrowed from the next.
        (top | word(Fields::<N>::UPPER)) - shifted(less.trailing_zeros())
    } else {
        let mut sum = top;
        for by in 1..5 {
            if factor >> by & 1 == 1 {
                sum += shifted(by);
            }
        }
        sum
    }
}

/// The numbers that pass of those whose first value, before it is hashed by `ROUNDS` rounds of
/// figure 4, is `x`.
#[inline(always)]
pub(in crate::stochastic::fast) fn nested<S: Simd, const N: usize, const ROUNDS: usize>(
    simd: S,
    x: u32x16<S>,
    limits: &Limits<S>,
) -> u32x16<S> {
    let word = |word: u32| u32x16::splat(simd, word);
    if N == 1 {
        let mut x = x;
        for factor in &LK2011[..ROUNDS] {
            x = x ^ (x * word(*factor));
        }
        return limits.pass(x).select(word(all(N)), word(0));
    }
    let top = |x: u32x16<S>| (x >> (32 - Fields::<N>::BITS)) * word(Fields::<N>::ONES);
    let low = word(u32::MAX >> Fields::<N>::BITS);
    let kept = word(Fields::<N>::STRATA);
    // Up to four words are needed.
    let mut strata = [word(0); 4];
    let start = top(x);
    for i in 0..Fields::<N>::WORDS {
        strata[i] = (start + word(Fields::<N>::first(i))) & kept;
    }
    let mut lower = x & low;
    for factor in &LK2011[..ROUNDS] {
        let y = lower * word(*factor);
        let top = top(y);
        for i in 0..Fields::<N>::WORDS {
            strata[i] = strata[i] ^ (added::<S, N>(simd, strata[i], top, *factor) & kept);
        }
        lower = (lower ^ y) & low;
    }
    // How many strata pass.
    let whole = limits.threshold >> (32 - Fields::<N>::BITS);
    let part = lower.simd_lt(limits.threshold & low);
    let passing = part.select(whole + word(1), whole);
    let passing = limits.opaque.select(word(N as u32), passing);
    // A field's upper bit is set where its stratum is not among them.
    let beyond = (word(1 << (Fields::<N>::WIDTH - 1)) - passing) * word(Fields::<N>::ONES);
    if N <= 8 {
        return !(strata[0] + beyond) & word(all(N));
    }
    let mut hits = word(0);
    for i in 0..Fields::<N>::WORDS {
        let failed = (strata[i] + beyond) >> (Fields::<N>::WIDTH - 1 - i as u32);
        hits |= !failed & word(Fields::<N>::ONES << i);
    }
    // Four bits of each byte side by side.
    let hits = (hits | hits >> 4) & word(0x00ff_00ff);
    (hits | hits >> 8) & word(0xffff)
}
