//! Opacity reference values (Laine and Karras 2011, section 3): nested uniform
//! scrambles of the radical inverse, from one hash to the next better mixed.

use crate::stochastic::pixel_order::PixelIndex;
use screendoor_trace::random::{PREHASHED, hash, mix, scatter};

screendoor_trace::options! {
    /// How reference values are made.
    pub enum Reference {
        Lk2011 = "lk2011": "four multiply-XOR rounds (LK figure 4; Burley, JCGT 9(4), 2020)",
        Lk2011Rounds1 = "lk2011-1": "the first of figure 4's four rounds alone",
        Lk2011Rounds2 = "lk2011-2": "the first two of figure 4's four rounds",
        Lk2011Rounds3 = "lk2011-3": "the first three of figure 4's four rounds",
        VegdahlV2 = "vegdahl-v2": "fewer multiplications, constants found by search (psychopath.io, January 2021)",
        Vegdahl = "vegdahl": "the seed multiplied in (psychopath.io; sobol_burley, pbrt-v4's FastOwenScrambler)",
        Owen = "owen": "one random flip for each node of the binary tree (Owen 1995)",
        RadicalInverse = "radical-inverse": "no scrambling: surfaces stay correlated (LK section 3)",
        Sobol = "sobol": "each bit flipped by an AND-parity of those below (LK figure 3b)",
        White = "white": "independent random numbers: no stratification",
    }
}

/// What a reference value is made of, but for the sample's number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReferenceKey {
    /// The pixel's number along its curve.
    pub pixel: PixelIndex,
    /// The surface's number within the pixel.
    pub surface: u32,
    /// The run's seed; 0 gives the publication's own sequence.
    pub seed: u32,
}

impl Reference {
    /// The reference value of sample number `n` of a pixel with `samples` samples:
    /// a 32-bit fraction of 1.
    #[inline]
    pub fn value(self, n: u32, samples: u32, key: &ReferenceKey) -> u32 {
        if self == Reference::White {
            return hash([key.seed, key.pixel.0, key.surface, n]);
        }
        let (x, s) = place(n, samples, key);
        self.scramble(x, s)
    }

    /// The reversed index `x` scrambled by the seed `s`.
    pub fn scramble(self, x: u32, s: u32) -> u32 {
        match self {
            Reference::Lk2011 => scramble_lk2011(x.wrapping_add(s)),
            Reference::Lk2011Rounds1 | Reference::Lk2011Rounds2 | Reference::Lk2011Rounds3 => {
                let rounds = LK2011.iter().take(self.lk2011_rounds().unwrap_or(0));
                rounds.fold(x.wrapping_add(s), |x, factor| x ^ x.wrapping_mul(*factor))
            }
            Reference::VegdahlV2 => scramble_vegdahl_v2(x, s),
            Reference::Vegdahl => scramble_vegdahl(x, s),
            Reference::Owen => scramble_owen(x, s),
            Reference::Sobol => scramble_sobol(x.wrapping_add(s)),
            Reference::RadicalInverse => x.wrapping_add(s),
            Reference::White => hash([s, x]),
        }
    }

    /// How many of figure 4's multiply-XOR rounds a value passes through; `None` for
    /// other hashes.
    pub(crate) fn lk2011_rounds(self) -> Option<usize> {
        match self {
            Reference::Lk2011Rounds1 => Some(1),
            Reference::Lk2011Rounds2 => Some(2),
            Reference::Lk2011Rounds3 => Some(3),
            Reference::Lk2011 => Some(LK2011.len()),
            _ => None,
        }
    }

    /// Loop iterations that a value takes.
    pub fn iterations(self) -> u32 {
        match self {
            Reference::Owen | Reference::Sobol => u32::BITS,
            _ => 0,
        }
    }

    /// Whether two surfaces of a pixel get unrelated values.
    pub fn scrambles(self) -> bool {
        // One round leaves the lowest bits of every factor's multiples in place.
        !matches!(self, Reference::RadicalInverse | Reference::Sobol | Reference::Lk2011Rounds1)
    }
}

impl ReferenceKey {
    /// The key whose surface and seed have passed through a hash first: neighbouring
    /// seeds are then as far apart as any.
    pub fn prehashed(self) -> Self {
        let s = self.surface.wrapping_add(scatter(self.seed));
        ReferenceKey { surface: prehash(s), seed: 0, ..self }
    }
}

/// A hash for seeds (sobol_burley): with Wellons' multipliers, and a constant that
/// keeps 0 from being mapped to itself.
#[inline]
pub const fn prehash(n: u32) -> u32 {
    mix(n ^ PREHASHED)
}

