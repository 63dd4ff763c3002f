//! `wboit` with sixteen pixels side by side.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over channels and halves are unrolled into registers; closures would be called"
)]

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, f64x8, u32x16};
use screendoor_rop::in_lanes::{HasLanes, InLanes, LANES, Met, Told, Wide, widened};
use screendoor_rop::view_depth::fraction_lanes;
use screendoor_rop::{Accumulators, Probe, SumLanes, Summed};
use screendoor_trace::tile::TILE_PIXELS;

use crate::wboit::{Rules, Weight, WeightedBlendedAt, WeightedSums};

/// The numbers of [`WeightedSums`]: a colour, a weight, a transmittance.
const NUMBERS: usize = 5;

impl Summed<NUMBERS> for WeightedSums {
    fn numbers(&self) -> [f32; NUMBERS] {
        let [r, g, b] = self.colour;
        [r, g, b, self.weight, self.transmittance]
    }

    fn of([r, g, b, weight, transmittance]: [f32; NUMBERS]) -> Self {
        WeightedSums { colour: [r, g, b], weight, transmittance }
    }
}

/// The design in lanes.
#[derive(Debug)]
pub struct WeightedInLanes(Rules);

impl<const N: usize> HasLanes<N> for WeightedBlendedAt<N> {
    type InLanes = WeightedInLanes;

    fn in_lanes(&self) -> Option<WeightedInLanes> {
        Some(WeightedInLanes(self.rules.clone()))
    }
}

/// [`raised`](super::raised) of eight, to a power of 2 or more.
#[inline(always)]
fn raised<S: Simd>(x: f64x8<S>, power: u32) -> f64x8<S> {
    let mut product = x;
    for _ in 1..power {
        product *= x;
    }
    product
}

impl Rules {
    /// [`Weight::of`] sixteen fragments.
    #[inline(always)]
    fn weights<S: Simd>(&self, simd: S, z: u32x16<S>, alpha: &Wide<S>) -> Wide<S> {
        let number = |x: f64| f64x8::splat(simd, x);
        let mut wide = match self.weight {
            Weight::Eq7 | Weight::Eq8 | Weight::Eq9 => self.depth.at_lanes(simd, z),
            Weight::Eq10 => fraction_lanes(simd, z),
            Weight::One => return [number(1.0); 2],
        };
        for half in 0..2 {
            let x = wide[half];
            let (scale, sum) = match self.weight {
                Weight::Eq7 => (10.0, raised(x / 5.0, 2) + raised(x / 200.0, 6)),
                Weight::Eq8 => (10.0, raised(x / 10.0, 3) + raised(x / 200.0, 6)),
                _ => (0.03, raised(x / 200.0, 4)),
            };
            let falling = (number(scale) / (sum + 1e-5)).max(1e-2).min(3e3);
            let by_depth = match self.weight {
                Weight::Eq10 => (raised(number(1.0) - x, 3) * 3e3).max(1e-2),
                _ => falling,
            };
            wide[half] = alpha[half] * by_depth;
        }
        wide
    }
}

impl InLanes for WeightedInLanes {
    type State = Accumulators<WeightedSums>;
    type Lanes<S: Simd> = SumLanes<S, NUMBERS>;

    fn clear<S: Simd>(&self, simd: S) -> Self::Lanes<S> {
        SumLanes::cleared::<WeightedSums>(simd, self.0.sums())
    }

    #[inline(always)]
    fn clear_again<S: Simd>(&self, simd: S, lanes: &mut Self::Lanes<S>) {
        lanes.clear::<WeightedSums>(simd);
    }

    #[inline(always)]
    fn load<S: Simd>(
        &self,
        simd: S,
        lanes: &mut Self::Lanes<S>,
        states: &[Self::State; TILE_PIXELS],
        pixels: &[u8; LANES],
    ) {
        lanes.load(simd, states, pixels);
    }

    #[inline(always)]
    fn store<S: Simd>(
        &self,
        lanes: &Self::Lanes<S>,
        states: &mut [Self::State; TILE_PIXELS],
        pixels: &[u8; LANES],
    ) {
        lanes.store(states, pixels);
    }

    #[inline(always)]
    fn draw<S: Simd, P: Probe>(
        &self,
        simd: S,
        lanes: &mut Self::Lanes<S>,
        _pass: u32,
        met: &Met<S>,
        told: &mut Told<S, P>,
    ) {
        let Rules { coverage, store, samples, .. } = self.0;
        let alpha = coverage.alpha_lanes(simd, met, samples);
        let wide = widened(simd, alpha);
        let [low, high] = self.0.weights(simd, met.z, &wide);
        let weighted = simd.narrow_f64x8(low * wide[0], high * wide[1]);
        let mut colour = met.colour;
        for c in &mut colour {
            *c *= weighted;
        }
        let through = f32x16::splat(simd, 1.0) - alpha;
        let touched = coverage.touched_lanes(simd, met);
        lanes.touch(met.any);
        for (s, sum) in lanes.sums.iter_mut().enumerate() {
            let covers = (touched & u32x16::splat(simd, 1 << s)).simd_ne(0);
            for c in 0..3 {
                sum[c] = covers.select(store.channels(simd, sum[c] + colour[c]), sum[c]);
            }
            sum[3] = covers.select(store.channels(simd, sum[3] + weighted), sum[3]);
            sum[4] = covers.select(store.channels(simd, sum[4] * through), sum[4]);
        }
        told.written(met.any, met.coverage);
        let bits = simd.count_ones_u32x16(touched) * (5 * store.channel_bits());
        told.state(met.any, bits, bits);
    }

    #[inline(always)]
    fn resolve<S: Simd>(
        &self,
        simd: S,
        lanes: &Self::Lanes<S>,
        behind: &[[f32x16<S>; 3]],
    ) -> [Wide<S>; 3] {
        lanes.over(
            simd,
            behind,
            #[inline(always)]
            |sum| {
                let [r, g, b, weight, transmittance] = *sum;
                let (weight, transmittance) = (widened(simd, weight), widened(simd, transmittance));
                let mut colour = [widened(simd, r), widened(simd, g), widened(simd, b)];
                let nought = f64x8::splat(simd, 0.0);
                for half in 0..2 {
                    let opacity = f64x8::splat(simd, 1.0) - transmittance[half];
                    let any = weight[half].simd_gt(nought);
                    for c in &mut colour {
                        c[half] = any.select(c[half] / weight[half] * opacity, nought);
                    }
                }
                (colour, transmittance)
            },
        )
    }
}
