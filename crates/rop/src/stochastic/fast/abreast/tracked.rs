//! Figure 7 of Laine and Karras with pixels in lanes.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, i32x16, mask32x16, u32x16};

use crate::contract::event::Probe;
use crate::in_lanes::words as words_of;
use crate::stochastic::fast::abreast::hits::{Limits, scrambled};
use crate::stochastic::fast::abreast::met::{Abreast, Counted, Met, Source, gather};
use crate::stochastic::fast::abreast::packed::{Ranks, STRIDE, bit, count, pack, right_by, unpack};
use crate::stochastic::fast::references::FastReferences;
use crate::stochastic::fast::tracked::{FastTracked, Rules, Switches, Track};
use crate::stochastic::methods::Round;
use crate::stochastic::reference_value::{LK2011, ReferenceKey};
use crate::stochastic::surface::SurfaceRule;
use screendoor_trace::random::{PREHASHED, scatter};
use screendoor_trace::tile::TILE_PIXELS;

/// The samples of sixteen fragments that are to be numbered.
#[derive(Clone, Copy)]
pub struct NumberedAbreast<S: Simd> {
    /// The bits of the place in a sequence that the pixel gives, in reverse.
    pub reversed: u32x16<S>,
    /// How far seed, frame and surface move the values.
    pub moved: u32x16<S>,
    /// Thresholds.
    pub(in crate::stochastic::fast) limits: Limits<S>,
    /// Where no sample of the surface has been numbered.
    pub fresh: mask32x16<S>,
    /// The first one's number in its surface.
    pub first: u32x16<S>,
    /// How many they are.
    pub count: u32x16<S>,
}

impl<S: Simd> NumberedAbreast<S> {
    /// Thresholds modulo 2^32.
    pub fn threshold(&self) -> u32x16<S> {
        self.limits.threshold
    }

    /// The first of the values of figure 4.
    #[inline(always)]
    pub fn first_lk2011(&self, simd: S) -> u32x16<S> {
        scrambled(simd, self.reversed + self.moved, &LK2011)
    }

    /// The numbers, packed, whose value passes.
    #[inline(always)]
    pub fn passing<const N: usize>(
        &self,
        simd: S,
        value: impl FnMut(u32) -> u32x16<S>,
    ) -> u32x16<S> {
        super::hits::each::<S, N>(simd, &self.limits, value)
    }
}

/// What figure 7 keeps of sixteen pixels.
#[derive(Clone, Copy)]
pub struct TrackLanes<S: Simd> {
    covered: u32x16<S>,
    surface: u32x16<S>,
    reversed: u32x16<S>,
    /// Of the surface, but where surfaces are hashed first: of the round.
    moved: u32x16<S>,
    numbered: u32x16<S>,
    last: u32x16<S>,
    /// Where something has drawn.
    drawn: u32x16<S>,
    kept: u32x16<S>,
}

impl<R: Rules, F: FastReferences<N>, const N: usize> Abreast<N> for FastTracked<R, F, N> {
    type Kept = Track<F::Kept, R::More>;
    type Lanes<S: Simd> = TrackLanes<S>;

    fn source(&self) -> Source {
        match self.rules.switches().surfaces {
            SurfaceRule::Primitive => Source::Primitive,
            SurfaceRule::Object => Source::Object,
            SurfaceRule::Bitmask | SurfaceRule::EveryFragment => Source::Nothing,
        }
    }

    #[inline(always)]
    fn load<S: Simd>(
        &self,
        simd: S,
        round: &Round,
        kept: &[Self::Kept; TILE_PIXELS],
        pixels: &[u8; 16],
    ) -> TrackLanes<S> {
        let bases = |p: usize| match self.rules.switches().prehash {
            false => kept[p].base,
            true => F::base(round, &ReferenceKey { pixel: kept[p].pixel, surface: 0, seed: 0 }),
        };
        let none = u32x16::splat(simd, 0);
        let mut lanes = TrackLanes {
            covered: gather(simd, pixels, |p| pack(kept[p].covered as u32)),
            surface: gather(simd, pixels, |p| kept[p].surface),
            reversed: gather(simd, pixels, |p| bases(p).reversed),
            moved: gather(simd, pixels, |p| bases(p).moved),
            numbered: none,
            last: none,
            drawn: none,
            kept: none,
        };
        if R::HAS_MORE {
            lanes.numbered = gather(simd, pixels, |p| R::numbered(&kept[p].more));
            lanes.last = gather(simd, pixels, |p| R::last(&kept[p].more).unwrap_or_default());
            lanes.drawn = gather(simd, pixels, |p| u32::from(R::last(&kept[p].more).is_some()));
        }
        if F::KEEPS {
            lanes.kept = gather(simd, pixels, |p| F::word(kept[p].kept));
        }
        lanes
    }

