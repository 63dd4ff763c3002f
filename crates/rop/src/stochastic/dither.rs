//! One number ξ in [0, 1) for each pixel and surface, even over the surface's
//! neighbouring pixels: dithering.

use std::sync::LazyLock;

use crate::contract::frame::Site;
use crate::contract::words::{Ranks, TILE};
use crate::stochastic::methods::Round;
use crate::stochastic::pixel_order::PixelIndex;
use crate::stochastic::reference_value::{Reference, ReferenceKey};
use screendoor_trace::random::{hash, hash_on};

screendoor_trace::options! {
    /// How ξ is spread over the pixels.
    pub enum Dither {
        White = "white": "independent random numbers",
        Sequence = "sequence": "reference values along the pixels' curve, one a pixel",
        Bayer = "bayer": "Bayer's matrix of 64 x 64, moved for each surface (Bayer 1973)",
        BlueNoise = "blue-noise": "a void-and-cluster mask of 64 x 64, moved for each surface (Ulichney 1993)",
    }
}

const TILE_BITS: u32 = TILE.trailing_zeros();
const RANK_BITS: u32 = 2 * TILE_BITS;

/// A hash's last word that keeps it apart from others of the same seed and pixel.
const OFFSET: u32 = 0x0ff5_e700;
pub(crate) const FINE: u32 = 0x0f19_e000;
const ROUND: u32 = 0x0c0d_e500;

impl Dither {
    /// The matrix of a dither that has one.
    pub fn ranks(self) -> Option<&'static Ranks> {
        match self {
            Dither::White | Dither::Sequence => None,
            Dither::Bayer => Some(&BAYER),
            Dither::BlueNoise => Some(&BLUE_NOISE),
        }
    }

    /// Whether two surfaces of a pixel get unrelated values, where those along the curve are
    /// made as `reference` says.
    pub fn scrambles(self, reference: Reference) -> bool {
        self != Dither::Sequence || reference.scrambles()
    }

    /// What ξ of a pixel's surfaces have in common with [`Dither::White`].
    #[inline(always)]
    pub fn white_in(seed: u32, PixelIndex(pixel): PixelIndex) -> u32 {
        hash([seed, pixel])
    }

    /// ξ of a surface with [`Dither::White`], of what its pixel's have in common.
    #[inline(always)]
    pub fn white(in_pixel: u32, surface: u32) -> u32 {
        hash_on(in_pixel, [surface, FINE])
    }

    /// ξ of a surface in a pixel, as a 32-bit fraction of 1: uniform over the seeds,
    /// and independent from surface to surface.
    pub fn value(self, site: Site, key: &ReferenceKey, reference: Reference) -> u32 {
        let Some(ranks) = self.ranks() else {
            return match self {
                Dither::Sequence => reference.value(0, 1, key),
                _ => Dither::white(Dither::white_in(key.seed, key.pixel), key.surface),
            };
        };
        let offset = hash([key.seed, key.surface, OFFSET]);
        let x = (u32::from(site.x) + offset) as usize % TILE;
        let y = (u32::from(site.y) + (offset >> 16)) as usize % TILE;
        let PixelIndex(pixel) = key.pixel;
        // Between the ranks' steps: anything, so that no alpha is favoured.
        let fine = hash([key.seed, pixel, key.surface, FINE]) >> RANK_BITS;
        u32::from(ranks[y * TILE + x]) << (32 - RANK_BITS) | fine
    }
}

impl Dither {
    /// ξ of a surface in one of several rounds that are stratified together: by itself as
    /// good as [`Dither::value`], and of R rounds one in each Rth of [0, 1). Where a round
    /// writes `⌊x + ξ⌋` samples, with the same x in each, they write ⌊Rx⌋ or ⌈Rx⌉ together.
    pub fn in_round(
        self,
        round: Round,
        site: Site,
        key: &ReferenceKey,
        reference: Reference,
    ) -> u32 {
        if self == Dither::Sequence {
            // The rounds' values follow each other in the sequence, as samples do.
            return reference.value(round.index, round.count, key);
        }
        let PixelIndex(pixel) = key.pixel;
        let word = |r| hash([key.seed, pixel, key.surface, ROUND + r]);
        stratified(round, self.value(site, key, reference), word)
    }
}

