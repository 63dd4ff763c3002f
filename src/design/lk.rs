//! Stratified sampling for stochastic transparency (Laine and Karras, EGSR 2011):
//! the plain reference, line by line after the paper's figures 4 and 7.
//!
//! This file is the only normative text of the algorithm; anything faster must
//! give the same bits.

use crate::error::Result;
use crate::param::{Param, Values};
use crate::resolve::box_filter;
use crate::rop::{
    Blueprint, Contents, Design, Family, Frame, Info, OpaquePromise, OrderPromise, PixelIndex,
    PixelOrder, Probe, Promises, Reference, ReferenceKey, SampleList, Samples, Site, StateBits,
    SurfaceRule, SurfaceTracker, Threshold, Tracked, depth_bits, in_sample_order,
    sort_by_stored_depth,
};
use crate::trace::{Fragment, SampleMask, Unorm32};

/// The design's entry in the registry.
pub struct LaineKarras;

impl Blueprint for LaineKarras {
    const INFO: Info = Info {
        name: "lk",
        family: Family::Stochastic,
        summary: "surface tracking, samples sorted by stored depth, hashed reference values",
        citation: "Laine, Karras: Stratified Sampling for Stochastic Transparency, EGSR 2011",
        params: &[
            Param::flag(
                "sort",
                true,
                "number samples in the order of their stored depths (LK section 4)",
            ),
            Param::flag(
                "compact",
                true,
                "test depth before numbering samples (LK figure 5b); off: when writing",
            ),
            Param::choice::<SurfaceRule>(
                "surfaces",
                "bitmask",
                "when a fragment starts a new surface",
            ),
            Param::choice::<Tracked>(
                "track",
                "survivors",
                "which samples the surface tracking sees",
            ),
            Param::choice::<PixelOrder>(
                "pixel-order",
                "hilbert",
                "the curve that numbers the pixels",
            ),
            Param::choice::<Reference>("reference", "lk2011", "how reference values are made"),
            depth_bits::PARAM,
        ],
        combinations: &[],
    };

    type At<const N: usize> = LaineKarrasAt<N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<LaineKarrasAt<N>> {
        let compact = values.flag("compact");
        Ok(LaineKarrasAt {
            frame: frame.clone(),
            sort: values.flag("sort"),
            compact,
            surfaces: values.choice("surfaces"),
            // Without compaction all covered samples are tracked and numbered either
            // way, so no counter is needed.
            track: if compact { values.choice("track") } else { Tracked::Survivors },
            pixel_order: values.choice("pixel-order"),
            reference: values.choice("reference"),
            depth_bits: depth_bits::of(values),
        })
    }

    fn promises(values: &Values) -> Promises {
        let reference: Reference = values.choice("reference");
        // Without scrambling, a pixel's surfaces share their reference values.
        let scrambled = matches!(reference, Reference::Lk2011 | Reference::White);
        // The publication takes its tracking to be unbiased; it is not quite. Whether
        // a fragment that survives in part continues the current surface depends on
        // which of that surface's samples it wrote: where they passed, they hide the
        // conflict, the surface goes on, and the samples still to come are given the
        // complementary reference values, which rather fail; where they did not pass,
        // a new surface starts afresh. Any of these breaks the link. (With surfaces
        // = primitive it takes a primitive whose pieces in a pixel come with others
        // between them, which a trace may hold although no rasteriser makes it.)
        let rule: SurfaceRule = values.choice("surfaces");
        let apart = depth_bits::tells_apart(values);
        let chance_decides_surfaces = reference != Reference::White
            && rule != SurfaceRule::EveryFragment
            && values.choice::<Tracked>("track") == Tracked::Survivors
            && values.flag("compact");
        Promises {
            unbiased: apart && scrambled && !chance_decides_surfaces,
            // Unscrambled values still share out each stored surface evenly, as long as
            // its samples are numbered in a row.
            consistent: apart && (scrambled || (values.flag("compact") && values.flag("sort"))),
            order: OrderPromise::Dependent,
            exact_opaque: OpaquePromise::Always,
            seeded: true,
        }
    }
}

/// The design for pixels of `N` samples.
#[derive(Clone, Debug)]
pub struct LaineKarrasAt<const N: usize> {
    frame: Frame,
    sort: bool,
    compact: bool,
    surfaces: SurfaceRule,
    track: Tracked,
    pixel_order: PixelOrder,
    reference: Reference,
    depth_bits: u32,
}

