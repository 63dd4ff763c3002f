//! `mboit` with sixteen pixels side by side.
//!
//! The second pass takes long to find a transmittance, of each sample that a fragment covers.
//! Samples of a pixel that hold the same moments share it. What is left, of all sixteen pixels,
//! is put together into full vectors.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over channels and halves are unrolled into registers; closures would be called"
)]

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, f64x8, mask32x16, u32x16};
use screendoor_rop::functions::{exp, log};
use screendoor_rop::in_lanes::{HasLanes, InLanes, LANES, Met, Told, Wide, widened};
use screendoor_rop::{Accumulators, Factors, MOST_MOMENTS, Moments, Probe, SumLanes, Summed};
use screendoor_trace::tile::TILE_PIXELS;

use crate::mboit::{LEAST_SEEN, LEAST_TRANSMITTANCE, MomentBasedAt, MomentSums, Rules};

/// The numbers of [`MomentSums`]: moments, a colour and a weight.
const NUMBERS: usize = MOST_MOMENTS + 4;
const COLOUR: usize = MOST_MOMENTS;
const WEIGHT: usize = MOST_MOMENTS + 3;

impl Summed<NUMBERS> for MomentSums {
    fn numbers(&self) -> [f32; NUMBERS] {
        let mut numbers = [0.0; NUMBERS];
        numbers[..COLOUR].copy_from_slice(&self.moments.sums());
        numbers[COLOUR..WEIGHT].copy_from_slice(&self.colour);
        numbers[WEIGHT] = self.weight;
        numbers
    }

    fn of(numbers: [f32; NUMBERS]) -> Self {
        let [r, g, b, weight] = [0, 1, 2, 3].map(|i| numbers[COLOUR + i]);
        MomentSums { moments: Moments::of(moments(&numbers)), colour: [r, g, b], weight }
    }
}

/// The first numbers: moments.
#[inline(always)]
fn moments<T: Copy>(numbers: &[T; NUMBERS]) -> [T; MOST_MOMENTS] {
    *numbers.first_chunk().expect("more follow")
}

/// The design in lanes.
#[derive(Debug)]
pub struct MomentsInLanes(Rules);

impl<const N: usize> HasLanes<N> for MomentBasedAt<N> {
    type InLanes = MomentsInLanes;

    fn in_lanes(&self) -> Option<MomentsInLanes> {
        Some(MomentsInLanes(self.rules.clone()))
    }
}

/// Sums of sixteen pixels, and what the second pass knows of them.
pub struct Lanes<S: Simd> {
    sums: SumLanes<S, NUMBERS>,
    /// Whether the rest is theirs.
    known: bool,
    /// By sum and lane: its moments' factors.
    factors: Vec<[Factors; LANES]>,
    /// By sum: bits that name the first sums of the pixels with the same moments.
    first: Vec<u32x16<S>>,
    /// By sum and lane: where the weight of that first one stands.
    places: Vec<[u32; LANES]>,
    /// Sums and lanes of which transmittance is asked: their places.
    asked: Vec<u32>,
    /// Their weights.
    weights: Vec<f32>,
}

impl<S: Simd> Lanes<S> {
    fn new(simd: S, sums: SumLanes<S, NUMBERS>) -> Self {
        let count = sums.sums.len();
        Lanes {
            sums,
            known: false,
            factors: vec![[[[0.0; 8]; 2]; LANES]; count],
            first: vec![u32x16::splat(simd, 0); count],
            places: vec![[0; LANES]; count],
            // Vectors are written whole.
            asked: vec![0; LANES * (count + 1)],
            weights: vec![0.0; LANES * count],
        }
    }

    /// Finds what the second pass has to know.
    #[inline(never)]
    fn know(&mut self, simd: S, rules: &Rules) {
        simd.vectorize(
            #[inline(always)]
            || self.know_here(simd, rules),
        );
        self.known = true;
    }

    #[inline(always)]
    fn know_here(&mut self, simd: S, rules: &Rules) {
        let sums = &self.sums.sums;
        let mut lane = [0; LANES];
        for (i, lane) in lane.iter_mut().enumerate() {
            *lane = i as u32;
        }
        let lane = u32x16::from_slice(simd, &lane);
        for (s, sum) in sums.iter().enumerate() {
            let own = moments(sum);
            self.factors[s] = rules.of_moments.factors(simd, &own);
            let mut first = u32x16::splat(simd, s as u32);
            for (t, other) in sums[..s].iter().enumerate().rev() {
                let mut same = own[0].simd_eq(other[0]);
                for k in 1..MOST_MOMENTS {
                    same &= own[k].simd_eq(other[k]);
                }
                first = same.select(u32x16::splat(simd, t as u32), first);
            }
            (first * LANES as u32 + lane).store_slice(&mut self.places[s]);
            self.first[s] = simd.shlv_u32x16(u32x16::splat(simd, 1), first);
        }
    }

