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
    #[inline(always)]
    pub const fn of(alpha: f32) -> Self {
        // α = m·2^(e−150): exactly m·2^(e−118) multiples of 2^-32 from e = 118 up, rounded
        // up below. Of denormal numbers m is too large, but what is not 0 becomes 1.
        let bits = alpha.to_bits();
        let exponent = bits >> 23 & 0xff;
        let mantissa = bits & 0x7f_ffff | ((exponent > 0) as u32) << 23;
        let (up, down) = (exponent.saturating_sub(118), 118_u32.saturating_sub(exponent));
        let down = if down < 31 { down } else { 31 };
        let whole = (mantissa + ((1 << down) - 1)) >> down;
        Threshold((whole as u64) << up)
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

    /// The threshold that is `T`, from 0 to 2^32.
    #[inline]
    pub(crate) const fn of_value(value: u64) -> Self {
        Threshold(value)
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
