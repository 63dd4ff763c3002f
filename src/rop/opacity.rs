//! The opacity test in integers.

use std::fmt;

/// An alpha as the opacity test compares it: a reference value `x`, uniform over
/// the 32-bit words, passes iff `x < T` with `T = ⌈α·2^32⌉`.
///
/// Alpha 1 always passes and alpha 0 never does, whatever the reference value; in
/// between the probability exceeds alpha by less than 2^-32.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Threshold(u64);

impl Threshold {
    /// The threshold of an alpha in [0, 1].
    #[inline]
    pub fn of(alpha: f32) -> Self {
        // Of an alpha from 2^-9 up, the bits themselves: all that its mantissa holds are
        // multiples of 2^-32.
        let (exponent, mantissa) = (alpha.to_bits() >> 23, alpha.to_bits() & 0x7f_ffff);
        if let 118..=127 = exponent {
            return Threshold(u64::from(mantissa | 1 << 23) << (exponent - 118));
        }
        // Exact: a single-precision number times a power of two, in double precision.
        let scaled = f64::from(alpha) * 4_294_967_296.0;
        Threshold(scaled.ceil() as u64)
    }

    /// Whether reference value `x` lets a sample pass.
    #[inline]
    pub const fn passes(self, x: u32) -> bool {
        (x as u64) < self.0
    }

    /// `⌊α·count + ξ⌋` for ξ = `x`/2^32: how many of `count` ≤ 64 samples a
    /// stratified choice takes.
    #[inline]
    pub const fn of_many(self, count: u32, x: u32) -> u32 {
        ((self.0 * count as u64 + x as u64) >> 32) as u32
    }

    /// `T`, from 0 to 2^32.
    #[inline]
    pub const fn value(self) -> u64 {
        self.0
    }
}

impl fmt::Debug for Threshold {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Threshold({:#x})", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_are_exact_and_everything_rounds_up() {
        assert!(!Threshold::of(0.0).passes(0));
        assert!(Threshold::of(1.0).passes(u32::MAX));
        assert_eq!(Threshold::of(f32::from_bits(1)).value(), 1);
        assert_eq!(Threshold::of(0.5).value(), 1 << 31);
        assert_eq!(Threshold::of(1.0 - f32::EPSILON / 2.0).value(), (1 << 32) - (1 << 8));
        assert_eq!(Threshold::of(-0.0).value(), 0);
        // Both ways to a threshold agree where they meet, and all over.
        for bits in (0..=1.0_f32.to_bits()).step_by(4099).chain(0x3a80_0000 - 9..0x3b80_0000 + 9) {
            let alpha = f32::from_bits(bits);
            let expected = (f64::from(alpha) * 4_294_967_296.0).ceil() as u64;
            assert_eq!(Threshold::of(alpha).value(), expected, "{alpha}");
        }
    }

    #[test]
    fn a_stratified_choice_takes_floor_or_ceiling() {
        let half = Threshold::of(0.5);
        assert_eq!((half.of_many(3, 0), half.of_many(3, u32::MAX)), (1, 2));
        assert_eq!((half.of_many(4, 0), half.of_many(4, u32::MAX)), (2, 2));
        assert_eq!(Threshold::of(1.0).of_many(64, u32::MAX), 64);
        assert_eq!(Threshold::of(0.0).of_many(64, u32::MAX), 0);
    }
}
