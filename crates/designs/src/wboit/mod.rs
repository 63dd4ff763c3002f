//! Weighted blended order-independent transparency (McGuire and Bavoil, JCGT 2(2),
//! 2013): the mean of all fragments, weighted by a guess from depth and alpha of how
//! much of each is seen, over the background by the exact transmittance.

mod lanes;

use fearless_simd::Level;
use screendoor_rop::fast::{Count, Width};
use screendoor_rop::in_lanes;
use screendoor_rop::shader;
use screendoor_rop::{
    Accumulators, Blueprint, ColourStore, Contents, Coverage, Declaration, Family, Frame, Info,
    Layout, OnDevice, OpaquePromise, OrderPromise, OverOpaque, PixelWords, Port, Probe, Promises,
    Site, TiledDesign, Transparent, ViewDepth, accumulators, colour, over_opaque, view_depth,
};
use screendoor_trace::error::Result;
use screendoor_trace::param::{Typed, Values};
use screendoor_trace::trace::{Fragment, Unorm32};

screendoor_trace::options! {
    /// The weight of a fragment of opacity α at view depth z.
    pub enum Weight {
        Eq7 = "eq7": "alpha clamp(10 / (1e-5 + (z/5)^2 + (z/200)^6), 1e-2, 3e3)",
        Eq8 = "eq8": "alpha clamp(10 / (1e-5 + (z/10)^3 + (z/200)^6), 1e-2, 3e3)",
        Eq9 = "eq9": "alpha clamp(0.03 / (1e-5 + (z/200)^4), 1e-2, 3e3)",
        Eq10 = "eq10": "alpha max(1e-2, 3e3 (1 - d)^3), d the stored depth as a fraction",
        One = "one": "1: the plain mean by alpha, as the colour of Bavoil and Myers 2008",
    }
}

impl Weight {
    fn of(self, depth: &ViewDepth, z: Unorm32, alpha: f32) -> f64 {
        let falling = |scale: f64, sum: f64| (scale / (1e-5 + sum)).clamp(1e-2, 3e3);
        let over = |unit: f64, power| raised(depth.at(z) / unit, power);
        let by_depth = match self {
            Weight::Eq7 => falling(10.0, over(5.0, 2) + over(200.0, 6)),
            Weight::Eq8 => falling(10.0, over(10.0, 3) + over(200.0, 6)),
            Weight::Eq9 => falling(0.03, over(200.0, 4)),
            Weight::Eq10 => (3e3 * raised(1.0 - view_depth::fraction(z), 3)).max(1e-2),
            Weight::One => return 1.0,
        };
        f64::from(alpha) * by_depth
    }
}

/// A whole power by multiplication, which rounds alike everywhere.
fn raised(x: f64, power: u32) -> f64 {
    (0..power).fold(1.0, |product, _| product * x)
}

/// The design's entry in the registry.
pub struct WeightedBlended;

const WEIGHT: Typed<Weight> =
    Typed::choice("weight", "eq7", "a fragment's weight (the paper's equations)");

impl Blueprint for WeightedBlended {
    const INFO: Info = Info {
        name: "wboit",
        family: Family::Blended,
        summary: "weighted blended: the fragments' mean, weighted by depth and alpha, in one pass of sums",
        citation: "McGuire, Bavoil: Weighted Blended Order-Independent Transparency, JCGT 2(2), 2013",
        params: &[
            WEIGHT.param,
            view_depth::NEAR.param,
            view_depth::RANGE.param,
            view_depth::LENS.param,
            accumulators::PARAM.param,
            over_opaque::PARAM.param,
            colour::PARAM.param,
        ],
        combinations: &["weight=one,coverage=share", "coverage=share,opaque=together"],
    };

