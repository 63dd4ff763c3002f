//! Transmittance from moments of many sums side by side. What depends on the moments alone is
//! found once.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over channels and halves are unrolled into registers; closures would be called"
)]

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, f64x8};

use crate::blended::functions::exp;
use crate::blended::moments::newton::{ABREAST, Polynomials, roots};
use crate::blended::moments::{DEGREE, LEAST_PIVOT, MOST_MOMENTS, MomentCount};
use crate::in_lanes::{Wide, widened};

/// Eight sums' Hankel matrices as L D Lᵀ, and all their absorbance.
#[derive(Clone, Copy)]
struct Hankels<S: Simd> {
    l: [Polynomials<S>; DEGREE + 1],
    d: Polynomials<S>,
    total: f64x8<S>,
}

/// What a sum's moments say of any depth: parts of the Hankel matrix, and all absorbance. Those
/// of few moments need the first eight numbers alone.
pub type Factors = [[f64; 8]; 2];

/// Numbers of [`Factors`].
const PLACES: usize = 16;

/// How transmittance is found of moments.
#[derive(Clone, Copy, Debug)]
pub struct OfMoments {
    /// How many.
    pub count: MomentCount,
    /// As of [`Moments::transmittance`](super::Moments::transmittance).
    pub bias: f64,
    /// The same.
    pub overestimation: f64,
}

impl OfMoments {
    /// What sixteen sums say of any depth.
    #[inline(always)]
    pub fn factors<S: Simd>(&self, simd: S, sums: &[f32x16<S>; MOST_MOMENTS]) -> [Factors; 16] {
        match self.count {
            MomentCount::Four => self.factored::<S, 2>(simd, sums),
            MomentCount::Six => self.factored::<S, 3>(simd, sums),
            MomentCount::Eight => self.factored::<S, 4>(simd, sums),
        }
    }

    #[inline(always)]
    fn factored<S: Simd, const D: usize>(
        &self,
        simd: S,
        sums: &[f32x16<S>; MOST_MOMENTS],
    ) -> [Factors; 16] {
        let (pull, towards) = self.count.pull(self.bias);
        let mut factors = [[[0.0; 8]; 2]; 16];
        let mut wide = [[f64x8::splat(simd, 1.0); MOST_MOMENTS]; 2];
        for k in 0..=2 * D {
            [wide[0][k], wide[1][k]] = widened(simd, sums[k]);
        }
        for (half, wide) in wide.iter_mut().enumerate() {
            let total = wide[0];
            wide[0] = f64x8::splat(simd, 1.0);
            for k in 1..=2 * D {
                wide[k] = wide[k] * (1.0 - pull) / total + pull * towards[k];
            }
            let hankels = Hankels::factor::<D>(simd, wide, total);
            let rows = &mut factors[8 * half..][..8];
            hankels.write::<D>(simd, rows);
        }
        factors
    }

    /// [`Moments::transmittance`](super::Moments::transmittance) at sixteen depths.
    #[inline(always)]
    pub fn transmittances<S: Simd>(
        &self,
        simd: S,
        factors: [&Factors; 16],
        z: &Wide<S>,
    ) -> Wide<S> {
        match self.count {
            MomentCount::Four => self.transmitted::<S, 2>(simd, factors, z),
            MomentCount::Six => self.transmitted::<S, 3>(simd, factors, z),
            MomentCount::Eight => self.transmitted::<S, 4>(simd, factors, z),
        }
    }

    #[inline(always)]
    fn transmitted<S: Simd, const D: usize>(
        &self,
        simd: S,
        factors: [&Factors; 16],
        z: &[f64x8<S>; ABREAST],
    ) -> [f64x8<S>; ABREAST] {
        let number = |x: f64| f64x8::splat(simd, x);
        let (low, high) = factors.split_at(8);
        let hankels = [Hankels::read::<D>(simd, low), Hankels::read::<D>(simd, high)];
        let mut kernels = [[z[0]; DEGREE + 1]; ABREAST];
        let mut share = *z;
        for v in 0..ABREAST {
            (kernels[v], share[v]) = hankels[v].kernel::<D>(simd, z[v]);
        }
        let roots = roots::<S, D>(simd, &kernels, z);
        let [nought, one] = [0.0, 1.0].map(number);
        for v in 0..ABREAST {
            let mut before = nought;
            for root in &roots[v][..D] {
                let mass = hankels[v].mass::<D>(simd, root.x);
                before += root.there.select(mass, nought);
            }
            let all = before + share[v] * self.overestimation;
            let finite = all.abs().simd_lt(number(f64::INFINITY));
            share[v] = finite.select(all.max(0.0).min(1.0), number(self.overestimation));
        }
        let mut result = share;
        for v in 0..ABREAST {
            let total = hankels[v].total;
            let some = exp(simd, -total * share[v]);
            result[v] = total.simd_le(nought).select(one, some);
        }
        result
    }
}

