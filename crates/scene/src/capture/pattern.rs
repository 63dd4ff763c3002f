//! Where a pixel's samples lie.
//!
//! 1 to 16 samples: the standard patterns of Direct3D and Vulkan. 64 (and its
//! prefix of 32): a nested pattern of our own, whose first 2^k samples are well
//! spread for every k, so that one trace serves every sample count.
//!
//! The nested pattern is the first 64 points of the two-dimensional Sobol'
//! sequence, Owen-scrambled in both dimensions and cut to 1/16 pixel. The
//! sequence being a (0, 2)-sequence in base 2 and scrambling keeping that, each of
//! the first 2^k points has every elementary interval of area 2^-k to itself, as
//! far as 1/16 pixel resolves. There are 2^22 such scramblings that put the first
//! point on the pixel's centre; all were searched for the least sum, over the
//! prefixes of 2 to 64 points, of star discrepancy and of inverse least distance
//! across the pixel's repeating edges, each relative to its mean over the
//! scramblings. The tests check the intervals, find the exact star discrepancy of
//! every prefix, and (ignored, a minute) redo the search.

use screendoor_trace::error::{Error, Result};
use screendoor_trace::trace::SamplePattern;

screendoor_trace::options! {
    /// Which family of sample patterns.
    pub enum PatternKind {
        Auto = "auto": "standard up to 16 samples, nested for 32 and 64",
        Standard = "standard": "the patterns of Direct3D and Vulkan, 1 to 16 samples",
        Nested = "nested": "one pattern whose prefixes serve every smaller sample count",
        Centre = "centre": "all samples at the pixel's centre: no antialiasing (Enderton et al. 2011, section 3.1)",
    }
}

/// The flips of the best scrambling, the same in both dimensions: bit `i − 1` says
/// whether node `i` of the binary tree over four digits (numbered as in a heap)
/// flips the digit below it.
const FLIPS: [u16; 2] = [0x51, 0x51];

/// The upper four bits of the two coordinates of the Sobol' sequence's point `i`.
const fn sobol(i: u32) -> [u32; 2] {
    let (mut direction, mut y, mut rest) = (1_u32 << 31, 0, i);
    while rest != 0 {
        if rest & 1 == 1 {
            y ^= direction;
        }
        direction ^= direction >> 1;
        rest >>= 1;
    }
    [i.reverse_bits() >> 28, y >> 28]
}

/// Owen's scrambling of a four-digit coordinate.
const fn owen(digits: u32, flips: u16) -> u32 {
    let (mut node, mut result, mut place) = (1, 0, 4);
    while place > 0 {
        place -= 1;
        let digit = digits >> place & 1;
        result = result << 1 | (digit ^ (flips >> (node - 1) & 1) as u32);
        node = 2 * node + digit;
    }
    result
}

/// The first `samples` positions of the nested pattern under a scrambling.
fn nested(samples: u32, flips: [u16; 2]) -> Vec<[i8; 2]> {
    let point = |i| {
        let [x, y] = sobol(i);
        [owen(x, flips[0]) as i8 - 8, owen(y, flips[1]) as i8 - 8]
    };
    (0..samples).map(point).collect()
}

