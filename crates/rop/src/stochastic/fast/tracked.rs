//! Figure 7 of Laine and Karras in lanes: the twin of [`crate::tracked`].

use fearless_simd::Simd;

use crate::contract::event::Probe;
use crate::contract::samples::Samples;
use crate::lanes::Lanes;
use crate::stochastic::depth_bits;
use crate::stochastic::fast::rank::{in_sample_order, picked, ranks, ranks_of_any};
use crate::stochastic::fast::references::{Base, FastReferences, Numbered};
use crate::stochastic::fast::sampler::{FastSampler, Loaded, Offered};
use crate::stochastic::fast::tally::Tally;
use crate::stochastic::methods::Round;
use crate::stochastic::pixel_order::{PixelIndex, PixelOrder};
use crate::stochastic::reference_value::{Reference, ReferenceKey};
use crate::stochastic::surface::{CoveredMask, SurfaceRule, SurfaceTracker, Tracked};
use crate::stochastic::tracked::{
    COMPACT, PIXEL_ORDER, PREHASH, REFERENCE, References, SORT, SURFACES, SampleOf, TRACK,
    TrackedSampler, TrackedState,
};
use screendoor_trace::param::Values;
use screendoor_trace::tile::{TILE_PIXELS, TileGrid, TileId};
use screendoor_trace::trace::SampleMask;

/// The parameters that the kernel asks for with every fragment.
#[derive(Clone, Copy, Debug)]
pub struct Switches {
    pub(super) sort: bool,
    pub(super) compact: bool,
    pub(super) surfaces: SurfaceRule,
    track: Tracked,
    pub(super) prehash: bool,
    depth_bits: u32,
}

/// Where the switches come from: known when the kernel is compiled, or not.
pub trait Rules: Copy + Send + Sync + 'static {
    /// What a pixel keeps beside the published state.
    type More: Copy + Default + Send + Sync + 'static;
    /// Whether that is anything.
    const HAS_MORE: bool;

    /// The switches.
    fn switches(&self) -> Switches;
    /// How many samples of the surface have been numbered, if that is kept.
    fn numbered(more: &Self::More) -> u32;
    /// The primitive or object that drew last.
    fn last(more: &Self::More) -> Option<u32>;
    /// Keeps both.
    fn keep(more: &mut Self::More, numbered: u32, last: Option<u32>);
}

/// The publication's parameters.
#[derive(Clone, Copy, Debug)]
pub struct Published;

impl Rules for Published {
    type More = ();
    const HAS_MORE: bool = false;

    #[inline(always)]
    fn switches(&self) -> Switches {
        Switches {
            sort: true,
            compact: true,
            surfaces: SurfaceRule::Bitmask,
            track: Tracked::Survivors,
            prehash: false,
            depth_bits: 32,
        }
    }
    #[inline(always)]
    fn numbered((): &()) -> u32 {
        0
    }
    #[inline(always)]
    fn last((): &()) -> Option<u32> {
        None
    }
    #[inline(always)]
    fn keep((): &mut (), _: u32, _: Option<u32>) {}
}

/// Any parameters.
#[derive(Clone, Copy, Debug)]
pub struct Parameterised(Switches);

impl Rules for Parameterised {
    type More = (u32, Option<u32>);
    const HAS_MORE: bool = true;

    #[inline(always)]
    fn switches(&self) -> Switches {
        self.0
    }
    #[inline(always)]
    fn numbered(more: &Self::More) -> u32 {
        more.0
    }
    #[inline(always)]
    fn last(more: &Self::More) -> Option<u32> {
        more.1
    }
    #[inline(always)]
    fn keep(more: &mut Self::More, numbered: u32, last: Option<u32>) {
        *more = (numbered, last);
    }
}

