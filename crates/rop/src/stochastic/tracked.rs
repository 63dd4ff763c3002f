//! Figure 7 of Laine and Karras (EGSR 2011) with any reference values: surface
//! tracking, compaction and sorting, as the plain reference, line by line.
//!
//! This file is the only normative text of the algorithm; anything faster must
//! give the same bits.

use crate::contract::event::Probe;
use crate::contract::frame::{Frame, Site};
use crate::contract::opacity::Threshold;
use crate::contract::samples::{SampleList, Samples, in_sample_order, sort_by_stored_depth};
use crate::contract::words::{Declaration, OnDevice, PixelWords};
use crate::stochastic::methods::{Round, Sampler};
use crate::stochastic::pixel_order::{PixelIndex, PixelOrder};
use crate::stochastic::reference_value::{Reference, ReferenceKey};
use crate::stochastic::surface::{CoveredMask, SurfaceRule, SurfaceTracker, Tracked};
use screendoor_trace::param::{Typed, Values};
use screendoor_trace::tile::TileGrid;
use screendoor_trace::trace::{Fragment, SampleMask};

/// Where a surface's reference values come from.
pub trait References: Send + Sync {
    /// What is kept of the current surface; the default before its first sample.
    type Kept: Clone + Default + Send + Sync + 'static;

    /// The reference value of the surface's `n`-th sample, and how many hashes it
    /// took. Values are asked for in the order of the samples.
    fn value<const N: usize>(
        &self,
        kept: &mut Self::Kept,
        n: u32,
        sample: &SampleOf<'_>,
    ) -> (u32, u32);

    /// Bits of [`References::Kept`].
    fn kept_bits(&self) -> u32;
}

/// Whose reference value is asked for.
#[derive(Clone, Copy, Debug)]
pub struct SampleOf<'a> {
    /// The pixel.
    pub site: Site,
    /// Pixel, surface and seed.
    pub key: &'a ReferenceKey,
    /// The round; those that are stratified together share the pixel's part of a
    /// sequence.
    pub round: Round,
    /// The fragment's threshold.
    pub opacity: Threshold,
    /// Which of its fragment's numbered samples it is, from 0.
    pub place: u32,
    /// How many samples of its fragment are numbered.
    pub count: u32,
}

/// Reference values of figure 4: a hash for each sample.
#[derive(Clone, Copy, Debug)]
pub struct Hashed(pub Reference);

impl References for Hashed {
    type Kept = ();

    fn value<const N: usize>(&self, (): &mut (), n: u32, of: &SampleOf<'_>) -> (u32, u32) {
        let samples = N as u32;
        (self.0.value(of.round.index * samples + n, of.round.count * samples, of.key), 1)
    }

    fn kept_bits(&self) -> u32 {
        0
    }
}

/// The parameters of [`TrackedSampler`].
pub const SORT: Typed<bool> =
    Typed::flag("sort", true, "number samples in the order of their stored depths (LK section 4)");
/// As [`SORT`].
pub const COMPACT: Typed<bool> = Typed::flag(
    "compact",
    true,
    "test depth before numbering samples (LK figure 5b); off: when writing",
);
/// As [`SORT`].
pub const SURFACES: Typed<SurfaceRule> =
    Typed::choice("surfaces", "bitmask", "when a fragment starts a new surface");
/// As [`SORT`].
pub const TRACK: Typed<Tracked> =
    Typed::choice("track", "survivors", "which samples the surface tracking sees");
/// As [`SORT`].
pub const PIXEL_ORDER: Typed<PixelOrder> =
    Typed::choice("pixel-order", "hilbert", "the curve that numbers the pixels");
/// As [`SORT`].
pub const REFERENCE: Typed<Reference> =
    Typed::choice("reference", "lk2011", "how reference values are made");
/// As [`SORT`].
pub const PREHASH: Typed<bool> =
    Typed::flag("prehash", false, "hash surface and seed before they scramble (sobol_burley)");

/// Whether chance decides which fragments form a surface, as figure 7 has it: biased.
///
/// The publication takes its tracking to be unbiased; it is not quite. Whether a
/// fragment that survives in part continues the current surface depends on which of
/// that surface's samples it wrote: where they passed, they hide the conflict, the
/// surface goes on, and the samples still to come are given the complementary
/// reference values, which rather fail; where they did not pass, a new surface starts
/// afresh. (With surfaces = primitive it takes a primitive whose pieces in a pixel
/// come with others between them, which a trace may hold although no rasteriser makes
/// it.)
pub fn chance_decides_surfaces(values: &Values) -> bool {
    values.get(SURFACES) != SurfaceRule::EveryFragment
        && values.get(TRACK) == Tracked::Survivors
        && values.get(COMPACT)
}

/// Figure 7 with any reference values, for pixels of `N` samples.
#[derive(Clone, Debug)]
pub struct TrackedSampler<R, const N: usize> {
    pub(crate) grid: TileGrid,
    pub(crate) sort: bool,
    pub(crate) compact: bool,
    pub(crate) surfaces: SurfaceRule,
    pub(crate) track: Tracked,
    pub(crate) pixel_order: PixelOrder,
    pub(crate) prehash: bool,
    pub(crate) references: R,
}

