//! What a raster-operations unit does, as countable events.

use serde::{Deserialize, Serialize};

use crate::rop::opacity::Threshold;
use crate::trace::{MAX_SAMPLES, SampleMask};

/// Is told what a design does while it draws. The methods do nothing unless they
/// are overridden: with [`NoProbe`] they vanish from the compiled code.
pub trait Probe {
    /// Whether anybody is told: where not, nothing need be worked out for it.
    const LISTENS: bool = true;

    /// A fragment reached the pixel, covering these samples.
    fn fragment(&mut self, _covered: SampleMask) {}
    /// These of its samples were put to the depth test, and these passed it.
    fn depth_test(&mut self, _tested: SampleMask, _passed: SampleMask) {}
    /// The fragment starts a new surface with this number.
    fn surface(&mut self, _number: u32) {}
    /// Samples were sorted; this is their order now.
    fn sorted(&mut self, _order: &[u8]) {}
    /// All this happened.
    fn many(&mut self, _events: &EventCounts) {}
    /// Sample `sample` got reference value `value` as the `number`-th of its
    /// surface and was held against `threshold`.
    fn reference(&mut self, _sample: u8, _number: u32, _value: u32, _threshold: Threshold) {}
    /// `count` hashes were evaluated.
    fn hashed(&mut self, _count: u32) {}
    /// The fragment was written to these samples.
    fn written(&mut self, _samples: SampleMask) {}
    /// The fragment's depth was compared with those of `count` stored layers.
    fn compared(&mut self, _count: u32) {}
    /// State bits of the pixel were read and written.
    fn state(&mut self, _read: u32, _written: u32) {}
}

/// Counts nothing and costs nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoProbe;

impl Probe for NoProbe {
    const LISTENS: bool = false;
}

/// How often each event happened over a replay.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct EventCounts {
    /// Fragments drawn; over several passes each counts several times.
    pub fragments: u64,
    /// Samples put to the depth test.
    pub samples_tested: u64,
    /// Samples that passed it.
    pub samples_passed: u64,
    /// Samples written.
    pub samples_written: u64,
    /// Hashes evaluated.
    pub hashes: u64,
    /// Sorts of two or more samples; entry `i` counts those of `i` samples.
    pub sorts_by_length: Vec<u64>,
    /// New surfaces started.
    pub surfaces: u64,
    /// Depths of stored layers that fragments were compared with.
    pub layers_compared: u64,
    /// Bits of pixel state read.
    pub state_bits_read: u64,
    /// Bits of pixel state written.
    pub state_bits_written: u64,
}

impl Default for EventCounts {
    fn default() -> Self {
        EventCounts {
            fragments: 0,
            samples_tested: 0,
            samples_passed: 0,
            samples_written: 0,
            hashes: 0,
            sorts_by_length: vec![0; MAX_SAMPLES as usize + 1],
            surfaces: 0,
            layers_compared: 0,
            state_bits_read: 0,
            state_bits_written: 0,
        }
    }
}

impl EventCounts {
    /// How many sorts there were.
    pub fn sorts(&self) -> u64 {
        self.sorts_by_length.iter().sum()
    }

    /// Comparisons of two depths: one for each sample put to the depth test, one for each
    /// layer that a fragment is to find its place among, and for each sort those of
    /// Batcher's odd-even merge network of its length.
    pub fn comparators(&self) -> u64 {
        let sorts = self.sorts_by_length.iter().enumerate();
        let sorting = |(length, count): (usize, &u64)| network_comparators(length) * count;
        self.samples_tested + self.layers_compared + sorts.map(sorting).sum::<u64>()
    }

    /// Bytes of pixel state read and written.
    pub fn state_bytes(&self) -> [u64; 2] {
        [self.state_bits_read.div_ceil(8), self.state_bits_written.div_ceil(8)]
    }

    /// These counts and those of another part of the same replay.
    pub fn merged(mut self, other: &Self) -> Self {
        self.add(other);
        self
    }

    /// Adds the counts of another part of the same replay.
    pub fn add(&mut self, other: &Self) {
        self.fragments += other.fragments;
        self.samples_tested += other.samples_tested;
        self.samples_passed += other.samples_passed;
        self.samples_written += other.samples_written;
        self.hashes += other.hashes;
        for (sum, count) in self.sorts_by_length.iter_mut().zip(&other.sorts_by_length) {
            *sum += count;
        }
        self.surfaces += other.surfaces;
        self.layers_compared += other.layers_compared;
        self.state_bits_read += other.state_bits_read;
        self.state_bits_written += other.state_bits_written;
    }
}