    /// Finds of which sums transmittance is asked; how many they are.
    #[inline(always)]
    fn ask(&mut self, simd: S, touched: u32x16<S>) -> usize {
        let mut needed = u32x16::splat(simd, 0);
        for (s, first) in self.first.iter().enumerate() {
            needed |= covers(simd, touched, s).select(*first, u32x16::splat(simd, 0));
        }
        let mut place = [0; LANES];
        for (i, place) in place.iter_mut().enumerate() {
            *place = i as u32;
        }
        let mut place = u32x16::from_slice(simd, &place);
        let mut count = 0;
        for s in 0..self.first.len() {
            let asked = covers(simd, needed, s);
            place.compress(asked).store_slice(&mut self.asked[count..][..LANES]);
            count += asked.to_bitmask().count_ones() as usize;
            place += LANES as u32;
        }
        count
    }

    /// Finds the weights that are asked for.
    #[inline(always)]
    fn weigh(&mut self, simd: S, rules: &Rules, touched: u32x16<S>, z: &Wide<S>, alpha: &Wide<S>) {
        let count = self.ask(simd, touched);
        let [mut depths, mut alphas] = [[0.0; LANES]; 2];
        for half in 0..2 {
            let of = LANES / 2 * half..LANES / 2 * (half + 1);
            z[half].store_slice(&mut depths[of.clone()]);
            alpha[half].store_slice(&mut alphas[of]);
        }
        for start in (0..count).step_by(LANES) {
            // What is beyond the last is the first again.
            let mut places = [self.asked[0] as usize; LANES];
            for (i, place) in places.iter_mut().enumerate() {
                if start + i < count {
                    *place = self.asked[start + i] as usize;
                }
            }
            let all = self.factors.as_flattened();
            let mut factors = [&all[places[0]]; LANES];
            let [mut z, mut alpha] = [[0.0; LANES]; 2];
            for i in 0..LANES {
                factors[i] = &all[places[i]];
                z[i] = depths[places[i] % LANES];
                alpha[i] = alphas[places[i] % LANES];
            }
            let [z, alpha] = [z, alpha].map(|v| {
                let (low, high) = v.split_at(LANES / 2);
                [f64x8::from_slice(simd, low), f64x8::from_slice(simd, high)]
            });
            let mut through = rules.of_moments.transmittances(simd, factors, &z);
            for half in 0..2 {
                through[half] = alpha[half] * through[half].max(LEAST_SEEN);
            }
            let mut weights = [0.0; LANES];
            simd.narrow_f64x8(through[0], through[1]).store_slice(&mut weights);
            for (place, weight) in places.iter().zip(weights) {
                self.weights[*place] = weight;
            }
        }
    }

    /// The weights of a sum, where they are found.
    #[inline(always)]
    fn weights(&self, simd: S, s: usize) -> f32x16<S> {
        let mut weights = [0.0; LANES];
        for (weight, place) in weights.iter_mut().zip(&self.places[s]) {
            *weight = self.weights[*place as usize];
        }
        f32x16::from_slice(simd, &weights)
    }
}

/// Where sets have a member.
#[inline(always)]
fn covers<S: Simd>(simd: S, sets: u32x16<S>, s: usize) -> mask32x16<S> {
    (sets & u32x16::splat(simd, 1 << s)).simd_ne(0)
}

impl MomentsInLanes {
    /// The first pass: moments.
    #[inline(always)]
    fn sum<S: Simd>(
        &self,
        simd: S,
        lanes: &mut Lanes<S>,
        touched: u32x16<S>,
        z: &Wide<S>,
        alpha: &Wide<S>,
    ) {
        let mut term = *alpha;
        for half in 0..2 {
            let rest = (f64x8::splat(simd, 1.0) - alpha[half]).max(LEAST_TRANSMITTANCE);
            term[half] = -log(simd, rest);
        }
        let count = self.0.of_moments.count.count();
        let mut terms = [f32x16::splat(simd, 0.0); MOST_MOMENTS];
        for to in &mut terms[..=count] {
            *to = simd.narrow_f64x8(term[0], term[1]);
            for half in 0..2 {
                term[half] *= z[half];
            }
        }
        for (s, sum) in lanes.sums.sums.iter_mut().enumerate() {
            let covers = covers(simd, touched, s);
            for (sum, term) in sum.iter_mut().zip(&terms[..=count]) {
                *sum = covers.select(*sum + *term, *sum);
            }
        }
    }

