//! Moment-based order-independent transparency (Münstermann, Krumpen, Klein, Peters,
//! I3D 2018), with power moments: a first pass sums each fragment's absorbance times
//! the powers of its depth; a second weighs each fragment by the transmittance before
//! it that these moments tell.

mod lanes;
#[cfg(test)]
mod tests;

use fearless_simd::Level;
use screendoor_rop::fast::{Count, Width};
use screendoor_rop::in_lanes;
use screendoor_rop::{
    Accumulators, Blueprint, ColourStore, Contents, Coverage, Family, Frame, Info, Layout,
    MomentCount, Moments, OfMoments, OpaquePromise, OrderPromise, OverOpaque, Probe, Promises,
    Site, TiledDesign, Transparent, ViewDepth, accumulators, colour, over_opaque, view_depth,
};
use screendoor_trace::error::Result;
use screendoor_trace::param::{Typed, Values};
use screendoor_trace::trace::{Fragment, Unorm32};

/// The design's entry in the registry.
pub struct MomentBased;

const MOMENTS: Typed<MomentCount> =
    Typed::choice("moments", "4", "power moments beside the zeroth");
const BIAS: Typed<f64> = Typed::real(
    "bias",
    "1",
    (0.1, 10.0),
    "how far moments are drawn towards those of a fixed measure, in units of \
     5e-7, 5e-6, 5e-5 for 4, 6, 8 moments",
);
const OVERESTIMATION: Typed<f64> = Typed::real(
    "overestimation",
    "0.25",
    (0.0, 1.0),
    "the share counted as before a fragment of what may lie where it lies",
);

impl Blueprint for MomentBased {
    const INFO: Info = Info {
        name: "mboit",
        family: Family::Blended,
        summary: "moment-based: two passes of sums, the transmittance between them from power moments",
        citation: "Münstermann, Krumpen, Klein, Peters: Moment-Based Order-Independent Transparency, PACM CGIT 1(1), 2018",
        params: &[
            MOMENTS.param,
            BIAS.param,
            OVERESTIMATION.param,
            view_depth::NEAR.param,
            view_depth::RANGE.param,
            view_depth::LENS.param,
            accumulators::PARAM.param,
            over_opaque::PARAM.param,
            colour::PARAM.param,
        ],
        combinations: &["moments=8,coverage=share", "moments=8,bias=0.1"],
    };

    type At<const N: usize> = OverOpaque<MomentBasedAt<N>, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        let rules = Rules {
            of_moments: OfMoments {
                count: values.get(MOMENTS),
                bias: values.get(BIAS),
                overestimation: values.get(OVERESTIMATION),
            },
            depth: ViewDepth::of(values, frame)?,
            coverage: accumulators::of(values),
            store: ColourStore::of(values, frame),
            samples: N,
        };
        let inner = MomentBasedAt { rules };
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

    fn promises(values: &Values) -> Promises {
        Promises {
            // How much a reconstruction differs with the moments' rounding grows as their
            // matrix nears a singular one; only the bias bounds it.
            order: OrderPromise::AmplifiedRounding,
            exact_opaque: over_opaque::exactness(values, OpaquePromise::Never),
            seeded: false,
            ..Promises::NONE
        }
    }
}

/// The sums, for pixels of `N` samples.
#[derive(Clone, Debug)]
pub struct MomentBasedAt<const N: usize> {
    rules: Rules,
}

/// What is summed, whatever the number of samples.
#[derive(Clone, Debug)]
struct Rules {
    of_moments: OfMoments,
    depth: ViewDepth,
    coverage: Coverage,
    store: ColourStore,
    samples: usize,
}

/// What is kept of all fragments together.
#[derive(Clone, Debug, Default)]
pub struct MomentSums {
    /// The first pass's.
    moments: Moments,
    /// Σ α T c, of the second pass.
    colour: [f32; 3],
    /// Σ α T.
    weight: f32,
}

/// The least 1 − α: an opaque fragment's absorbance has no bound. It is the least
/// that another alpha in single precision has.
const LEAST_TRANSMITTANCE: f64 = 1.0 / (1 << 24) as f64;

/// The least weight: where all that a pixel holds seems hidden, its fragments' mean by
/// alpha is left.
const LEAST_SEEN: f64 = 1e-30;

impl Rules {
    fn moment_bits(&self) -> u32 {
        32 * (self.of_moments.count.count() as u32 + 1)
    }

