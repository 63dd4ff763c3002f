//! The choice of samples and the account of its errors in lanes, where errors are kept whole,
//! at one depth and for the pixel: then they are a few words, and of the samples three pairs of
//! sums are needed, over those that passed and those that are written.

use fearless_simd::Simd;

use crate::residual::choice::{Drawing, exchanges};
use crate::residual::errors::{
    Entry, Sums, Width, attenuated, centre, mass_of, of_pixel, share, shown,
};
use crate::residual::{ResidualSampler, Residue};
use screendoor_rop::fast::{
    self, Count, FastSampler, Lanes, Loaded, Offered, Tally, below, in_sample_order, picked, ranks,
};
use screendoor_rop::{PixelIndex, Probe, ReferenceKey, Round, Samples};
use screendoor_trace::tile::{TILE_PIXELS, TileGrid, TileId};

/// [`ResidualSampler`] with errors of one depth.
pub(super) struct FastResidual<W: fast::Width, const N: usize> {
    plain: ResidualSampler<N>,
    /// Each number's place in the comb, and by how much an exchange moves it.
    places: [W::Row; 2],
    /// How far the number's bit of [`exchanges`] lies from the upper one.
    bits: W::Row,
}

/// What a pixel keeps beside its samples.
#[derive(Clone, Copy)]
pub(super) struct Kept<R> {
    index: PixelIndex,
    fragments: u32,
    /// Whether anything was drawn: until then there is no entry.
    begun: bool,
    z: u32,
    mass: u32,
    sums: Sums,
    /// The samples' colours as the sums take them.
    fixed: [R; 3],
}

impl<const N: usize> FastResidual<Count<N>, N>
where
    Count<N>: fast::Width,
{
    /// The twin of `plain`, if it has one.
    pub(super) fn new(plain: ResidualSampler<N>) -> Option<Self> {
        let store = &plain.store;
        let simple = store.layers == 1 && store.parts == 1 && store.width == Width::Whole;
        let row = |word: &dyn Fn(i32) -> i32| <Count<N> as fast::Width>::row(|n| word(n as i32));
        (simple && plain.drawing == Drawing::Paired).then(|| FastResidual {
            places: [row(&|n| n + 1), row(&|n| 1 - 2 * (n & 1))],
            bits: row(&|n| 31 - n / 2),
            plain,
        })
    }
}

impl<const N: usize> FastSampler<N> for FastResidual<Count<N>, N>
where
    Count<N>: fast::Width,
{
    type Plain = ResidualSampler<N>;
    type State = Kept<<Count<N> as fast::Width>::Row>;

    fn clear(&self, grid: TileGrid, tile: TileId) -> Vec<Self::State> {
        let cleared = |index| Kept {
            index,
            fragments: 0,
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

    fn enter(&self, _: &Round, _: &mut [Self::State; TILE_PIXELS]) {}

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
        _: &Loaded<L>,
        kept: &mut Self::State,
        offered: Offered<'_, L>,
        tally: &mut Tally<'_, P>,
    ) -> L::Mask {
        let plain = &self.plain;
        let Offered { round, stored, words, passed, coverage, limit, fragment } = offered;
        let threshold = limit.threshold().value();
        let key = ReferenceKey { pixel: kept.index, surface: kept.fragments, seed: round.seed };
        let xi = plain.dither.in_round(*round, fragment.site(), &key, plain.reference);
        kept.fragments = kept.fragments.wrapping_add(1);

        // The samples' numbers pass or not, before it is known which sample has which.
        let load = |row: &<Count<N> as fast::Width>::Row| L::load(simd, row.as_ref());
        let step = L::splat(simd, threshold as u32 as i32);
        let exchange = L::splat(simd, exchanges(xi) as i32);
        let exchange = exchange.shift_left_by(load(&self.bits)).negative(simd);
        let [place, move_by] = [load(&self.places[0]), load(&self.places[1])];
        let place = L::select(exchange, place.add(move_by), place);
        let hits = below(simd, place.mul(step).add(L::splat(simd, xi as i32)), limit);
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
        let zero = L::splat(simd, 0);
        let drawn = plain.fixed(fragment.colour());
        let counts = [passed, writes].map(|mask| mask.count_ones() as i32);
        let gone = [met, left].map(|mask| mask.count_ones() as i32);
        let mut changes = [[0; 2]; 4];
        for ((change, row), x) in changes.iter_mut().zip(&mut kept.fixed).zip(drawn) {
            let held = L::load(simd, row.as_ref());
            let sums = [met, left].map(|mask| L::select(L::mask(simd, mask), held, zero).sum());
            *change = [counts[0] * x - sums[0], counts[1] * x - sums[1]];
            L::select(written, L::splat(simd, x), held).store(row.as_mut());
        }
        changes[3] = [(counts[0] - gone[0]) * drawn[3], (counts[1] - gone[1]) * drawn[3]];

        // The entry.
        let lowest = coverage.trailing_zeros() as usize % N;
        let z = fragment.depth().at(plain.positions[lowest]).narrowed(plain.depth_bits).0;
        let attenuation = of_pixel(threshold, coverage.count_ones(), N.ilog2());
        let mass = mass_of(attenuation);
        let own = [z, mass];
        if !kept.begun {
            [kept.z, kept.mass] = own;
        } else if kept.z < z {
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
