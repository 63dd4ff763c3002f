//! A bounded A-buffer (Carpenter, SIGGRAPH 1984, in the fixed size that hardware
//! gives it): a pixel's fragments as they come, sorted when it is resolved. What
//! becomes of fragments that find the list full is a parameter.

use screendoor_rop::layers::{COVERAGE, DEPTH_BITS, LAYERS, Layer, Layering, composite, contents};
use screendoor_rop::{
    Blueprint, Contents, Family, Frame, Info, Layout, OpaquePromise, OrderPromise, OverOpaque,
    Probe, Promises, Site, Transparent, colour, network_comparators, over_opaque,
};
use screendoor_trace::error::Result;
use screendoor_trace::param::{Typed, Values};
use screendoor_trace::trace::{Fragment, Unorm32};

screendoor_trace::options! {
    /// What becomes of a fragment that finds the list full.
    pub enum Overflow {
        Newest = "newest": "it is dropped",
        Furthest = "furthest": "the furthest is dropped: the picture of a k-buffer",
        Blend = "blend": "it is blended behind the list, in the order in which such fragments come",
    }
}

/// The design's entry in the registry.
pub struct ABuffer;

const OVERFLOW: Typed<Overflow> = Typed::choice("overflow", "newest", "what a full list does");

impl Blueprint for ABuffer {
    const INFO: Info = Info {
        name: "abuffer",
        family: Family::Layered,
        summary: "a bounded list of fragments as they come, sorted at the end",
        citation: "Carpenter: The A-buffer, an Antialiased Hidden Surface Method, SIGGRAPH 1984",
        params: &[
            over_opaque::PARAM.param,
            LAYERS.param,
            OVERFLOW.param,
            COVERAGE.param,
            colour::PARAM.param,
        ],
        combinations: &["overflow=blend,coverage=share"],
    };

    type At<const N: usize> = OverOpaque<ABufferAt<N>, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        let layering = Layering::of(values, frame);
        let inner = ABufferAt { overflow: values.get(OVERFLOW), layering };
        Ok(OverOpaque::new(values, frame, over_opaque::of(values), inner))
    }

    fn promises(values: &Values) -> Promises {
        Promises {
            order: match values.get(OVERFLOW) {
                Overflow::Furthest => OrderPromise::Independent,
                Overflow::Newest | Overflow::Blend => OrderPromise::Dependent,
            },
            exact_opaque: over_opaque::exactness(values, OpaquePromise::Never),
            seeded: false,
            ..Promises::NONE
        }
    }
}

/// The design for pixels of `N` samples.
#[derive(Clone, Debug)]
pub struct ABufferAt<const N: usize> {
    overflow: Overflow,
    layering: Layering<N>,
}

/// A pixel.
#[derive(Clone, Debug, Default)]
pub struct ABufferPixel {
    /// In API order until the pass ends, then from near to far.
    layers: Vec<Layer>,
    /// What is blended behind them: a colour and a transmittance in each column, once
    /// there is any.
    blended: Vec<([f32; 3], f32)>,
}

impl<const N: usize> ABufferAt<N> {
    /// Draws a layer over what is blended.
    fn blend<P: Probe>(&self, pixel: &mut ABufferPixel, layer: &Layer, probe: &mut P) {
        let store = self.layering.columns.store;
        pixel.blended.resize(self.layering.columns.count(), ([0.0; 3], 1.0));
        for column in layer.coverage.iter() {
            let (colour, transmittance) = &mut pixel.blended[column];
            for (c, l) in colour.iter_mut().zip(layer.colour) {
                *c = store.channel(l + *c * layer.transmittance);
            }
            *transmittance = store.channel(*transmittance * layer.transmittance);
        }
        let bits = store.texel_bits() * layer.coverage.count();
        probe.state(bits, bits);
    }
}

impl<const N: usize> Transparent<N> for ABufferAt<N> {
    type Pixel = ABufferPixel;

