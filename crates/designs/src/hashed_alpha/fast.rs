//! The published threshold with samples in lanes.

use fearless_simd::Simd;

use crate::hashed_alpha::cells::{Cells, Mix};
use crate::hashed_alpha::{Each, HashedThreshold, Noise};
use screendoor_rop::fast::{FastSampler, Lanes, Loaded, Offered, OneByOne, Tally};
use screendoor_rop::{Probe, Round, Samples};
use screendoor_trace::random::{GOLDEN, MIX};
use screendoor_trace::tile::{TILE_PIXELS, TileGrid, TileId};
use screendoor_trace::trace::MAX_SAMPLES;

/// [`HashedThreshold`] of a place, sample by sample: what is shipped elsewhere stays on the
/// plain text.
#[derive(Clone, Debug)]
pub(super) struct FastHashed {
    plain: HashedThreshold,
    depth_bits: u32,
}

impl FastHashed {
    /// The twin of `plain`, if it has one.
    pub(super) fn new(plain: HashedThreshold, depth_bits: u32) -> Option<Self> {
        let published = plain.noise == Noise::Place && plain.power == 1.0;
        let has_one = published && plain.each == Each::Sample;
        has_one.then_some(FastHashed { plain, depth_bits })
    }
}

impl<const N: usize> FastSampler<N> for FastHashed {
    type Plain = HashedThreshold;
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
        let Offered { round, passed, fragment, limit, .. } = offered;
        if passed == 0 {
            return L::mask(simd, 0);
        }
        tally.hashed(2 * passed.count_ones());
        let opacity = limit.threshold().value();
        if opacity >> 32 == 1 {
            return L::mask(simd, passed);
        }
        let HashedThreshold { scale, depth_in_pixels, .. } = self.plain;
        let cells = Cells::of(scale, depth_in_pixels, fragment.site(), fragment.depth());
        // A loop, for what is handed to `map` would not be compiled for the level's instructions.
        let mut words = [[0; MAX_SAMPLES as usize]; 2];
        let hashes = cells.hashes(round.seed, fragment.object());
        for (words, (before, exponent)) in words.iter_mut().zip(hashes) {
            let with_sample = mixed(simd, L::splat(simd, before as i32).xor(loaded.lanes));
            let hashed = mixed(simd, with_sample.xor(L::splat(simd, exponent as i32)));
            hashed.store(&mut words[..L::LEN]);
        }
        // ⌊v⌋ < T just where v < T.
        let (mix, below) = (Mix::of(cells.between), opacity as f64);
        let mut chosen = [0; MAX_SAMPLES as usize];
        for s in 0..L::LEN {
            let [lower, upper] = [words[0][s] as u32, words[1][s] as u32];
            chosen[s] = i32::from(mix.uniform(lower, upper) * 2_f64.powi(32) < below);
        }
        let chosen = L::load(simd, &chosen[..L::LEN]).greater(L::splat(simd, 0));
        L::mask(simd, passed & L::bits(chosen))
    }
}

/// `random::mix` of what a word has been mixed into.
#[inline(always)]
fn mixed<S: Simd, L: Lanes<S>>(simd: S, x: L) -> L {
    let word = |word: u32| L::splat(simd, word as i32);
    let x = x.add(word(GOLDEN));
    let x = x.xor(x.shift_right_zeros(16)).mul(word(MIX[0]));
    let x = x.xor(x.shift_right_zeros(15)).mul(word(MIX[1]));
    x.xor(x.shift_right_zeros(16))
}
