//! The choice of samples in lanes.

use fearless_simd::Simd;

use crate::enderton::{Among, EndertonSampler, MaskRule, Words};
use screendoor_rop::fast::{
    FastSampler, Lanes, Loaded, Offered, OneByOne, Tally, below, picked, ranks_of_distinct,
};
use screendoor_rop::{Probe, Round, Samples};
use screendoor_trace::random::{GOLDEN, MIX, hash};
use screendoor_trace::tile::{TILE_PIXELS, TileGrid, TileId};
use screendoor_trace::trace::MAX_SAMPLES;

/// [`EndertonSampler`] with masks that are computed, stratified within a round.
#[derive(Clone, Debug)]
pub(super) struct FastEnderton<const N: usize> {
    plain: EndertonSampler<N>,
    /// Each sample on its own.
    naive: bool,
    depth_bits: u32,
}

impl<const N: usize> FastEnderton<N> {
    /// The twin of `plain`, if it has one: tables are looked up one by one.
    pub(super) fn new(plain: EndertonSampler<N>, depth_bits: u32) -> Option<Self> {
        let naive = match plain.mask {
            MaskRule::Naive => true,
            MaskRule::Stratified => false,
            MaskRule::Table => return None,
        };
        Some(FastEnderton { plain, naive, depth_bits })
    }
}

impl<const N: usize> FastSampler<N> for FastEnderton<N> {
    type Plain = EndertonSampler<N>;
    type State = ();
    type Abreast = OneByOne<()>;

    fn clear(&self, _: TileGrid, _: TileId) -> Vec<()> {
        vec![(); TILE_PIXELS]
    }

    fn to_plain(&self, (): ()) {}
    fn of_plain(&self, (): &(), _: &Samples<N>, (): &mut ()) {}
    fn enter(&self, _: &Round, _: &mut [(); TILE_PIXELS]) {}

    #[inline(always)]
    fn depth_bits(&self) -> u32 {
        self.depth_bits
    }

    #[inline(always)]
    fn needs_survivors(&self) -> bool {
        true
    }

    #[inline(always)]
    fn choose<S: Simd, L: Lanes<S>, P: Probe>(
        &self,
        simd: S,
        loaded: &Loaded<L>,
        (): &mut (),
        offered: Offered<'_, L>,
        tally: &mut Tally<'_, P>,
    ) -> L::Mask {
        let Offered { round, passed, coverage, fragment, limit, .. } = offered;
        if passed == 0 {
            return L::mask(simd, 0);
        }
        let site = fragment.site();
        let words = self.plain.words(*round, site, &fragment.whole());
        let from = match self.plain.among {
            Among::Passed => passed,
            Among::Covered => coverage,
        };
        let count = from.count_ones();
        let of_samples = words_of_samples(simd, loaded, words);
        if self.naive {
            tally.hashed(count);
            return L::mask(simd, below(simd, of_samples, limit) & from & passed);
        }
        tally.hashed(1 + count);
        let chosen = limit.threshold().of_many(count, self.plain.xi(*round, site, words));
        let hits = u64::MAX.checked_shr(64 - chosen).unwrap_or(0);
        let keys = of_samples.xor(L::splat(simd, i32::MIN));
        let mut list = [0; MAX_SAMPLES as usize];
        keys.store(&mut list[..L::LEN]);
        let ranks = ranks_of_distinct(simd, keys, &list, from);
        picked(simd, hits, ranks, L::mask(simd, from & passed))
    }
}

/// [`Words::word`] of each sample: no two are equal, since the last step of the hash is
/// a bijection.
#[inline(always)]
fn words_of_samples<S: Simd, L: Lanes<S>>(simd: S, loaded: &Loaded<L>, words: Words) -> L {
    let word = |word: u32| L::splat(simd, word as i32);
    let before = hash([words.seed, words.pixel, words.source]);
    // `random::mix`.
    let x = loaded.lanes.xor(word(before)).add(word(GOLDEN));
    let x = x.xor(x.shift_right_zeros(16)).mul(word(MIX[0]));
    let x = x.xor(x.shift_right_zeros(15)).mul(word(MIX[1]));
    x.xor(x.shift_right_zeros(16))
}
