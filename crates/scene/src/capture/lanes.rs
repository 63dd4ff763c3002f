//! Vectors of numbers, one for each of several fragments, with the arithmetic of shading: the
//! same operations in the same order as [`glam`]'s, so that the last bit is the same.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, f64x8};
use glam::{DVec3, Vec3};

/// Fragments that are shaded at a time.
pub(super) const LANES: usize = 8;
/// A number of each fragment, in double and in single precision.
pub(super) type Doubles<S> = f64x8<S>;
pub(super) type Singles<S> = f32x8<S>;

/// `f` of 0, 1 and 2: what [`std::array::from_fn`] and `map` do, but without the calls that
/// they may remain, in which vectors are passed by memory.
#[inline(always)]
pub(super) fn three<T>(f: impl Fn(usize) -> T) -> [T; 3] {
    [f(0), f(1), f(2)]
}

/// `f` of 0 to 3.
#[inline(always)]
pub(super) fn four<T>(f: impl Fn(usize) -> T) -> [T; 4] {
    [f(0), f(1), f(2), f(3)]
}

/// As `as f32` would have it.
#[inline(always)]
pub(super) fn narrow<S: Simd>(value: Doubles<S>) -> Singles<S> {
    let (low, high) = value.split();
    low.narrow(high)
}

#[inline(always)]
fn dot<V: Copy + std::ops::Mul<Output = V> + std::ops::Add<Output = V>>(a: [V; 3], b: [V; 3]) -> V {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(super) fn splat3<S: Simd>(simd: S, v: Vec3) -> [Singles<S>; 3] {
    three(
        #[inline(always)]
        |i| Singles::splat(simd, v[i]),
    )
}

/// `Vec3::dot` with the same vector for all.
#[inline(always)]
pub(super) fn dot_with<S: Simd>(simd: S, a: [Singles<S>; 3], b: Vec3) -> Singles<S> {
    dot(a, splat3(simd, b))
}

/// All levels of instructions that this machine has.
#[cfg(test)]
pub(super) fn levels() -> Vec<fearless_simd::Level> {
    use fearless_simd::Level;
    let here = Level::new();
    let mut levels = vec![Level::baseline(), Level::fallback(), here];
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
        levels.extend(here.as_sse4_2().map(Level::Sse4_2));
        levels.extend(here.as_avx2().map(Level::Avx2));
    }
    levels
}

/// Makes `normalize_or` of a type of lanes.
macro_rules! normalize {
    ($name:ident, $vector:ident, $number:ident) => {
        /// `normalize_or`: `fallback` where the reciprocal of the length is no positive number.
        #[inline(always)]
        pub(super) fn $name<S: Simd>(
            simd: S,
            v: [$vector<S>; 3],
            fallback: [$vector<S>; 3],
        ) -> [$vector<S>; 3] {
            let reciprocal = $vector::splat(simd, 1.0) / dot(v, v).sqrt();
            let good = reciprocal.simd_gt(0.0) & reciprocal.simd_lt($number::INFINITY);
            three(
                #[inline(always)]
                |i| good.select(v[i] * reciprocal, fallback[i]),
            )
        }
    };
}
normalize!(normalize_doubles, Doubles, f64);
normalize!(normalize_singles, Singles, f32);

/// A point for all.
#[inline(always)]
pub(super) fn splat_point<S: Simd>(simd: S, v: DVec3) -> [Doubles<S>; 3] {
    three(
        #[inline(always)]
        |i| Doubles::splat(simd, v[i]),
    )
}

/// `v` where it is more than `least`, else `least`: what is no number becomes `least`, too.
#[inline(always)]
pub(super) fn at_least<S: Simd>(simd: S, v: Singles<S>, least: f32) -> Singles<S> {
    v.simd_gt(least).select(v, Singles::splat(simd, least))
}

/// `v` where it is less than `most`, else `most`.
#[inline(always)]
pub(super) fn at_most<S: Simd>(simd: S, v: Singles<S>, most: f32) -> Singles<S> {
    v.simd_lt(most).select(v, Singles::splat(simd, most))
}
