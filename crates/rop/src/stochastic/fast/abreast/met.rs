//! What a sampler is told, and what it tells: sixteen pixels and a fragment of each.

use std::marker::PhantomData;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, i32x16, mask32x16, u32x16};

use crate::contract::event::Probe;
use crate::in_lanes::words as words_of;
use crate::stochastic::fast::abreast::packed::{count, left_by};
use crate::stochastic::fast::tally::Tally;
use crate::stochastic::methods::Round;
use screendoor_trace::tile::TILE_PIXELS;

/// What fragments are part of, where a sampler asks.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Source {
    /// Nobody asks.
    Nothing,
    /// Their primitives.
    Primitive,
    /// Their objects.
    Object,
    /// Their depths at the pixels' centres.
    Depth,
}

/// A fragment for each of sixteen pixels. Sets of samples are packed (see
/// [`bit`](crate::fast::bit)); a pixel that has none covers nothing.
#[derive(Clone, Copy)]
pub struct Met<'a, S: Simd, const N: usize> {
    /// The round.
    pub round: &'a Round,
    /// The samples that passed the depth test.
    pub passed: u32x16<S>,
    /// The samples that were put to it.
    pub coverage: u32x16<S>,
    /// Stored depths, one less than they are and their upper bit flipped; none is 0.
    pub stored: &'a [i32x16<S>; N],
    /// The fragments' depths at the samples in the same form.
    pub depths: &'a [i32x16<S>; N],
    /// Stored depths of the samples that passed, and more than any depth of the others.
    pub keys: &'a [i32x16<S>; N],
    /// Which passed, sample by sample.
    pub passes: &'a [mask32x16<S>; N],
    /// Thresholds modulo 2^32.
    pub threshold: u32x16<S>,
    /// Where the threshold is 2^32.
    pub opaque: mask32x16<S>,
    /// What the fragments are part of, where that is asked for.
    pub source: u32x16<S>,
    /// Red, green and blue of the fragments, where they are asked for.
    pub colours: [f32x16<S>; 3],
}

/// A [`FastSampler`](crate::fast::FastSampler) with pixels in lanes in place of samples.
pub trait Abreast<const N: usize>: Send + Sync {
    /// What it keeps of a pixel.
    type Kept;
    /// The same of sixteen.
    type Lanes<S: Simd>: Copy;

    /// Whether it asks for the fragments' colours.
    const COLOURS: bool = false;

    /// What it asks of fragments.
    fn source(&self) -> Source;

    /// What is kept of these pixels, in a round.
    fn load<S: Simd>(
        &self,
        simd: S,
        round: &Round,
        kept: &[Self::Kept; TILE_PIXELS],
        pixels: &[u8; 16],
    ) -> Self::Lanes<S>;

    /// Puts it back.
    fn store<S: Simd>(
        &self,
        lanes: &Self::Lanes<S>,
        kept: &mut [Self::Kept; TILE_PIXELS],
        pixels: &[u8; 16],
    );

    /// As [`Sampler::choose`](crate::Sampler::choose), of sixteen pixels: where each sample is
    /// written.
    fn choose<S: Simd, P: Probe>(
        &self,
        simd: S,
        lanes: &mut Self::Lanes<S>,
        met: &Met<'_, S, N>,
        counted: &mut Counted<S, P>,
    ) -> [mask32x16<S>; N];

    /// As [`Sampler::excess`](crate::Sampler::excess), of sixteen pixels, where it corrects.
    fn excess<S: Simd>(&self, _: &Self::Lanes<S>) -> [[f64; 3]; 16] {
        [[0.0; 3]; 16]
    }
}

/// Words of sixteen pixels, told one by one.
#[inline(always)]
pub fn gather<S: Simd>(simd: S, pixels: &[u8; 16], word: impl Fn(usize) -> u32) -> u32x16<S> {
    let mut words = [0; 16];
    for (to, pixel) in words.iter_mut().zip(pixels) {
        *to = word(usize::from(*pixel));
    }
    u32x16::from_slice(simd, &words)
}

/// Events of sixteen pixels, if `P` listens.
#[derive(Clone, Copy)]
pub struct Counted<S: Simd, P> {
    simd: S,
    sums: [u32x16<S>; 9],
    /// Sorts by their length, from 2 to 8: four bits each.
    sorts: u32x16<S>,
    /// The same in bytes: of even lengths, and of odd ones.
    sorts_in_bytes: [u32x16<S>; 2],
    rounds: u32,
    probe: PhantomData<P>,
}

/// The numbers that are counted.
#[derive(Clone, Copy)]
enum Count {
    Tested,
    Passed,
    Written,
    Tracked,
    Surfaces,
    Compared,
    Multiplied,
    ColoursRead,
    Hashes,
}

