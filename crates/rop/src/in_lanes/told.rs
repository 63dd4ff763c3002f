//! Events of sixteen pixels.

use std::marker::PhantomData;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, mask32x16, u32x16};

use crate::contract::event::{EventCounts, Probe};
use crate::in_lanes::words;

/// Counts what is done in lanes, if `P` listens: as [`Probe`], where the numbers are those of
/// sixteen pixels.
///
/// A lane's sums are of a window's fragments: some thousands, of a few thousand bits each.
#[derive(Clone, Copy)]
pub struct Told<S: Simd, P> {
    simd: S,
    fragments: u32x16<S>,
    written: u32x16<S>,
    hashes: u32x16<S>,
    compared: u32x16<S>,
    multiplied: u32x16<S>,
    read_bits: u32x16<S>,
    written_bits: u32x16<S>,
    probe: PhantomData<P>,
}

impl<S: Simd, P: Probe> Told<S, P> {
    pub(super) fn new(simd: S) -> Self {
        let none = u32x16::splat(simd, 0);
        Told {
            simd,
            fragments: none,
            written: none,
            hashes: none,
            compared: none,
            multiplied: none,
            read_bits: none,
            written_bits: none,
            probe: PhantomData,
        }
    }

    /// A number where `mask` says, and nothing elsewhere.
    #[inline(always)]
    fn only(&self, mask: mask32x16<S>, count: u32x16<S>) -> u32x16<S> {
        mask.select(count, u32x16::splat(self.simd, 0))
    }

    /// Fragments reached these pixels.
    #[inline(always)]
    pub(super) fn fragments(&mut self, of: mask32x16<S>) {
        if P::LISTENS {
            self.fragments += self.only(of, u32x16::splat(self.simd, 1));
        }
    }

    /// Samples were written there: [`Probe::written`].
    #[inline(always)]
    pub fn written(&mut self, of: mask32x16<S>, samples: u32x16<S>) {
        if P::LISTENS {
            self.written += self.only(of, self.simd.count_ones_u32x16(samples));
        }
    }

    /// [`Probe::hashed`].
    #[inline(always)]
    pub fn hashed(&mut self, of: mask32x16<S>, count: u32) {
        if P::LISTENS {
            self.hashes += self.only(of, u32x16::splat(self.simd, count));
        }
    }

    /// [`Probe::compared`].
    #[inline(always)]
    pub fn compared(&mut self, of: mask32x16<S>, counts: u32x16<S>) {
        if P::LISTENS {
            self.compared += self.only(of, counts);
        }
    }

    /// [`Probe::multiplied`].
    #[inline(always)]
    pub fn multiplied(&mut self, of: mask32x16<S>, counts: u32x16<S>) {
        if P::LISTENS {
            self.multiplied += self.only(of, counts);
        }
    }

    /// [`Probe::state`].
    #[inline(always)]
    pub fn state(&mut self, of: mask32x16<S>, read: u32x16<S>, written: u32x16<S>) {
        if P::LISTENS {
            self.read_bits += self.only(of, read);
            self.written_bits += self.only(of, written);
        }
    }

    /// All that was counted.
    pub(super) fn events(&self) -> EventCounts {
        let sum = |lanes| words(lanes).into_iter().map(u64::from).sum();
        EventCounts {
            fragments: sum(self.fragments),
            samples_written: sum(self.written),
            hashes: sum(self.hashes),
            layers_compared: sum(self.compared),
            multiplications: Some(sum(self.multiplied)),
            state_bits_read: sum(self.read_bits),
            state_bits_written: sum(self.written_bits),
            ..EventCounts::default()
        }
    }
}