/// Whether the parameters in `values` are the publication's, as far as kernels know
/// them.
pub fn is_published(values: &Values) -> bool {
    let Switches { sort, compact, surfaces, track, prehash, depth_bits } =
        Parameterised::of(values).switches();
    sort && compact
        && surfaces == SurfaceRule::Bitmask
        && track == Tracked::Survivors
        && !prehash
        && depth_bits == 32
        && values.get(REFERENCE) == Reference::Lk2011
}

impl Parameterised {
    /// As `values` say.
    pub fn of(values: &Values) -> Self {
        Parameterised(Switches {
            sort: values.get(SORT),
            compact: values.get(COMPACT),
            surfaces: values.get(SURFACES),
            track: values.get(TRACK),
            prehash: values.get(PREHASH),
            depth_bits: depth_bits::of(values),
        })
    }
}

/// Figure 7 with any reference values, for pixels of `N` samples.
#[derive(Clone, Debug)]
pub struct FastTracked<R, F, const N: usize> {
    pub(super) rules: R,
    pub(super) references: F,
    pixel_order: PixelOrder,
}

/// What figure 7 keeps of a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Track<K, M> {
    pub(super) covered: u64,
    pub(super) surface: u32,
    /// What the surface's reference values are made of, but for the number, in this round.
    pub(super) base: Base,
    pub(super) pixel: PixelIndex,
    pub(super) kept: K,
    pub(super) more: M,
}

impl<R: Rules, F: FastReferences<N>, const N: usize> FastTracked<R, F, N> {
    /// The sampler of the rules and references, which must say what `values` do.
    pub fn new(values: &Values, rules: R, references: F) -> Self {
        FastTracked { rules, references, pixel_order: values.get(PIXEL_ORDER) }
    }
}

impl<R: Rules, F: FastReferences<N>, const N: usize> FastSampler<N> for FastTracked<R, F, N> {
    type Plain = TrackedSampler<F::Plain, N>;
    type State = Track<F::Kept, R::More>;
    type Abreast = Self;

    fn abreast(&self) -> Option<&Self> {
        self.references.goes_abreast().then_some(self)
    }

    fn clear(&self, grid: TileGrid, tile: TileId) -> Vec<Self::State> {
        let cleared = |pixel| Track {
            covered: 0,
            surface: 0,
            base: Base::default(),
            pixel,
            kept: F::Kept::default(),
            more: R::More::default(),
        };
        self.pixel_order.tile(tile, grid).iter().map(|pixel| cleared(*pixel)).collect()
    }

    fn to_plain(&self, state: Self::State) -> TrackedState<<F::Plain as References>::Kept> {
        let covered = SampleMask(state.covered);
        // Where no counter is kept, all that are covered have been numbered.
        let numbered = match self.counts() {
            true => R::numbered(&state.more),
            false => covered.count(),
        };
        TrackedState {
            surface: SurfaceTracker {
                covered: CoveredMask::new([state.covered]),
                surface_id: state.surface,
                numbered,
                last: R::last(&state.more),
            },
            pixel_id: state.pixel,
            kept: F::to_plain(state.kept),
        }
    }

    fn of_plain(
        &self,
        plain: &TrackedState<<F::Plain as References>::Kept>,
        _: &Samples<N>,
        state: &mut Self::State,
    ) {
        let SurfaceTracker { surface_id, numbered, last, .. } = plain.surface;
        R::keep(&mut state.more, numbered, last);
        state.covered = plain.surface.held().0;
        state.base = state.base.of_surface(surface_id.wrapping_sub(state.surface));
        state.surface = surface_id;
        state.kept = F::of_plain(&plain.kept);
    }

    fn enter(&self, round: &Round, states: &mut [Self::State; TILE_PIXELS]) {
        for state in states {
            let Track { pixel, surface, .. } = *state;
            state.base = F::base(round, &ReferenceKey { pixel, surface, seed: round.seed });
        }
    }

    #[inline(always)]
    fn depth_bits(&self) -> u32 {
        self.rules.switches().depth_bits
    }

