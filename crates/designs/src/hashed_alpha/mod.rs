//! Hashed alpha testing (Wyman, McGuire: Hashed Alpha Testing, I3D 2017; Improved Alpha
//! Testing Using Hashed Sampling, TVCG 25(2), 2019).
//!
//! The published threshold is a hash of the fragment's place in its object, at two
//! scales near the pixel's, so that it sticks to the object as it moves. A trace does
//! not hold places in objects. Here the place is the fragment's in the frame, its
//! depth scaled to pixels, hashed with its object's number: the same statistics in a
//! still picture, without the stability that is the method's aim.
//!
//! What renderers of Gaussian splats ship is the same test against other numbers (`noise`,
//! `power`). StochasticSplats (Kheradmand et al. 2025; `splat_frag_ST.glsl`), nvpro's
//! `vk_gaussian_splatting` and Spark 0.1 hash pixel, frame and primitive, each by its own formula;
//! the first puts pixel and sample into one word and adds the primitive before it hashes, so that
//! primitive p + 1 has at a pixel the number that p has at the next one to the right; PlayCanvas
//! (pull request 9443) takes a mask of blue noise, moved for each primitive along its diagonal, to
//! the power of 2.2. In steps of the mask's texels there are 32 places, so that more than half of
//! all neighbours in the file share theirs and hide each other; and the power lets an alpha of 0.1
//! pass a third of the time.

mod cells;
mod fast;

use fearless_simd::Level;

use crate::hashed_alpha::cells::{Cells, fraction};
use crate::hashed_alpha::fast::FastHashed;
use screendoor_rop::fast::{Count, FastEngine, Width};
use screendoor_rop::stochastic::{self, Round, Sampler, Stochastic};
use screendoor_rop::{
    Blueprint, Dither, Family, Frame, Info, OpaquePromise, OrderPromise, Probe, Promise, Promises,
    Samples, Site, TILE, Threshold, TiledDesign, colour, depth_bits,
};
use screendoor_trace::error::Result;
use screendoor_trace::param::{Typed, Values};
use screendoor_trace::random::{hash, mix};
use screendoor_trace::trace::{Fragment, SampleMask};

screendoor_trace::options! {
    /// For what a threshold is computed.
    pub enum Each {
        Sample = "sample": "each sample on its own",
        Pixel = "pixel": "the whole fragment, as the publication's shader does without multisampling",
    }
}

screendoor_trace::options! {
    /// Where the random numbers come from.
    pub enum Noise {
        Place = "place": "a hash of where the fragment lies, at two scales, as published",
        Primitive = "primitive": "a hash of pixel, sample and primitive: white noise",
        StochasticSplats = "stochasticsplats": "the hash of StochasticSplats, of pixel and sample in one word plus the primitive",
        Nvpro = "nvpro": "the hash of nvpro's vk_gaussian_splatting; each sample is a frame of its own",
        Spark = "spark": "the hash of Spark 0.1; each sample is a frame of its own",
        Mask = "mask": "a mask of blue noise, moved by the primitive to one of 32 places, as PlayCanvas has it",
    }
}

/// The design's entry in the registry.
pub struct HashedAlpha;

const THRESHOLD: Typed<Each> =
    Typed::choice("threshold", "sample", "for what a threshold is computed");
const NOISE: Typed<Noise> = Typed::choice("noise", "place", "where the random numbers come from");
const POWER: Typed<f64> = Typed::real(
    "power",
    "1",
    (1.0, 4.0),
    "the random number to this power is what alpha is compared with; PlayCanvas' is 2.2",
);
const SCALE: Typed<f64> = Typed::real("scale", "1", (0.1, 16.0), "cells of the hash, in pixels");

impl Blueprint for HashedAlpha {
    const INFO: Info = Info {
        name: "hashed-alpha",
        family: Family::Stochastic,
        summary: "an alpha test against a hash of where the fragment lies, at two scales",
        citation: "Wyman, McGuire: Hashed Alpha Testing, I3D 2017",
        params: &[
            NOISE.param,
            POWER.param,
            THRESHOLD.param,
            SCALE.param,
            depth_bits::PARAM.param,
            colour::PARAM.param,
        ],
        combinations: &[
            "noise=mask,power=2.2",
            "noise=primitive,threshold=pixel",
            "noise=stochasticsplats,threshold=pixel",
        ],
    };

    type At<const N: usize> = Stochastic<HashedThreshold, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        Ok(stochastic::single_pass(values, frame, HashedThreshold::of(values, frame)))
    }

    fn fast<const N: usize>(
        values: &Values,
        frame: &Frame,
        level: Level,
    ) -> Result<Option<Box<dyn TiledDesign>>>
    where
        Count<N>: Width,
    {
        let twin = FastHashed::new(HashedThreshold::of(values, frame), depth_bits::of(values));
        let plain = Self::at::<N>(values, frame)?;
        let Some(sampler) = twin.filter(|_| plain.keeps_colours()) else { return Ok(None) };
        Ok(Some(Box::new(FastEngine::new(plain, sampler, level))))
    }

    fn promises(values: &Values) -> Promises {
        let apart = depth_bits::tells_apart(values);
        // Surfaces of one object that lie within a cell share their threshold, as do primitives
        // whose masks lie at one place; a hash of the primitive is new for each.
        let hashed = !matches!(values.get(NOISE), Noise::Place | Noise::Mask);
        let independent = hashed && values.get(POWER) == 1.0;
        Promises {
            unbiased: Promise::always_if(apart && independent),
            consistent: Promise::always_if(
                apart && independent && values.get(THRESHOLD) == Each::Sample,
            ),
            order: if apart { OrderPromise::Independent } else { OrderPromise::Dependent },
            exact_opaque: OpaquePromise::Always,
            seeded: true,
        }
    }
}