    type At<const N: usize> = OverOpaque<WeightedBlendedAt<N>, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        let rules = Rules {
            weight: values.get(WEIGHT),
            depth: ViewDepth::of(values, frame)?,
            coverage: accumulators::of(values),
            store: ColourStore::of(values, frame),
            samples: N,
        };
        let inner = WeightedBlendedAt { rules };
        Ok(OverOpaque::new(values, frame, over_opaque::of(values), inner))
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
        Ok(Some(Port::of(shader!("wboit"), &Self::INFO, values, frame, plain)))
    }

    fn promises(values: &Values) -> Promises {
        Promises {
            order: OrderPromise::UpToRounding,
            exact_opaque: over_opaque::exactness(values, OpaquePromise::Never),
            seeded: false,
            ..Promises::NONE
        }
    }
}

/// The sums, for pixels of `N` samples.
#[derive(Clone, Debug)]
pub struct WeightedBlendedAt<const N: usize> {
    rules: Rules,
}

/// What is summed, whatever the number of samples.
#[derive(Clone, Debug)]
struct Rules {
    weight: Weight,
    depth: ViewDepth,
    coverage: Coverage,
    store: ColourStore,
    samples: usize,
}

impl Rules {
    /// How many sums a pixel has.
    fn sums(&self) -> usize {
        self.coverage.sums(self.samples)
    }
}

/// What is kept of all fragments together.
#[derive(Clone, Debug)]
pub struct WeightedSums {
    /// Σ w α c.
    colour: [f32; 3],
    /// Σ w α.
    weight: f32,
    /// Π (1 − α).
    transmittance: f32,
}

impl Default for WeightedSums {
    fn default() -> Self {
        WeightedSums { colour: [0.0; 3], weight: 0.0, transmittance: 1.0 }
    }
}

impl WeightedSums {
    /// What is seen of the fragments: their mean, by their opacity together.
    fn seen(&self) -> [f64; 3] {
        let opacity = 1.0 - f64::from(self.transmittance);
        let weight = f64::from(self.weight);
        self.colour.map(|c| if weight > 0.0 { f64::from(c) / weight * opacity } else { 0.0 })
    }
}

impl<const N: usize> Transparent<N> for WeightedBlendedAt<N> {
    type Pixel = Accumulators<WeightedSums>;

    fn layout(&self) -> Layout {
        let store = self.rules.store;
        let channel = store.channel_bits();
        let sums =
            [(store.colour_bits(), "colour"), (channel, "weight"), (channel, "transmittance")];
        Layout::of(self.rules.sums() as u32, &sums)
    }

    fn clear(&self, _site: Site) -> Self::Pixel {
        Accumulators::default()
    }

    fn draw<P: Probe>(
        &self,
        _pass: u32,
        _site: Site,
        pixel: &mut Self::Pixel,
        fragment: &Fragment,
        probe: &mut P,
    ) {
        // Shaded once a fragment, at the pixel's centre, whatever the samples.
        let rules = &self.rules;
        let alpha = rules.coverage.alpha(fragment, N);
        let weight = rules.weight.of(&rules.depth, fragment.depth.z, alpha);
        let weighted = (weight * f64::from(alpha)) as f32;
        let touched = rules.coverage.touched(fragment.coverage);
        let store = rules.store;
        let sums = pixel.touch(rules.sums());
        for s in touched.iter() {
            let sums = &mut sums[s];
            for (sum, c) in sums.colour.iter_mut().zip(fragment.colour) {
                *sum = store.channel(*sum + weighted * c);
            }
            sums.weight = store.channel(sums.weight + weighted);
            sums.transmittance = store.channel(sums.transmittance * (1.0 - alpha));
        }
        probe.written(fragment.coverage);
        let bits = 5 * store.channel_bits() * touched.count();
        probe.state(bits, bits);
    }

    fn resolve(&self, _site: Site, pixel: &Self::Pixel, behind: &[[f32; 3]; N]) -> [f64; 3] {
        pixel.over(behind, |sums| (sums.seen(), f64::from(sums.transmittance)))
    }

    fn contents(&self, pixel: &Self::Pixel) -> Contents {
        let list =
            |value: fn(&WeightedSums) -> f32| accumulators::list(pixel.get().iter().map(value));
        let fields =
            vec![("weights", list(|s| s.weight)), ("transmittance", list(|s| s.transmittance))];
        Contents { samples: Vec::new(), fields }
    }
}

