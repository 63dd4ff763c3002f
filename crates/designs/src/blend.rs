//! Alpha blending in the order in which fragments arrive: what hardware does by
//! itself, at the least cost, and wrong wherever something nearer came first.

use screendoor_rop::over_opaque;
use screendoor_rop::{
    BlendBuffer, Blueprint, ColourStore, Contents, Family, Frame, Info, Layout, Opaque,
    OpaquePromise, OrderPromise, OverOpaque, Probe, Promises, Site, Transparent, colour,
};
use screendoor_trace::error::Result;
use screendoor_trace::param::Values;
use screendoor_trace::trace::Fragment;

/// The design's entry in the registry.
pub struct Blend;

impl Blueprint for Blend {
    const INFO: Info = Info {
        name: "blend",
        family: Family::Blended,
        summary: "alpha blending in API order, sample by sample: the baseline of cost",
        citation: "Porter, Duff: Compositing Digital Images, SIGGRAPH 1984, operator over",
        params: &[over_opaque::PARAM.param, colour::PARAM.param],
        combinations: &[],
    };

    const MULTIPLICATIONS: bool = true;

    type At<const N: usize> = OverOpaque<BlendAt<N>, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        let opaque = over_opaque::on(values, frame);
        Ok(OverOpaque::new(
            values,
            frame,
            opaque,
            BlendAt { opaque, store: ColourStore::of(values, frame) },
        ))
    }

    fn promises(values: &Values) -> Promises {
        Promises {
            order: OrderPromise::Dependent,
            exact_opaque: over_opaque::exactness(values, OpaquePromise::Never),
            seeded: false,
            ..Promises::NONE
        }
    }
}

/// The blending, for pixels of `N` samples.
#[derive(Clone, Debug)]
pub struct BlendAt<const N: usize> {
    opaque: Opaque,
    store: ColourStore,
}

impl<const N: usize> Transparent<N> for BlendAt<N> {
    type Pixel = BlendBuffer<N>;

    fn layout(&self) -> Layout {
        BlendBuffer::<N>::layout(self.opaque, self.store)
    }

    fn clear(&self, _site: Site) -> BlendBuffer<N> {
        BlendBuffer::default()
    }

    fn over(&self, buffer: &mut BlendBuffer<N>, behind: &[[f32; 3]; N]) {
        buffer.colour = *behind;
    }

    fn draw<P: Probe>(
        &self,
        _pass: u32,
        _site: Site,
        buffer: &mut BlendBuffer<N>,
        fragment: &Fragment,
        probe: &mut P,
    ) {
        buffer.blend(fragment.coverage, fragment.colour, fragment.alpha, self.store);
        BlendBuffer::<N>::tell(fragment.coverage, self.store, probe);
    }

    fn resolve(&self, _site: Site, buffer: &BlendBuffer<N>, _: &[[f32; 3]; N]) -> [f64; 3] {
        buffer.resolve()
    }

    fn contents(&self, buffer: &BlendBuffer<N>) -> Contents {
        buffer.contents()
    }
}
