//! The choice of samples and the account of its errors in lanes, where errors are kept whole,
//! at one depth and for the pixel: then they are a few words, and of the samples three pairs of
//! sums are needed, over those that passed and those that are written.

use fearless_simd::Simd;

#[cfg(test)]
use crate::residual::abreast::LaneFlaw;
use crate::residual::choice::Drawing;
use crate::residual::errors::{
    Entry, Sums, Width, attenuated, centre, mass_of, of_pixel, share, shown,
};
use crate::residual::{ResidualSampler, Residue};
use screendoor_rop::fast::{
    self, Count, FastSampler, Lanes, Loaded, Offered, Tally, below, in_sample_order, picked, ranks,
    teeth,
};
use screendoor_rop::stochastic::comb::exchanges;
use screendoor_rop::{Dither, PixelIndex, Probe, ReferenceKey, Round, Samples};
use screendoor_trace::tile::{TILE_PIXELS, TileGrid, TileId};

/// [`ResidualSampler`] with errors of one depth.
pub(super) struct FastResidual<const N: usize> {
    pub(super) plain: ResidualSampler<N>,
    #[cfg(test)]
    pub(super) flaw: Option<LaneFlaw>,
}

/// What a pixel keeps beside its samples.
#[derive(Clone, Copy)]
pub(super) struct Kept<R> {
    pub(super) index: PixelIndex,
    pub(super) fragments: u32,
    /// What ξ of all fragments have in common where they are white.
    pub(super) white: u32,
    /// Whether anything was drawn: until then there is no entry.
    pub(super) begun: bool,
    pub(super) z: u32,
    pub(super) mass: u32,
    pub(super) sums: Sums,
    /// The samples' colours as the sums take them.
    pub(super) fixed: [R; 3],
}

/// What ξ is made of.
#[inline(always)]
fn key<R>(round: &Round, kept: &Kept<R>) -> ReferenceKey {
    ReferenceKey { pixel: kept.index, surface: kept.fragments, seed: round.seed }
}

/// The sum of the lanes that `mask` names.
#[inline(always)]
fn over<S: Simd, L: Lanes<S>>(simd: S, row: L, mask: u64) -> i32 {
    L::select(L::mask(simd, mask), row, L::splat(simd, 0)).sum()
}

impl<const N: usize> FastResidual<N> {
    /// The twin of `plain`, if it has one.
    pub(super) fn new(plain: ResidualSampler<N>) -> Option<Self> {
        let store = &plain.store;
        let simple = store.layers == 1 && store.parts == 1 && store.width == Width::Whole;
        (simple && plain.drawing == Drawing::Paired).then_some(FastResidual {
            plain,
            #[cfg(test)]
            flaw: None,
        })
    }

    /// What shows wrongly of errors with these sums.
    pub(super) fn shown_wrongly(&self, sums: &Sums) -> [f64; 3] {
        let [r, g, b, _] = self.plain.store.fractions([sums].into_iter());
        [r, g, b]
    }
}

