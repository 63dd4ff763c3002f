//! The exact answer: every sample's fragments sorted and composited.

mod fast;
mod lanes;
mod layer;
mod order;
mod resolve;

use fearless_simd::Level;

use crate::exact::fast::Fast;
use screendoor_rop::fast::{Count, Width};
use screendoor_rop::{
    Blueprint, Contents, Design, Family, Frame, Info, Layout, OpaquePromise, OrderPromise, Probe,
    Promise, Promises, Site, TiledDesign,
};
use screendoor_trace::error::Result;
use screendoor_trace::param::Values;
use screendoor_trace::trace::{DepthPlane, Fragment, SampleMask, Unorm32};

/// The design's entry in the registry.
pub struct Exact;

impl Blueprint for Exact {
    const INFO: Info = Info {
        name: "exact",
        family: Family::Reference,
        summary: "per-sample sorted compositing in double precision: the expectation of every unbiased design",
        citation: "Enderton, Sintorn, Shirley, Luebke: Stochastic Transparency, TVCG 17(8), 2011, equation 2",
        params: &[],
        combinations: &[],
    };

    type At<const N: usize> = ExactAt<N>;

    fn at<const N: usize>(_: &Values, frame: &Frame) -> Result<ExactAt<N>> {
        Ok(ExactAt { frame: frame.clone() })
    }

    fn fast<const N: usize>(
        values: &Values,
        frame: &Frame,
        level: Level,
    ) -> Result<Option<Box<dyn TiledDesign>>>
    where
        Count<N>: Width,
    {
        let reference = Box::new(Self::at::<N>(values, frame)?);
        Ok(Some(Box::new(Fast::new(frame, reference, level))))
    }

    fn promises(_: &Values) -> Promises {
        Promises {
            unbiased: Promise::Always,
            consistent: Promise::Always,
            order: OrderPromise::Independent,
            exact_opaque: OpaquePromise::Always,
            seeded: false,
        }
    }
}

/// The design for pixels of `N` samples.
#[derive(Clone, Debug)]
pub struct ExactAt<const N: usize> {
    frame: Frame,
}

/// What is kept of a fragment: all of it, as the trace has it.
fn fields(frame: &Frame) -> [(u32, &'static str); 4] {
    let colour = (frame.colour_bits, "colour");
    [(frame.samples(), "coverage"), (3 * 32, "depth plane"), colour, (32, "alpha")]
}

/// What keeping a fragment costs.
fn tell<P: Probe>(frame: &Frame, fragment: &Fragment, probe: &mut P) {
    probe.written(fragment.coverage);
    probe.state(0, fields(frame).iter().map(|(bits, _)| bits).sum());
}

/// What is kept of a fragment.
#[derive(Clone, Copy, Debug)]
pub struct Layer {
    coverage: SampleMask,
    depth: DepthPlane,
    colour: [f32; 3],
    alpha: f32,
}

impl<const N: usize> Design for ExactAt<N> {
    /// All fragments, in API order.
    type Pixel = Vec<Layer>;

    fn layout(&self) -> Layout {
        Layout::of_each_fragment(&fields(&self.frame))
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
        let Fragment { coverage, depth, colour, alpha, .. } = *fragment;
        layers.push(Layer { coverage, depth, colour, alpha });
        tell(&self.frame, fragment, probe);
    }

    /// `C = Σ α_i c_i Π (1 − α_j)` over the fragments from near to far, at each
    /// sample; the pixel is the samples' mean. Of fragments at equal depths the
    /// later one lies in front, as a less-or-equal depth test has it.
    fn resolve(&self, _site: Site, layers: &Vec<Layer>) -> [f64; 3] {
        let background = self.frame.background.map(f64::from);
        let mut sum = [0.0; 3];
        let mut order: Vec<u64> = Vec::with_capacity(layers.len());
        for (s, offset) in self.frame.positions.iter().enumerate() {
            order.clear();
            order.extend(layers.iter().enumerate().filter(|(_, l)| l.coverage.contains(s)).map(
                |(i, layer)| u64::from(layer.depth.at(*offset).0) << 32 | u64::from(!(i as u32)),
            ));
            order.sort_unstable();
            let mut colour = [0.0; 3];
            let mut transmittance = 1.0;
            for key in &order {
                let layer = &layers[!(*key as u32) as usize];
                let alpha = f64::from(layer.alpha);
                for (c, l) in colour.iter_mut().zip(layer.colour) {
                    *c += transmittance * alpha * f64::from(l);
                }
                transmittance *= 1.0 - alpha;
                if transmittance == 0.0 {
                    break;
                }
            }
            for (sum, (c, b)) in sum.iter_mut().zip(colour.iter().zip(background)) {
                *sum += c + transmittance * b;
            }
        }
        sum.map(|s| s / N as f64)
    }

    fn contents(&self, layers: &Vec<Layer>) -> Contents {
        Contents { samples: Vec::new(), fields: vec![("fragments", layers.len().to_string())] }
    }

    /// `Π (1 − α_i)` over the fragments that lie nearer at the sample (Enderton et al. 2011,
    /// section 3.2): the truth that other designs' are held against.
    fn visibility(&self, layers: &Vec<Layer>, at: &[Unorm32], to: &mut [f64]) -> bool {
        for ((s, offset), (at, to)) in
            self.frame.positions.iter().enumerate().zip(at.iter().zip(to))
        {
            let nearer = |l: &&Layer| l.coverage.contains(s) && l.depth.at(*offset) < *at;
            *to = layers.iter().filter(nearer).map(|l| 1.0 - f64::from(l.alpha)).product();
        }
        true
    }

    fn bytes_per_fragment(&self) -> Option<usize> {
        // A growing list can be half empty.
        Some(2 * size_of::<Layer>())
    }
}

#[cfg(test)]
mod tests;
