//! Sums of sixteen pixels.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, f64x8, mask32x16, u32x16};

use crate::blended::accumulators::{Accumulators, Coverage};
use crate::in_lanes::{LANES, Met, Wide, counted, widened, words};
use crate::resolve::box_filter;
use screendoor_trace::tile::TILE_PIXELS;

/// What is kept of all fragments together, as numbers.
pub trait Summed<const K: usize>: Clone + Default {
    /// They.
    fn numbers(&self) -> [f32; K];
    /// The other way.
    fn of(numbers: [f32; K]) -> Self;
}

/// [`Accumulators`] of sixteen pixels.
pub struct SumLanes<S: Simd, const K: usize> {
    /// Each sum's numbers.
    pub sums: Vec<[f32x16<S>; K]>,
    /// Pixels of which a fragment came.
    touched: mask32x16<S>,
}

impl<S: Simd, const K: usize> SumLanes<S, K> {
    /// Those of cleared pixels that have `count` sums.
    pub fn cleared<A: Summed<K>>(simd: S, count: usize) -> Self {
        let mut cleared = [f32x16::splat(simd, 0.0); K];
        for (lanes, number) in cleared.iter_mut().zip(A::default().numbers()) {
            *lanes = f32x16::splat(simd, number);
        }
        SumLanes { sums: vec![cleared; count], touched: mask32x16::splat(simd, false) }
    }

    /// Makes them those of cleared pixels again.
    #[inline(always)]
    pub fn clear<A: Summed<K>>(&mut self, simd: S) {
        let numbers = A::default().numbers();
        for sum in &mut self.sums {
            for k in 0..K {
                sum[k] = f32x16::splat(simd, numbers[k]);
            }
        }
        self.touched = mask32x16::splat(simd, false);
    }

    /// Takes pixels in.
    #[inline(always)]
    pub fn load<A: Summed<K>>(
        &mut self,
        simd: S,
        states: &[Accumulators<A>; TILE_PIXELS],
        pixels: &[u8; LANES],
    ) {
        let mut touched = 0;
        for (lane, pixel) in pixels.iter().enumerate() {
            let any = !states[usize::from(*pixel)].get().is_empty();
            touched |= u64::from(any) << lane;
        }
        self.touched = mask32x16::from_bitmask(simd, touched);
        let none = A::default();
        for (s, to) in self.sums.iter_mut().enumerate() {
            let mut columns = [[0.0; LANES]; K];
            for (lane, pixel) in pixels.iter().enumerate() {
                let numbers = states[usize::from(*pixel)].get().get(s).unwrap_or(&none).numbers();
                for (column, number) in columns.iter_mut().zip(numbers) {
                    column[lane] = number;
                }
            }
            for k in 0..K {
                to[k] = f32x16::from_slice(simd, &columns[k]);
            }
        }
    }

    /// Puts them back.
    #[inline(always)]
    pub fn store<A: Summed<K>>(
        &self,
        states: &mut [Accumulators<A>; TILE_PIXELS],
        pixels: &[u8; LANES],
    ) {
        let touched = self.touched.to_bitmask();
        for (s, sum) in self.sums.iter().enumerate() {
            let mut columns = [[0.0; LANES]; K];
            for k in 0..K {
                sum[k].store_slice(&mut columns[k]);
            }
            for (lane, pixel) in pixels.iter().enumerate() {
                if touched >> lane & 1 == 1 {
                    let mut numbers = [0.0; K];
                    for (number, column) in numbers.iter_mut().zip(&columns) {
                        *number = column[lane];
                    }
                    let sums = states[usize::from(*pixel)].touch(self.sums.len());
                    sums[s] = A::of(numbers);
                }
            }
        }
    }

    /// Notes that these pixels have a fragment.
    #[inline(always)]
    pub fn touch(&mut self, of: mask32x16<S>) {
        self.touched |= of;
    }

    /// [`Accumulators::over`].
    #[inline(always)]
    pub fn over(
        &self,
        simd: S,
        behind: &[[f32x16<S>; 3]],
        layer: impl Fn(&[f32x16<S>; K]) -> ([Wide<S>; 3], Wide<S>),
    ) -> [Wide<S>; 3] {
        let mut sums = [[f64x8::splat(simd, 0.0); 2]; 3];
        let mut mean = sums;
        let untouched = !self.touched;
        if self.sums.len() == 1 || untouched.any_true() {
            mean = box_filtered(simd, behind);
        }
        for (s, sum) in self.sums.iter().enumerate() {
            let (colour, transmittance) = layer(sum);
            for c in 0..3 {
                let behind =
                    if self.sums.len() == 1 { mean[c] } else { widened(simd, behind[s][c]) };
                for half in 0..2 {
                    sums[c][half] += colour[c][half] + transmittance[half] * behind[half];
                }
            }
        }
        let (low, high) = simd.widen_mask32x16(untouched);
        for c in 0..3 {
            for (half, untouched) in [low, high].into_iter().enumerate() {
                let all = sums[c][half] / self.sums.len() as f64;
                sums[c][half] = untouched.select(mean[c][half], all);
            }
        }
        sums
    }
}

/// [`box_filter`] of sixteen pixels.
#[inline(always)]
fn box_filtered<S: Simd>(simd: S, samples: &[[f32x16<S>; 3]]) -> [Wide<S>; 3] {
    let mut differ = mask32x16::splat(simd, false);
    for sample in samples {
        for c in 0..3 {
            let [a, b] = [samples[0][c], sample[c]].map(|v| v.bitcast::<u32x16<S>>());
            differ |= a.simd_ne(b);
        }
    }
    if differ.any_true() {
        return filtered_one_by_one(simd, samples);
    }
    let mut same = [[f64x8::splat(simd, 0.0); 2]; 3];
    for c in 0..3 {
        same[c] = widened(simd, samples[0][c]);
    }
    same
}

/// Of pixels of which some have samples that differ.
#[inline(never)]
fn filtered_one_by_one<S: Simd>(simd: S, samples: &[[f32x16<S>; 3]]) -> [Wide<S>; 3] {
    let samples: Vec<_> = samples.iter().map(|s| s.map(|c| words(c.bitcast()))).collect();
    let mut columns = [[0.0; LANES]; 3];
    let mut pixel = vec![[0.0; 3]; samples.len()];
    for lane in 0..LANES {
        for (pixel, sample) in pixel.iter_mut().zip(&samples) {
            *pixel = [0, 1, 2].map(|c| f32::from_bits(sample[c][lane]));
        }
        for (column, mean) in columns.iter_mut().zip(box_filter(&pixel)) {
            column[lane] = mean;
        }
    }
    columns.map(|column| {
        let (low, high) = column.split_at(LANES / 2);
        [f64x8::from_slice(simd, low), f64x8::from_slice(simd, high)]
    })
}

impl Coverage {
    /// [`Coverage::touched`], of sixteen fragments.
    #[inline(always)]
    pub fn touched_lanes<S: Simd>(self, simd: S, met: &Met<S>) -> u32x16<S> {
        match self {
            Coverage::Sample => met.coverage,
            Coverage::Share => met.any.select(u32x16::splat(simd, 1), u32x16::splat(simd, 0)),
        }
    }

    /// [`Coverage::alpha`], of sixteen fragments.
    #[inline(always)]
    pub fn alpha_lanes<S: Simd>(self, simd: S, met: &Met<S>, samples: usize) -> f32x16<S> {
        match self {
            Coverage::Sample => met.alpha,
            Coverage::Share => met.alpha * (counted(simd, met.coverage) / samples as f32),
        }
    }
}