    /// The second: colours, as much as is seen of them.
    #[inline(always)]
    fn blend<S: Simd>(
        &self,
        simd: S,
        lanes: &mut Lanes<S>,
        met: &Met<S>,
        touched: u32x16<S>,
        z: &Wide<S>,
        alpha: &Wide<S>,
    ) {
        if !lanes.known {
            lanes.know(simd, &self.0);
        }
        lanes.weigh(simd, &self.0, touched, z, alpha);
        let store = self.0.store;
        for s in 0..lanes.first.len() {
            let covers = covers(simd, touched, s);
            if !covers.any_true() {
                continue;
            }
            let weight = lanes.weights(simd, s);
            let sum = &mut lanes.sums.sums[s];
            for c in 0..3 {
                let sum = &mut sum[COLOUR + c];
                let more = store.channels(simd, *sum + weight * met.colour[c]);
                *sum = covers.select(more, *sum);
            }
            let sum = &mut sum[WEIGHT];
            *sum = covers.select(store.channels(simd, *sum + weight), *sum);
        }
    }
}

impl InLanes for MomentsInLanes {
    type State = Accumulators<MomentSums>;
    type Lanes<S: Simd> = Lanes<S>;

    fn clear<S: Simd>(&self, simd: S) -> Lanes<S> {
        Lanes::new(simd, SumLanes::cleared::<MomentSums>(simd, self.0.sums()))
    }

    #[inline(always)]
    fn clear_again<S: Simd>(&self, simd: S, lanes: &mut Lanes<S>) {
        lanes.sums.clear::<MomentSums>(simd);
        lanes.known = false;
    }

    #[inline(always)]
    fn load<S: Simd>(
        &self,
        simd: S,
        lanes: &mut Lanes<S>,
        states: &[Self::State; TILE_PIXELS],
        pixels: &[u8; LANES],
    ) {
        lanes.sums.load(simd, states, pixels);
        lanes.known = false;
    }

    #[inline(always)]
    fn store<S: Simd>(
        &self,
        lanes: &Lanes<S>,
        states: &mut [Self::State; TILE_PIXELS],
        pixels: &[u8; LANES],
    ) {
        lanes.sums.store(states, pixels);
    }

    #[inline(always)]
    fn draw<S: Simd, P: Probe>(
        &self,
        simd: S,
        lanes: &mut Lanes<S>,
        pass: u32,
        met: &Met<S>,
        told: &mut Told<S, P>,
    ) {
        let rules = &self.0;
        let z = rules.depth.log_warped_lanes(simd, met.z);
        let alpha = widened(simd, rules.coverage.alpha_lanes(simd, met, rules.samples));
        let touched = rules.coverage.touched_lanes(simd, met);
        lanes.sums.touch(met.any);
        told.written(met.any, met.coverage);
        let count = simd.count_ones_u32x16(touched);
        let moments = rules.moment_bits();
        if pass == 0 {
            self.sum(simd, lanes, touched, &z, &alpha);
            return told.state(met.any, count * moments, count * moments);
        }
        self.blend(simd, lanes, met, touched, &z, &alpha);
        let texel = rules.store.texel_bits();
        told.state(met.any, count * (moments + texel), count * texel);
    }

    #[inline(always)]
    fn resolve<S: Simd>(
        &self,
        simd: S,
        lanes: &Lanes<S>,
        behind: &[[f32x16<S>; 3]],
    ) -> [Wide<S>; 3] {
        lanes.sums.over(
            simd,
            behind,
            #[inline(always)]
            |sum| {
                let mut through = widened(simd, sum[0]);
                let weight = widened(simd, sum[WEIGHT]);
                let mut colour = [through; 3];
                let nought = f64x8::splat(simd, 0.0);
                for c in 0..3 {
                    colour[c] = widened(simd, sum[COLOUR + c]);
                }
                for half in 0..2 {
                    through[half] = exp(simd, -through[half]);
                    let opacity = f64x8::splat(simd, 1.0) - through[half];
                    let any = weight[half].simd_gt(nought);
                    for c in &mut colour {
                        c[half] = any.select(c[half] / weight[half] * opacity, nought);
                    }
                }
                (colour, through)
            },
        )
    }
}
