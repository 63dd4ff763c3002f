//! Which samples a fragment writes: a comb over the samples in the order of their stored
//! depths, or a hash for each.

use screendoor_rop::Threshold;

screendoor_trace::options! {
    /// How reference values are made.
    pub enum Drawing {
        Paired = "paired": "evenly spaced, pairs of samples exchanged at random: one hash a fragment",
        Hashed = "hashed": "as 'reference' says: a hash a sample",
    }
}

/// A bit of ξ for each pair of samples, which exchanges them: the lower half twice.
pub(super) fn exchanges(xi: u32) -> u32 {
    xi & 0xffff | xi << 16
}

/// The reference value of the `n`-th sample: teeth of a comb, a threshold apart, so that as
/// nearly as can be `α·n` of `n` samples pass; all moved by `xi`.
///
/// Even teeth alone would take every other sample at an alpha of 1/2, and the next surface
/// every other of those, or of the rest. So the low bits of `xi` exchange the samples of each
/// pair. Given its bit, ξ is uniform over half of the words: a sample of pair `p` passes with
/// a probability within 2^(p − 32) of α, `p` modulo 16.
pub(super) fn paired(xi: u32, n: u32, threshold: Threshold) -> u32 {
    comb(xi, n ^ (exchanges(xi) >> (n / 2) & 1), threshold)
}

/// The `n`-th tooth of the comb.
pub(super) fn comb(xi: u32, n: u32, threshold: Threshold) -> u32 {
    xi.wrapping_add((threshold.value() as u32).wrapping_mul(n + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_pass_as_alpha_says_within_one() {
        for alpha in [0.0, 0.01, 0.25, 0.5, 0.61, 0.999, 1.0] {
            let threshold = Threshold::of(alpha);
            for seed in 0..200 {
                let xi = screendoor_trace::random::mix(seed);
                let passed = |n: &u32| threshold.passes(paired(xi, *n, threshold));
                for count in (0..=64).step_by(2) {
                    let expected = f64::from(alpha) * f64::from(count);
                    let found = f64::from((0..count).filter(passed).count() as u32);
                    assert!((found - expected).abs() < 1.0 + 1e-6, "{alpha}: {found} of {count}");
                }
            }
        }
    }
}
