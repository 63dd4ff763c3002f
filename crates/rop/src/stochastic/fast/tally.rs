//! Event counts of one run of fragments, kept in registers.

use std::marker::PhantomData;

use crate::contract::event::{EventCounts, Probe};
use screendoor_trace::trace::MAX_SAMPLES;

/// Sorts by their length.
pub(super) type Lengths = [u64; MAX_SAMPLES as usize + 1];

/// Counts what a kernel does, if `P` listens. What follows from these counts, such as
/// the bits of state, is worked out once at the end.
#[derive(Debug)]
pub struct Tally<'a, P> {
    pub(super) fragments: u64,
    pub(super) tested: u64,
    pub(super) passed: u64,
    pub(super) written: u64,
    pub(super) tracked: u64,
    pub(super) surfaces: u64,
    pub(super) compared: u64,
    pub(super) multiplied: u64,
    pub(super) colours_read: u64,
    pub(super) hashes: u64,
    /// Apart from the others: written where a number says, it must lie in memory.
    lengths: &'a mut Lengths,
    probe: PhantomData<P>,
}

impl<'a, P: Probe> Tally<'a, P> {
    /// Nothing counted yet.
    pub fn new(lengths: &'a mut Lengths) -> Self {
        Tally {
            fragments: 0,
            tested: 0,
            passed: 0,
            written: 0,
            tracked: 0,
            surfaces: 0,
            compared: 0,
            multiplied: 0,
            colours_read: 0,
            hashes: 0,
            lengths,
            probe: PhantomData,
        }
    }

    /// A new surface was started, or not.
    #[inline(always)]
    pub fn surface(&mut self, started: bool) {
        if P::LISTENS {
            self.surfaces += u64::from(started);
        }
    }

    /// The state that the sampler keeps was read and written, or not.
    #[inline(always)]
    pub fn tracked(&mut self, touched: bool) {
        if P::LISTENS {
            self.tracked += u64::from(touched);
        }
    }

    /// So many comparisons of what is kept beside the samples.
    #[inline(always)]
    pub fn compared(&mut self, count: u32) {
        if P::LISTENS {
            self.compared += u64::from(count);
        }
    }

    /// So many multiplications.
    #[inline(always)]
    pub fn multiplied(&mut self, count: u32) {
        if P::LISTENS {
            self.multiplied += u64::from(count);
        }
    }

    /// So many samples' colours were read.
    #[inline(always)]
    pub fn colours_read(&mut self, count: u32) {
        if P::LISTENS {
            self.colours_read += u64::from(count);
        }
    }

    /// So many samples were sorted.
    #[inline(always)]
    pub fn sorted(&mut self, samples: u32) {
        if P::LISTENS {
            self.lengths[samples as usize % self.lengths.len()] += 1;
        }
    }

    /// So many sorts of so many samples.
    pub(super) fn sorts(&mut self, samples: usize, sorts: u64) {
        self.lengths[samples] += sorts;
    }

    /// So many hashes were evaluated.
    #[inline(always)]
    pub fn hashed(&mut self, count: u32) {
        if P::LISTENS {
            self.hashes += u64::from(count);
        }
    }

    /// The same as everybody counts, where a tested sample's depth, a written sample
    /// and the sampler's state take so many bits.
    pub(super) fn events(&self, depth_bits: u32, sample_bits: u32, state_bits: u32) -> EventCounts {
        let bits = |count: u64, each: u32| count * u64::from(each);
        let mut sorts_by_length = self.lengths.to_vec();
        // There is nothing to do in a sort of fewer than two.
        sorts_by_length[..2].fill(0);
        EventCounts {
            fragments: self.fragments,
            samples_tested: self.tested,
            samples_passed: self.passed,
            samples_written: self.written,
            hashes: self.hashes,
            sorts_by_length,
            surfaces: self.surfaces,
            layers_compared: self.compared,
            multiplications: Some(self.multiplied),
            state_bits_read: bits(self.tested, depth_bits)
                + bits(self.colours_read, sample_bits - depth_bits)
                + bits(self.tracked, state_bits),
            state_bits_written: bits(self.tracked, state_bits) + bits(self.written, sample_bits),
        }
    }
}