impl<const N: usize> FastSampler<N> for FastResidual<N>
where
    Count<N>: fast::Width,
{
    type Plain = ResidualSampler<N>;
    type State = Kept<<Count<N> as fast::Width>::Row>;
    type Abreast = Self;

    fn abreast(&self) -> Option<&Self> {
        // ξ of the others is looked up.
        (self.plain.dither == Dither::White).then_some(self)
    }

    fn clear(&self, grid: TileGrid, tile: TileId) -> Vec<Self::State> {
        let cleared = |index| Kept {
            index,
            fragments: 0,
            white: 0,
            begun: false,
            z: 0,
            mass: 0,
            sums: [0; 4],
            fixed: [<Count<N> as fast::Width>::row(|_| 0); 3],
        };
        self.plain.pixel_order.tile(tile, grid).iter().map(|index| cleared(*index)).collect()
    }

    fn to_plain(&self, kept: Self::State) -> Residue {
        let Kept { index, fragments, begun, z, mass, sums, .. } = kept;
        let entry = Entry { z, mass, parts: Box::new([sums]) };
        Residue { index, fragments, errors: if begun { vec![entry] } else { Vec::new() } }
    }

    fn of_plain(&self, plain: &Residue, samples: &Samples<N>, kept: &mut Self::State) {
        kept.fragments = plain.fragments;
        if let [entry] = &plain.errors[..] {
            (kept.begun, kept.z, kept.mass) = (true, entry.z, entry.mass);
            kept.sums = entry.parts[0];
        }
        for (s, colour) in samples.colour.iter().enumerate() {
            for (row, x) in kept.fixed.iter_mut().zip(self.plain.fixed(*colour)) {
                row.as_mut()[s] = x;
            }
        }
    }

    fn enter(&self, round: &Round, states: &mut [Self::State; TILE_PIXELS]) {
        for kept in states {
            kept.white = Dither::white_in(round.seed, kept.index);
        }
    }

    fn excess(&self, _: &ResidualSampler<N>, kept: &Self::State) -> [f64; 3] {
        self.shown_wrongly(&kept.sums)
    }

    #[inline(always)]
    fn depth_bits(&self) -> u32 {
        self.plain.depth_bits
    }

    #[inline(always)]
    fn needs_survivors(&self) -> bool {
        false
    }

    #[inline(always)]
    fn choose<S: Simd, L: Lanes<S>, P: Probe>(
        &self,
        simd: S,
        loaded: &Loaded<L>,
        kept: &mut Self::State,
        offered: Offered<'_, L>,
        tally: &mut Tally<'_, P>,
    ) -> L::Mask {
        let plain = &self.plain;
        let Offered { round, stored, words, passed, coverage, limit, fragment } = offered;
        let threshold = limit.threshold().value();
        let xi = match plain.dither {
            Dither::White => Dither::white(kept.white, kept.fragments),
            other => other.in_round(*round, fragment.site(), &key(round, kept), plain.reference),
        };
        kept.fragments = kept.fragments.wrapping_add(1);

        // The samples' numbers pass or not, before it is known which sample has which.
        let values = teeth(simd, loaded, xi, exchanges(xi), limit.threshold());
        let hits = below(simd, values, limit);
        let ranks = match plain.sort {
            true => ranks(simd, stored, words, passed),
            false => in_sample_order(simd, passed),
        };
        let written = picked(simd, hits, ranks, L::mask(simd, passed));

        // Over what passed and what is written: the colours that are there, and how many are.
        let full = L::bits(L::splat(simd, i32::MAX).greater(stored));
        // What lies at the far plane counts as nothing, as it does everywhere.
        let writes = L::bits(written);
        let [met, left] = [passed & full, writes & full];
        let drawn = plain.fixed(fragment.colour());
        let counts = [passed.count_ones() as i32, writes.count_ones() as i32];
        let gone = [met.count_ones() as i32, left.count_ones() as i32];
        let mut changes = [[0; 2]; 4];
        for ((change, row), x) in changes.iter_mut().zip(&mut kept.fixed).zip(drawn) {
            // No closures here: they would be compiled without the vectors' instructions.
            let held = L::load(simd, row.as_ref());
            let (all, some) = (over(simd, held, met), over(simd, held, left));
            *change = [counts[0] * x - all, counts[1] * x - some];
            L::select(written, L::splat(simd, x), held).store(row.as_mut());
        }
        changes[3] = [(counts[0] - gone[0]) * drawn[3], (counts[1] - gone[1]) * drawn[3]];

        // The entry.
        let lowest = coverage.trailing_zeros() as usize % N;
        let z = fragment.depth().at(plain.positions[lowest]).narrowed(plain.depth_bits).0;
        let attenuation = of_pixel(threshold, coverage.count_ones(), N.ilog2());
        let mass = mass_of(attenuation);
        let own = [z, mass];
        let behind = kept.z >= z;
        if !kept.begun {
            [kept.z, kept.mass] = own;
        } else if !behind {
            let hidden = share(attenuation, kept.sums[3]);
            for (sum, x) in kept.sums.iter_mut().zip(drawn) {
                *sum = sum.saturating_add(shown(hidden, x).saturating_neg());
            }
            [kept.z, kept.mass] = centre([kept.z, kept.mass], own);
        } else {
            for sum in &mut kept.sums {
                *sum -= share(attenuation, *sum);
            }
            [kept.z, kept.mass] = centre(own, [kept.z, attenuated(kept.mass, mass)]);
        }
        for (sum, [all, some]) in kept.sums.iter_mut().zip(changes) {
            *sum = sum.saturating_add(some - share(threshold, all));
        }

        tally.compared(u32::from(kept.begun));
        // As the plain text's: an error behind has a mass, too; both have a centre of mass.
        let attenuating = if behind { 4 + 1 } else { 4 };
        let made = if kept.begun { attenuating + 1 } else { 0 };
        tally.multiplied(made + if passed == 0 { 0 } else { 4 });
        tally.colours_read(gone[0] as u32);
        tally.tracked(true);
        tally.hashed(1);
        if plain.sort {
            tally.sorted(counts[0] as u32);
        }
        kept.begun = true;
        written
    }
}
