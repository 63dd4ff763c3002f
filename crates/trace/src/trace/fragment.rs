//! The fragment: what the rasteriser hands to the raster-operations unit.

use std::fmt;
use std::ops::{BitAnd, BitOr, BitOrAssign};

use serde::{Serialize, Serializer};

use crate::trace::cells::{Cells, ChannelColumn, CoverageColumn};
use crate::trace::column::{Column, Scalar};
use crate::trace::columns::{ColumnId, OptionalValues, columns, with_probe};

/// The most samples a pixel can have.
pub const MAX_SAMPLES: u32 = 64;

/// A set of samples of one pixel: bit `s` stands for sample `s`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct SampleMask(pub u64);

impl SampleMask {
    /// No sample.
    pub const NONE: SampleMask = SampleMask(0);

    /// The first `n` samples, `n` ≤ 64.
    #[inline]
    pub const fn first(n: u32) -> Self {
        SampleMask(if n >= 64 { u64::MAX } else { (1 << n) - 1 })
    }

    /// How many samples are in the set.
    #[inline]
    pub const fn count(self) -> u32 {
        self.0.count_ones()
    }

    /// Whether no sample is in the set.
    #[inline]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether sample `s` < 64 is in the set.
    #[inline]
    pub const fn contains(self, s: usize) -> bool {
        self.0 >> s & 1 == 1
    }

    /// Puts sample `s` < 64 into the set.
    #[inline]
    pub fn insert(&mut self, s: usize) {
        self.0 |= 1 << s;
    }

    /// The samples in the set, in rising order.
    #[inline]
    pub fn iter(self) -> impl Iterator<Item = usize> {
        let mut left = self.0;
        std::iter::from_fn(move || {
            (left != 0).then(|| {
                let s = left.trailing_zeros() as usize;
                left &= left - 1;
                s
            })
        })
    }
}

impl FromIterator<usize> for SampleMask {
    fn from_iter<I: IntoIterator<Item = usize>>(samples: I) -> Self {
        let mut mask = SampleMask::NONE;
        samples.into_iter().for_each(|s| mask.insert(s));
        mask
    }
}

impl BitAnd for SampleMask {
    type Output = Self;
    #[inline]
    fn bitand(self, other: Self) -> Self {
        SampleMask(self.0 & other.0)
    }
}

impl BitOr for SampleMask {
    type Output = Self;
    #[inline]
    fn bitor(self, other: Self) -> Self {
        SampleMask(self.0 | other.0)
    }
}

impl BitOrAssign for SampleMask {
    #[inline]
    fn bitor_assign(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

impl fmt::Debug for SampleMask {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "SampleMask({:#x})", self.0)
    }
}

/// As the list of its samples, which no JSON reader rounds.
impl Serialize for SampleMask {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.iter())
    }
}

/// A depth: 0 at the near plane, 2^32 − 1 at the far plane.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize)]
#[serde(transparent)]
pub struct Unorm32(pub u32);

impl Unorm32 {
    /// The near plane.
    pub const NEAR: Unorm32 = Unorm32(0);
    /// The far plane, where a cleared depth buffer stands.
    pub const FAR: Unorm32 = Unorm32(u32::MAX);

    /// The depth kept to its upper `bits` bits (16 to 32), as a narrower depth
    /// buffer holds it; the lower bits are set, so that the far plane stays far.
    #[inline]
    pub const fn narrowed(self, bits: u32) -> Self {
        Unorm32(self.0 | ((1_u64 << (32 - bits)) - 1) as u32)
    }
}

