//! The products and quotients of [`errors`](crate::residual::errors) in lanes, to the bit.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, i32x16, i64x8, mask32x16, u32x16, u64x8};

use crate::residual::errors::{MASS, POINT};

/// Shares of 2^32, up to the whole.
#[derive(Clone, Copy)]
pub(super) struct Share<S: Simd> {
    /// Modulo 2^32.
    low: u32x16<S>,
    /// Where it is 2^32.
    whole: mask32x16<S>,
}

impl<S: Simd> Share<S> {
    /// That of a threshold.
    #[inline(always)]
    pub(super) fn of_threshold(threshold: u32x16<S>, opaque: mask32x16<S>) -> Self {
        Share { low: threshold, whole: opaque }
    }

    /// [`of_pixel`](crate::residual::errors::of_pixel) of `N` samples.
    #[inline(always)]
    pub(super) fn of_pixel<const N: usize>(
        simd: S,
        [threshold, covered]: [u32x16<S>; 2],
        opaque: mask32x16<S>,
    ) -> Self {
        let word = |word: u32| u32x16::splat(simd, word);
        let (half, bits) = (word(0xffff), N.ilog2());
        // In halves that 32 bits hold.
        let low = (threshold & half) * covered;
        let high = (threshold >> 16) * covered + (low >> 16);
        let part = (high << (16 - bits)) + ((low & half) >> bits);
        // All samples' share is the whole, and nothing is left of it here.
        let of_opaque = if bits == 0 { word(0) } else { covered << (32 - bits) };
        Share {
            low: opaque.select(of_opaque, part),
            whole: opaque & covered.simd_eq(word(N as u32)),
        }
    }

    /// [`mass_of`](crate::residual::errors::mass_of).
    #[inline(always)]
    pub(super) fn mass(&self, simd: S) -> u32x16<S> {
        self.whole.select(u32x16::splat(simd, 1 << MASS), self.low >> (32 - MASS))
    }

    /// [`share`](crate::residual::errors::share).
    #[inline(always)]
    pub(super) fn of(&self, simd: S, x: i32x16<S>) -> i32x16<S> {
        let long = |word: u64| u64x8::splat(simd, word);
        let half = long(1 << 31);
        let [a, b] = [self.low.bitcast::<u64x8<S>>(), x.bitcast::<u64x8<S>>()];
        // The upper halves of the products as if x had no sign: of lanes in even places, and in
        // odd ones.
        let lower = long(u32::MAX.into());
        let even = ((a & lower) * (b & lower) + half) >> 32;
        let odd = ((a >> 32) * (b >> 32) + half) & !lower;
        let product = (even | odd).bitcast::<u32x16<S>>();
        // A sign is 2^32 less.
        let none = u32x16::splat(simd, 0);
        let sign = x.simd_lt(i32x16::splat(simd, 0)).select(self.low, none);
        self.whole.select(x, (product - sign).bitcast())
    }
}

/// [`shown`](crate::residual::errors::shown).
#[inline(always)]
pub(super) fn shown<S: Simd>(simd: S, coverage: i32x16<S>, colour: i32x16<S>) -> i32x16<S> {
    let half = i64x8::splat(simd, 1 << (POINT - 1));
    let (low, high) = simd.widening_mul_i32x16(coverage, colour);
    simd.saturating_narrow_i64x8((low + half) >> POINT, (high + half) >> POINT)
}

/// [`attenuated`](crate::residual::errors::attenuated).
#[inline(always)]
pub(super) fn attenuated<S: Simd>(mass: u32x16<S>, drawn: u32x16<S>) -> u32x16<S> {
    mass - ((mass * drawn) >> MASS)
}

/// [`centre`](crate::residual::errors::centre).
#[inline(always)]
pub(super) fn centre<S: Simd>(
    simd: S,
    [z, mass]: [u32x16<S>; 2],
    [far_z, far_mass]: [u32x16<S>; 2],
) -> [u32x16<S>; 2] {
    let word = |word: u32| u32x16::splat(simd, word);
    let both = mass + far_mass;
    let odds = quotient(simd, far_mass << MASS, both.max(word(1)));
    // In halves that 32 bits hold.
    let apart = far_z - z;
    let moved = (((apart >> 16) * odds) << 1) + (((apart & word(0xffff)) * odds) >> MASS);
    [z + moved, both.min(word(u16::MAX.into()))]
}