    fn layout(&self) -> Layout {
        // How many fragments the list holds.
        let count = (self.layering.room as u32).ilog2() + 1;
        let columns = &self.layering.columns;
        let store = columns.store;
        let blended = match self.overflow {
            Overflow::Blend => columns.count() as u32,
            Overflow::Newest | Overflow::Furthest => 0,
        };
        let texel = [(store.colour_bits(), "blended colour"), (store.channel_bits(), "alpha")];
        self.layering.layout().and(1, &[(count, "count")]).and(blended, &texel)
    }

    fn clear(&self, _site: Site) -> ABufferPixel {
        ABufferPixel::default()
    }

    fn draw<P: Probe>(
        &self,
        _pass: u32,
        _site: Site,
        pixel: &mut ABufferPixel,
        fragment: &Fragment,
        probe: &mut P,
    ) {
        let layer = self.layering.columns.layer(fragment);
        if pixel.layers.len() < self.layering.room {
            pixel.layers.push(layer);
            probe.state(0, self.layering.bits);
            return probe.written(fragment.coverage);
        }
        match self.overflow {
            Overflow::Newest => {}
            Overflow::Furthest => {
                // The first of the furthest: of equal depths the later lies in front.
                let held = pixel.layers.iter().enumerate().rev();
                let furthest = held.max_by_key(|(_, l)| l.depth).map(|(i, l)| (i, l.depth));
                // The greatest of all, and the new one against that.
                probe.compared(pixel.layers.len() as u32);
                probe.state(DEPTH_BITS * pixel.layers.len() as u32, 0);
                if let Some((i, _)) = furthest.filter(|(_, depth)| layer.depth <= *depth) {
                    // Later layers stay behind earlier ones in the list.
                    pixel.layers.remove(i);
                    pixel.layers.push(layer);
                    probe.state(0, self.layering.bits);
                    probe.written(fragment.coverage);
                }
            }
            Overflow::Blend => {
                self.blend(pixel, &layer, probe);
                probe.written(fragment.coverage);
            }
        }
    }

    /// Sorts the layers; of equal depths the later lies in front.
    fn end_pass<P: Probe>(&self, _pass: u32, _site: Site, pixel: &mut ABufferPixel, probe: &mut P) {
        probe.compared(network_comparators(pixel.layers.len()) as u32);
        pixel.layers.reverse();
        pixel.layers.sort_by_key(|l| l.depth);
    }

    fn resolve(&self, _site: Site, pixel: &ABufferPixel, behind: &[[f32; 3]; N]) -> [f64; 3] {
        self.layering.columns.over(behind, |column| {
            let (mut colour, transmittance) = composite(&pixel.layers, column);
            let Some((blended, passes)) = pixel.blended.get(column) else {
                return (colour, transmittance);
            };
            for (c, b) in colour.iter_mut().zip(blended) {
                *c += transmittance * f64::from(*b);
            }
            (colour, transmittance * f64::from(*passes))
        })
    }

    /// What was blended for want of room lies behind the list, as it does in the picture.
    fn visibility(&self, pixel: &ABufferPixel, at: &[Unorm32; N]) -> Option<[f64; N]> {
        Some(self.layering.columns.passing_nearer(&pixel.layers, at, |nearer, column| {
            let listed = composite(nearer, column).1;
            let blended = pixel.blended.get(column).filter(|_| nearer.len() == pixel.layers.len());
            blended.map_or(listed, |(_, passes)| listed * f64::from(*passes))
        }))
    }

    fn contents(&self, pixel: &ABufferPixel) -> Contents {
        let mut contents = contents(&pixel.layers);
        if !pixel.blended.is_empty() {
            let mean = pixel.blended.iter().map(|(_, t)| t).sum::<f32>();
            let mean = mean / pixel.blended.len() as f32;
            contents.fields.push(("blended behind", format!("t {mean:.3} on average")));
        }
        contents
    }
}