/// A pixel: `p` of figure 7.
#[derive(Clone, Debug)]
pub struct LaineKarrasPixel<const N: usize> {
    samples: Samples<N>,
    surface: SurfaceTracker,
    /// `p.pixelId`: follows from where the pixel lies, so it is no state.
    pixel_id: PixelIndex,
}

impl<const N: usize> Design for LaineKarrasAt<N> {
    type Pixel = LaineKarrasPixel<N>;

    fn state_bits(&self) -> StateBits {
        StateBits {
            samples: N as u32 * (self.depth_bits + self.frame.colour_bits),
            extra: SurfaceTracker::state_bits(self.surfaces, self.track, N as u32),
            unbounded: false,
        }
    }

    fn clear(&self, site: Site) -> Self::Pixel {
        let (width, height) = (self.frame.grid.width(), self.frame.grid.height());
        LaineKarrasPixel {
            samples: Samples::cleared(self.frame.background),
            surface: SurfaceTracker::default(),
            pixel_id: self.pixel_order.index(site.x, site.y, width, height),
        }
    }

    /// `DrawFragment` of figure 7; numbers are the figure's lines.
    fn draw<P: Probe>(
        &self,
        _pass: u32,
        _site: Site,
        p: &mut Self::Pixel,
        fragment: &Fragment,
        probe: &mut P,
    ) {
        // Depth and opacity are compared as integers, not as the figure's reals.
        let z: [Unorm32; N] = self.frame.depths(fragment, self.depth_bits);
        let opacity = Threshold::of(fragment.alpha);

        // 1–3: drop the samples that fail the depth test. With `compact` off that
        // waits until line 12, and all covered samples are tracked and numbered.
        let passed = p.samples.depth_test(fragment.coverage, &z);
        probe.depth_test(fragment.coverage, passed);
        probe.state(self.depth_bits * fragment.coverage.count(), 0);
        let s = if self.compact { passed } else { fragment.coverage };
        // The figure tracks what is left of S; see `Tracked` for the alternative.
        let tracked = match self.track {
            Tracked::Survivors => s,
            Tracked::Covered => fragment.coverage,
        };
        if tracked.is_empty() {
            return;
        }

        // 4–8: a new surface where one is needed, and the first sample's number.
        let (mut n, starts) = p.surface.enter(self.surfaces, tracked, fragment);
        if starts {
            probe.surface(p.surface.surface_id);
        }

        // 9: in the order of the depths that are stored, not of the fragment's own.
        let mut order: SampleList<N> = in_sample_order(s);
        if self.sort {
            sort_by_stored_depth(&mut order, &p.samples.depth);
            probe.sorted(&order);
        }

        // 10–17.
        let mut written = SampleMask::NONE;
        let key = ReferenceKey {
            pixel: p.pixel_id,
            surface: p.surface.surface_id,
            seed: self.frame.seed,
        };
        probe.hashed(order.len() as u32);
        for sample in order {
            let index = usize::from(sample);
            let reference = self.reference.value(n, N as u32, &key);
            probe.reference(sample, n, reference, opacity);
            if opacity.passes(reference) && passed.contains(index) {
                p.samples.write(index, z[index], fragment.colour);
                written.insert(index);
            }
            n += 1;
        }

        // 18: all that were numbered, written or not.
        p.surface.hold(tracked, s.count());
        probe.written(written);
        let tracking = SurfaceTracker::state_bits(self.surfaces, self.track, N as u32);
        let sample_bits = self.depth_bits + self.frame.colour_bits;
        probe.state(tracking, tracking + sample_bits * written.count());
    }

    fn resolve(&self, _site: Site, p: &Self::Pixel) -> [f64; 3] {
        box_filter(&p.samples.colour)
    }

    fn contents(&self, p: &Self::Pixel) -> Contents {
        let held: Vec<String> = p.surface.held().iter().map(|s| s.to_string()).collect();
        Contents {
            samples: p.samples.contents(),
            fields: vec![
                ("surface", p.surface.surface_id.to_string()),
                ("covered", if held.is_empty() { "none".into() } else { held.join(" ") }),
            ],
        }
    }
}