impl fmt::Debug for Unorm32 {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Unorm32({:#010x})", self.0)
    }
}

/// A fragment's depth over its pixel: a plane with integer coefficients, so that
/// every implementation finds the same depth at every sample.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
pub struct DepthPlane {
    /// Depth at the pixel's centre.
    pub z: Unorm32,
    /// Change per pixel to the right, in units of 2^-32 of the depth range.
    pub dzdx: i32,
    /// Change per pixel downwards, in units of 2^-32 of the depth range.
    pub dzdy: i32,
}

impl DepthPlane {
    /// The depth at an `[x, y]` offset from the pixel's centre, in 1/16 pixel:
    /// `z + ⌊(dzdx·x + dzdy·y) / 16⌋`, clamped to the depth range.
    #[inline]
    pub const fn at(self, offset: [i8; 2]) -> Unorm32 {
        let slope = self.dzdx as i64 * offset[0] as i64 + self.dzdy as i64 * offset[1] as i64;
        let z = self.z.0 as i64 + (slope >> 4);
        Unorm32(if z < 0 {
            0
        } else if z > u32::MAX as i64 {
            u32::MAX
        } else {
            z as u32
        })
    }
}

/// One row of a trace: what one primitive leaves in one pixel.
///
/// Where one is written down, `..Fragment::default()` at its end keeps the text good when
/// columns are added.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
pub struct Fragment {
    /// Column of the pixel, from the left.
    pub x: u16,
    /// Row of the pixel, from the top.
    pub y: u16,
    /// The samples that the primitive covers; never empty in a trace.
    pub coverage: SampleMask,
    /// Depth over the pixel.
    pub depth: DepthPlane,
    /// Colour, not multiplied by alpha: linear, or as the trace's space says.
    pub colour: [f32; 3],
    /// Opacity in [0, 1].
    pub alpha: f32,
    /// The primitive's number in the scene.
    pub primitive: u32,
    /// The object's number in the scene.
    pub object: u32,
    /// Values of the columns that a trace may lack.
    #[serde(flatten)]
    pub optional: OptionalValues,
}

/// Makes a fragment's values of the table of columns.
macro_rules! values {
    (
        { $($id:ident $name:ident: $type:ty, [$($place:tt)+], $check:ident,
            $unit:literal, $what:literal;)* }
        { $($oid:ident $oname:ident: $otype:ty = $default:expr, $ocheck:ident,
            $ounit:literal, $owhat:literal;)* }
    ) => {
        impl Fragment {
            /// Its value of `column`.
            #[inline]
            pub fn value(&self, column: ColumnId) -> Scalar {
                match column {
                    $(ColumnId::$id => <$type as Cells>::scalar(self.$($place)+),)*
                    $(ColumnId::$oid => <$otype as Cells>::scalar(self.optional.$oname),)*
                }
            }
        }
    };
}
columns!(values);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks() {
        assert_eq!(SampleMask::first(64).count(), 64);
        assert_eq!(SampleMask::first(0), SampleMask::NONE);
        let mask: SampleMask = [0, 5, 63].into_iter().collect();
        assert_eq!(mask.iter().collect::<Vec<_>>(), [0, 5, 63]);
        assert!(mask.contains(63) && !mask.contains(1));
    }

    #[test]
    fn depth_planes_round_down_and_clamp() {
        let plane = DepthPlane { z: Unorm32(100), dzdx: 16, dzdy: -1 };
        assert_eq!(plane.at([0, 0]), Unorm32(100));
        assert_eq!(plane.at([3, 0]), Unorm32(103));
        // ⌊−1/16⌋ = −1: division rounds towards the near plane, not towards zero.
        assert_eq!(plane.at([0, 1]), Unorm32(99));
        let steep = DepthPlane { z: Unorm32(5), dzdx: i32::MIN, dzdy: i32::MIN };
        assert_eq!(steep.at([7, 7]), Unorm32::NEAR);
        assert_eq!(steep.at([-8, -8]), Unorm32(5 + (1 << 31)));
        let flat = DepthPlane { z: Unorm32::FAR, dzdx: i32::MAX, dzdy: 0 };
        assert_eq!(flat.at([7, 0]), Unorm32::FAR);
    }

    #[test]
    fn a_narrow_depth_keeps_the_far_plane_far() {
        assert_eq!(Unorm32::FAR.narrowed(16), Unorm32::FAR);
        assert_eq!(Unorm32(0x1234_5678).narrowed(24), Unorm32(0x1234_56ff));
        assert_eq!(Unorm32(0x1234_5678).narrowed(32), Unorm32(0x1234_5678));
    }
}
