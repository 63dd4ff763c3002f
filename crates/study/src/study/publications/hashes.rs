//! What matters of a reference-value hash: how many permutations it reaches, whether
//! surfaces and seeds are correlated, and what that does to pictures. No study: hashes are
//! tried on numbers, and the pictures are of layers that no scene has.

use std::collections::HashSet;

use serde::Serialize;

use crate::metrics::{Ensemble, Estimate, Region};
use crate::study::measure;
use crate::study::publications::{pictures, replay, whole_layers};
use screendoor_rop::{PixelIndex, Reference, ReferenceKey, Threshold};
use screendoor_trace::error::Result;
use screendoor_trace::param::Options;
use screendoor_trace::tile::TileGrid;

/// One hash, with or without the seeds hashed first.
#[derive(Clone, Debug, Serialize)]
pub struct HashRow {
    /// Its name as a parameter's value.
    pub reference: &'static str,
    /// Whether surface and seed are hashed first.
    pub prehash: bool,
    /// Whether it is meant to tell surfaces apart.
    pub scrambles: bool,
    /// Different orders of 16 consecutive reference values of a pixel, among
    /// [`TRIES`] surfaces and pixels (LK's use: the highest bits scrambled by all
    /// below); 32768 exist.
    pub orders: usize,
    /// Different permutations of the lowest 4 bits over as many seeds (Burley's use).
    pub low_orders: usize,
    /// The largest correlation of reference values between surfaces up to 8 apart.
    pub between_surfaces: f64,
    /// The same between seeds.
    pub between_seeds: f64,
    /// Mean transmittance of four layers, alpha 0.3, in one pixel of 8 samples over
    /// consecutive surface numbers without a spatial index; 0.2401 is right.
    pub transmittance: f64,
    /// RMSE in 8-bit units of `lk` at 8 samples on eight layers of alpha 0.3.
    pub rmse: Estimate,
    /// RMSE of the same averaged over blocks of 4 × 4 pixels.
    pub rmse_blocks: Estimate,
    /// Mean error in 8-bit units of the same.
    pub mean: Estimate,
}

/// How many surfaces and pixels, or seeds, are tried for permutations.
pub const TRIES: u32 = 1 << 17;

/// The table, over `seeds` seeds.
pub(super) fn hashes(seeds: u32) -> Result<Vec<HashRow>> {
    Values::all().map(|(values, name)| row(values, name, seeds)).collect()
}

/// Reference values of one hash.
#[derive(Clone, Copy)]
pub(in crate::study) struct Values {
    pub reference: Reference,
    pub prehash: bool,
}

impl Values {
    /// Those of every hash, with or without the seeds hashed first, and the hash's name.
    pub(crate) fn all() -> impl Iterator<Item = (Self, &'static str)> {
        let named = Reference::ALL.iter().zip(Reference::CHOICES);
        let each = named.flat_map(|(reference, choice)| {
            let reference = *reference;
            [false, true].map(|prehash| (Values { reference, prehash }, choice.name))
        });
        // Independent numbers have no seed to correlate by.
        each.filter(|(v, _)| !(v.prehash && v.reference == Reference::White))
    }

    /// The reference value of sample number `n` of a pixel with so many samples.
    pub(crate) fn at(self, n: u32, samples: u32, pixel: u32, surface: u32, seed: u32) -> u32 {
        let key = ReferenceKey { pixel: PixelIndex(pixel), surface, seed };
        let key = if self.prehash { key.prehashed() } else { key };
        self.reference.value(n, samples, &key)
    }

    /// The permutations that are reached, of 16 values by their highest bits.
    fn orders(self) -> usize {
        let order = |i: u32| {
            let value = |n| self.at(n, 16, i % 512, i / 512, 0);
            (0..16).fold(0_u64, |word, n| word << 4 | u64::from(value(n) >> 28))
        };
        (0..TRIES).map(order).collect::<HashSet<_>>().len()
    }

