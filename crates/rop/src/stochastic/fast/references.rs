//! Reference values in lanes, in the order of the samples' numbers.

use crate::stochastic::fast::abreast::{Counted, NumberedAbreast, from_first, nested};
use crate::stochastic::fast::limit::{Limit, below};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, u32x16};

use crate::contract::event::Probe;
use crate::lanes::Lanes;
use crate::stochastic::fast::sampler::Loaded;
use crate::stochastic::fast::tally::Tally;
use crate::stochastic::methods::Round;
use crate::stochastic::reference_value::{LK2011, Reference, ReferenceKey, place, scramble_lk2011};
use crate::stochastic::tracked::{Hashed, References, SampleOf};

/// The samples of a fragment that are to be numbered.
#[derive(Clone, Copy, Debug)]
pub struct Numbered<'a> {
    /// What they have in common: [`SampleOf::place`] is the first one's.
    pub of: SampleOf<'a>,
    /// The threshold once more.
    pub limit: Limit,
    /// What their values have in common if they belong to the surface before the fragment:
    /// what is made of this, and of the next surface's, need not wait for `starts`.
    pub base: Base,
    /// Whether the fragment starts the next surface.
    pub starts: bool,
    /// The first one's number in its surface.
    pub first: u32,
    /// How many they are.
    pub count: u32,
}

/// What the values of a surface have in common in a round: the part of the place in a
/// sequence that the pixel gives, its bits in reverse, and how far seed, frame and surface
/// move the values.
#[derive(Clone, Copy, Default, Debug)]
pub struct Base {
    pub(super) reversed: u32,
    pub(super) moved: u32,
}

impl Base {
    /// Of the surface of `key`, whose values are those from the `earlier`-th of `total`.
    #[inline]
    pub fn of(earlier: u32, total: u32, key: &ReferenceKey) -> Self {
        let (reversed, moved) = place(earlier, total, key);
        Base { reversed, moved }
    }

    /// That of a surface so many later.
    #[inline(always)]
    pub fn of_surface(self, later: u32) -> Self {
        Base { moved: self.moved.wrapping_add(later), ..self }
    }

    /// The first of the values of figure 4.
    #[inline(always)]
    pub fn first_lk2011(self) -> u32 {
        scramble_lk2011(self.reversed.wrapping_add(self.moved))
    }
}

/// [`References`] a fragment at a time.
pub trait FastReferences<const N: usize>: Copy + Send + Sync + 'static {
    /// The plain text.
    type Plain: References;
    /// What is kept of the current surface; the default before its first sample.
    type Kept: Copy + Default + Send + Sync + 'static;

    /// What is kept, as the plain text has it.
    fn to_plain(kept: Self::Kept) -> <Self::Plain as References>::Kept;
    /// The other way.
    fn of_plain(kept: &<Self::Plain as References>::Kept) -> Self::Kept;

    /// What a surface's values have in common in a round.
    fn base(round: &Round, key: &ReferenceKey) -> Base {
        Base::of(round.index * N as u32, round.count * N as u32, key)
    }

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

    /// Whether a word of it is kept from fragment to fragment, where pixels are in lanes.
    const KEEPS: bool = false;

    /// That word.
    fn word(_kept: Self::Kept) -> u32 {
        0
    }
    /// What is kept, of that word and whether a sample of the surface has been numbered.
    fn of_word(_word: u32, _begun: bool) -> Self::Kept {
        Self::Kept::default()
    }

    /// Whether there is [`FastReferences::passing_abreast`].
    fn goes_abreast(&self) -> bool {
        false
    }

    /// As [`FastReferences::passing`], with pixels in lanes; `word` is what is kept.
    fn passing_abreast<S: Simd, P: Probe>(
        &self,
        _simd: S,
        _samples: &NumberedAbreast<S>,
        _word: &mut u32x16<S>,
        _counted: &mut Counted<S, P>,
    ) -> u32x16<S> {
        unreachable!("it does not go abreast")
    }
}

/// Figure 4 of the publication, known when the kernel is compiled.
#[derive(Clone, Copy, Debug)]
pub struct PublishedHash;

/// A hash for each sample.
pub trait HashBy: Copy + Send + Sync + 'static {
    /// Whether it is known when the kernel is compiled, and keys are as they are.
    const KNOWN: bool;

    /// Which one.
    fn reference(&self) -> Reference;
}

impl HashBy for PublishedHash {
    const KNOWN: bool = true;

    #[inline(always)]
    fn reference(&self) -> Reference {
        Reference::Lk2011
    }
}

impl HashBy for Hashed {
    const KNOWN: bool = false;

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
        tally.hashed(samples.count);
        if H::KNOWN && L::LEN <= 8 {
            return ahead(simd, loaded, &samples);
        }
        hashed::<S, L, N>(self.reference(), simd, loaded, &samples)
    }

    fn goes_abreast(&self) -> bool {
        // The others are no few multiplications.
        !matches!(self.reference(), Reference::Owen | Reference::Sobol | Reference::White)
    }

    #[inline(always)]
    fn passing_abreast<S: Simd, P: Probe>(
        &self,
        simd: S,
        samples: &NumberedAbreast<S>,
        _: &mut u32x16<S>,
        counted: &mut Counted<S, P>,
    ) -> u32x16<S> {
        counted.hashed(samples.count);
        let hits = all_abreast::<S, N>(self.reference(), simd, samples);
        from_first(simd, hits, samples.first)
    }
}