/// `x / by`, rounded down, where `x` is less than 2^31, `by` less than 2^24, and the quotient
/// less than 2^20.
#[inline(always)]
fn quotient<S: Simd>(simd: S, x: u32x16<S>, by: u32x16<S>) -> u32x16<S> {
    let signed = |word: u32x16<S>| word.bitcast::<i32x16<S>>();
    let [x, by] = [signed(x), signed(by)];
    // In single precision it is off by less than 1: the remainder tells.
    let near = simd.cvt_i32_f32x16(simd.cvt_f32_i32x16(x) / simd.cvt_f32_i32x16(by));
    let rest = x - near * by;
    let (none, one) = (i32x16::splat(simd, 0), i32x16::splat(simd, 1));
    let near = rest.simd_lt(none).select(near - one, near);
    rest.simd_ge(by).select(near + one, near).bitcast()
}

#[cfg(test)]
mod tests {
    use fearless_simd::Level;

    use super::*;
    use crate::residual::errors;
    use screendoor_rop::fast::levels;
    use screendoor_trace::random::Stream;

    /// What is multiplied in a lane: a threshold, covered samples of eight, sums, two entries.
    #[derive(Clone, Copy, PartialEq, Debug)]
    struct Given {
        threshold: u64,
        covered: u32,
        sums: [i32; 2],
        entries: [[u32; 2]; 2],
    }

    /// A word that is often at an end of its range.
    fn word(random: &mut Stream) -> u32 {
        match random.below(5) {
            0 => random.below(3),
            1 => u32::MAX - random.below(3),
            2 => (1 << 31) - 1 + random.below(3),
            _ => random.word() >> random.below(32),
        }
    }

    fn given(random: &mut Stream) -> Given {
        let mut depths = [word(random), word(random)];
        depths.sort_unstable();
        let masses = [word(random) & 0xffff, word(random) % 0x8001];
        Given {
            threshold: if random.below(4) == 0 { 1 << 32 } else { word(random).into() },
            covered: random.below(9),
            sums: [word(random) as i32, word(random) as i32],
            entries: std::array::from_fn(|i| [depths[i], masses[i]]),
        }
    }

    type Found = [u32; 6];

    fn one(given: Given) -> Found {
        let share = errors::of_pixel(given.threshold, given.covered, 3);
        let mass = errors::mass_of(share);
        let [near, far] = given.entries;
        let [z, both] = errors::centre(near, far);
        let [a, b] = given.sums;
        let attenuated = errors::attenuated(near[1], far[1]);
        [mass, errors::share(share, a) as u32, errors::shown(a, b) as u32, attenuated, z, both]
    }

    fn sixteen(level: Level, given: &[Given; 16]) -> [Found; 16] {
        #[inline(always)]
        fn found<S: Simd>(simd: S, given: &[Given; 16]) -> [Found; 16] {
            let lanes = |word: fn(&Given) -> u32| {
                u32x16::from_slice(simd, &std::array::from_fn::<_, 16, _>(|i| word(&given[i])))
            };
            let opaque = lanes(|given| (given.threshold >> 32) as u32);
            let opaque = opaque.simd_gt(u32x16::splat(simd, 0));
            let threshold = lanes(|given| given.threshold as u32);
            let share =
                Share::of_pixel::<8>(simd, [threshold, lanes(|given| given.covered)], opaque);
            let a = lanes(|given| given.sums[0] as u32).bitcast::<i32x16<S>>();
            let b = lanes(|given| given.sums[1] as u32).bitcast::<i32x16<S>>();
            let near = [lanes(|given| given.entries[0][0]), lanes(|given| given.entries[0][1])];
            let far = [lanes(|given| given.entries[1][0]), lanes(|given| given.entries[1][1])];
            let [z, both] = centre(simd, near, far);
            let [product, seen] = [share.of(simd, a), shown(simd, a, b)].map(|x| x.bitcast());
            let rows = [share.mass(simd), product, seen, attenuated(near[1], far[1]), z, both];
            std::array::from_fn(|i| rows.map(|row: u32x16<S>| row.as_slice()[i]))
        }
        screendoor_rop::for_level!(level, simd => found(simd, given))
    }

    #[test]
    fn sixteen_products_are_the_plain_text() {
        let mut random = Stream::new([0x9e0d]);
        for _ in 0..20_000 {
            let all: [Given; 16] = std::array::from_fn(|_| given(&mut random));
            for (name, level) in levels() {
                for (found, given) in sixteen(level, &all).into_iter().zip(all) {
                    assert_eq!(found, one(given), "{name} {given:?}");
                }
            }
        }
    }
}
