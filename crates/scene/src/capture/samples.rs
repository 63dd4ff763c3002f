//! A pixel's samples, as the rasteriser needs them.

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
    /// For each eight samples the place in `by_distance` of the nearest of those of a set.
    nearest: Vec<[u8; 256]>,
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
        let mut ranks = [u8::MAX; MOST];
        order.iter().enumerate().for_each(|(rank, s)| ranks[*s] = rank as u8);
        // A set is its first sample and a smaller set.
        let table = |ranks: &[u8]| {
            let mut nearest = [u8::MAX; 256];
            for set in 1..256_usize {
                let first = ranks[set.trailing_zeros() as usize];
                nearest[set] = first.min(nearest[set & (set - 1)]);
            }
            nearest
        };
        let nearest = ranks.chunks(8).take(offsets.len().div_ceil(8)).map(table).collect();
        let padded = offsets.len().next_multiple_of(VECTOR);
        let reach = [range(0), range(1)];
        Samples { offsets, lanes, padded, reach, by_distance, nearest }
    }

    /// All of them.
    pub(super) fn all(&self) -> SampleMask {
        SampleMask::first(self.offsets.len() as u32)
    }

    /// The offset of the sample in `coverage` that is nearest to the pixel's centre.
    #[inline(always)]
    pub(super) fn nearest(&self, coverage: SampleMask) -> [i64; 2] {
        let eights = self.nearest.iter().zip(coverage.0.to_le_bytes());
        let rank = eights.map(|(nearest, set)| nearest[usize::from(set)]).min();
        rank.and_then(|rank| self.by_distance.get(usize::from(rank))).copied().unwrap_or([0, 0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::pattern::{PatternKind, pattern};

    #[test]
    fn the_nearest_of_some_samples_is_found() {
        for count in [1, 2, 4, 8, 16, 32, 64] {
            let samples =
                Samples::new(&pattern(PatternKind::Auto, count).unwrap().positions);
            let mut random = screendoor_trace::random::Stream::new([5]);
            for _ in 0..200 {
                let bits = u64::from(random.word()) << 32 | u64::from(random.word());
                let coverage = SampleMask(bits) & samples.all();
                let square = |[x, y]: [i64; 2]| x * x + y * y;
                let offsets = coverage.iter().map(|s| samples.offsets[s]);
                let wanted = offsets.min_by_key(|o| square(*o)).unwrap_or([0, 0]);
                assert_eq!(samples.nearest(coverage), wanted);
            }
        }
    }
}