    #[inline(always)]
    fn needs_survivors(&self) -> bool {
        self.rules.switches().compact && !self.counts()
    }

    #[inline(always)]
    fn choose<S: Simd, L: Lanes<S>, P: Probe>(
        &self,
        simd: S,
        loaded: &Loaded<L>,
        p: &mut Self::State,
        offered: Offered<'_, L>,
        tally: &mut Tally<'_, P>,
    ) -> L::Mask {
        let Switches { sort, compact, surfaces, prehash, .. } = self.rules.switches();
        let Offered { round, stored, words, passed, fragment, coverage, limit } = offered;
        let s = if compact { passed } else { coverage };
        let tracked = if self.counts() { coverage } else { s };
        if surfaces != SurfaceRule::Bitmask && tracked == 0 {
            return L::mask(simd, 0);
        }

        // 4–8.
        let conflict = tracked & p.covered != 0;
        let source = match surfaces {
            SurfaceRule::Primitive => Some(fragment.primitive()),
            SurfaceRule::Object => Some(fragment.object()),
            SurfaceRule::Bitmask | SurfaceRule::EveryFragment => None,
        };
        let starts = match surfaces {
            SurfaceRule::Bitmask => conflict,
            SurfaceRule::EveryFragment => true,
            SurfaceRule::Primitive | SurfaceRule::Object => {
                let last = R::last(&p.more);
                (last.is_some() && last != source) || conflict
            }
        };
        let surface = p.surface.wrapping_add(u32::from(starts));
        let held = if starts { 0 } else { p.covered };
        let mut kept = if starts { F::Kept::default() } else { p.kept };
        let first = match (self.counts(), starts) {
            (false, _) => held.count_ones(),
            (true, true) => 0,
            (true, false) => R::numbered(&p.more),
        };
        tally.surface(starts);
        let count = s.count_ones();
        if sort {
            tally.sorted(count);
        }

        // 10–17, the values in the order of the numbers.
        let key = ReferenceKey { pixel: p.pixel, surface, seed: round.seed };
        let (key, base) = match prehash {
            true => {
                let key = key.prehashed();
                let before = key.surface.wrapping_sub(u32::from(starts));
                (key, F::base(round, &ReferenceKey { surface: before, ..key }))
            }
            false => (key, p.base),
        };
        let (site, opacity) = (fragment.site(), limit.threshold());
        let of = SampleOf { site, key: &key, round: *round, opacity, place: 0, count };
        let samples = Numbered { of, limit, base, starts, first, count };
        let hits = self.references.passing::<S, L, P>(simd, loaded, &mut kept, samples, tally);

        // 18.
        p.surface = surface;
        p.base = p.base.of_surface(u32::from(starts));
        p.covered = held | tracked;
        p.kept = kept;
        R::keep(&mut p.more, first + count, source);
        tally.tracked(tracked != 0);

        if L::LEN > 8 {
            let all = u64::MAX.checked_shr(64 - count).unwrap_or(0);
            if hits & all == 0 || hits & all == all {
                return L::mask(simd, if hits & all == 0 { 0 } else { passed });
            }
        }

        // 9: which sample has which number. A sample that passed lies behind the fragment,
        // which is not at the near end; others may hold any depth.
        let ranks = match (sort, compact) {
            (true, true) => ranks(simd, stored, words, s),
            (true, false) => ranks_of_any(simd, stored, words, s),
            (false, _) => in_sample_order(simd, s),
        };
        picked(simd, hits, ranks, L::mask(simd, passed))
    }
}

impl<R: Rules, F, const N: usize> FastTracked<R, F, N> {
    /// Whether all covered samples are tracked, so that numbered ones are counted
    /// apart.
    #[inline(always)]
    pub(super) fn counts(&self) -> bool {
        let switches = self.rules.switches();
        switches.compact && switches.track == Tracked::Covered
    }
}
