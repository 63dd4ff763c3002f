//! The choice of samples in lanes.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, i32x16, mask32x16, u32x16};

use crate::enderton::{Among, EndertonSampler, MaskRule, SeedBy, Words, pixel_word};
use screendoor_rop::fast::{
    Abreast, Counted, FastSampler, Lanes, Loaded, Met, Offered, Ranks, STRIDE, Source, Tally,
    below, bit, gather, left_by, mixed, picked, ranks_of_distinct,
};
use screendoor_rop::{Dither, Probe, Round, Samples, Site};
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
    /// The pixel, as it is hashed.
    type State = u32;
    type Abreast = Self;

    fn abreast(&self) -> Option<&Self> {
        // ξ of the others is looked up.
        (self.naive || self.plain.dither == Dither::White).then_some(self)
    }

    fn clear(&self, grid: TileGrid, tile: TileId) -> Vec<u32> {
        let pixel = |within| {
            // Beyond a frame of full size this wraps; such pixels are never drawn to.
            let (x, y) = grid.pixel(tile, within);
            pixel_word(Site { x: x as u16, y: y as u16 })
        };
        (0..TILE_PIXELS).map(pixel).collect()
    }

    fn to_plain(&self, _: u32) {}
    fn of_plain(&self, (): &(), _: &Samples<N>, _: &mut u32) {}
    fn enter(&self, _: &Round, _: &mut [u32; TILE_PIXELS]) {}

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
        _: &mut u32,
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

#[allow(clippy::needless_range_loop, reason = "loops over samples are unrolled into registers")]
impl<const N: usize> Abreast<N> for FastEnderton<N> {
    type Kept = u32;
    /// What the words of a pixel's fragments have in common.
    type Lanes<S: Simd> = u32x16<S>;

    fn source(&self) -> Source {
        match self.plain.seed_by {
            SeedBy::Primitive => Source::Primitive,
            SeedBy::Object => Source::Object,
            SeedBy::Depth => Source::Depth,
        }
    }

    #[inline(always)]
    fn load<S: Simd>(
        &self,
        simd: S,
        round: &Round,
        kept: &[u32; TILE_PIXELS],
        pixels: &[u8; 16],
    ) -> u32x16<S> {
        gather(simd, pixels, |p| hash([round.seed, kept[p]]))
    }

    #[inline(always)]
    fn store<S: Simd>(&self, _: &u32x16<S>, _: &mut [u32; TILE_PIXELS], _: &[u8; 16]) {}

    #[inline(always)]
    fn choose<S: Simd, P: Probe>(
        &self,
        simd: S,
        lanes: &mut u32x16<S>,
        met: &Met<'_, S, N>,
        counted: &mut Counted<S, P>,
    ) -> [mask32x16<S>; N] {
        let word = |word: u32| u32x16::splat(simd, word);
        let none = word(0);
        let some = met.passed.simd_gt(none);
        let from = match self.plain.among {
            Among::Passed => met.passed,
            Among::Covered => some.select(met.coverage, none),
        };
        let count = from.count_ones();
        let before = mixed(simd, (*lanes ^ met.source) + word(GOLDEN));
        let of = |place: u32| mixed(simd, (before ^ word(place)) + word(GOLDEN));
        let mut words = [none; N];
        for s in 0..N {
            words[s] = of(s as u32);
        }
        if self.naive {
            counted.hashed(count);
            let mut written = *met.passes;
            for s in 0..N {
                written[s] &= words[s].simd_lt(met.threshold) | met.opaque;
            }
            return written;
        }
        counted.hashed(some.select(count + word(1), none));
        // ⌊α·count + ξ⌋, in halves that 32 bits hold.
        let (xi, half) = (of(N as u32), word(0xffff));
        let low = (met.threshold & half) * count + (xi & half);
        let high = (met.threshold >> 16) * count + (xi >> 16);
        let chosen = met.opaque.select(count, (high + (low >> 16)) >> 16);
        // The first so many numbers.
        let all = (0..N).fold(0, |all, n| all | bit(n));
        let beyond = left_by(simd, word(all), chosen * word(STRIDE));
        let hits = !beyond & word(all);
        // Words in the order of signed numbers; of samples that are not among them, more than
        // any or as much.
        let signed = |word: u32x16<S>| word.bitcast::<i32x16<S>>();
        let [mut keys, mut others] = [[i32x16::splat(simd, i32::MAX); N]; 2];
        let mut outside = [some; N];
        for s in 0..N {
            keys[s] = signed(words[s] ^ word(1 << 31));
            outside[s] = (from & word(bit(s))).simd_eq(none);
            others[s] = outside[s].select(others[s], keys[s]);
        }
        let ranks = Ranks::<S, N>::by(
            simd,
            #[inline(always)]
            |i, j| keys[i].simd_gt(others[j]) | outside[i],
        );
        ranks.picked(simd, hits, met.passed)
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