/// Comparators of an odd-even merge sorting network for `length` values (Batcher 1968;
/// Knuth, The Art of Computer Programming 3, algorithm 5.2.2M).
fn network_comparators(length: usize) -> u64 {
    let mut count = 0;
    let top = length.next_power_of_two() / 2;
    let mut p = top;
    while p > 0 {
        let (mut q, mut r, mut d) = (top, 0, p);
        loop {
            count += (0..length.saturating_sub(d)).filter(|i| i & p == r).count() as u64;
            if q == p {
                break;
            }
            (d, q, r) = (q - p, q / 2, p);
        }
        p /= 2;
    }
    count
}

impl Probe for EventCounts {
    fn many(&mut self, events: &EventCounts) {
        self.add(events);
    }
    #[inline]
    fn fragment(&mut self, _covered: SampleMask) {
        self.fragments += 1;
    }
    #[inline]
    fn depth_test(&mut self, tested: SampleMask, passed: SampleMask) {
        self.samples_tested += u64::from(tested.count());
        self.samples_passed += u64::from(passed.count());
    }
    #[inline]
    fn surface(&mut self, _number: u32) {
        self.surfaces += 1;
    }
    #[inline]
    fn sorted(&mut self, order: &[u8]) {
        if order.len() > 1 {
            self.sorts_by_length[order.len()] += 1;
        }
    }
    #[inline]
    fn hashed(&mut self, count: u32) {
        self.hashes += u64::from(count);
    }
    #[inline]
    fn written(&mut self, samples: SampleMask) {
        self.samples_written += u64::from(samples.count());
    }
    #[inline]
    fn compared(&mut self, count: u32) {
        self.layers_compared += u64::from(count);
    }
    #[inline]
    fn state(&mut self, read: u32, written: u32) {
        self.state_bits_read += u64::from(read);
        self.state_bits_written += u64::from(written);
    }
}

/// Writes down what happened to one fragment, for `explain`.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Record {
    /// Samples that the fragment covers.
    pub covered: SampleMask,
    /// Samples that passed the last depth test; `None` where the design makes none.
    pub passed: Option<SampleMask>,
    /// Samples put to depth tests; a design may test against several buffers.
    pub samples_tested: u32,
    /// Samples that passed them.
    pub samples_passed: u32,
    /// The new surface's number, where one was started.
    pub surface: Option<u32>,
    /// The samples' order after sorting, where they were sorted.
    pub order: Option<Vec<u8>>,
    /// The opacity tests in the order in which they were made.
    pub references: Vec<ReferenceRecord>,
    /// Samples written.
    pub written: SampleMask,
    /// Hashes evaluated.
    pub hashes: u32,
    /// Stored layers whose depths were compared with the fragment's.
    pub layers_compared: u32,
    /// Bits of pixel state read.
    pub state_bits_read: u32,
    /// Bits of pixel state written.
    pub state_bits_written: u32,
}

/// One opacity test.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ReferenceRecord {
    /// The sample.
    pub sample: u8,
    /// Its number within its surface.
    pub number: u32,
    /// Its reference value, as a fraction of 1.
    pub value: f64,
    /// Whether it passed.
    pub passed: bool,
}

impl Record {
    /// Whether nothing was done: a pass that does not look at the fragment.
    pub fn is_idle(&self) -> bool {
        self.samples_tested == 0
            && self.written.is_empty()
            && self.state_bits_read == 0
            && self.state_bits_written == 0
    }
}

impl Probe for Record {
    fn fragment(&mut self, covered: SampleMask) {
        self.covered = covered;
    }
    fn depth_test(&mut self, tested: SampleMask, passed: SampleMask) {
        self.passed = Some(passed);
        self.samples_tested += tested.count();
        self.samples_passed += passed.count();
    }
    fn surface(&mut self, number: u32) {
        self.surface = Some(number);
    }
    fn sorted(&mut self, order: &[u8]) {
        self.order = Some(order.to_vec());
    }
    fn reference(&mut self, sample: u8, number: u32, value: u32, threshold: Threshold) {
        self.references.push(ReferenceRecord {
            sample,
            number,
            value: f64::from(value) / 4_294_967_296.0,
            passed: threshold.passes(value),
        });
    }
    fn hashed(&mut self, count: u32) {
        self.hashes += count;
    }
    fn written(&mut self, samples: SampleMask) {
        self.written |= samples;
    }
    fn compared(&mut self, count: u32) {
        self.layers_compared += count;
    }
    fn state(&mut self, read: u32, written: u32) {
        self.state_bits_read += read;
        self.state_bits_written += written;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn networks_have_their_known_sizes() {
        // Knuth 5.3.4, table 1's row for merge exchange; 2^t: (t²−t+4)·2^(t−2) − 1.
        let known = [0, 0, 1, 3, 5, 9, 12, 16, 19, 26, 31, 37, 41, 48, 53, 59, 63];
        for (length, count) in known.into_iter().enumerate() {
            assert_eq!(network_comparators(length), count, "{length}");
        }
        assert_eq!(network_comparators(32), 191);
        assert_eq!(network_comparators(64), 543);
    }
}
