//! Reference values in lanes, in the order of the samples' numbers.

use fearless_simd::Simd;

use crate::random::scatter;
use crate::rop::event::Probe;
use crate::rop::fast::engine::Loaded;
use crate::rop::fast::lanes::Lanes;
use crate::rop::fast::tally::Tally;
use crate::rop::reference_value::{LK2011, Reference, ReferenceKey};
use crate::rop::tracked::{Hashed, References, SampleOf};

/// The samples of a fragment that are to be numbered.
#[derive(Clone, Copy, Debug)]
pub struct Numbered<'a> {
    /// What they have in common; [`SampleOf::first`] is set.
    pub of: SampleOf<'a>,
    /// The first one's number in its surface.
    pub first: u32,
    /// How many they are.
    pub count: u32,
}

/// [`References`] a fragment at a time.
pub trait FastReferences<const N: usize>: Copy + Send + Sync + 'static {
    /// The plain text.
    type Plain: References;
    /// What is kept of the current surface; the default before its first sample.
    type Kept: Copy + Default + Send + 'static;

    /// What is kept, as the plain text has it.
    fn to_plain(kept: Self::Kept) -> <Self::Plain as References>::Kept;
    /// The other way.
    fn of_plain(kept: &<Self::Plain as References>::Kept) -> Self::Kept;

    /// Which of the samples pass the opacity test: bit `i` for the `i`-th of them.
    /// Bits beyond their count hold anything.
    fn passing<S: Simd, L: Lanes<S>, P: Probe>(
        &self,
        simd: S,
        loaded: &Loaded<L>,
        kept: &mut Self::Kept,
        samples: Numbered<'_>,
        tally: &mut Tally<'_, P>,
    ) -> u64;
}

/// Figure 4 of the publication, known when the kernel is compiled.
#[derive(Clone, Copy, Debug)]
pub struct PublishedHash;

/// A hash for each sample.
pub trait HashBy: Copy + Send + Sync + 'static {
    /// Which one.
    fn reference(&self) -> Reference;
}

impl HashBy for PublishedHash {
    #[inline(always)]
    fn reference(&self) -> Reference {
        Reference::Lk2011
    }
}

impl HashBy for Hashed {
    #[inline(always)]
    fn reference(&self) -> Reference {
        self.0
    }
}

impl<H: HashBy, const N: usize> FastReferences<N> for H {
    type Plain = Hashed;
    type Kept = ();

    fn to_plain((): ()) {}
    fn of_plain((): &()) {}

    #[inline(always)]
    fn passing<S: Simd, L: Lanes<S>, P: Probe>(
        &self,
        simd: S,
        loaded: &Loaded<L>,
        (): &mut (),
        samples: Numbered<'_>,
        tally: &mut Tally<'_, P>,
    ) -> u64 {
        hashed::<S, L, P, N>(self.reference(), simd, loaded, samples, tally)
    }
}

/// The values of all numbers that a surface can have, and those of them from the
/// first sample's on: which number goes to which sample need not be known yet.
#[inline(always)]
fn hashed<S: Simd, L: Lanes<S>, P: Probe, const N: usize>(
    reference: Reference,
    simd: S,
    loaded: &Loaded<L>,
    samples: Numbered<'_>,
    tally: &mut Tally<'_, P>,
) -> u64 {
    let Numbered { of: SampleOf { key, round, opacity, .. }, first, count } = samples;
    tally.hashed(count);
    let total = round.count * N as u32;
    // Below 2^6 · 2^3 of the index are the numbers, above them the pixel: its bits
    // reversed are joined without a carry.
    let base = u64::from(round.index * N as u32) + u64::from(key.pixel.0) * u64::from(total);
    let mut moved = key.surface.wrapping_add(scatter(key.seed));
    // On frames of more than 2^32 samples.
    if base >> 32 != 0 {
        moved = moved.wrapping_add(scatter((base >> 32) as u32));
    }
    let place = L::splat(simd, (base as u32).reverse_bits() as i32);
    let place = loaded.reversed.or(place);
    let values = match reference {
        Reference::Lk2011 => lk2011(simd, place.add(L::splat(simd, moved as i32))),
        Reference::VegdahlV2 => vegdahl_v2(simd, place, moved),
        Reference::Vegdahl => vegdahl(simd, place, moved),
        _ => one_by_one::<S, L, N>(reference, simd, round.index * N as u32, total, key),
    };
    let passing = below(simd, values, opacity.value());
    passing >> (first & 63)
}

/// Where values lie below a threshold from 0 to 2^32.
#[inline(always)]
pub fn below<S: Simd, L: Lanes<S>>(simd: S, values: L, threshold: u64) -> u64 {
    // Signed comparisons, as all instruction sets have them.
    let sign = L::splat(simd, i32::MIN);
    let limit = L::splat(simd, threshold as u32 as i32 ^ i32::MIN);
    let all = 0_u64.wrapping_sub(threshold >> 32);
    L::bits(limit.greater(values.xor(sign))) | all
}

/// Figure 4, lines 3 to 6.
#[inline(always)]
fn lk2011<S: Simd, L: Lanes<S>>(simd: S, mut x: L) -> L {
    for factor in LK2011 {
        x = x.xor(x.mul(L::splat(simd, factor as i32)));
    }
    x
}

#[inline(always)]
fn vegdahl_v2<S: Simd, L: Lanes<S>>(simd: S, x: L, s: u32) -> L {
    let word = |word: u32| L::splat(simd, word as i32);
    let x = x.add(word(s)).xor(word(0xdc96_7795)).mul(word(0x97b7_54b7));
    x.xor(word(0x8663_50b1)).mul(word(0x9e37_79cd))
}

#[inline(always)]
fn vegdahl<S: Simd, L: Lanes<S>>(simd: S, x: L, s: u32) -> L {
    let word = |word: u32| L::splat(simd, word as i32);
    let x = x.xor(x.mul(word(0x3d20_adea))).add(word(s)).mul(word((s >> 16) | 1));
    let x = x.xor(x.mul(word(0x0552_6c56)));
    x.xor(x.mul(word(0x53a2_2864)))
}

/// Values that are no few multiplications: from the plain text.
#[cold]
#[inline(never)]
fn one_by_one<S: Simd, L: Lanes<S>, const N: usize>(
    reference: Reference,
    simd: S,
    earlier: u32,
    total: u32,
    key: &ReferenceKey,
) -> L {
    let mut words = [0; 64];
    for (n, word) in words[..N].iter_mut().enumerate() {
        *word = reference.value(earlier + n as u32, total, key) as i32;
    }
    L::load(simd, &words[..L::LEN])
}
