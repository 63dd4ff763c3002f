//! The multisample buffer of one pixel, and the choice and order of samples.

use crate::contract::contents::SampleContents;
use arrayvec::ArrayVec;

use crate::contract::words::PixelWords;
use screendoor_trace::trace::{SampleMask, Unorm32};

/// Depth and colour of a pixel's `N` samples.
#[derive(Clone, Debug)]
pub struct Samples<const N: usize> {
    /// Stored depths; the far plane in a cleared pixel.
    pub depth: [Unorm32; N],
    /// Stored colours; the background in a cleared pixel.
    pub colour: [[f32; 3]; N],
}

impl<const N: usize> Samples<N> {
    /// A cleared pixel.
    pub fn cleared(background: [f32; 3]) -> Self {
        Samples { depth: [Unorm32::FAR; N], colour: [background; N] }
    }

    /// Writes a fragment's colour, and its depth at the sample, to sample `s`.
    #[inline]
    pub fn write(&mut self, s: usize, z: Unorm32, colour: [f32; 3]) {
        self.depth[s] = z;
        self.colour[s] = colour;
    }

    /// The samples of a fragment that pass the depth test, less-or-equal.
    #[inline]
    pub fn depth_test(&self, covered: SampleMask, z: &[Unorm32; N]) -> SampleMask {
        covered.iter().filter(|s| z[*s] <= self.depth[*s]).collect()
    }

    /// The samples as a device holds them, in these fields.
    pub(crate) fn read(from: &PixelWords<'_>, depth: &str, colour: &str) -> Self {
        Samples { depth: from.array(depth).map(Unorm32), colour: from.colours(colour) }
    }

    /// The samples as `explain` shows them.
    pub fn contents(&self) -> Vec<SampleContents> {
        let pairs = self.depth.iter().zip(&self.colour);
        pairs.map(|(depth, colour)| SampleContents { depth: *depth, colour: *colour }).collect()
    }
}

/// Samples in the order in which they are numbered.
pub type SampleList<const N: usize> = ArrayVec<u8, N>;

/// The samples of a mask in rising order.
#[inline]
pub fn in_sample_order<const N: usize>(mask: SampleMask) -> SampleList<N> {
    mask.iter().map(|s| s as u8).collect()
}

/// Sorts samples by increasing *stored* depth, equal depths in sample order
/// (LK figure 7, line 9).
// As Frame::depths.
#[cfg_attr(debug_assertions, inline(never))]
#[cfg_attr(not(debug_assertions), inline)]
pub fn sort_by_stored_depth<const N: usize>(list: &mut SampleList<N>, stored: &[Unorm32; N]) {
    list.sort_by_key(|s| (stored[usize::from(*s)], *s));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sorting_is_by_stored_depth_then_sample() {
        let stored = [9, 3, 9, 1].map(Unorm32);
        let mut list: SampleList<4> = in_sample_order(SampleMask::first(4));
        sort_by_stored_depth(&mut list, &stored);
        assert_eq!(list[..], [3, 1, 0, 2]);
    }

    #[test]
    fn the_depth_test_lets_equal_depths_pass() {
        let samples = Samples { depth: [1, 2, 3, 4].map(Unorm32), colour: [[0.0; 3]; 4] };
        let passed = samples.depth_test(SampleMask(0b0111), &[Unorm32(2); 4]);
        assert_eq!(passed, SampleMask(0b0110));
    }
}
