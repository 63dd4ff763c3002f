//! Randomness as a pure function of its inputs.
//!
//! Nothing in the crate keeps a generator's state across fragments or threads:
//! a random word is the hash of the things it depends on (seed, pixel,
//! primitive, sample, …), so that a replay gives the same bits in any order of
//! execution and on any machine.

/// A bijection of the 32-bit words in which every input bit flips every output
/// bit with a probability near one half (multipliers and shifts of Wellons'
/// `lowbias32`; u32 arithmetic only, so that a GPU computes the same).
#[inline]
pub const fn mix(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(MIX[0]);
    x ^= x >> 15;
    x = x.wrapping_mul(MIX[1]);
    x ^ (x >> 16)
}

/// The factors of [`mix`].
pub const MIX: [u32; 2] = [0x7feb_352d, 0x846c_a68b];

/// The fraction of the golden ratio, of 2^32: far from any small number.
pub const GOLDEN: u32 = 0x9e37_79b9;

/// The hash of a list of words; it depends on their order.
#[inline]
pub const fn hash<const N: usize>(words: [u32; N]) -> u32 {
    hash_on(GOLDEN, words)
}

/// The hash of a longer list: `h` is that of the words before, `words` are the rest.
#[inline]
pub const fn hash_on<const N: usize>(mut h: u32, words: [u32; N]) -> u32 {
    let mut i = 0;
    while i < N {
        h = mix((h ^ words[i]).wrapping_add(GOLDEN));
        i += 1;
    }
    h
}

/// What keeps 0 from being mapped to itself by [`mix`].
pub const PREHASHED: u32 = 0xe6fe_3beb;

/// A run's seed as an offset that leaves seed 0 where a publication has it:
/// `scatter(0) == 0`, all other seeds land far apart.
#[inline]
pub const fn scatter(seed: u32) -> u32 {
    if seed == 0 { 0 } else { mix(seed ^ PREHASHED) }
}

/// A stream of random words for scene generation, where one thing has many
/// random properties: word `i` is the hash of (key, `i`).
#[derive(Clone, Debug)]
pub struct Stream {
    key: u32,
    next: u32,
}

impl Stream {
    /// The stream named by `words`.
    pub fn new<const N: usize>(words: [u32; N]) -> Self {
        Stream { key: hash(words), next: 0 }
    }

    /// The next word.
    pub fn word(&mut self) -> u32 {
        self.next += 1;
        hash([self.key, self.next])
    }

    /// The next number in [0, 1), a multiple of 2^-24.
    pub fn unit(&mut self) -> f32 {
        (self.word() >> 8) as f32 / (1 << 24) as f32
    }

    /// The next number in [`low`, `high`).
    pub fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// A whole number in 0..`bound` (`bound` > 0), by Lemire's multiplication;
    /// its bias is at most `bound`/2^32.
    pub fn below(&mut self, bound: u32) -> u32 {
        ((u64::from(self.word()) * u64::from(bound)) >> 32) as u32
    }

    /// Puts `items` in a random order (Fisher and Yates).
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.below(i as u32 + 1) as usize);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mix_flips_every_output_bit_about_half_the_time() {
        // 4096 inputs × 32 flips; each count is binomial(4096, 1/2) for a random
        // function: σ = 32. The bound of 8σ is for gross faults, not for bias.
        for input_bit in 0..32 {
            let mut flips = [0_i32; 32];
            for i in 0..4096_u32 {
                let x = hash([i]);
                let change = mix(x) ^ mix(x ^ (1 << input_bit));
                for (bit, count) in flips.iter_mut().enumerate() {
                    *count += (change >> bit & 1) as i32;
                }
            }
            for count in flips {
                assert!((count - 2048).abs() < 8 * 32, "bit {input_bit}: {count}");
            }
        }
    }

    #[test]
    fn hash_depends_on_order_and_length() {
        assert_ne!(hash([1, 2]), hash([2, 1]));
        assert_ne!(hash([1]), hash([1, 0]));
        assert_eq!(scatter(0), 0);
        assert_ne!(scatter(1), 0);
    }

    #[test]
    fn a_shuffle_is_a_permutation() {
        let mut items: Vec<u32> = (0..100).collect();
        Stream::new([7]).shuffle(&mut items);
        assert_ne!(items, (0..100).collect::<Vec<_>>());
        items.sort_unstable();
        assert_eq!(items, (0..100).collect::<Vec<_>>());
    }
}
