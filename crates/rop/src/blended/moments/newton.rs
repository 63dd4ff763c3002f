//! Roots of eight polynomials side by side: the steps of the plain text, and whoever has done
//! with them stands still until all have.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over channels and halves are unrolled into registers; closures would be called"
)]

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x8, mask64x8};

use crate::blended::moments::{DEGREE, REACH};

/// Eight polynomials: a coefficient for each power.
pub(super) type Polynomials<S> = [f64x8<S>; DEGREE + 1];

/// How many vectors are gone through at once: a step's sums wait for each other, and those of
/// other vectors need not.
pub(super) const ABREAST: usize = 2;

/// A root of each of eight polynomials, where there is one.
#[derive(Clone, Copy)]
pub(super) struct Root<S: Simd> {
    pub x: f64x8<S>,
    pub there: mask64x8<S>,
}

/// [`roots`](super::roots): places for all there may be.
#[inline(always)]
pub(super) fn roots<S: Simd, const D: usize>(
    simd: S,
    p: &[Polynomials<S>; ABREAST],
    high: &[f64x8<S>; ABREAST],
) -> [[Root<S>; DEGREE]; ABREAST] {
    let none = Root { x: f64x8::splat(simd, 0.0), there: mask64x8::splat(simd, false) };
    let mut chain = [*p; DEGREE + 1];
    for k in 1..=D {
        let last = chain[k - 1];
        for (p, last) in chain[k].iter_mut().zip(&last) {
            for i in 0..=D - k {
                p[i] = last[i + 1] * (i + 1) as f64;
            }
        }
    }
    let mut found = [[none; DEGREE]; ABREAST];
    found = between_turns::<S, 1>(simd, &chain[D - 1], &chain[D], &found, high);
    if D >= 2 {
        found = between_turns::<S, 2>(simd, &chain[D - 2], &chain[D - 1], &found, high);
    }
    if D >= 3 {
        found = between_turns::<S, 3>(simd, &chain[D - 3], &chain[D - 2], &found, high);
    }
    if D >= 4 {
        found = between_turns::<S, 4>(simd, &chain[D - 4], &chain[D - 3], &found, high);
    }
    found
}

/// The roots of polynomials of degree `L` between neighbouring roots of their derivatives.
#[inline(always)]
fn between_turns<S: Simd, const L: usize>(
    simd: S,
    p: &[Polynomials<S>; ABREAST],
    derivative: &[Polynomials<S>; ABREAST],
    turns: &[[Root<S>; DEGREE]; ABREAST],
    high: &[f64x8<S>; ABREAST],
) -> [[Root<S>; DEGREE]; ABREAST] {
    let mut found = *turns;
    let mut intervals = [[Interval::whole(simd); DEGREE]; ABREAST];
    for v in 0..ABREAST {
        let mut start = f64x8::splat(simd, -REACH);
        for i in 0..L {
            let there = if i + 1 < L { turns[v][i].there } else { mask64x8::splat(simd, true) };
            let end = if i + 1 < L { turns[v][i].x } else { high[v] };
            intervals[v][i] = Interval { low: start, high: end, there };
            start = there.select(end, start);
        }
    }
    // Two intervals at once, where there are two.
    for i in (0..L / 2).map(|pair| 2 * pair) {
        let [[a, b], [c, d]] = [0, 1].map(|v| [intervals[v][i], intervals[v][i + 1]]);
        let of = [a, b, c, d];
        let by = [0, 0, 1, 1];
        let [a, b, c, d] = newton::<S, L, 4>(simd, p, derivative, by, of);
        [found[0][i], found[0][i + 1], found[1][i], found[1][i + 1]] = [a, b, c, d];
    }
    if L % 2 == 1 {
        let of = [intervals[0][L - 1], intervals[1][L - 1]];
        let [a, b] = newton::<S, L, 2>(simd, p, derivative, [0, 1], of);
        [found[0][L - 1], found[1][L - 1]] = [a, b];
    }
    found
}

/// Where a root is looked for, if it is.
#[derive(Clone, Copy)]
struct Interval<S: Simd> {
    low: f64x8<S>,
    high: f64x8<S>,
    there: mask64x8<S>,
}

impl<S: Simd> Interval<S> {
    fn whole(simd: S) -> Self {
        let [low, high] = [-REACH, REACH].map(|x| f64x8::splat(simd, x));
        Interval { low, high, there: mask64x8::splat(simd, true) }
    }
}

/// The values of polynomials of degree `L`.
#[inline(always)]
fn evaluate<S: Simd, const L: usize>(p: &Polynomials<S>, x: f64x8<S>) -> f64x8<S> {
    let mut sum = p[L];
    for i in (0..L).rev() {
        sum = sum * x + p[i];
    }
    sum
}

/// [`root_between`](super::root_between) in `C` times eight intervals; `by` says of which vector
/// the polynomials are.
#[inline(always)]
fn newton<S: Simd, const L: usize, const C: usize>(
    simd: S,
    p: &[Polynomials<S>; ABREAST],
    derivative: &[Polynomials<S>; ABREAST],
    by: [usize; C],
    mut intervals: [Interval<S>; C],
) -> [Root<S>; C] {
    let number = |x: f64| f64x8::splat(simd, x);
    let [nought, half, one] = [0.0, 0.5, 1.0].map(number);
    let mut rises = [intervals[0].there; C];
    let mut roots = [Root { x: nought, there: intervals[0].there }; C];
    let mut moving = rises;
    for c in 0..C {
        let Interval { low, high, there } = intervals[c];
        rises[c] = evaluate::<S, L>(&p[by[c]], high).simd_gt(nought);
        let falls = evaluate::<S, L>(&p[by[c]], low).simd_gt(nought) ^ rises[c];
        roots[c] = Root { x: half * (low + high), there: there & falls };
        moving[c] = roots[c].there;
    }
    for _ in 0..80 {
        let mut any = moving[0];
        for more in &moving[1..] {
            any |= *more;
        }
        if !any.any_true() {
            break;
        }
        for c in 0..C {
            let x = roots[c].x;
            let interval = &mut intervals[c];
            let value = evaluate::<S, L>(&p[by[c]], x);
            let mut slope = derivative[by[c]][L - 1];
            for i in (0..L - 1).rev() {
                slope = slope * x + derivative[by[c]][i];
            }
            let beyond = value.simd_gt(nought) ^ rises[c];
            interval.high = beyond.select(interval.high, x);
            interval.low = beyond.select(x, interval.low);
            let step = x - value / slope;
            // At an end, too: there it has arrived.
            let within = step.simd_ge(interval.low) & step.simd_le(interval.high);
            let next = within.select(step, half * (interval.low + interval.high));
            let near = (next - x).abs().simd_le(number(1e-14) * (one + x.abs()));
            moving[c] &= !near;
            roots[c].x = moving[c].select(next, x);
        }
    }
    roots
}