impl<R, const N: usize> TrackedSampler<R, N> {
    /// The sampler with its parameters in `values`.
    pub fn new(values: &Values, frame: &Frame, references: R) -> Self {
        let compact = values.get(COMPACT);
        TrackedSampler {
            grid: frame.grid,
            sort: values.get(SORT),
            compact,
            surfaces: values.get(SURFACES),
            // Without compaction all covered samples are tracked and numbered either
            // way, so no counter is needed.
            track: if compact { values.get(TRACK) } else { Tracked::Survivors },
            pixel_order: values.get(PIXEL_ORDER),
            prehash: values.get(PREHASH),
            references,
        }
    }
}

/// What figure 7 keeps of a pixel, `p`, beside its samples.
#[derive(Clone, Debug)]
pub struct TrackedState<K> {
    pub(crate) surface: SurfaceTracker,
    /// `p.pixelId`: follows from where the pixel lies, so it is no state.
    pub(crate) pixel_id: PixelIndex,
    /// What the reference values keep.
    pub(crate) kept: K,
}

impl<R: References, const N: usize> Sampler<N> for TrackedSampler<R, N> {
    type State = TrackedState<R::Kept>;

    fn clear(&self, site: Site) -> Self::State {
        TrackedState {
            surface: SurfaceTracker::default(),
            pixel_id: self.pixel_order.index(site, self.grid),
            kept: R::Kept::default(),
        }
    }

    fn state_bits(&self) -> u32 {
        SurfaceTracker::state_bits(self.surfaces, self.track, N as u32)
            + self.references.kept_bits()
    }

    /// `DrawFragment` of figure 7 from line 4 to the opacity test; numbers are the
    /// figure's lines. Lines 1 to 3, the depth test, have given `passed`.
    fn choose<P: Probe>(
        &self,
        round: Round,
        site: Site,
        p: &mut Self::State,
        samples: &Samples<N>,
        passed: SampleMask,
        fragment: &Fragment,
        probe: &mut P,
    ) -> SampleMask {
        let opacity = Threshold::of(fragment.alpha);
        // With `compact` off the depth test waits until line 12, and all covered
        // samples are tracked and numbered.
        let s = if self.compact { passed } else { fragment.coverage };
        // The figure tracks what is left of S; see `Tracked` for the alternative.
        let tracked = match self.track {
            Tracked::Survivors => s,
            Tracked::Covered => fragment.coverage,
        };
        if tracked.is_empty() {
            return SampleMask::NONE;
        }

        // 4–8: a new surface where one is needed, and the first sample's number.
        let (mut n, starts) = p.surface.enter(self.surfaces, tracked, fragment);
        if starts {
            probe.surface(p.surface.surface_id);
            p.kept = R::Kept::default();
        }

        // 9: in the order of the depths that are stored, not of the fragment's own.
        let mut order: SampleList<N> = in_sample_order(s);
        if self.sort {
            sort_by_stored_depth(&mut order, &samples.depth);
            probe.sorted(&order);
        }

        // 10–17.
        let mut written = SampleMask::NONE;
        let key =
            ReferenceKey { pixel: p.pixel_id, surface: p.surface.surface_id, seed: round.seed };
        let key = if self.prehash { key.prehashed() } else { key };
        let count = s.count();
        let mut of = SampleOf { site, key: &key, round, opacity, place: 0, count };
        for sample in order {
            let index = usize::from(sample);
            let (reference, hashes) = self.references.value::<N>(&mut p.kept, n, &of);
            probe.hashed(hashes);
            probe.reference(sample, n, reference, opacity);
            if opacity.passes(reference) && passed.contains(index) {
                written.insert(index);
            }
            n += 1;
            of.place += 1;
        }

        // 18: all that were numbered, written or not.
        p.surface.hold(tracked, count);
        let tracking = self.state_bits();
        probe.state(tracking, tracking);
        written
    }

    fn fields(&self, p: &Self::State) -> Vec<(&'static str, String)> {
        p.surface.fields()
    }
}

impl<R, const N: usize> OnDevice<TrackedState<R::Kept>> for TrackedSampler<R, N>
where
    R: References + OnDevice<R::Kept>,
{
    fn declare(&self, to: &mut Declaration) {
        let by_source = matches!(self.surfaces, SurfaceRule::Primitive | SurfaceRule::Object);
        to.field("COVERED", (N as u32).div_ceil(32));
        to.field("SURFACE", 1);
        to.field("NUMBERED", 1);
        // Whether there is one, behind it.
        to.field("LAST", if by_source { 2 } else { 0 });
        // Each sample finds its place among all.
        to.iterations(N as u32 * (N as u32 + 1));
        self.references.declare(to);
    }

    fn read(&self, site: Site, from: &PixelWords<'_>) -> TrackedState<R::Kept> {
        let last: Vec<u32> = from.field("LAST").collect();
        let surface = SurfaceTracker {
            covered: CoveredMask::new([from.mask("COVERED")]),
            surface_id: from.word("SURFACE"),
            numbered: from.word("NUMBERED"),
            last: (last.get(1) == Some(&1)).then(|| last[0]),
        };
        let pixel_id = self.pixel_order.index(site, self.grid);
        TrackedState { surface, pixel_id, kept: self.references.read(site, from) }
    }
}

impl OnDevice<()> for Hashed {
    fn declare(&self, to: &mut Declaration) {
        to.iterations(self.0.iterations() * to.samples());
    }
    fn read(&self, _: Site, _: &PixelWords<'_>) {}
}
