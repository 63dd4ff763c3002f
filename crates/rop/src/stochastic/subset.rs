//! Random subsets of samples or of coverage bits, and how likely they are to be seen.

use arrayvec::ArrayVec;

use screendoor_trace::trace::{MAX_SAMPLES, SampleMask};

/// `count` members of `from` at random: those with the smallest words, where `word`
/// gives each its random one.
pub fn random_subset(from: SampleMask, count: u32, word: impl Fn(u32) -> u32) -> SampleMask {
    let mut keyed: ArrayVec<(u32, u8), { MAX_SAMPLES as usize }> =
        from.iter().map(|s| (word(s as u32), s as u8)).collect();
    keyed.sort_unstable();
    keyed.iter().take(count as usize).map(|(_, s)| usize::from(*s)).collect()
}

/// The probability that a random `t`-subset of `b` bits is not wholly hidden by a
/// given `s`-subset: Wyman 2016, equation 1,
/// `P_b(s, t) = 1 − (s)_t / (b)_t` for t ≤ s, and 1 for t > s.
///
/// An empty subset is always hidden: `P_b(s, 0) = 0`.
///
/// # Panics
/// Where `s` or `t` exceeds `b`.
pub fn visible_stratified(b: u32, s: u32, t: u32) -> f64 {
    assert!(s <= b && t <= b, "{s} and {t} of {b} bits");
    if t > s {
        return 1.0;
    }
    1.0 - (0..t).map(|i| f64::from(s - i) / f64::from(b - i)).product::<f64>()
}

/// The probability that not all of `b` bits, each set independently with a
/// probability of `t`/`b`, are hidden by a given `s`-subset:
/// `1 − ((b − t)/b)^(b − s)` (Wyman 2016, below equation 1).
///
/// # Panics
/// Where `s` or `t` exceeds `b`, or where there are no bits.
pub fn visible_independent(b: u32, s: u32, t: u32) -> f64 {
    assert!(s <= b && t <= b && b > 0, "{s} and {t} of {b} bits");
    let clear = f64::from(b - t) / f64::from(b);
    1.0 - (0..b - s).map(|_| clear).product::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_probabilities_are_those_of_enumeration() {
        for b in 1..=16_u32 {
            for s in 0..=b {
                let hidden = SampleMask::first(s).0;
                // Subsets by size, and those of them not wholly hidden.
                let mut all = [0_u32; 17];
                let mut seen = [0_u32; 17];
                for mask in 0..1_u64 << b {
                    let t = mask.count_ones() as usize;
                    all[t] += 1;
                    seen[t] += u32::from(mask & !hidden != 0);
                }
                for t in 0..=b {
                    let size = t as usize;
                    let exact = f64::from(seen[size]) / f64::from(all[size]);
                    let printed = visible_stratified(b, s, t);
                    assert!((printed - exact).abs() < 1e-12, "{b} {s} {t}: {printed} {exact}");
                    // Each subset of u bits comes with (t/b)^u (1 − t/b)^(b−u).
                    let p = f64::from(t) / f64::from(b);
                    let weigh = |u: u32| p.powi(u as i32) * (1.0 - p).powi((b - u) as i32);
                    let exact: f64 = (0..=b).map(|u| f64::from(seen[u as usize]) * weigh(u)).sum();
                    let printed = visible_independent(b, s, t);
                    assert!((printed - exact).abs() < 1e-12, "{b} {s} {t}: {printed} {exact}");
                }
            }
        }
    }

    #[test]
    fn with_bits_both_probabilities_approach_1() {
        // A quarter over three quarters.
        let few = [visible_stratified(4, 3, 1), visible_independent(4, 3, 1)];
        let many = [visible_stratified(64, 48, 16), visible_independent(64, 48, 16)];
        assert_eq!(few, [0.25, 0.25]);
        assert!(many.iter().all(|p| (0.98..1.0).contains(p)), "{many:?}");
    }

    #[test]
    fn a_random_subset_has_the_size_that_was_asked_for() {
        let from = SampleMask(0b1011_0110);
        let chosen = random_subset(from, 3, |s| s ^ 2);
        assert_eq!(chosen & from, chosen);
        // Words: 1 ↦ 3, 2 ↦ 0, 4 ↦ 6, 5 ↦ 7, 7 ↦ 5.
        assert_eq!(chosen, SampleMask(0b1000_0110));
        assert_eq!(random_subset(from, 64, |s| s), from);
    }
}