    /// How many sums a pixel has.
    fn sums(&self) -> usize {
        self.coverage.sums(self.samples)
    }
}

impl MomentSums {
    /// What is seen of the fragments, and what of that behind them.
    fn layer(&self) -> ([f64; 3], f64) {
        let transmittance = libm::exp(-self.moments.total());
        let weight = f64::from(self.weight);
        let seen = |c: f32| {
            if weight > 0.0 { f64::from(c) / weight * (1.0 - transmittance) } else { 0.0 }
        };
        (self.colour.map(seen), transmittance)
    }
}

impl<const N: usize> Transparent<N> for MomentBasedAt<N> {
    type Pixel = Accumulators<MomentSums>;

    fn passes(&self) -> u32 {
        2
    }

    fn layout(&self) -> Layout {
        // Moments are of single precision whatever colours are: their matrix asks for it.
        let sums = [
            (self.rules.moment_bits(), "moments"),
            (self.rules.store.colour_bits(), "colour"),
            (self.rules.store.channel_bits(), "weight"),
        ];
        Layout::of(self.rules.sums() as u32, &sums)
    }

    fn clear(&self, _site: Site) -> Self::Pixel {
        Accumulators::default()
    }

    fn draw<P: Probe>(
        &self,
        pass: u32,
        _site: Site,
        pixel: &mut Self::Pixel,
        fragment: &Fragment,
        probe: &mut P,
    ) {
        // One depth a fragment, that at the pixel's centre: it is shaded once. The
        // second pass reads moments sample by sample.
        let rules = &self.rules;
        let OfMoments { count: moments, bias, overestimation } = rules.of_moments;
        let z = rules.depth.log_warped(fragment.depth.z);
        let alpha = rules.coverage.alpha(fragment, N);
        let touched = rules.coverage.touched(fragment.coverage);
        let count = touched.count();
        let sums = pixel.touch(rules.sums());
        probe.written(fragment.coverage);
        if pass == 0 {
            let absorbance = -libm::log((1.0 - f64::from(alpha)).max(LEAST_TRANSMITTANCE));
            touched.iter().for_each(|s| sums[s].moments.add(moments, absorbance, z));
            return probe.state(rules.moment_bits() * count, rules.moment_bits() * count);
        }
        // Neighbouring samples mostly hold the same moments.
        let mut last: Option<(Moments, f32)> = None;
        for s in touched.iter() {
            let sums = &mut sums[s];
            let weight = match last {
                Some((moments, weight)) if moments == sums.moments => weight,
                _ => {
                    let transmittance =
                        sums.moments.transmittance(moments, z, bias, overestimation);
                    (f64::from(alpha) * transmittance.max(LEAST_SEEN)) as f32
                }
            };
            last = Some((sums.moments, weight));
            for (sum, c) in sums.colour.iter_mut().zip(fragment.colour) {
                *sum = rules.store.channel(*sum + weight * c);
            }
            sums.weight = rules.store.channel(sums.weight + weight);
        }
        let texel = rules.store.texel_bits();
        probe.state((rules.moment_bits() + texel) * count, texel * count);
    }

    fn resolve(&self, _site: Site, pixel: &Self::Pixel, behind: &[[f32; 3]; N]) -> [f64; 3] {
        pixel.over(behind, MomentSums::layer)
    }

    /// As a fragment of the second pass would be weighed.
    fn visibility(&self, pixel: &Self::Pixel, at: &[Unorm32; N]) -> Option<[f64; N]> {
        let OfMoments { count, bias, overestimation } = self.rules.of_moments;
        let sums = pixel.get();
        let passes = |s: usize| {
            // One sum a pixel, or one for each sample.
            let Some(sums) = sums.get(s).or(sums.first()) else { return 1.0 };
            let z = self.rules.depth.log_warped(at[s]);
            sums.moments.transmittance(count, z, bias, overestimation)
        };
        Some(std::array::from_fn(passes))
    }

    fn contents(&self, pixel: &Self::Pixel) -> Contents {
        let list = |value: fn(&MomentSums) -> f64| {
            accumulators::list(pixel.get().iter().map(|s| value(s) as f32))
        };
        let fields = vec![
            ("absorbance", list(|s| s.moments.total())),
            ("weights", list(|s| f64::from(s.weight))),
        ];
        Contents { samples: Vec::new(), fields }
    }
}