impl<const N: usize> OnDevice<Accumulators<WeightedSums>> for WeightedBlendedAt<N> {
    fn declare(&self, to: &mut Declaration) {
        let sums = self.rules.sums() as u32;
        to.field("TOUCHED", 1);
        to.field("SUM_COLOUR", 3 * sums);
        to.field("SUM_WEIGHT", sums);
        to.field("SUM_THROUGH", sums);
        to.iterations(sums);
        self.rules.depth.declare(to);
    }

    fn read(&self, _: Site, from: &PixelWords<'_>) -> Accumulators<WeightedSums> {
        let mut colours = from.field("SUM_COLOUR").map(f32::from_bits);
        let values = |name| from.field(name).map(f32::from_bits);
        let sums = values("SUM_WEIGHT").zip(values("SUM_THROUGH"));
        let sums = sums.map(|(weight, transmittance)| WeightedSums {
            colour: std::array::from_fn(|_| colours.next().expect("three a sum")),
            weight,
            transmittance,
        });
        match from.word("TOUCHED") {
            0 => Accumulators::default(),
            _ => Accumulators::from(sums.collect::<Vec<_>>()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_trace::trace::Projection;

    #[test]
    fn weights_by_hand() {
        // At view depth 10: 10/(1e-5 + 4 + 1.5625e-8), 10/(1e-5 + 1 + …), and at a
        // depth of 1/2 of the range.
        let depth = ViewDepth::new(10.0, 10.0, Projection::Orthographic);
        let near = |weight: Weight| weight.of(&depth, Unorm32::NEAR, 0.5);
        assert!((near(Weight::Eq7) - 0.5 * 2.499_993_7).abs() < 1e-6);
        assert!((near(Weight::Eq8) - 0.5 * 9.999_899_9).abs() < 1e-5);
        assert!((near(Weight::Eq9) - 0.5 * 0.03 / 1.625e-5).abs() < 1e-6);
        assert_eq!(near(Weight::Eq10), 1500.0);
        assert_eq!(near(Weight::One), 1.0);
        let middle = Weight::Eq10.of(&depth, Unorm32(1 << 31), 1.0);
        assert!((middle - 375.0).abs() < 1e-5);
        // Clamped at either end.
        let wide = ViewDepth::new(1e-3, 1e6, Projection::Orthographic);
        assert_eq!(Weight::Eq7.of(&wide, Unorm32::NEAR, 1.0), 3e3);
        assert_eq!(Weight::Eq7.of(&wide, Unorm32::FAR, 1.0), 1e-2);
    }

    #[test]
    fn a_pixel_by_hand() {
        // Two fragments of weight 1: red at 0.5, green at 0.25. The mean by alpha is
        // (2/3, 1/3, 0), the transmittance 3/8.
        let rules = Rules {
            weight: Weight::One,
            depth: ViewDepth::new(1.0, 1.0, Projection::Orthographic),
            coverage: Coverage::Sample,
            store: ColourStore::single(),
            samples: 1,
        };
        let design = WeightedBlendedAt::<1> { rules };
        let mut pixel = Accumulators::default();
        let site = Site { x: 0, y: 0 };
        for (colour, alpha) in [([1.0, 0.0, 0.0], 0.5), ([0.0, 1.0, 0.0], 0.25)] {
            let fragment = Fragment {
                x: 0,
                y: 0,
                coverage: screendoor_trace::trace::SampleMask::first(1),
                depth: Default::default(),
                colour,
                alpha,
                primitive: 0,
                object: 0,
                ..Fragment::default()
            };
            design.draw(0, site, &mut pixel, &fragment, &mut screendoor_rop::NoProbe);
        }
        let found = design.resolve(site, &pixel, &[[0.0, 0.0, 1.0]]);
        let expected = [0.625 * 2.0 / 3.0, 0.625 / 3.0, 0.375];
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-7), "{found:?}");
    }
}
