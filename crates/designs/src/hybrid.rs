//! Hybrid transparency (Maule, Comba, Torchelsen, Bastos, I3D 2013): the nearest
//! layers are the core, composited in order; all others are the tail, of which a
//! weighted average is kept (Bavoil, Myers 2008).

use screendoor_rop::layers::{COVERAGE, Columns, LAYERS, Layer, Layering, composite, contents};
use screendoor_rop::{
    Blueprint, ColourStore, Contents, Family, Frame, Info, Layout, OpaquePromise, OrderPromise,
    OverOpaque, Probe, Promises, Site, Transparent, colour, over_opaque,
};
use screendoor_trace::error::Result;
use screendoor_trace::param::Values;
use screendoor_trace::trace::{Fragment, Unorm32};

/// The design's entry in the registry.
pub struct Hybrid;

impl Blueprint for Hybrid {
    const INFO: Info = Info {
        name: "hybrid",
        family: Family::Layered,
        summary: "the nearest layers, sorted, before the weighted average of all others",
        citation: "Maule, Comba, Torchelsen, Bastos: Hybrid Transparency, I3D 2013",
        params: &[over_opaque::PARAM.param, LAYERS.param, COVERAGE.param, colour::PARAM.param],
        combinations: &[],
    };

    const MULTIPLICATIONS: bool = true;

    type At<const N: usize> = OverOpaque<HybridAt<N>, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        let inner = HybridAt(Layering::of(values, frame));
        Ok(OverOpaque::new(values, frame, over_opaque::of(values), inner))
    }

    fn promises(values: &Values) -> Promises {
        Promises {
            // Which layers end in the core and which in the tail does not depend on the
            // order, but the tail's sums are rounded as they come.
            order: OrderPromise::UpToRounding,
            exact_opaque: over_opaque::exactness(values, OpaquePromise::WholePixels),
            seeded: false,
            ..Promises::NONE
        }
    }
}

/// The design for pixels of `N` samples.
#[derive(Clone, Debug)]
pub struct HybridAt<const N: usize>(Layering<N>);

/// A pixel.
#[derive(Clone, Debug, Default)]
pub struct HybridPixel {
    core: Vec<Layer>,
    tail: Tail,
}

/// Sums over all layers behind the core, each weighted by the share of the columns
/// that it covers.
#[derive(Clone, Copy, Debug, Default)]
struct Tail {
    /// Of colour times alpha.
    colour: [f32; 3],
    /// Of alpha.
    alpha: f32,
    /// Of 1: how many layers a column has on average.
    count: f32,
}

impl Tail {
    /// Three sums of colour, one of alpha, a count: all of them channels.
    fn fields(store: ColourStore) -> [(u32, &'static str); 3] {
        let channel = store.channel_bits();
        [(store.colour_bits(), "tail colour"), (channel, "alpha"), (channel, "count")]
    }

    fn bits(store: ColourStore) -> u32 {
        Self::fields(store).iter().map(|(bits, _)| bits).sum()
    }

    fn add(&mut self, store: ColourStore, layer: &Layer, columns: usize) {
        let share = layer.coverage.count() as f32 / columns as f32;
        for (sum, c) in self.colour.iter_mut().zip(layer.colour) {
            *sum = store.channel(*sum + share * c);
        }
        self.alpha = store.channel(self.alpha + share * (1.0 - layer.transmittance));
        self.count = store.channel(self.count + share);
    }

    /// As `count` layers of the mean colour and the mean alpha: `c (1 − T)` and
    /// `T = (1 − ᾱ)^count`.
    fn over(&self) -> ([f64; 3], f64) {
        if self.alpha == 0.0 {
            return ([0.0; 3], 1.0);
        }
        let [alpha, count] = [self.alpha, self.count].map(f64::from);
        let transmittance = libm::pow((1.0 - alpha / count).max(0.0), count);
        (self.colour.map(|c| f64::from(c) / alpha * (1.0 - transmittance)), transmittance)
    }
}

impl<const N: usize> Transparent<N> for HybridAt<N> {
    type Pixel = HybridPixel;

    fn layout(&self) -> Layout {
        self.0.layout().and(1, &Tail::fields(self.0.columns.store))
    }

    fn clear(&self, _site: Site) -> HybridPixel {
        HybridPixel::default()
    }

    fn draw<P: Probe>(
        &self,
        _pass: u32,
        _site: Site,
        pixel: &mut HybridPixel,
        fragment: &Fragment,
        probe: &mut P,
    ) {
        let layer = self.0.columns.layer(fragment);
        // What does not fit is added by the share of the samples that it covers.
        probe.multiplied(Columns::<N>::LAYERED);
        if let Some(furthest) = self.0.insert(&mut pixel.core, layer, probe) {
            let store = self.0.columns.store;
            pixel.tail.add(store, &furthest, self.0.columns.count());
            probe.state(Tail::bits(store), Tail::bits(store));
        }
        probe.written(fragment.coverage);
    }

    fn resolve(&self, _site: Site, pixel: &HybridPixel, behind: &[[f32; 3]; N]) -> [f64; 3] {
        let (tail, passes_tail) = pixel.tail.over();
        self.0.columns.over(behind, |column| {
            let (core, passes_core) = composite(&pixel.core, column);
            let colour = std::array::from_fn(|i| core[i] + passes_core * tail[i]);
            (colour, passes_core * passes_tail)
        })
    }

    /// The tail has no depths: it lies right behind the core, whose last layer is nearer than all
    /// of it.
    fn visibility(&self, pixel: &HybridPixel, at: &[Unorm32; N]) -> Option<[f64; N]> {
        let passes_tail = pixel.tail.over().1;
        Some(self.0.columns.passing_nearer(&pixel.core, at, |nearer, column| {
            let core = composite(nearer, column).1;
            if nearer.len() == pixel.core.len() { core * passes_tail } else { core }
        }))
    }

    fn contents(&self, pixel: &HybridPixel) -> Contents {
        let Tail { colour, alpha, count } = pixel.tail;
        let colour = colour.map(|c| format!("{c:.3}")).join(" ");
        let mut contents = contents(&pixel.core);
        contents.fields.push(("tail", format!("rgb {colour} alpha {alpha:.3} count {count:.3}")));
        contents
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_trace::trace::SampleMask;

    #[test]
    fn a_tail_by_hand() {
        let layer = |coverage, colour: f32, alpha: f32| Layer {
            depth: Unorm32(0),
            coverage: SampleMask(coverage),
            colour: [colour * alpha; 3],
            transmittance: 1.0 - alpha,
        };
        let mut tail = Tail::default();
        assert_eq!(tail.over(), ([0.0; 3], 1.0));
        // The mean colour is (0.25·1 + 0.75·0) / 1 = 0.25, the mean alpha 0.5, and two
        // such layers let a quarter pass.
        tail.add(ColourStore::single(), &layer(0b11, 1.0, 0.25), 2);
        tail.add(ColourStore::single(), &layer(0b11, 0.0, 0.75), 2);
        assert_eq!(tail.over(), ([0.25 * 0.75; 3], 0.25));
        // One column of two: half a layer more.
        tail.add(ColourStore::single(), &layer(0b10, 1.0, 0.5), 2);
        assert_eq!((tail.alpha, tail.count), (1.25, 2.5));
        let (colour, transmittance) = tail.over();
        assert!((transmittance - 0.5_f64.powf(2.5)).abs() < 1e-12);
        assert!((colour[0] - 0.5 / 1.25 * (1.0 - transmittance)).abs() < 1e-12);
    }
}