/// LK figure 4, lines 1 and 2: the reversed bits of the place in the sequence, and
/// the seed by which figure 4 moves it on: the surface.
///
/// The publication's 32-bit index wraps on frames of more than 2^32 samples. Here
/// it is 64 bits wide; what lies above 32 bits, like the seed, moves the sequence
/// to an unrelated place, and 0 leaves it where figure 4 has it.
#[inline]
pub(crate) fn place(n: u32, samples: u32, key: &ReferenceKey) -> (u32, u32) {
    let index = u64::from(n) + u64::from(key.pixel.0) * u64::from(samples);
    let moved =
        key.surface.wrapping_add(scatter(key.seed)).wrapping_add(scatter((index >> 32) as u32));
    ((index as u32).reverse_bits(), moved)
}

/// The factors of LK figure 4.
pub(crate) const LK2011: [u32; 4] = [0x6c50_b47c, 0xb82f_1e52, 0xc7af_e638, 0x8d22_f6e6];

/// LK figure 4, lines 3 to 6.
#[inline]
pub const fn scramble_lk2011(mut x: u32) -> u32 {
    x ^= x.wrapping_mul(LK2011[0]);
    x ^= x.wrapping_mul(LK2011[1]);
    x ^= x.wrapping_mul(LK2011[2]);
    x ^ x.wrapping_mul(LK2011[3])
}

/// Vegdahl's second version.
#[inline]
const fn scramble_vegdahl_v2(mut x: u32, s: u32) -> u32 {
    x = x.wrapping_add(s);
    x ^= 0xdc96_7795;
    x = x.wrapping_mul(0x97b7_54b7);
    x ^= 0x8663_50b1;
    x.wrapping_mul(0x9e37_79cd)
}

