//! Multi-layer alpha blending (Salvi, Vaidyanathan, I3D 2014): layers in the order
//! of their depths; where there is one too many, the last two are merged.

use fearless_simd::{Level, Simd, mask32x16};
use screendoor_rop::fast::{Count, Width};
use screendoor_rop::in_lanes::{self, Told};
use screendoor_rop::layers::{COVERAGE, LAYERS, Layer, Layering};
use screendoor_rop::shader;
use screendoor_rop::{
    Blueprint, Bounded, BoundedInLanes, EvictedLanes, Eviction, Family, Frame, Info, OpaquePromise,
    OrderPromise, OverOpaque, Port, Probe, Promises, TiledDesign, colour, over_opaque,
};
use screendoor_trace::error::Result;
use screendoor_trace::param::Values;

/// The design's entry in the registry.
pub struct Mlab;

impl Blueprint for Mlab {
    const INFO: Info = Info {
        name: "mlab",
        family: Family::Layered,
        summary: "layers sorted as they come; of one too many the last two are merged",
        citation: "Salvi, Vaidyanathan: Multi-Layer Alpha Blending, I3D 2014",
        params: &[over_opaque::PARAM.param, LAYERS.param, COVERAGE.param, colour::PARAM.param],
        combinations: &[],
    };

    const MULTIPLICATIONS: bool = true;

    type At<const N: usize> = OverOpaque<Bounded<Merged, N>, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        Ok(Bounded::over_opaque(values, frame))
    }

    fn fast<const N: usize>(
        values: &Values,
        frame: &Frame,
        level: Level,
    ) -> Result<Option<Box<dyn TiledDesign>>>
    where
        Count<N>: Width,
    {
        Ok(in_lanes::engine(Self::at::<N>(values, frame)?, level))
    }

    const PORTED: bool = true;

    fn port<const N: usize>(values: &Values, frame: &Frame) -> Result<Option<Port>> {
        let plain = Self::at::<N>(values, frame)?;
        Ok(Some(Port::of(shader!("mlab"), &Self::INFO, values, frame, plain)))
    }

    fn promises(values: &Values) -> Promises {
        Promises {
            // What comes between two that are already merged cannot part them.
            order: OrderPromise::Dependent,
            exact_opaque: over_opaque::exactness(values, OpaquePromise::WholePixels),
            seeded: false,
            ..Promises::NONE
        }
    }
}

/// The last two of one layer too many become one.
#[derive(Clone, Copy, Debug)]
pub struct Merged;

impl Eviction for Merged {
    fn evict<P: Probe, const N: usize>(
        layering: &Layering<N>,
        layers: &mut [Layer],
        new: &Layer,
        evicted: Layer,
        probe: &mut P,
    ) -> bool {
        if let Some(last) = layers.last_mut() {
            *last = layering.columns.stored(last.merged(&evicted));
            probe.multiplied(Layer::MERGED);
            // Where all moved, the last was read and is written anyway.
            if evicted == *new {
                probe.state(layering.bits - 32, layering.bits);
            }
        }
        true
    }

    #[inline(always)]
    fn evict_lanes<S: Simd, P: Probe>(
        design: &BoundedInLanes<Self>,
        simd: S,
        lanes: EvictedLanes<'_, S>,
        told: &mut Told<S, P>,
    ) -> mask32x16<S> {
        let of = lanes.of;
        lanes.merge(design, simd, told);
        of
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::configure;
    use screendoor_rop::{Frame, Site, draw_pixel};
    use screendoor_trace::tile::TileGrid;
    use screendoor_trace::trace::{DepthPlane, Fragment, SampleMask, Unorm32};

    #[test]
    fn a_merge_by_hand() {
        let frame = Frame {
            grid: TileGrid::new(1, 1),
            positions: [[0, 0]].into(),
            background: [1.0; 3],
            space: Default::default(),
            seed: 0,
            colour_bits: 48,
            view: None,
            opaque: true,
            primitive_depths: None,
            columns: Default::default(),
        };
        let fragment = |z: u32, colour: f32, alpha: f32| Fragment {
            x: 0,
            y: 0,
            coverage: SampleMask::first(1),
            depth: DepthPlane { z: Unorm32(z), dzdx: 0, dzdy: 0 },
            colour: [colour; 3],
            alpha,
            primitive: z,
            object: 0,
            ..Fragment::default()
        };
        let design = configure("mlab:layers=2", &[]).unwrap();
        let design = Mlab::at::<1>(design.values(), &frame).unwrap();
        let site = Site { x: 0, y: 0 };
        let resolve = |fragments: &[Fragment]| {
            use screendoor_rop::Design;
            Design::resolve(&design, site, &draw_pixel(&design, site, fragments))[0]
        };
        let (a, b, c) = (fragment(1, 1.0, 0.5), fragment(2, 0.0, 0.5), fragment(3, 1.0, 0.25));
        // 0.5 + 0.5·(0 + 0.5·(0.25 + 0.75·1)) = 0.75, exactly, while the last two that are
        // merged are neighbours.
        assert_eq!(resolve(&[a, b, c]), 0.75);
        assert_eq!(resolve(&[c, b, a]), 0.75);
        // The first and the third merge at the first's depth, 0.5 + 0.5·0.25 over
        // 0.375, and the second comes to lie behind both, where it merges with them:
        // 0.625 + 0.375·(0 + 0.5·1).
        let d = fragment(0, 0.0, 0.0);
        assert_eq!(resolve(&[d, a, c, b]), 0.8125);
    }
}