impl<S: Simd> Hankels<S> {
    /// [`Hankel::factor`](super::Hankel::factor).
    #[inline(always)]
    fn factor<const D: usize>(simd: S, b: &[f64x8<S>; MOST_MOMENTS], total: f64x8<S>) -> Self {
        let mut hankels = Self::none(simd);
        hankels.total = total;
        let least = f64x8::splat(simd, LEAST_PIVOT);
        for j in 0..=D {
            for i in j..=D {
                let mut known = f64x8::splat(simd, -0.0);
                for k in 0..j {
                    known += hankels.l[i][k] * hankels.l[j][k] * hankels.d[k];
                }
                let rest = b[i + j] - known;
                if i == j {
                    hankels.d[j] = rest.simd_gt(least).select(rest, least);
                } else {
                    hankels.l[i][j] = rest / hankels.d[j];
                }
            }
        }
        hankels
    }

    #[inline(always)]
    fn none(simd: S) -> Self {
        let nought = f64x8::splat(simd, 0.0);
        Hankels { l: [[nought; DEGREE + 1]; DEGREE + 1], d: [nought; DEGREE + 1], total: nought }
    }

    /// Puts them into [`Factors`]: L below its diagonal, D, and the absorbance.
    #[inline(always)]
    fn write<const D: usize>(&self, simd: S, rows: &mut [Factors]) {
        let mut columns = [f64x8::splat(simd, 0.0); PLACES];
        let mut at = 0;
        for i in 0..=D {
            for j in 0..i {
                columns[at] = self.l[i][j];
                at += 1;
            }
        }
        for i in 0..=D {
            columns[at] = self.d[i];
            at += 1;
        }
        columns[at] = self.total;
        for part in 0..2 {
            let mut eight = [columns[0]; 8];
            for i in 0..8 {
                eight[i] = columns[8 * part + i];
            }
            let eight = transposed(simd, eight);
            for i in 0..8 {
                eight[i].store_slice(&mut rows[i][part]);
            }
        }
    }

    /// Takes them out again.
    #[inline(always)]
    fn read<const D: usize>(simd: S, rows: &[&Factors]) -> Self {
        let mut columns = [f64x8::splat(simd, 0.0); PLACES];
        // Those of degree 2 are seven numbers.
        for part in 0..if D == 2 { 1 } else { 2 } {
            let mut eight = [columns[0]; 8];
            for i in 0..8 {
                eight[i] = f64x8::from_slice(simd, &rows[i][part]);
            }
            let eight = transposed(simd, eight);
            for i in 0..8 {
                columns[8 * part + i] = eight[i];
            }
        }
        let mut hankels = Self::none(simd);
        let mut at = 0;
        for i in 0..=D {
            for j in 0..i {
                hankels.l[i][j] = columns[at];
                at += 1;
            }
        }
        for i in 0..=D {
            hankels.d[i] = columns[at];
            at += 1;
        }
        hankels.total = columns[at];
        hankels
    }

    /// [`Hankel::orthogonal`](super::Hankel::orthogonal).
    #[inline(always)]
    fn orthogonal<const D: usize>(&self, simd: S, x: f64x8<S>) -> Polynomials<S> {
        let mut power = f64x8::splat(simd, 1.0);
        let mut y = [power; DEGREE + 1];
        for i in 0..=D {
            let mut sum = f64x8::splat(simd, -0.0);
            for (y, l) in y.iter().zip(&self.l[i]).take(i) {
                sum += *y * *l;
            }
            y[i] = power - sum;
            power *= x;
        }
        y
    }

    /// [`Hankel::mass`](super::Hankel::mass).
    #[inline(always)]
    fn mass<const D: usize>(&self, simd: S, x: f64x8<S>) -> f64x8<S> {
        let y = self.orthogonal::<D>(simd, x);
        let mut sum = f64x8::splat(simd, -0.0);
        for (y, d) in y.iter().zip(&self.d).take(D + 1) {
            sum += *y * *y / *d;
        }
        f64x8::splat(simd, 1.0) / sum
    }

    /// [`Hankel::kernel`](super::Hankel::kernel).
    #[inline(always)]
    fn kernel<const D: usize>(&self, simd: S, z: f64x8<S>) -> (Polynomials<S>, f64x8<S>) {
        let y = self.orthogonal::<D>(simd, z);
        let mut q = [f64x8::splat(simd, 0.0); DEGREE + 1];
        let mut inverse = f64x8::splat(simd, -0.0);
        for i in 0..=D {
            q[i] = y[i] / self.d[i];
            inverse += y[i] * q[i];
        }
        for i in (0..=D).rev() {
            let mut sum = f64x8::splat(simd, -0.0);
            for (row, q) in self.l.iter().zip(&q).take(D + 1).skip(i + 1) {
                sum += row[i] * *q;
            }
            q[i] -= sum;
        }
        (q, f64x8::splat(simd, 1.0) / inverse)
    }
}

/// The first numbers of all eight vectors, then the second ones, and so on.
#[inline(always)]
fn transposed<S: Simd>(simd: S, mut rows: [f64x8<S>; 8]) -> [f64x8<S>; 8] {
    for _ in 0..3 {
        let mut parted = rows;
        for i in 0..4 {
            (parted[i], parted[i + 4]) = simd.deinterleave_f64x8(rows[2 * i], rows[2 * i + 1]);
        }
        rows = parted;
    }
    rows
}