impl<S: Simd, P: Probe> Counted<S, P> {
    pub(super) fn new(simd: S) -> Self {
        let none = u32x16::splat(simd, 0);
        Counted {
            simd,
            sums: [none; 9],
            sorts: none,
            sorts_in_bytes: [none; 2],
            rounds: 0,
            probe: PhantomData,
        }
    }

    #[inline(always)]
    fn add(&mut self, what: Count, counts: u32x16<S>) {
        if P::LISTENS {
            self.sums[what as usize] += counts;
        }
    }

    #[inline(always)]
    fn add_where(&mut self, what: Count, mask: mask32x16<S>) {
        if P::LISTENS {
            self.add(what, mask.select(u32x16::splat(self.simd, 1), u32x16::splat(self.simd, 0)));
        }
    }

    /// Samples that were tested, passed and written.
    #[inline(always)]
    pub(super) fn samples(&mut self, tested: u32x16<S>, passed: u32x16<S>, written: u32x16<S>) {
        if P::LISTENS {
            self.add(Count::Tested, count(self.simd, tested));
            self.add(Count::Passed, count(self.simd, passed));
            self.add(Count::Written, count(self.simd, written));
        }
    }

    /// Where a new surface was started.
    #[inline(always)]
    pub fn surfaces(&mut self, started: mask32x16<S>) {
        self.add_where(Count::Surfaces, started);
    }

    /// Where the state that the sampler keeps was read and written.
    #[inline(always)]
    pub fn tracked(&mut self, touched: mask32x16<S>) {
        self.add_where(Count::Tracked, touched);
    }

    /// So many hashes were evaluated.
    #[inline(always)]
    pub fn hashed(&mut self, counts: u32x16<S>) {
        self.add(Count::Hashes, counts);
    }

    /// So many comparisons of what is kept beside the samples.
    #[inline(always)]
    pub fn compared(&mut self, counts: u32x16<S>) {
        self.add(Count::Compared, counts);
    }

    /// So many multiplications.
    #[inline(always)]
    pub fn multiplied(&mut self, counts: u32x16<S>) {
        self.add(Count::Multiplied, counts);
    }

    /// So many samples' colours were read.
    #[inline(always)]
    pub fn colours_read(&mut self, counts: u32x16<S>) {
        self.add(Count::ColoursRead, counts);
    }

    /// So many samples were sorted, up to 8.
    #[inline(always)]
    pub fn sorted(&mut self, samples: u32x16<S>) {
        if P::LISTENS {
            let word = |word: u32| u32x16::splat(self.simd, word);
            // Of fewer than 2, which is no sort, nothing is left in the word.
            let by = ((samples - word(2)) << 2).min(word(32));
            self.sorts += left_by(self.simd, word(1), by);
        }
    }

    /// Ends a round: what is counted in four bits is moved before it overflows.
    #[inline(always)]
    pub(super) fn next_round(&mut self, tally: &mut Tally<'_, P>) {
        if P::LISTENS {
            self.rounds += 1;
            if self.rounds.is_multiple_of(15) {
                self.widen();
                if self.rounds.is_multiple_of(240) {
                    self.tell_sorts(tally);
                }
            }
        }
    }

    #[inline(always)]
    fn widen(&mut self) {
        let low = u32x16::splat(self.simd, 0x0f0f_0f0f);
        let [even, odd] = &mut self.sorts_in_bytes;
        *even += self.sorts & low;
        *odd += (self.sorts >> 4) & low;
        self.sorts = u32x16::splat(self.simd, 0);
    }

    #[inline(never)]
    fn tell_sorts(&mut self, tally: &mut Tally<'_, P>) {
        for (odd, bytes) in self.sorts_in_bytes.iter_mut().enumerate() {
            for lane in words_of(*bytes) {
                for (place, byte) in lane.to_le_bytes().into_iter().enumerate() {
                    tally.sorts(2 * place + odd + 2, u64::from(byte));
                }
            }
            *bytes = u32x16::splat(self.simd, 0);
        }
    }

    /// Tells all that was counted.
    pub(super) fn tell(mut self, tally: &mut Tally<'_, P>) {
        if !P::LISTENS {
            return;
        }
        self.widen();
        self.tell_sorts(tally);
        let sum = |what: Count| {
            words_of(self.sums[what as usize]).into_iter().map(u64::from).sum::<u64>()
        };
        tally.tested += sum(Count::Tested);
        tally.passed += sum(Count::Passed);
        tally.written += sum(Count::Written);
        tally.tracked += sum(Count::Tracked);
        tally.surfaces += sum(Count::Surfaces);
        tally.compared += sum(Count::Compared);
        tally.multiplied += sum(Count::Multiplied);
        tally.colours_read += sum(Count::ColoursRead);
        tally.hashes += sum(Count::Hashes);
    }
}
