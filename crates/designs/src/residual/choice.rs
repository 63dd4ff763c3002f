//! Which samples a fragment writes: a comb over the samples in the order of their stored
//! depths, or a hash for each.

use screendoor_rop::Threshold;
use screendoor_rop::stochastic::comb::{comb, exchanged, exchanges};

screendoor_trace::options! {
    /// How reference values are made.
    pub enum Drawing {
        Paired = "paired": "evenly spaced, pairs of samples exchanged at random: one hash a fragment",
        Hashed = "hashed": "as 'reference' says: a hash a sample",
    }
}

/// A fragment's comb, of which pairs have exchanged their teeth at random.
pub(super) struct Pairs {
    xi: u32,
    exchanges: u32,
}

impl Pairs {
    pub(super) fn of(xi: u32) -> Self {
        Pairs { xi, exchanges: exchanges(xi) }
    }

    /// The reference value of the `n`-th sample.
    pub(super) fn value(&self, n: u32, threshold: Threshold) -> u32 {
        comb(self.xi, exchanged(n, self.exchanges), threshold)
    }
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
                let pairs = Pairs::of(xi);
                let passed = |n: &u32| threshold.passes(pairs.value(*n, threshold));
                for count in (0..=64).step_by(2) {
                    let expected = f64::from(alpha) * f64::from(count);
                    let found = f64::from((0..count).filter(passed).count() as u32);
                    assert!((found - expected).abs() < 1.0 + 1e-6, "{alpha}: {found} of {count}");
                }
            }
        }
    }
}
