//! Alpha blending with primitives sorted far to near, as applications do it: each
//! primitive has one depth for the whole frame. Exact until primitives cross or
//! overlap in a circle.
//!
//! The sort is the application's, before it draws: it costs the raster-operations
//! unit nothing, and the modelled state and traffic are those of `blend`. To find
//! the depths takes one more pass over the trace here, which is none of the design's;
//! and since a trace stands in another order than the sorted one, each pixel's
//! fragments are kept until they can be sorted, which is none of its state.

use std::cmp::Reverse;
use std::sync::Arc;

use screendoor_rop::{
    BlendBuffer, Blueprint, ColourStore, Contents, Family, Frame, Info, Layout, NoProbe, Opaque,
    OpaquePromise, OrderPromise, OverOpaque, PrimitiveDepths, Probe, Promises, Site, Transparent,
};
use screendoor_rop::{colour, over_opaque};
use screendoor_trace::error::Result;
use screendoor_trace::param::Values;
use screendoor_trace::trace::{Fragment, SampleMask};

/// The design's entry in the registry.
pub struct SortedBlend;

impl Blueprint for SortedBlend {
    const INFO: Info = Info {
        name: "sorted-blend",
        family: Family::Blended,
        summary: "alpha blending of primitives sorted far to near by the application, each by its mean depth",
        citation: "Newell, Newell, Sancha: A Solution to the Hidden Surface Problem, ACM 1972, without its splitting",
        params: &[over_opaque::PARAM.param, colour::PARAM.param],
        combinations: &[],
    };

    const PRIMITIVE_DEPTHS: bool = true;

    type At<const N: usize> = OverOpaque<SortedBlendAt<N>, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        let opaque = over_opaque::on(values, frame);
        let depths = frame.primitive_depths.clone().unwrap_or_default();
        let inner = SortedBlendAt { opaque, store: ColourStore::of(values, frame), depths };
        Ok(OverOpaque::new(values, frame, opaque, inner))
    }

    fn promises(values: &Values) -> Promises {
        Promises {
            // Primitives of equal mean depth, and a primitive's own fragments in a
            // pixel, are blended as they come.
            order: OrderPromise::Dependent,
            exact_opaque: over_opaque::exactness(values, OpaquePromise::Never),
            seeded: false,
            ..Promises::NONE
        }
    }
}

/// The blending, for pixels of `N` samples.
#[derive(Clone, Debug)]
pub struct SortedBlendAt<const N: usize> {
    opaque: Opaque,
    store: ColourStore,
    depths: Arc<PrimitiveDepths>,
}

/// A fragment that waits to be sorted.
#[derive(Clone, Copy, Debug)]
pub struct Waiting {
    key: u64,
    coverage: SampleMask,
    colour: [f32; 3],
    alpha: f32,
}

impl<const N: usize> SortedBlendAt<N> {
    /// The fragments blended as they stand, over what lies behind them.
    fn blended(&self, fragments: &[Waiting], behind: &[[f32; 3]; N]) -> BlendBuffer<N> {
        let mut buffer = BlendBuffer { colour: *behind };
        for f in fragments {
            buffer.blend(f.coverage, f.colour, f.alpha, self.store);
        }
        buffer
    }
}

impl<const N: usize> Transparent<N> for SortedBlendAt<N> {
    /// In API order until the pass ends, then far to near.
    type Pixel = Vec<Waiting>;

    fn layout(&self) -> Layout {
        BlendBuffer::<N>::layout(self.opaque, self.store)
    }

    fn clear(&self, _site: Site) -> Vec<Waiting> {
        Vec::new()
    }

    fn draw<P: Probe>(
        &self,
        _pass: u32,
        _site: Site,
        waiting: &mut Vec<Waiting>,
        fragment: &Fragment,
        probe: &mut P,
    ) {
        let Fragment { coverage, colour, alpha, primitive, .. } = *fragment;
        waiting.push(Waiting { key: self.depths.mean(primitive), coverage, colour, alpha });
        BlendBuffer::<N>::tell(coverage, self.store, probe);
    }

    /// A stable sort: what is equally deep is drawn in API order.
    fn end_pass<P: Probe>(
        &self,
        _pass: u32,
        _site: Site,
        waiting: &mut Vec<Waiting>,
        _probe: &mut P,
    ) {
        // The application sorts, before anything reaches the hardware.
        waiting.sort_by_key(|f| Reverse(f.key));
    }

    fn resolve(&self, _site: Site, sorted: &Vec<Waiting>, behind: &[[f32; 3]; N]) -> [f64; 3] {
        self.blended(sorted, behind).resolve()
    }

    fn contents(&self, waiting: &Vec<Waiting>) -> Contents {
        let mut so_far = waiting.clone();
        self.end_pass(0, Site { x: 0, y: 0 }, &mut so_far, &mut NoProbe);
        // Over black: what lies behind is shown apart.
        self.blended(&so_far, &[[0.0; 3]; N]).contents()
    }

    fn bytes_per_fragment(&self) -> Option<usize> {
        // A growing list can be half empty.
        Some(2 * size_of::<Waiting>())
    }
}
