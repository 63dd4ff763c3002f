//! What the samples of sixteen pixels hold, and what a round writes to them.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, i32x16, mask32x16, u32x16};

use crate::lanes::{Count, Width};
use crate::stochastic::fast::abreast::lists::LANES;
use crate::stochastic::fast::abreast::packed::bit;
use crate::stochastic::fast::abreast::window::NOBODY;
use crate::stochastic::fast::sampler::FastSampler;
use crate::stochastic::fast::state::{FastTile, SIGN};
#[cfg(test)]
use crate::stochastic::fast::twin::Flaw;
use screendoor_trace::trace::Unorm32;

/// What a group's samples hold, in lanes of pixels.
pub(super) struct Held<S: Simd, const N: usize> {
    /// One less than they are, their upper bit flipped.
    pub depth: [i32x16<S>; N],
    /// The fragments that were written last, or [`NOBODY`].
    pub winner: [u32x16<S>; N],
}

impl<S: Simd, const N: usize> Held<S, N>
where
    Count<N>: Width,
{
    #[inline(always)]
    pub(super) fn load<F: FastSampler<N>>(
        simd: S,
        tile: &FastTile<F, N>,
        pixels: &[u8; LANES],
    ) -> Self {
        let mut words = [[0; LANES]; N];
        for (lane, pixel) in pixels.iter().enumerate() {
            let depths = tile.held[usize::from(*pixel)].depth.as_ref();
            for (row, depth) in words.iter_mut().zip(depths) {
                row[lane] = depth.wrapping_sub(1);
            }
        }
        let mut depth = [i32x16::splat(simd, 0); N];
        for i in 0..N {
            depth[i] = i32x16::from_slice(simd, &words[i]);
        }
        Held { depth, winner: [u32x16::splat(simd, NOBODY); N] }
    }

    #[inline(always)]
    pub(super) fn store<F: FastSampler<N>>(&self, tile: &mut FastTile<F, N>, pixels: &[u8; LANES]) {
        let mut words = [[0; LANES]; N];
        for i in 0..N {
            self.depth[i].store_slice(&mut words[i]);
        }
        for (lane, pixel) in pixels.iter().enumerate() {
            let depths = tile.held[usize::from(*pixel)].depth.as_mut();
            for (row, depth) in words.iter().zip(depths) {
                *depth = row[lane].wrapping_add(1);
            }
        }
    }
}

impl<S: Simd, const N: usize> Held<S, N> {
    /// Samples that nothing was written to.
    #[inline(always)]
    pub(super) fn cleared(simd: S) -> Self {
        let far = ((Unorm32::FAR.0 ^ SIGN) as i32).wrapping_sub(1);
        Held { depth: [i32x16::splat(simd, far); N], winner: [u32x16::splat(simd, NOBODY); N] }
    }

    #[inline(always)]
    pub(super) fn write(&mut self, drawn: &Drawn<S, N>) {
        for i in 0..N {
            self.depth[i] = drawn.written[i].select(drawn.z[i], self.depth[i]);
            self.winner[i] = drawn.written[i].select(drawn.who, self.winner[i]);
        }
    }
}

/// What came of a round.
pub(super) struct Drawn<S: Simd, const N: usize> {
    pub z: [i32x16<S>; N],
    pub who: u32x16<S>,
    pub coverage: u32x16<S>,
    pub passed: u32x16<S>,
    pub written: [mask32x16<S>; N],
}

impl<S: Simd, const N: usize> Drawn<S, N> {
    /// The samples that were written.
    #[inline(always)]
    pub(super) fn set(&self, simd: S) -> u32x16<S> {
        let mut set = u32x16::splat(simd, 0);
        for i in 0..N {
            set = self.written[i].select(set | u32x16::splat(simd, bit(i)), set);
        }
        set
    }
}

/// What is written, with the lane's defect.
#[cfg(test)]
pub(super) fn flawed<S: Simd, const N: usize>(
    simd: S,
    flaw: Option<Flaw>,
    mut drawn: Drawn<S, N>,
) -> Drawn<S, N> {
    match flaw {
        Some(Flaw::Depth(lane)) => drawn.z[lane] ^= i32x16::splat(simd, 1),
        Some(Flaw::Choice(lane)) => {
            let mine =
                (drawn.passed & u32x16::splat(simd, bit(lane))).simd_gt(u32x16::splat(simd, 0));
            drawn.written[lane] ^= mine;
        }
        None => {}
    }
    drawn
}