    #[inline(always)]
    fn store<S: Simd>(
        &self,
        lanes: &TrackLanes<S>,
        kept: &mut [Self::Kept; TILE_PIXELS],
        pixels: &[u8; 16],
    ) {
        let [covered, surface] = [lanes.covered, lanes.surface].map(words_of);
        let [numbered, last, drawn] = [lanes.numbered, lanes.last, lanes.drawn].map(words_of);
        let words = words_of(lanes.kept);
        for (i, pixel) in pixels.iter().enumerate() {
            let to = &mut kept[usize::from(*pixel)];
            to.base = to.base.of_surface(surface[i].wrapping_sub(to.surface));
            to.surface = surface[i];
            to.covered = u64::from(unpack(covered[i]));
            if F::KEEPS {
                to.kept = F::of_word(words[i], covered[i] != 0);
            }
            if R::HAS_MORE {
                R::keep(&mut to.more, numbered[i], (drawn[i] != 0).then_some(last[i]));
            }
        }
    }

    #[inline(always)]
    fn choose<S: Simd, P: Probe>(
        &self,
        simd: S,
        lanes: &mut TrackLanes<S>,
        met: &Met<'_, S, N>,
        counted: &mut Counted<S, P>,
    ) -> [mask32x16<S>; N] {
        let Switches { sort, compact, surfaces, prehash, .. } = self.rules.switches();
        let word = |word: u32| u32x16::splat(simd, word);
        let none = word(0);
        let s = if compact { met.passed } else { met.coverage };
        let tracked = if self.counts() { met.coverage } else { s };

        // 4–8.
        let conflict = (tracked & lanes.covered).simd_gt(none);
        let starts = match surfaces {
            SurfaceRule::Bitmask => conflict,
            SurfaceRule::EveryFragment => tracked.simd_gt(none),
            SurfaceRule::Primitive | SurfaceRule::Object => {
                let other = lanes.drawn.simd_gt(none) & lanes.last.simd_ne(met.source);
                conflict | (other & tracked.simd_gt(none))
            }
        };
        let one = word(1);
        lanes.surface = starts.select(lanes.surface + one, lanes.surface);
        if !prehash {
            lanes.moved = starts.select(lanes.moved + one, lanes.moved);
        }
        let held = starts.select(none, lanes.covered);
        let first = match self.counts() {
            false => count(simd, held),
            true => starts.select(none, lanes.numbered),
        };
        counted.surfaces(starts);
        let count = count(simd, s);
        if sort {
            counted.sorted(count);
        }

        // 10–17, the values in the order of the numbers.
        let moved = match prehash {
            false => lanes.moved,
            true => lanes.moved + prehashed(simd, lanes.surface, met.round.seed),
        };
        let limits = Limits { threshold: met.threshold, opaque: met.opaque };
        let fresh = held.simd_eq(none);
        let reversed = lanes.reversed;
        let numbered = NumberedAbreast { reversed, moved, limits, fresh, first, count };
        let hits =
            self.references.passing_abreast::<S, P>(simd, &numbered, &mut lanes.kept, counted);

        // 18.
        lanes.covered = held | tracked;
        if R::HAS_MORE {
            lanes.numbered = first + count;
            let touched = tracked.simd_gt(none);
            if self.source() != Source::Nothing {
                lanes.last = touched.select(met.source, lanes.last);
                lanes.drawn = touched.select(one, lanes.drawn);
            }
        }
        counted.tracked(tracked.simd_gt(none));

        // 9: which sample has which number.
        let ranks = match (sort, compact) {
            (true, true) => Ranks::of(simd, met.keys),
            (true, false) => Ranks::of(simd, &keys_among(simd, met)),
            (false, _) => Ranks::in_sample_order(simd, s),
        };
        ranks.picked(simd, hits, met.passed)
    }
}

/// Stored depths of the samples that are covered, and more than any of the others.
#[inline(always)]
fn keys_among<S: Simd, const N: usize>(simd: S, met: &Met<'_, S, N>) -> [i32x16<S>; N] {
    let (none, most) = (u32x16::splat(simd, 0), i32x16::splat(simd, i32::MAX));
    let mut keys = [most; N];
    for i in 0..N {
        let covers = (met.coverage & u32x16::splat(simd, bit(i))).simd_gt(none);
        keys[i] = covers.select(met.stored[i], most);
    }
    keys
}

/// How far surfaces move the values where they are hashed with the seed first:
/// [`ReferenceKey::prehashed`].
#[inline(always)]
fn prehashed<S: Simd>(simd: S, surface: u32x16<S>, seed: u32) -> u32x16<S> {
    super::mixed(simd, (surface + u32x16::splat(simd, scatter(seed))) ^ PREHASHED)
}

/// Hits from the first number on.
#[inline(always)]
pub(in crate::stochastic::fast) fn from_first<S: Simd>(
    simd: S,
    hits: u32x16<S>,
    first: u32x16<S>,
) -> u32x16<S> {
    right_by(simd, hits, first * u32x16::splat(simd, STRIDE))
}