/// The ξ of one of R rounds, an even step apart in an order at random, which `word` gives a
/// random word for each: `(p + ξ)/R` in the round at place p. Then
/// `Σ ⌊x + (p + ξ)/R⌋ = ⌊R·x + ξ⌋` (Hermite's identity).
pub fn stratified(round: Round, xi: u32, word: impl Fn(u32) -> u32) -> u32 {
    let bits = round.count.trailing_zeros();
    if bits == 0 {
        return xi;
    }
    let key = |r: u32| (word(r), r);
    let own = key(round.index);
    let place = (0..round.count).filter(|r| key(*r) < own).count() as u32;
    place << (u32::BITS - bits) | xi >> bits
}

/// Bayer's matrix: rank bits are those of `x ^ y` and `y` in turn, the lowest first.
pub static BAYER: LazyLock<Box<Ranks>> = LazyLock::new(|| {
    Box::new(std::array::from_fn(|i| {
        let (x, y) = (i % TILE, i / TILE);
        (0..TILE_BITS).fold(0, |rank, bit| {
            let pair = ((x ^ y) >> bit & 1) << 1 | (y >> bit & 1);
            // Two bits at a time, the pixel's lowest into the highest of the rank.
            rank | (pair as u16) << (RANK_BITS - 2 - 2 * bit)
        })
    }))
});

/// A blue-noise mask by the void-and-cluster method (Ulichney, SPIE 1913, 1993).
pub static BLUE_NOISE: LazyLock<Box<Ranks>> = LazyLock::new(void_and_cluster);

/// Points on a torus with the energy that they make around them.
struct Pattern {
    set: Vec<bool>,
    energy: Vec<f64>,
    kernel: Vec<f64>,
}

impl Pattern {
    fn empty() -> Self {
        // Ulichney's choice of width.
        const SIGMA: f64 = 1.5;
        let distance = |i: usize| i.min(TILE - i) as f64;
        let kernel = (0..TILE * TILE)
            .map(|i| {
                let (x, y) = (distance(i % TILE), distance(i / TILE));
                libm::exp(-(x * x + y * y) / (2.0 * SIGMA * SIGMA))
            })
            .collect();
        Pattern { set: vec![false; TILE * TILE], energy: vec![0.0; TILE * TILE], kernel }
    }

    fn put(&mut self, at: usize, present: bool) {
        self.set[at] = present;
        let sign = if present { 1.0 } else { -1.0 };
        let (x0, y0) = (at % TILE, at / TILE);
        for (y, row) in self.energy.chunks_exact_mut(TILE).enumerate() {
            let kernel = &self.kernel[(y + TILE - y0) % TILE * TILE..][..TILE];
            for (x, energy) in row.iter_mut().enumerate() {
                *energy += sign * kernel[(x + TILE - x0) % TILE];
            }
        }
    }

    /// The place of the highest energy among the points (the tightest cluster), or of
    /// the lowest among the gaps (the largest void); the first of equals.
    fn extreme(&self, point: bool) -> usize {
        let mut best: Option<usize> = None;
        for i in (0..TILE * TILE).filter(|i| self.set[*i] == point) {
            let further = |b: usize| {
                (self.energy[i] > self.energy[b]) == point && self.energy[i] != self.energy[b]
            };
            if best.is_none_or(further) {
                best = Some(i);
            }
        }
        best.expect("there are points and gaps")
    }
}