    /// The same by their lowest bits, over seeds.
    fn low_orders(self) -> usize {
        let order = |seed: u32| {
            let s = if self.prehash { screendoor_rop::prehash(seed) } else { seed };
            let value = |x| self.reference.scramble(x, s) & 15;
            (0..16).fold(0_u64, |word, x| word << 4 | u64::from(value(x)))
        };
        (0..TRIES).map(order).collect::<HashSet<_>>().len()
    }

    /// The largest absolute correlation over the lags 1 to 8, between the values of
    /// the same sample and pixel, `at(sample, pixel, i)` and `at(sample, pixel, i + lag)`.
    fn correlation(self, at: impl Fn(u32, u32, u32) -> u32) -> f64 {
        let unit = |x: u32| f64::from(x) / 4_294_967_296.0 - 0.5;
        let of_lag = |lag| {
            let (mut sum, mut count) = (0.0, 0.0);
            for (pixel, n, i) in
                (0..1024).flat_map(|p| (0..8).flat_map(move |n| (0..8).map(move |i| (p, n, i))))
            {
                sum += unit(at(n, pixel, i)) * unit(at(n, pixel, i + lag));
                count += 1.0;
            }
            // The variance of a uniform number is 1/12.
            (sum / count * 12.0).abs()
        };
        (1..=8).map(of_lag).fold(0.0, f64::max)
    }

    fn transmittance(self) -> f64 {
        const LAYERS: u32 = 4;
        let opacity = Threshold::of(0.3);
        let pixels = 4096;
        let through = (0..pixels)
            .flat_map(|i| (0..8).map(move |n| (i, n)))
            .filter(|(i, n)| {
                (0..LAYERS).all(|l| !opacity.passes(self.at(*n, 8, 0, i * LAYERS + l, 0)))
            })
            .count();
        through as f64 / f64::from(8 * pixels)
    }
}

fn row(values: Values, name: &'static str, seeds: u32) -> Result<HashRow> {
    let prehash = values.prehash;
    const SIDE: u32 = 128;
    let gray = |i: u32| [(i * 5 % 8) as f32 / 7.0; 3];
    let layers: Vec<_> = (0..8).map(|i| (gray(i), 0.3)).collect();
    let trace = whole_layers(SIDE, 8, [0.0; 3], &layers)?;
    let exact = replay("exact", &trace, 8, 0)?.picture;
    let blocks = measure::averaged(&exact, 4);
    let frame = Region::frame(exact.grid());
    let block_frame = Region::frame(TileGrid::new(SIDE / 4, SIDE / 4));
    let mut whole = Ensemble::new(&exact, &[&frame]);
    let mut averaged = Ensemble::new(&blocks, &[&block_frame]);
    let spec = format!("lk:reference={name},prehash={prehash}");
    for picture in pictures(&spec, &trace, 8, seeds)? {
        let picture = picture?;
        averaged.add(&measure::averaged(&picture, 4));
        whole.add(&picture);
    }
    let (whole, averaged) = (whole.finish().swap_remove(0), averaged.finish().swap_remove(0));
    Ok(HashRow {
        reference: name,
        prehash,
        scrambles: values.reference.scrambles(),
        orders: values.orders(),
        low_orders: values.low_orders(),
        between_surfaces: values.correlation(|n, pixel, i| values.at(n, 8, pixel, i, 0)),
        between_seeds: values.correlation(|n, pixel, i| values.at(n, 8, pixel, 0, i)),
        transmittance: values.transmittance(),
        rmse: whole.rmse,
        rmse_blocks: averaged.rmse,
        mean: whole.mean,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_known_numbers_of_permutations() {
        // Burley's use: the lowest k bits depend on (x + s) mod 2^k alone.
        let low = |reference, prehash| Values { reference, prehash }.low_orders();
        assert_eq!(low(Reference::Lk2011, false), 16);
        assert_eq!(low(Reference::Lk2011, true), 16);
        // Vegdahl's multiplies the upper half of the seed in, which small seeds leave 0.
        assert_eq!(low(Reference::Vegdahl, false), 16);
        assert_eq!(low(Reference::Vegdahl, true), 128);
        // Owen's scrambling reaches all 2^15, of which 2^17 draws miss about 2 %.
        assert!((31_500..32_768).contains(&low(Reference::Owen, false)));
    }
}