/// Vegdahl's last version, as libraries have it.
#[inline]
const fn scramble_vegdahl(mut x: u32, s: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(s);
    x = x.wrapping_mul((s >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// Owen's scrambling itself: bit `b` is flipped by a coin that belongs to the bits
/// below, the nodes of the tree above `b` (the index is reversed).
fn scramble_owen(x: u32, s: u32) -> u32 {
    (0..32).fold(x, |scrambled, b| {
        let below = x & ((1 << b) - 1);
        scrambled ^ (hash([s, b, below]) & 1) << b
    })
}

/// The second dimension of the Sobol' sequence as a scrambling of the first: bit
/// `b` of the result is the parity of an AND of the word with a constant.
fn scramble_sobol(x: u32) -> u32 {
    let (mut direction, mut result) = (1_u32 << 31, 0);
    for bit in (0..32).rev() {
        if x >> bit & 1 == 1 {
            result ^= direction;
        }
        direction ^= direction >> 1;
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_trace::param::Options;

    fn key(pixel: u32, surface: u32, seed: u32) -> ReferenceKey {
        ReferenceKey { pixel: PixelIndex(pixel), surface, seed }
    }

    #[test]
    fn lk2011_is_figure_4_word_for_word() {
        // Figure 4 with nothing of ours: 32 bits, no seed.
        let figure_4 = |sample_id: u32, pixel_id: u32, surface_id: u32, samples_per_pixel: u32| {
            let mut x = sample_id.wrapping_add(pixel_id.wrapping_mul(samples_per_pixel));
            x = x.reverse_bits().wrapping_add(surface_id);
            x ^= x.wrapping_mul(0x6C50B47C);
            x ^= x.wrapping_mul(0xB82F1E52);
            x ^= x.wrapping_mul(0xC7AFE638);
            x ^= x.wrapping_mul(0x8D22F6E6);
            x
        };
        for samples in [1, 4, 64] {
            for pixel in [0, 1, 77, 1 << 20] {
                for surface in [0, 1, 2, 1000] {
                    for n in 0..samples {
                        let ours = Reference::Lk2011.value(n, samples, &key(pixel, surface, 0));
                        assert_eq!(ours, figure_4(n, pixel, surface, samples));
                    }
                }
            }
        }
    }

    #[test]
    fn fewer_rounds_are_the_first_of_figure_4() {
        let round = |x: u32, factor: u32| x ^ x.wrapping_mul(factor);
        for (x, s) in [(0_u32, 0), (1, 0), (1 << 31, 1), (0xdead_beef, 0x1234_5678)] {
            let one = round(x.wrapping_add(s), 0x6c50_b47c);
            let two = round(one, 0xb82f_1e52);
            let three = round(two, 0xc7af_e638);
            let expected = [one, two, three, round(three, 0x8d22_f6e6)];
            let found = [
                Reference::Lk2011Rounds1,
                Reference::Lk2011Rounds2,
                Reference::Lk2011Rounds3,
                Reference::Lk2011,
            ]
            .map(|reference| reference.scramble(x, s));
            assert_eq!(found, expected);
        }
    }

    #[test]
    fn scrambles_give_the_values_of_their_published_formulas() {
        // Computed outside of this program from the formulas as published.
        const INPUTS: [(u32, u32); 4] = [(0, 0), (1, 0), (1 << 31, 1), (0xdead_beef, 0x1234_5678)];
        for (reference, expected) in [
            (Reference::Lk2011, [0, 0x3707_b665, 0xb707_b665, 0x023f_ba03]),
            (Reference::VegdahlV2, [0x4534_cd0a, 0xa4e7_8b19, 0x24e7_8b19, 0x1aea_e043]),
            (Reference::Vegdahl, [0, 0x3eae_f8dd, 0x3c7f_85ab, 0xabdb_6de7]),
        ] {
            assert_eq!(INPUTS.map(|(x, s)| reference.scramble(x, s)), expected, "{reference:?}");
        }
        let hashed = [0, 1, 2, 0xdead_beef].map(prehash);
        assert_eq!(hashed, [0x9e7d_57dc, 0xe4fd_3835, 0x6eff_0c63, 0x0fa8_e141]);
    }

    #[test]
    fn owen_scrambling_flips_each_node_of_the_tree_by_a_coin_of_its_own() {
        // Two indices that first differ at a bit keep the order of all bits below, and
        // the coins of one level are heads half the time: 6 sigma of 4096 draws.
        for bit in [0, 3, 12] {
            let mut heads = 0;
            for i in 0..4096_u32 {
                let x = i << bit;
                let scrambled = Reference::Owen.scramble(x, 77);
                let low = (1_u32 << bit) - 1;
                assert_eq!(scrambled & low, Reference::Owen.scramble(x & low, 77) & low);
                heads += (scrambled ^ x) >> (bit + 11) & 1;
            }
            assert!(heads.abs_diff(2048) < 6 * 32, "bit {bit}: {heads}");
        }
    }

    #[test]
    fn the_radical_inverse_is_the_table_of_section_3() {
        let values: Vec<f64> = (0..8)
            .map(|n| {
                f64::from(Reference::RadicalInverse.value(n, 8, &key(0, 0, 0))) / 2_f64.powi(32)
            })
            .collect();
        assert_eq!(values, [0.0, 0.5, 0.25, 0.75, 0.125, 0.625, 0.375, 0.875]);
    }

    #[test]
    fn every_aligned_span_is_stratified_but_for_white_noise() {
        for reference in Reference::ALL {
            let mut broken = 0;
            for (surface, seed) in [(0, 0), (1, 0), (5, 9), (1 << 20, 12345)] {
                for pixel in [0, 3, 1000, (1 << 31) + 5] {
                    for bits in 0..=6 {
                        let mut strata: Vec<u32> = (0..1 << bits)
                            .map(|n| {
                                let x = reference.value(n, 64, &key(pixel, surface, seed));
                                u64::from(x) as u32 >> (32 - bits.max(1)) >> u32::from(bits == 0)
                            })
                            .collect();
                        strata.sort_unstable();
                        broken += u32::from(strata != (0..1 << bits).collect::<Vec<_>>());
                    }
                }
            }
            assert_eq!(broken > 0, *reference == Reference::White, "{reference:?}: {broken}");
        }
    }

    #[test]
    fn neighbouring_pixels_share_the_strata() {
        // Spatial stratification: the 4 aligned pixels of a block of 8 samples each
        // have all 32 strata once.
        let stratified = Reference::ALL.iter().filter(|r| **r != Reference::White);
        for reference in stratified {
            let mut strata: Vec<u32> =
                (0..32).map(|i| reference.value(i % 8, 8, &key(40 + i / 8, 3, 7)) >> 27).collect();
            strata.sort_unstable();
            assert_eq!(strata, (0..32).collect::<Vec<_>>());
        }
    }

    #[test]
    fn large_frames_do_not_wrap() {
        // Pixels 2^26 apart at 64 samples would share an index of 32 bits.
        let value = |pixel| Reference::Lk2011.value(0, 64, &key(pixel, 0, 0));
        assert_ne!(value(5), value(5 + (1 << 26)));
    }
}