fn void_and_cluster() -> Box<Ranks> {
    const FIRST: usize = TILE * TILE / 10;
    let mut pattern = Pattern::empty();
    let mut places: Vec<usize> = (0..TILE * TILE).collect();
    screendoor_trace::random::Stream::new([0xb1e_0015e]).shuffle(&mut places);
    places[..FIRST].iter().for_each(|at| pattern.put(*at, true));
    // From the tightest cluster into the largest void, until that is where it was.
    loop {
        let cluster = pattern.extreme(true);
        pattern.put(cluster, false);
        let void = pattern.extreme(false);
        pattern.put(void, true);
        if void == cluster {
            break;
        }
    }
    let mut ranks = Box::new([0; TILE * TILE]);
    // Ranks below: points removed, the tightest first. Those above: voids filled.
    let mut thinned = Pattern { set: pattern.set.clone(), ..Pattern::empty() };
    thinned.energy.copy_from_slice(&pattern.energy);
    for rank in (0..FIRST).rev() {
        let cluster = thinned.extreme(true);
        thinned.put(cluster, false);
        ranks[cluster] = rank as u16;
    }
    for rank in FIRST..TILE * TILE {
        let void = pattern.extreme(false);
        pattern.put(void, true);
        ranks[void] = rank as u16;
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_trace::param::Options;

    #[test]
    fn tiles_hold_each_rank_once_and_bayer_begins_as_published() {
        for tile in [&*BAYER, &*BLUE_NOISE] {
            let mut ranks = tile.to_vec();
            ranks.sort_unstable();
            assert!(ranks.iter().enumerate().all(|(i, rank)| i == usize::from(*rank)));
        }
        // Bayer's matrix of 2 × 2, [[0, 2], [3, 1]], in the highest bits.
        let quarter = |x: usize, y: usize| BAYER[y * TILE + x] / 1024;
        assert_eq!([quarter(0, 0), quarter(1, 0), quarter(0, 1), quarter(1, 1)], [0, 2, 3, 1]);
    }

    #[test]
    fn rounds_have_a_stratum_each_and_write_as_many_samples_as_one_would() {
        let site = Site { x: 9, y: 5 };
        for (dither, seed) in Dither::ALL.iter().flat_map(|d| (0..20).map(move |s| (*d, s))) {
            let key = ReferenceKey { pixel: PixelIndex(77), surface: 3, seed };
            for count in [1, 2, 4, 8] {
                let of = |index| {
                    let round = Round { index, count, seed };
                    u64::from(dither.in_round(round, site, &key, Reference::Lk2011))
                };
                let all: Vec<u64> = (0..count).map(of).collect();
                let mut strata: Vec<u64> =
                    all.iter().map(|x| (x * u64::from(count)) >> 32).collect();
                strata.sort_unstable();
                assert_eq!(strata, (0..u64::from(count)).collect::<Vec<_>>(), "{dither:?}");
                for share in [0.1, 0.4, 0.5, 1.6, 2.0] {
                    let x = (share * 2_f64.powi(32)) as u64;
                    let written: u64 = all.iter().map(|xi| (x + xi) >> 32).sum();
                    let expected = share * f64::from(count);
                    assert!(
                        (written as f64 - expected).abs() < 1.0 + 1e-6,
                        "{dither:?}: {written}"
                    );
                }
            }
        }
    }

    #[test]
    fn each_round_by_itself_is_uniform() {
        // The mean of 4096 uniform numbers is off by more than 6 σ = 6/√(12·4096) never.
        let site = Site { x: 1, y: 2 };
        for dither in [Dither::White, Dither::Sequence, Dither::BlueNoise] {
            for index in 0..4 {
                let of = |seed| {
                    let key = ReferenceKey { pixel: PixelIndex(5), surface: 1, seed };
                    let round = Round { index, count: 4, seed };
                    f64::from(dither.in_round(round, site, &key, Reference::Lk2011))
                        / 2_f64.powi(32)
                };
                let mean = (0..4096).map(of).sum::<f64>() / 4096.0;
                assert!((mean - 0.5).abs() < 0.028, "{dither:?}, round {index}: {mean}");
            }
        }
    }

    /// The variance of the mean of ξ over blocks of 4 × 4 pixels, as a share of that of
    /// independent numbers, 1/12/16.
    fn block_variance(dither: Dither) -> f64 {
        let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
        for (seed, block) in (0..64).flat_map(|seed| (0..256).map(move |b| (seed, b))) {
            let mean = (0..16)
                .map(|i| {
                    let site = Site {
                        x: (block % 16 * 4 + i % 4) as u16,
                        y: (block / 16 * 4 + i / 4) as u16,
                    };
                    let pixel = PixelIndex(u32::from(site.y) * 64 + u32::from(site.x));
                    let key = ReferenceKey { pixel, surface: 3, seed };
                    f64::from(dither.value(site, &key, Reference::Lk2011)) / 2_f64.powi(32) / 16.0
                })
                .sum::<f64>();
            sum += mean;
            squares += mean * mean;
            count += 1.0;
        }
        (squares / count - (sum / count).powi(2)) * 12.0 * 16.0
    }

    #[test]
    fn dithered_blocks_are_even() {
        assert!((block_variance(Dither::White) - 1.0).abs() < 0.1);
        for (dither, most) in [(Dither::Bayer, 0.05), (Dither::BlueNoise, 0.25)] {
            let found = block_variance(dither);
            assert!(found < most, "{dither:?}: {found}");
        }
    }
}
