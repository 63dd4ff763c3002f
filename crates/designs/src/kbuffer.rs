//! The k-buffer (Bavoil, Callahan, Lefohn, Comba, Silva, I3D 2007): the nearest
//! layers are kept in the order of their depths, what lies behind them is dropped.

use screendoor_rop::layers::{COVERAGE, LAYERS, Layer, Layering, contents};
use screendoor_rop::shader;
use screendoor_rop::{
    Blueprint, Contents, Declaration, Family, Frame, Info, Layout, OnDevice, OpaquePromise,
    OrderPromise, OverOpaque, PixelWords, Port, Probe, Promises, Site, Transparent, colour,
    over_opaque,
};
use screendoor_trace::error::Result;
use screendoor_trace::param::Values;
use screendoor_trace::trace::Fragment;

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

    type At<const N: usize> = OverOpaque<KBufferAt<N>, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        let inner = KBufferAt(Layering::of(values, frame));
        Ok(OverOpaque::new(values, frame, over_opaque::of(values), inner))
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

/// The design for pixels of `N` samples.
#[derive(Clone, Debug)]
pub struct KBufferAt<const N: usize>(Layering<N>);

impl<const N: usize> Transparent<N> for KBufferAt<N> {
    /// The layers from near to far.
    type Pixel = Vec<Layer>;

    fn layout(&self) -> Layout {
        self.0.layout()
    }

    fn clear(&self, _site: Site) -> Vec<Layer> {
        Vec::new()
    }

    fn draw<P: Probe>(
        &self,
        _pass: u32,
        _site: Site,
        layers: &mut Vec<Layer>,
        fragment: &Fragment,
        probe: &mut P,
    ) {
        let layer = self.0.columns.layer(fragment);
        if self.0.insert(layers, layer, probe) != Some(layer) {
            probe.written(fragment.coverage);
        }
    }

    fn resolve(&self, _site: Site, layers: &Vec<Layer>, behind: &[[f32; 3]; N]) -> [f64; 3] {
        self.0.resolve(layers, behind)
    }

    fn contents(&self, layers: &Vec<Layer>) -> Contents {
        contents(layers)
    }
}

impl<const N: usize> OnDevice<Vec<Layer>> for KBufferAt<N> {
    fn declare(&self, to: &mut Declaration) {
        self.0.declare(to);
    }

    fn read(&self, site: Site, from: &PixelWords<'_>) -> Vec<Layer> {
        self.0.read(site, from)
    }
}