/// The pattern with `samples` samples.
///
/// # Errors
/// [`Error::Config`] where the kind has no pattern of that size.
pub fn pattern(kind: PatternKind, samples: u32) -> Result<SamplePattern> {
    if !SamplePattern::is_count(samples) {
        return Err(Error::config(
            format_args!("a pixel cannot have {samples} samples"),
            "samples are 1, 2, 4, 8, 16, 32 or 64",
        ));
    }
    let standard = SamplePattern::standard(samples);
    match (kind, standard) {
        (PatternKind::Centre, _) => {
            let positions = vec![[0, 0]; samples as usize];
            let name = format!("centre-{samples}");
            Ok(SamplePattern { name, positions, nested: true })
        }
        (PatternKind::Auto | PatternKind::Standard, Some(standard)) => Ok(standard),
        (PatternKind::Standard, None) => Err(Error::config(
            format_args!("there is no standard pattern of {samples} samples"),
            "ask for at most 16, or for the pattern 'nested'",
        )),
        (PatternKind::Auto | PatternKind::Nested, _) => Ok(SamplePattern {
            name: format!("nested-{samples}"),
            positions: nested(samples, FLIPS),
            nested: true,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The exact star discrepancy of points on the 1/16 grid: the largest
    /// difference, over all boxes anchored at the pixel's corner, between a box's
    /// share of the points and its area. Only boxes that end at grid lines matter.
    fn star_discrepancy(points: &[[i8; 2]]) -> f64 {
        let mut below = [[0_u32; 17]; 17];
        for [x, y] in points {
            below[(x + 9) as usize][(y + 9) as usize] += 1;
        }
        for i in 1..17 {
            for j in 1..17 {
                below[i][j] += below[i - 1][j] + below[i][j - 1] - below[i - 1][j - 1];
            }
        }
        let share = |i: usize, j: usize| f64::from(below[i][j]) / points.len() as f64;
        let mut worst = 0.0_f64;
        for i in 0..17 {
            for j in 0..17 {
                let area = (i * j) as f64 / 256.0;
                let closed = share((i + 1).min(16), (j + 1).min(16));
                worst = worst.max(area - share(i, j)).max(closed - area);
            }
        }
        worst
    }

    /// The least distance between two points, in 1/16 pixel, the pixel repeating.
    fn least_distance(points: &[[i8; 2]]) -> f64 {
        let around = |a: i8, b: i8| {
            let d = i32::from(a) - i32::from(b);
            d.abs().min(16 - d.abs())
        };
        let mut least = i32::MAX;
        for (i, a) in points.iter().enumerate() {
            for b in &points[..i] {
                let (dx, dy) = (around(a[0], b[0]), around(a[1], b[1]));
                least = least.min(dx * dx + dy * dy);
            }
        }
        f64::from(least).sqrt()
    }

    #[test]
    fn every_prefix_of_the_nested_pattern_fills_every_elementary_interval_once() {
        let points = nested(64, FLIPS);
        assert_eq!(points[0], [0, 0]);
        for k in 0..=6 {
            let prefix = &points[..1 << k];
            for wide in 0..=k.min(4) {
                let high = k - wide;
                if high > 4 {
                    continue;
                }
                let mut seen = vec![0; 1 << k];
                for [x, y] in prefix {
                    let column = (x + 8) as usize >> (4 - wide);
                    let row = (y + 8) as usize >> (4 - high);
                    seen[column << high | row] += 1;
                }
                assert!(seen.iter().all(|n| *n == 1), "{k} {wide} {seen:?}");
            }
        }
    }

    #[test]
    fn discrepancies_are_as_documented() {
        let nested = nested(64, FLIPS);
        // Exact values; the means over the 2^22 scramblings is 0.368, 0.247, 0.158,
        // 0.128, 0.122 from 4 samples on.
        let expected = [0.75, 0.75, 0.3125, 0.234375, 0.171875, 0.12109375, 0.12109375];
        for (k, expected) in expected.into_iter().enumerate() {
            assert_eq!(star_discrepancy(&nested[..1 << k]), expected, "{k}");
        }
        let distances = [128.0, 40.0, 32.0, 8.0, 8.0, 2.0].map(f64::sqrt);
        for (k, expected) in (1..).zip(distances) {
            assert_eq!(least_distance(&nested[..1 << k]), expected, "{k}");
        }
        // The standard patterns beside them: at 2 samples the nested one pays for
        // having the first at the centre, from 4 on they are alike.
        let standard = [0.75, 0.4375, 0.296875, 0.18359375, 0.1640625];
        for (k, expected) in standard.into_iter().enumerate() {
            let pattern = SamplePattern::standard(1 << k).unwrap();
            assert_eq!(star_discrepancy(&pattern.positions), expected, "{k}");
        }
    }

    #[test]
    fn standard_patterns_have_their_sizes_and_no_sample_twice() {
        for kind in [PatternKind::Auto, PatternKind::Standard, PatternKind::Nested] {
            for samples in [1, 2, 4, 8, 16, 32, 64] {
                let Ok(pattern) = pattern(kind, samples) else {
                    assert!(kind == PatternKind::Standard && samples > 16);
                    continue;
                };
                assert_eq!(pattern.samples(), samples);
                let mut positions = pattern.positions.clone();
                positions.sort_unstable();
                positions.dedup();
                assert_eq!(positions.len() as u32, samples);
            }
            assert!(pattern(kind, 0).is_err() && pattern(kind, 3).is_err());
            assert!(pattern(kind, 128).is_err());
        }
    }

    #[test]
    #[ignore = "an exhaustive search of a minute; run it to check the choice of FLIPS"]
    fn search() {
        use rayon::prelude::*;
        let centred: Vec<u16> = (0..1 << 15).filter(|f| owen(0, *f) == 8).collect();
        assert_eq!(centred.len(), 1 << 11);
        let measure = |flips| {
            let points = nested(64, flips);
            let prefix = |k: u32| &points[..1 << k];
            let values =
                (1..7).map(|k| [star_discrepancy(prefix(k)), 1.0 / least_distance(prefix(k))]);
            values.collect::<Vec<_>>()
        };
        let mut means = [[0.0; 2]; 6];
        let few: Vec<u16> = centred.iter().copied().step_by(37).collect();
        for x in &few {
            for y in &few {
                for (mean, value) in means.iter_mut().zip(measure([*x, *y])) {
                    mean[0] += value[0] / (few.len() * few.len()) as f64;
                    mean[1] += value[1] / (few.len() * few.len()) as f64;
                }
            }
        }
        let score = |flips| -> f64 {
            let ratios = measure(flips).into_iter().zip(means);
            ratios.map(|(v, m)| v[0] / m[0] + v[1] / m[1]).sum()
        };
        let best = centred
            .par_iter()
            .flat_map_iter(|x| centred.iter().map(|y| [*x, *y]))
            .map(|flips| (score(flips), flips))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        assert_eq!(best.unwrap().1, FLIPS);
    }
}
