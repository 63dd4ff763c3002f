//! A pixel's samples, as the rasteriser needs them.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, i32x16, mask32x16};

use crate::capture::setup::STEPS;
use screendoor_trace::trace::{MAX_SAMPLES, SampleMask};

/// The most samples a pixel can have, for arrays.
pub(super) const MOST: usize = MAX_SAMPLES as usize;
/// Samples in a vector.
pub(super) const VECTOR: usize = 16;

/// Where the samples of a pixel lie.
#[derive(Clone, Debug)]
pub(crate) struct Samples {
    /// From the pixel's centre, in sub-pixel steps.
    pub offsets: Vec<[i64; 2]>,
    /// The same along x and along y, padded to whole vectors.
    pub lanes: [[i32; MOST]; 2],
    /// How many of them there are with the padding.
    pub padded: usize,
    /// The least and the greatest offset along x and along y.
    pub reach: [[i64; 2]; 2],
    /// Their offsets, the nearest to the centre first.
    by_distance: Vec<[i64; 2]>,
    /// Each sample's place there, padded to whole vectors.
    ranks: [i32; MOST],
}

impl Samples {
    /// `positions` are in sixteenths of a pixel from its centre.
    pub(super) fn new(positions: &[[i8; 2]]) -> Self {
        let offsets: Vec<[i64; 2]> =
            positions.iter().map(|p| p.map(|v| i64::from(v) * STEPS / 16)).collect();
        let axis = |axis: usize| offsets.iter().map(move |o| o[axis]);
        let range = |i| [axis(i).min().unwrap_or(0), axis(i).max().unwrap_or(0)];
        let mut lanes = [[0; MOST]; 2];
        for (i, lanes) in lanes.iter_mut().enumerate() {
            lanes.iter_mut().zip(axis(i)).for_each(|(lane, offset)| *lane = offset as i32);
        }
        let mut order: Vec<usize> = (0..offsets.len()).collect();
        // Stable: of samples that are as near as each other the first counts.
        order.sort_by_key(|s| {
            let [x, y] = offsets[*s];
            x * x + y * y
        });
        let by_distance = order.iter().map(|s| offsets[*s]).collect();
        let mut ranks = [i32::MAX; MOST];
        order.iter().enumerate().for_each(|(rank, s)| ranks[*s] = rank as i32);
        let padded = offsets.len().next_multiple_of(VECTOR);
        let reach = [range(0), range(1)];
        Samples { offsets, lanes, padded, reach, by_distance, ranks }
    }

    /// All of them.
    pub(super) fn all(&self) -> SampleMask {
        SampleMask::first(self.offsets.len() as u32)
    }

    /// The offset of the sample in `coverage` that is nearest to the pixel's centre.
    pub(super) fn nearest(&self, coverage: SampleMask) -> [i64; 2] {
        self.of_rank(coverage.iter().map(|s| self.ranks[s]).min().unwrap_or(i32::MAX))
    }

    /// The same in vectors.
    #[inline(always)]
    pub(super) fn nearest_in<S: Simd>(&self, simd: S, coverage: SampleMask) -> [i64; 2] {
        let none = i32x16::splat(simd, i32::MAX);
        let mut least = none;
        for i in (0..self.padded).step_by(VECTOR) {
            let covered = mask32x16::from_bitmask(simd, coverage.0 >> i);
            let ranks = i32x16::from_slice(simd, &self.ranks[i..i + VECTOR]);
            least = least.min(covered.select(ranks, none));
        }
        self.of_rank(least.reduce_min())
    }

    #[inline(always)]
    fn of_rank(&self, rank: i32) -> [i64; 2] {
        self.by_distance.get(rank as usize).copied().unwrap_or([0, 0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::lanes::levels;
    use crate::capture::pattern::{PatternKind, pattern};
    use fearless_simd::dispatch;

    #[test]
    fn the_nearest_of_some_samples_is_found() {
        for count in [1, 2, 4, 8, 16, 32, 64] {
            let samples = Samples::new(&pattern(PatternKind::Auto, count).unwrap().positions);
            let mut random = screendoor_trace::random::Stream::new([5]);
            for _ in 0..200 {
                let bits = u64::from(random.word()) << 32 | u64::from(random.word());
                let coverage = SampleMask(bits) & samples.all();
                let square = |[x, y]: [i64; 2]| x * x + y * y;
                let offsets = coverage.iter().map(|s| samples.offsets[s]);
                let wanted = offsets.min_by_key(|o| square(*o)).unwrap_or([0, 0]);
                assert_eq!(samples.nearest(coverage), wanted);
                for level in levels() {
                    let found = dispatch!(level, simd => samples.nearest_in(simd, coverage));
                    assert_eq!(found, wanted, "{level:?}");
                }
            }
        }
    }
}
