//! The teeth of a comb in lanes: the twin of [`crate::stochastic::comb`].

use fearless_simd::Simd;

use crate::contract::opacity::Threshold;
use crate::lanes::Lanes;
use crate::stochastic::fast::sampler::Loaded;

/// The reference values of all numbers, moved by `xi`, of which pairs have exchanged theirs.
#[inline(always)]
pub fn teeth<S: Simd, L: Lanes<S>>(
    simd: S,
    loaded: &Loaded<L>,
    xi: u32,
    exchanges: u32,
    threshold: Threshold,
) -> L {
    let step = threshold.value() as u32;
    let bits = L::splat(simd, exchanges as i32).shift_left_by(loaded.pairs).shift_right_zeros(31);
    let steps = loaded.lanes.xor(bits).mul(L::splat(simd, step as i32));
    steps.add(L::splat(simd, xi.wrapping_add(step) as i32))
}
