//! Reference values that are the teeth of a comb: systematic sampling (Madow 1949).

use crate::contract::opacity::Threshold;
use screendoor_trace::random::mix;

/// The reference value of the `n`-th sample: teeth a threshold apart, so that of any run of
/// samples as nearly as can be a share of alpha pass; all moved by `xi`.
pub fn comb(xi: u32, n: u32, threshold: Threshold) -> u32 {
    // Modulo 2^32: an opaque fragment's threshold, 2^32, leaves the value as it is.
    xi.wrapping_add((threshold.value() as u32).wrapping_mul(n + 1))
}

/// A bit for each pair of samples, which says whether the two exchange their teeth: the lower
/// half of `xi`, mixed.
///
/// Teeth in order take every other sample at an alpha of 1/2, and the next surface every other
/// of those, or of the rest. Given the lower half, the upper one is still uniform: a sample
/// passes with a probability within 2^-16 of alpha, and with alpha itself where that is a
/// multiple of 2^-16.
#[inline(always)]
pub fn exchanges(xi: u32) -> u32 {
    mix(xi & 0xffff)
}

/// Those exchanges whose two samples are both among the first `count` (at most 64): then as
/// many of these pass as without any.
pub fn among(exchanges: u32, count: u32) -> u32 {
    exchanges & !((count & 1) << ((count / 2) & 31))
}

/// Which tooth the `n`-th sample has after the exchanges.
pub fn exchanged(n: u32, exchanges: u32) -> u32 {
    n ^ (exchanges >> (n / 2) & 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn teeth_are_exchanged_within_pairs_and_within_the_count() {
        for count in 0..=64 {
            let bits = among(u32::MAX, count);
            let mut teeth: Vec<u32> = (0..count).map(|n| exchanged(n, bits)).collect();
            let moved = teeth.iter().zip(0..).filter(|(tooth, n)| *tooth != n).count() as u32;
            assert_eq!(moved, count & !1);
            teeth.sort_unstable();
            assert_eq!(teeth, (0..count).collect::<Vec<_>>());
        }
        assert_eq!(
            [0, 1, 30, 31, 62, 63].map(|n| exchanged(n, 1 << 31 | 1)),
            [1, 0, 30, 31, 63, 62]
        );
    }

    #[test]
    fn an_exchange_changes_no_probability() {
        // Over all upper halves, whatever the lower one: as often as alpha says.
        for (alpha, lower) in [(0.25, 1), (0.5, 77), (0.7, 0xffff), (1e-3, 0x8000)] {
            let threshold = Threshold::of(alpha);
            let expected = threshold.value() as f64 / 65536.0;
            for n in [0, 1, 2, 31, 63] {
                let passes = |upper: &u32| {
                    let xi = upper << 16 | lower;
                    threshold.passes(comb(xi, exchanged(n, exchanges(xi)), threshold))
                };
                let count = (0..1 << 16).filter(passes).count() as f64;
                assert!((count - expected).abs() < 1.0, "{alpha}: {count} of {expected}");
            }
        }
    }
}
