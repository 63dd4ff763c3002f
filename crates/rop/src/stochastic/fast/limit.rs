//! The opacity test in lanes.

use fearless_simd::Simd;

use crate::contract::opacity::Threshold;
use crate::lanes::Lanes;

/// A [`Threshold`] as lanes are compared with it.
#[derive(Clone, Copy, Debug)]
pub struct Limit {
    /// Its lower 32 bits, the upper one of them flipped: all instruction sets compare signed
    /// words.
    pub(super) below: i32,
    /// All bits set where all values lie below it.
    pub(super) all: u64,
}

impl Limit {
    /// That of a threshold.
    #[inline(always)]
    pub fn of(threshold: Threshold) -> Self {
        let value = threshold.value();
        Limit { below: value as i32 ^ i32::MIN, all: 0_u64.wrapping_sub(value >> 32) }
    }

    /// The threshold.
    #[inline(always)]
    pub fn threshold(self) -> Threshold {
        Threshold::of_value(u64::from((self.below ^ i32::MIN) as u32) | (self.all & 1) << 32)
    }
}

/// Where values lie below a limit.
#[inline(always)]
pub fn below<S: Simd, L: Lanes<S>>(simd: S, values: L, limit: Limit) -> u64 {
    let values = values.xor(L::splat(simd, i32::MIN));
    L::bits(L::splat(simd, limit.below).greater(values)) | limit.all
}