/// The published threshold.
#[derive(Clone, Copy, Debug)]
pub struct HashedThreshold {
    noise: Noise,
    power: f64,
    each: Each,
    scale: f64,
    /// Pixels that one unit of depth is taken for: the depth range is as deep as the
    /// frame is wide.
    depth_in_pixels: f64,
}

/// Places that a mask moves to, a step of PlayCanvas' texture apart, and by how much of the
/// texture it moves from a primitive to the next.
const PLACES: f64 = 32.0;
const MOVED: f64 = 0.013;

impl HashedThreshold {
    /// As `values` say.
    fn of(values: &Values, frame: &Frame) -> Self {
        HashedThreshold {
            noise: values.get(NOISE),
            power: values.get(POWER),
            each: values.get(THRESHOLD),
            scale: values.get(SCALE),
            depth_in_pixels: f64::from(frame.grid.width().max(frame.grid.height()))
                / 2_f64.powi(32),
        }
    }

    /// What alpha is compared with, 0 to 1, for `sample` of a fragment; `cells` are the
    /// fragment's where the noise is of its place.
    fn threshold(
        &self,
        seed: u32,
        site: Site,
        fragment: &Fragment,
        cells: Option<&Cells>,
        sample: u32,
    ) -> f64 {
        let (x, y, primitive) = (u32::from(site.x), u32::from(site.y), fragment.primitive);
        let uniform = match self.noise {
            Noise::Place => cells.expect("it has cells").threshold(seed, fragment.object, sample),
            Noise::Primitive => fraction(hash([seed, x, y, sample, primitive])),
            Noise::StochasticSplats => {
                let packed = x ^ y << 20 ^ sample << 8;
                fraction(mix(packed.wrapping_add(primitive).wrapping_add(hash([seed]))))
            }
            Noise::Nvpro => {
                let pixel = xxhash32([x, y, hash([seed, sample])]);
                // The last is the number of the triangle of a splat's quad; a trace has one
                // fragment of both.
                fraction(pcg(xxhash32([pixel, primitive, 0])))
            }
            Noise::Spark => {
                let times = |word: u32, factor: u32| word.wrapping_mul(factor);
                let terms =
                    [times(x, 0x9e37_79b9), times(y, 0x85eb_ca6b), times(primitive, 0xc2b2_ae35)];
                fraction(pcg(terms.into_iter().fold(hash([seed, sample]), u32::wrapping_add)))
            }
            Noise::Mask => {
                // A frame's jitter in the shader; here each sample is a frame of its own.
                let jitter = hash([seed, sample]);
                let turn = f64::from(fragment.primitive) * MOVED;
                let place = ((turn - turn.floor()) * PLACES) as usize * (TILE / PLACES as usize);
                let at = |coordinate: u16, jitter: u32| {
                    (usize::from(coordinate) + place + jitter as usize % TILE) % TILE
                };
                let (x, y) = (at(site.x, jitter), at(site.y, jitter >> 16));
                let ranks = Dither::BlueNoise.ranks().expect("it has a mask");
                (f64::from(ranks[y * TILE + x]) + 0.5) / (TILE * TILE) as f64
            }
        };
        if self.power == 1.0 { uniform } else { libm::pow(uniform, self.power) }
    }
}

/// xxHash's 32-bit hash of three words, as shaders have it (Jarzynski, Olano: Hash Functions for
/// GPU Rendering, JCGT 2020, supplement).
fn xxhash32([x, y, z]: [u32; 3]) -> u32 {
    const PRIMES: [u32; 4] = [2_246_822_519, 3_266_489_917, 668_265_263, 374_761_393];
    let [second, third, fourth, fifth] = PRIMES;
    let round = |h: u32| h.rotate_left(17).wrapping_mul(fourth);
    let h = round(z.wrapping_add(fifth).wrapping_add(x.wrapping_mul(third)));
    let h = round(h.wrapping_add(y.wrapping_mul(third)));
    let h = (h ^ h >> 15).wrapping_mul(second);
    let h = (h ^ h >> 13).wrapping_mul(third);
    h ^ h >> 16
}

/// A step of PCG and its output (RXS-M-XS, 32 bits; O'Neill 2014).
fn pcg(word: u32) -> u32 {
    let state = word.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    word >> 22 ^ word
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
        let in_cells = self.noise == Noise::Place && !passed.is_empty();
        let cells =
            in_cells.then(|| Cells::of(self.scale, self.depth_in_pixels, site, fragment.depth));
        let passes = |sample: u32, probe: &mut P| {
            // Of a place two, one for each scale; nvpro's is a hash of a hash of a hash; a mask is
            // looked up.
            probe.hashed(match self.noise {
                Noise::Place => 2,
                Noise::Nvpro => 3,
                Noise::Primitive | Noise::StochasticSplats | Noise::Spark => 1,
                Noise::Mask => 0,
            });
            let threshold = self.threshold(round.seed, site, fragment, cells.as_ref(), sample);
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
mod tests;
