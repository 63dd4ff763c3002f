//! Hashed alpha testing (Wyman, McGuire: Hashed Alpha Testing, I3D 2017; Improved Alpha
//! Testing Using Hashed Sampling, TVCG 25(2), 2019).
//!
//! The published threshold is a hash of the fragment's place in its object, at two
//! scales near the pixel's, so that it sticks to the object as it moves. A trace does
//! not hold places in objects. Here the place is the fragment's in the frame, its
//! depth scaled to pixels, hashed with its object's number: the same statistics in a
//! still picture, without the stability that is the method's aim.

use screendoor_rop::stochastic::{self, Round, Sampler, Stochastic};
use screendoor_rop::{
    Blueprint, Family, Frame, Info, OpaquePromise, OrderPromise, Probe, Promises, Samples, Site,
    Threshold, colour, depth_bits,
};
use screendoor_trace::error::Result;
use screendoor_trace::param::{Typed, Values};
use screendoor_trace::random::hash;
use screendoor_trace::trace::{Fragment, SampleMask};

screendoor_trace::options! {
    /// For what a threshold is computed.
    pub enum Each {
        Sample = "sample": "each sample on its own",
        Pixel = "pixel": "the whole fragment, as the publication's shader does without multisampling",
    }
}

/// The design's entry in the registry.
pub struct HashedAlpha;

const THRESHOLD: Typed<Each> =
    Typed::choice("threshold", "sample", "for what a threshold is computed");
const SCALE: Typed<f64> = Typed::real("scale", "1", (0.1, 16.0), "cells of the hash, in pixels");

impl Blueprint for HashedAlpha {
    const INFO: Info = Info {
        name: "hashed-alpha",
        family: Family::Stochastic,
        summary: "an alpha test against a hash of where the fragment lies, at two scales",
        citation: "Wyman, McGuire: Hashed Alpha Testing, I3D 2017",
        params: &[THRESHOLD.param, SCALE.param, depth_bits::PARAM.param, colour::PARAM.param],
        combinations: &[],
    };

    type At<const N: usize> = Stochastic<HashedThreshold, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        let sampler = HashedThreshold {
            each: values.get(THRESHOLD),
            scale: values.get(SCALE),
            depth_in_pixels: f64::from(frame.grid.width().max(frame.grid.height()))
                / 2_f64.powi(32),
        };
        Ok(stochastic::single_pass(values, frame, sampler))
    }

    fn promises(values: &Values) -> Promises {
        let apart = depth_bits::tells_apart(values);
        Promises {
            order: if apart { OrderPromise::Independent } else { OrderPromise::Dependent },
            exact_opaque: OpaquePromise::Always,
            seeded: true,
            // Surfaces of one object that lie within a cell share their threshold.
            ..Promises::NONE
        }
    }
}

/// The published threshold.
#[derive(Clone, Copy, Debug)]
pub struct HashedThreshold {
    each: Each,
    scale: f64,
    /// Pixels that one unit of depth is taken for: the depth range is as deep as the
    /// frame is wide.
    depth_in_pixels: f64,
}

impl HashedThreshold {
    /// The threshold in (0, 1] of a fragment, from `sample` on where each has its own.
    fn threshold(&self, seed: u32, site: Site, fragment: &Fragment, sample: u32) -> f64 {
        let depth = |unorm: f64| unorm * self.depth_in_pixels;
        let place = [
            f64::from(site.x) + 0.5,
            f64::from(site.y) + 0.5,
            depth(f64::from(fragment.depth.z.0)),
        ];
        // How far the place moves from one pixel to the next.
        let step = |slope: i32| {
            let slope = depth(f64::from(slope));
            (1.0 + slope * slope).sqrt()
        };
        let step = step(fragment.depth.dzdx).max(step(fragment.depth.dzdy));
        // The two powers of two beside the pixel's scale, and how near it is to the
        // upper one.
        let log = libm::log2(1.0 / (self.scale * step));
        let between = log - log.floor();
        let cell = |exponent: f64| {
            let scale = libm::exp2(exponent);
            let [x, y, z] = place.map(|p| (p * scale).floor() as i64 as u32);
            let word = hash([seed, fragment.object, x, y, z, sample, exponent as i32 as u32]);
            (f64::from(word) + 0.5) / 2_f64.powi(32)
        };
        let (lower, upper) = (cell(log.floor()), cell(log.ceil()));
        uniform((1.0 - between) * lower + between * upper, between.min(1.0 - between))
    }
}

/// Makes a weighted mean of two uniform numbers uniform: its distribution function,
/// where the smaller weight is `a` (I3D 2017, section 3.3).
fn uniform(x: f64, a: f64) -> f64 {
    if a <= 0.0 {
        return x;
    }
    if x < a {
        x * x / (2.0 * a * (1.0 - a))
    } else if x < 1.0 - a {
        (x - a / 2.0) / (1.0 - a)
    } else {
        1.0 - (1.0 - x) * (1.0 - x) / (2.0 * a * (1.0 - a))
    }
}

impl<const N: usize> Sampler<N> for HashedThreshold {
    type State = ();

    fn clear(&self, _site: Site) {}

    fn state_bits(&self) -> u32 {
        0
    }

    fn choose<P: Probe>(
        &self,
        round: Round,
        site: Site,
        (): &mut (),
        _samples: &Samples<N>,
        passed: SampleMask,
        fragment: &Fragment,
        probe: &mut P,
    ) -> SampleMask {
        let opacity = Threshold::of(fragment.alpha);
        let passes = |sample: u32, probe: &mut P| {
            // Two hashes, one for each scale.
            probe.hashed(2);
            let threshold = self.threshold(round.seed, site, fragment, sample);
            let x = (threshold * 2_f64.powi(32)) as u32;
            probe.reference(sample as u8, sample, x, opacity);
            opacity.passes(x)
        };
        match self.each {
            Each::Sample => passed.iter().filter(|s| passes(*s as u32, probe)).collect(),
            Each::Pixel if passed.is_empty() || !passes(0, probe) => SampleMask::NONE,
            Each::Pixel => passed,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::uniform;
    use screendoor_trace::random::Stream;

    #[test]
    fn mixed_hashes_are_uniform_again() {
        for between in [0.0, 0.1, 0.3, 0.5, 0.8] {
            let mut random = Stream::new([1, (between * 10.0) as u32]);
            let mut tenths = [0; 10];
            for _ in 0..100_000 {
                let (lower, upper) = (f64::from(random.unit()), f64::from(random.unit()));
                let x = (1.0 - between) * lower + between * upper;
                let u = uniform(x, between.min(1.0 - between));
                assert!((0.0..=1.0).contains(&u));
                tenths[((u * 10.0) as usize).min(9)] += 1;
            }
            // Binomial: σ = 95; the bound is six of them.
            assert!(tenths.iter().all(|n: &i32| (n - 10_000).abs() < 570), "{tenths:?}");
        }
    }
}
