//! The k-buffer (Bavoil, Callahan, Lefohn, Comba, Silva, I3D 2007): the nearest
//! layers are kept in the order of their depths, what lies behind them is dropped.

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
pub struct KBuffer;

impl Blueprint for KBuffer {
    const INFO: Info = Info {
        name: "kbuffer",
        family: Family::Layered,
        summary: "the nearest layers, sorted; what lies behind them is dropped",
        citation: "Bavoil, Callahan, Lefohn, Comba, Silva: Multi-Fragment Effects on the GPU using the k-Buffer, I3D 2007",
        params: &[over_opaque::PARAM.param, LAYERS.param, COVERAGE.param, colour::PARAM.param],
        combinations: &[],
    };

    const MULTIPLICATIONS: bool = true;

    type At<const N: usize> = OverOpaque<Bounded<Dropped, N>, N>;

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
        Ok(Some(Port::of(shader!("kbuffer"), &Self::INFO, values, frame, plain)))
    }

    fn promises(values: &Values) -> Promises {
        Promises {
            order: OrderPromise::Independent,
            exact_opaque: over_opaque::exactness(values, OpaquePromise::WholePixels),
            seeded: false,
            // What is dropped is missing; and layers that cross within a pixel are
            // ordered as at its centre.
            ..Promises::NONE
        }
    }
}

/// The furthest of one layer too many is dropped.
#[derive(Clone, Copy, Debug)]
pub struct Dropped;

impl Eviction for Dropped {
    fn evict<P: Probe, const N: usize>(
        _layering: &Layering<N>,
        _layers: &mut [Layer],
        new: &Layer,
        evicted: Layer,
        _probe: &mut P,
    ) -> bool {
        evicted != *new
    }
    #[inline(always)]
    fn evict_lanes<S: Simd, P: Probe>(
        _design: &BoundedInLanes<Self>,
        _simd: S,
        lanes: EvictedLanes<'_, S>,
        _told: &mut Told<S, P>,
    ) -> mask32x16<S> {
        !lanes.same()
    }
}
