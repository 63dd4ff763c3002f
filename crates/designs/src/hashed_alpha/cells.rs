//! The published threshold: a hash of the cells that a fragment lies in, at two scales.

use screendoor_rop::Site;
use screendoor_trace::random::{hash, hash_on};
use screendoor_trace::trace::DepthPlane;

/// Cells of two sizes, the smaller exponent first, and how near the pixel's is to the upper.
pub(super) struct Cells {
    pub(super) between: f64,
    cells: [[u32; 4]; 2],
}

impl Cells {
    /// The cells that a fragment lies in: all its samples share them. They are `size` pixels
    /// large, and a unit of depth is so many pixels long.
    #[inline(always)]
    pub(super) fn of(size: f64, depth_in_pixels: f64, site: Site, plane: DepthPlane) -> Self {
        let depth = |unorm: f64| unorm * depth_in_pixels;
        let place = [f64::from(site.x) + 0.5, f64::from(site.y) + 0.5, depth(f64::from(plane.z.0))];
        // How far the place moves from one pixel to the next, along the steeper axis.
        let (across, down) = (plane.dzdx, plane.dzdy);
        let slope = depth(f64::from(across.unsigned_abs().max(down.unsigned_abs())));
        let step = (1.0 + slope * slope).sqrt();
        // The two powers of two beside the pixel's scale, and how near it is to the
        // upper one.
        let log = libm::log2(1.0 / (size * step));
        let exponents = [log.floor(), log.ceil()];
        let mut cells = [[0; 4]; 2];
        for (cell, exponent) in cells.iter_mut().zip(exponents) {
            let scale = power_of_two(exponent as i32);
            for (cell, place) in cell.iter_mut().zip(place) {
                *cell = (place * scale).floor() as i64 as u32;
            }
            cell[3] = exponent as i32 as u32;
        }
        Cells { between: log - exponents[0], cells }
    }

    /// For each size, the hash of all that comes before the sample, and what comes after it.
    #[inline(always)]
    pub(super) fn hashes(&self, seed: u32, object: u32) -> [(u32, u32); 2] {
        let [lower, upper] = self.cells;
        let before = |[x, y, z, _]: [u32; 4]| hash([seed, object, x, y, z]);
        [(before(lower), lower[3]), (before(upper), upper[3])]
    }

    /// The published threshold in (0, 1] of a fragment, from `sample` on where each has its own.
    pub(super) fn threshold(&self, seed: u32, object: u32, sample: u32) -> f64 {
        let word = |(before, exponent)| hash_on(before, [sample, exponent]);
        let [lower, upper] = self.hashes(seed, object).map(word);
        Mix::of(self.between).uniform(lower, upper)
    }
}

/// 2 to this power, which is not so far from 0 that it has no such number.
fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((1023 + exponent) as u64) << 52)
}

/// A word as a number between 0 and 1.
#[inline(always)]
pub(super) fn fraction(word: u32) -> f64 {
    (f64::from(word) + 0.5) / 2_f64.powi(32)
}

/// How two uniform numbers are mixed, and what makes their weighted mean uniform again.
#[derive(Clone, Copy)]
pub(super) struct Mix {
    between: f64,
    /// The smaller weight.
    a: f64,
    ends: f64,
    middle: f64,
}

impl Mix {
    /// With the weights `1 − between` and `between`.
    #[inline(always)]
    pub(super) fn of(between: f64) -> Self {
        let a = between.min(1.0 - between);
        // Of a single number the mean is uniform: all of it is the middle.
        let ends = if a <= 0.0 { 1.0 } else { 2.0 * a * (1.0 - a) };
        Mix { between, a, ends, middle: 1.0 - a }
    }

    /// The mean's distribution function (I3D 2017, section 3.3), of the numbers that two words
    /// stand for. It has no branch, so that loops over samples become vectors.
    #[inline(always)]
    pub(super) fn uniform(self, lower: u32, upper: u32) -> f64 {
        self.of_mean((1.0 - self.between) * fraction(lower) + self.between * fraction(upper))
    }

    /// The distribution function at `x`.
    #[inline(always)]
    pub(super) fn of_mean(self, x: f64) -> f64 {
        let Mix { a, ends, middle, .. } = self;
        let (first, last) = (x < a, x >= middle && a > 0.0);
        let rest = 1.0 - x;
        let end = if first { x * x } else { rest * rest };
        let at_end = first | last;
        let above = if at_end { end } else { x - a / 2.0 };
        let share = above / if at_end { ends } else { middle };
        if last { 1.0 - share } else { share }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_trace::random::Stream;

    #[test]
    fn mixed_hashes_are_uniform_again() {
        for between in [0.0, 0.1, 0.3, 0.5, 0.8] {
            let mut random = Stream::new([1, (between * 10.0) as u32]);
            let mut tenths = [0; 10];
            for _ in 0..100_000 {
                let u = Mix::of(between).uniform(random.word(), random.word());
                assert!((0.0..=1.0).contains(&u));
                tenths[((u * 10.0) as usize).min(9)] += 1;
            }
            // Binomial: σ = 95; the bound is six of them.
            assert!(tenths.iter().all(|n: &i32| (n - 10_000).abs() < 570), "{tenths:?}");
        }
    }

    /// The publication's formula, case by case.
    fn published(x: f64, a: f64) -> f64 {
        if a <= 0.0 {
            x
        } else if x < a {
            x * x / (2.0 * a * (1.0 - a))
        } else if x < 1.0 - a {
            (x - a / 2.0) / (1.0 - a)
        } else {
            1.0 - (1.0 - x) * (1.0 - x) / (2.0 * a * (1.0 - a))
        }
    }

    #[test]
    fn the_formula_without_branches_gives_the_published_bits() {
        let mut random = Stream::new([2]);
        for _ in 0..200_000 {
            let between = match random.below(8) {
                0 => 0.0,
                1 => 0.5,
                2 => f64::from_bits(1),
                3 => 1.0 - f64::EPSILON / 2.0,
                _ => fraction(random.word()),
            };
            let mix = Mix::of(between);
            let x = match random.below(6) {
                0 => mix.a,
                1 => mix.middle,
                _ => fraction(random.word()),
            };
            let expected = published(x, between.min(1.0 - between));
            assert_eq!(mix.of_mean(x).to_bits(), expected.to_bits(), "{between} {x}");
        }
    }

    #[test]
    fn powers_of_two_are_those_of_the_library() {
        // Far beyond what a frame's size and the parameter's range give.
        for exponent in -300..=300 {
            let expected = libm::exp2(f64::from(exponent));
            assert_eq!(power_of_two(exponent).to_bits(), expected.to_bits(), "{exponent}");
        }
    }
}
