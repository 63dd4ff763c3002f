//! Which numbers of a surface pass the opacity test: of all values of a pixel one hash.
//!
//! For `N = 2^b` samples the values of figure 4 differ in their upper `b` bits, the stratum:
//! numbers are added there, and since every factor is even, what a stratum's bits do in a
//! multiplication stays among them. So all values of a pixel share their lower bits `L`,
//! which are hashed once, and of each number only its stratum `t` is followed: with
//! `y = L·c`, a round is `t ^= (top_b(y) + c·t) mod N`, `L = (L ^ y) mod 2^(32−b)`. A value
//! is less than `T` where `t < top_b(T)`, or `t = top_b(T)` and `L < T mod 2^(32−b)`.
//!
//! The strata of up to 8 numbers take four bits each of one word.

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
        let hit = u32x16::splat(simd, bit(n));
        hits |= limits.pass(value(n as u32)).select(hit, none);
    }
    hits
}

/// The lowest bit of each stratum.
const ONES: u32 = 0x1111_1111;
/// The upper bit of each stratum's four.
const UPPER: u32 = 0x8888_8888;

/// The bits of strata of so many numbers.
const fn strata_bits(numbers: usize) -> u32 {
    (numbers as u32 - 1) * ONES
}

/// The strata where numbers are added: their bits in reverse.
const fn reversed_numbers(numbers: usize) -> u32 {
    let (mut bits, mut n) = (0, 0);
    while n < numbers {
        bits |= ((n as u32).reverse_bits() >> (32 - numbers.trailing_zeros())) << (4 * n);
        n += 1;
    }
    bits
}

/// `top_b(y) + factor·t` in each stratum's four bits, the lower `b` of them.
#[inline(always)]
fn added<S: Simd, const N: usize>(
    simd: S,
    strata: u32x16<S>,
    top: u32x16<S>,
    factor: u32,
) -> u32x16<S> {
    let word = |word: u32| u32x16::splat(simd, word);
    let factor = factor % N as u32;
    // The bits of a stratum that are left of it, shifted.
    let shifted = |by: u32| {
        let kept = ((N as u32 - 1) << by & (N as u32 - 1)) * ONES;
        (strata << by) & word(kept)
    };
    match factor {
        0 => top,
        _ if factor.is_power_of_two() => top + shifted(factor.trailing_zeros()),
        // Six of eight is two less than nothing. With the upper bit of each four, nothing is
        // borrowed from the next.
        _ => (top | word(UPPER)) - shifted((N as u32 - factor).trailing_zeros()),
    }
}

/// Rounds of figure 4 with these factors.
#[inline(always)]
pub(super) fn scrambled<S: Simd>(simd: S, mut x: u32x16<S>, factors: &[u32]) -> u32x16<S> {
    for factor in factors {
        x = x ^ (x * u32x16::splat(simd, *factor));
    }
    x
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
        return limits.pass(scrambled(simd, x, &LK2011[..ROUNDS])).select(word(all(N)), word(0));
    }
    let bits = N.trailing_zeros();
    let top = |x: u32x16<S>| (x >> (32 - bits)) * word(ONES);
    let low = word(u32::MAX >> bits);
    let kept = word(strata_bits(N));
    let mut strata = (top(x) + word(reversed_numbers(N))) & kept;
    let mut lower = x & low;
    for factor in &LK2011[..ROUNDS] {
        let y = lower * word(*factor);
        strata = strata ^ (added::<S, N>(simd, strata, top(y), *factor) & kept);
        lower = (lower ^ y) & low;
    }
    // How many strata pass.
    let whole = limits.threshold >> (32 - bits);
    let part = lower.simd_lt(limits.threshold & low);
    let passing = part.select(whole + word(1), whole);
    let passing = limits.opaque.select(word(N as u32), passing);
    // The upper bit of the four is set where a stratum is not among them.
    let beyond = (word(8) - passing) * word(ONES);
    !(strata + beyond) & word(all(N))
}
