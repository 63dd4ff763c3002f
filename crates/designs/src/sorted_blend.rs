//! Alpha blending with primitives sorted far to near, as applications do it: each
//! primitive has one depth for the whole frame. Exact until primitives cross or
//! overlap in a circle.
//!
//! The sort is the application's, before it draws: it costs the raster-operations
//! unit nothing, and the modelled state and traffic are those of `blend`. To find
//! the depths takes one more pass over the trace here, which is none of the design's;
//! and since a trace stands in another order than the sorted one, each pixel's
//! fragments are kept until they can be sorted, which is none of its state.
//!
//! With `stop` it ends where little light is left, as the reference rasteriser of Gaussian
//! splats does (Kerbl et al. 2023, `forward.cu`: 1e-4): front to back, the first fragment that
//! would leave less than that is not drawn, nor is what lies behind it, per sample here as a
//! pixel has one there. Splats have an alpha of 0.99 at most; of an alpha of 1, which leaves
//! nothing, is drawn what it covers.

use std::cmp::Reverse;
use std::sync::Arc;

use screendoor_rop::{
    BlendBuffer, Blueprint, ColourStore, Contents, Family, Frame, Info, Layout, NoProbe, Opaque,
    OpaquePromise, OrderPromise, OverOpaque, PrimitiveDepths, Probe, Promises, Site, Transparent,
};
use screendoor_rop::{colour, over_opaque};
use screendoor_trace::error::Result;
use screendoor_trace::param::{Typed, Values};
use screendoor_trace::trace::{Fragment, SampleMask};

/// The design's entry in the registry.
pub struct SortedBlend;

const STOP: Typed<f64> = Typed::real(
    "stop",
    "0",
    (0.0, 0.5),
    "what would leave less light than this is not drawn, nor what lies behind; 1e-4 for splats",
);

impl Blueprint for SortedBlend {
    const INFO: Info = Info {
        name: "sorted-blend",
        family: Family::Blended,
        summary: "alpha blending of primitives sorted far to near by the application, each by its mean depth",
        citation: "Newell, Newell, Sancha: A Solution to the Hidden Surface Problem, ACM 1972, without its splitting",
        params: &[STOP.param, over_opaque::PARAM.param, colour::PARAM.param],
        combinations: &[],
    };

    const PRIMITIVE_DEPTHS: bool = true;

    const MULTIPLICATIONS: bool = true;

    type At<const N: usize> = OverOpaque<SortedBlendAt<N>, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        let opaque = over_opaque::on(values, frame);
        let depths = frame.primitive_depths.clone().unwrap_or_default();
        let stop = values.get(STOP) as f32;
        let inner = SortedBlendAt { opaque, store: ColourStore::of(values, frame), depths, stop };
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
    stop: f32,
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
        let seen = self.seen(fragments);
        for (i, f) in fragments.iter().enumerate() {
            let coverage = seen.get(i).map_or(f.coverage, |seen| *seen);
            buffer.blend(coverage, f.colour, f.alpha, self.store);
        }
        buffer
    }

    /// The samples at which each fragment of a list from far to near is drawn; nothing where
    /// that is all that it covers.
    fn seen(&self, fragments: &[Waiting]) -> Vec<SampleMask> {
        if self.stop == 0.0 {
            return Vec::new();
        }
        let (mut left, mut closed) = ([1.0_f32; N], SampleMask::NONE);
        let mut seen = vec![SampleMask::NONE; fragments.len()];
        for (f, seen) in fragments.iter().zip(&mut seen).rev() {
            for sample in f.coverage.iter() {
                if closed.contains(sample) {
                    continue;
                }
                let after = left[sample] * (1.0 - f.alpha);
                let ends = after < self.stop;
                if !ends || f.alpha >= 1.0 {
                    seen.insert(sample);
                    left[sample] = after;
                }
                if ends {
                    closed.insert(sample);
                }
            }
        }
        seen
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
        if self.stop > 0.0 {
            // How much light is left at each sample.
            probe.multiplied(coverage.count());
        }
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