/// Which numbers of surfaces pass.
#[inline(always)]
fn all_abreast<S: Simd, const N: usize>(
    reference: Reference,
    simd: S,
    samples: &NumberedAbreast<S>,
) -> u32x16<S> {
    let NumberedAbreast { reversed, moved, limits, .. } = samples;
    let x = *reversed + *moved;
    let place = |n: u32| *reversed | u32x16::splat(simd, n.reverse_bits());
    let word = |word: u32| u32x16::splat(simd, word);
    match reference {
        Reference::Lk2011 => nested::<S, N, 4>(simd, x, limits),
        Reference::Lk2011Rounds1 => nested::<S, N, 1>(simd, x, limits),
        Reference::Lk2011Rounds2 => nested::<S, N, 2>(simd, x, limits),
        Reference::Lk2011Rounds3 => nested::<S, N, 3>(simd, x, limits),
        Reference::VegdahlV2 => samples.passing::<N>(
            simd,
            #[inline(always)]
            |n| {
                let x = ((place(n) + *moved) ^ word(0xdc96_7795)) * word(0x97b7_54b7);
                (x ^ word(0x8663_50b1)) * word(0x9e37_79cd)
            },
        ),
        Reference::Vegdahl => samples.passing::<N>(
            simd,
            #[inline(always)]
            |n| {
                let x = place(n);
                let x = (x ^ (x * word(0x3d20_adea))) + *moved;
                let x = x * ((*moved >> 16) | word(1));
                let x = x ^ (x * word(0x0552_6c56));
                x ^ (x * word(0x53a2_2864))
            },
        ),
        _ => nested::<S, N, 0>(simd, x, limits),
    }
}

/// The values of all numbers that a surface can have, and those of them from the
/// first sample's on: which number goes to which sample need not be known yet.
#[inline(always)]
fn hashed<S: Simd, L: Lanes<S>, const N: usize>(
    reference: Reference,
    simd: S,
    loaded: &Loaded<L>,
    samples: &Numbered<'_>,
) -> u64 {
    let Numbered { of: SampleOf { key, round, .. }, limit, base, starts, first, .. } = *samples;
    let moved = base.of_surface(u32::from(starts)).moved;
    let place = places(simd, loaded, base);
    let values = match reference {
        Reference::Lk2011 => lk2011(simd, place.add(L::splat(simd, moved as i32))),
        Reference::Lk2011Rounds1 => rounds::<S, L, 1>(simd, place, moved),
        Reference::Lk2011Rounds2 => rounds::<S, L, 2>(simd, place, moved),
        Reference::Lk2011Rounds3 => rounds::<S, L, 3>(simd, place, moved),
        Reference::VegdahlV2 => vegdahl_v2(simd, place, moved),
        Reference::Vegdahl => vegdahl(simd, place, moved),
        _ => one_by_one::<S, L, N>(reference, simd, round, key),
    };
    below(simd, values, limit).wrapping_shr(first)
}

/// [`hashed`] for the current surface and for the next, before it is known which it will be.
#[inline(always)]
fn ahead<S: Simd, L: Lanes<S>>(simd: S, loaded: &Loaded<L>, samples: &Numbered<'_>) -> u64 {
    let Numbered { limit, base, starts, first, .. } = *samples;
    let place = places(simd, loaded, base);
    let place = place.add(L::splat(simd, base.moved as i32));
    let this = below(simd, lk2011(simd, place), limit);
    let next = below(simd, lk2011(simd, place.add(L::splat(simd, 1))), limit);
    // What follows the last number of this surface is never looked at; the next one's first
    // number is 0.
    (this | next << L::LEN).wrapping_shr(first + u32::from(starts) * L::LEN as u32)
}

/// The places of all numbers in a pixel's sequence: below the pixel's part are the
/// numbers, and reversed, they are joined without a carry.
#[inline(always)]
fn places<S: Simd, L: Lanes<S>>(simd: S, loaded: &Loaded<L>, base: Base) -> L {
    loaded.reversed.or(L::splat(simd, base.reversed as i32))
}

/// Figure 4, lines 3 to 6.
#[inline(always)]
fn lk2011<S: Simd, L: Lanes<S>>(simd: S, mut x: L) -> L {
    for factor in LK2011 {
        x = x.xor(x.mul(L::splat(simd, factor as i32)));
    }
    x
}

/// The first `ROUNDS` of them.
#[inline(always)]
fn rounds<S: Simd, L: Lanes<S>, const ROUNDS: usize>(simd: S, place: L, moved: u32) -> L {
    let mut x = place.add(L::splat(simd, moved as i32));
    for factor in &LK2011[..ROUNDS] {
        x = x.xor(x.mul(L::splat(simd, *factor as i32)));
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
    round: Round,
    key: &ReferenceKey,
) -> L {
    let (earlier, total) = (round.index * N as u32, round.count * N as u32);
    let mut words = [0; 64];
    for (n, word) in words[..N].iter_mut().enumerate() {
        *word = reference.value(earlier + n as u32, total, key) as i32;
    }
    L::load(simd, &words[..L::LEN])
}
