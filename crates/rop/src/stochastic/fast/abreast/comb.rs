//! The teeth of a comb, sixteen fragments at once: the twin of [`crate::stochastic::comb`].

use fearless_simd::prelude::*;
use fearless_simd::{Simd, u32x16};

use crate::stochastic::dither::FINE;
use crate::stochastic::fast::abreast::met::Met;
use crate::stochastic::fast::abreast::packed::{STRIDE, all, bit};
use crate::stochastic::fast::abreast::{hashed_on, mixed};

/// [`Dither::white`](crate::Dither::white) in lanes.
#[inline(always)]
pub fn white<S: Simd>(simd: S, in_pixel: u32x16<S>, surface: u32x16<S>) -> u32x16<S> {
    hashed_on(simd, hashed_on(simd, in_pixel, surface), u32x16::splat(simd, FINE))
}

/// The numbers, packed, whose tooth passes, where pairs have exchanged theirs at random.
#[inline(always)]
pub fn exchanged_teeth<S: Simd, const N: usize>(
    simd: S,
    xi: u32x16<S>,
    met: &Met<'_, S, N>,
) -> u32x16<S> {
    let word = |word: u32| u32x16::splat(simd, word);
    let (mut tooth, mut hits) = (xi, word(0));
    // A single sample may have the tooth of a second.
    for n in 0..N.max(2) {
        tooth += met.threshold;
        let passes = tooth.simd_lt(met.threshold) | met.opaque;
        hits |= passes.select(word(bit(n)), word(0));
    }
    let exchanges = mixed(simd, xi & word(0xffff));
    exchanged(simd, hits, exchanges) & word(all(N))
}

/// What becomes of a packed set when pairs exchange their places:
/// [`exchanged`](crate::stochastic::comb::exchanged).
#[inline(always)]
pub(super) fn exchanged<S: Simd>(simd: S, set: u32x16<S>, exchanges: u32x16<S>) -> u32x16<S> {
    let word = |word: u32| u32x16::splat(simd, word);
    // A bit a pair: of up to four, eight bits apart.
    let pairs = ((exchanges & word(0xf)) * word(0x0020_4081)) & word(0x0101_0101);
    let differ = ((set >> STRIDE) ^ set) & (pairs << 3);
    set ^ differ ^ (differ << STRIDE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Dither;
    use crate::in_lanes::words as words_of;
    use crate::lanes::levels;
    use crate::stochastic::comb;
    use fearless_simd::Level;
    use screendoor_trace::random::Stream;

    fn at(level: Level, words: &[[u32; 16]; 2]) -> [[u32; 16]; 2] {
        #[inline(always)]
        fn found<S: Simd>(simd: S, words: &[[u32; 16]; 2]) -> [[u32; 16]; 2] {
            let [a, b] = words.each_ref().map(|words| u32x16::from_slice(simd, words));
            [exchanged(simd, a & u32x16::splat(simd, all(8)), b), white(simd, a, b)].map(words_of)
        }
        crate::for_level!(level, simd => found(simd, words))
    }

    #[test]
    fn pairs_are_exchanged_and_words_hashed_as_in_the_plain_text() {
        let mut random = Stream::new([0xc03b]);
        for _ in 0..500 {
            let words: [[u32; 16]; 2] =
                std::array::from_fn(|_| std::array::from_fn(|_| random.word()));
            for (name, level) in levels() {
                let [sets, hashes] = at(level, &words);
                for i in 0..16 {
                    let [set, exchanges] = [words[0][i], words[1][i]];
                    let tooth = |n: u32| comb::exchanged(n, exchanges) as usize;
                    let chosen = (0..8).filter(|n| set & bit(tooth(*n)) != 0);
                    let expected = chosen.fold(0, |set, n| set | bit(n as usize));
                    assert_eq!(sets[i], expected, "{name} {set:x} {exchanges:x}");
                    assert_eq!(hashes[i], Dither::white(set, exchanges), "{name}");
                }
            }
        }
    }
}
