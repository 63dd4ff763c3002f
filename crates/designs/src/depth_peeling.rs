//! Depth peeling (Everitt, NVIDIA, 2001): each pass over the geometry takes the
//! nearest layer behind the one that the pass before it took, at every sample. The
//! technique that Enderton et al. 2011 compare stochastic transparency with.
//!
//! Two depth tests a sample: behind the layer peeled last, and not behind the
//! nearest found yet. Fragments at equal depths are one layer to these tests: the
//! latest of them is peeled, the others are lost. `ties=kept` numbers the fragments
//! of a pass and compares the numbers where depths are equal, so that none is.

use screendoor_rop::layers::{LAYERS, room};
use screendoor_rop::{
    Blueprint, ColourStore, Contents, Family, Frame, Info, Layout, OpaquePromise, OrderPromise,
    OverOpaque, Probe, Promises, Site, Transparent, colour, over_opaque,
};
use screendoor_trace::error::Result;
use screendoor_trace::param::{Typed, Values};
use screendoor_trace::trace::{Fragment, SampleMask, Unorm32};

screendoor_trace::options! {
    /// What becomes of fragments at equal depths.
    pub enum Ties {
        Lost = "lost": "the latest is peeled, the others with it",
        Kept = "kept": "each is a layer; the later one lies in front",
    }
}

/// The design's entry in the registry.
pub struct DepthPeeling;

const TIES: Typed<Ties> =
    Typed::choice("ties", "lost", "what becomes of fragments at equal depths");

impl Blueprint for DepthPeeling {
    const INFO: Info = Info {
        name: "depth-peeling",
        family: Family::Layered,
        summary: "one pass for each layer, sample by sample; what lies behind the last is missing",
        citation: "Everitt: Interactive Order-Independent Transparency, NVIDIA, 2001",
        params: &[over_opaque::PARAM.param, LAYERS.param, TIES.param, colour::PARAM.param],
        combinations: &[],
    };

    type At<const N: usize> = OverOpaque<DepthPeelingAt<N>, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        let inner = DepthPeelingAt {
            frame: frame.clone(),
            store: ColourStore::of(values, frame),
            layers: room(values) as u32,
            ties: values.get(TIES),
        };
        Ok(OverOpaque::new(values, frame, over_opaque::of(values), inner))
    }

    fn promises(_: &Values) -> Promises {
        Promises {
            order: OrderPromise::Independent,
            // The nearest layer of every sample is always peeled.
            exact_opaque: OpaquePromise::Always,
            seeded: false,
            ..Promises::NONE
        }
    }
}

/// The design for pixels of `N` samples.
#[derive(Clone, Debug)]
pub struct DepthPeelingAt<const N: usize> {
    frame: Frame,
    store: ColourStore,
    layers: u32,
    ties: Ties,
}

/// A pixel.
#[derive(Clone, Debug)]
pub struct Peeled<const N: usize> {
    /// How many fragments this pass has seen.
    seen: u32,
    samples: [Peel; N],
}

/// A sample. Keys are ordered as layers are; none comes before any.
#[derive(Clone, Copy, Debug)]
struct Peel {
    /// The key of the layer peeled last.
    last: Option<u64>,
    /// The nearest behind it that this pass has found.
    candidate: Option<Candidate>,
    /// What all peeled layers show, and how much passes them.
    colour: [f32; 3],
    transmittance: f32,
}

#[derive(Clone, Copy, Debug)]
struct Candidate {
    key: u64,
    colour: [f32; 3],
    alpha: f32,
}

impl<const N: usize> DepthPeelingAt<N> {
    /// Bits by which a sample's layers are told apart.
    fn key_bits(&self) -> u32 {
        match self.ties {
            Ties::Lost => 32,
            Ties::Kept => 64,
        }
    }

    fn key(&self, z: Unorm32, number: u32) -> u64 {
        let number = match self.ties {
            Ties::Lost => 0,
            Ties::Kept => !number,
        };
        u64::from(z.0) << 32 | u64::from(number)
    }
}

impl<const N: usize> Transparent<N> for DepthPeelingAt<N> {
    type Pixel = Peeled<N>;

    fn passes(&self) -> u32 {
        self.layers
    }

    fn layout(&self) -> Layout {
        // What is peeled already, and the nearest behind it.
        let number = self.key_bits() - 32;
        let buffer = [
            (32, "depth"),
            (number, "number"),
            (self.store.colour_bits(), "colour"),
            (self.store.channel_bits(), "alpha"),
        ];
        Layout::of(2 * N as u32, &buffer).and(1, &[(number, "counter")])
    }

    fn clear(&self, _site: Site) -> Peeled<N> {
        let sample = Peel { last: None, candidate: None, colour: [0.0; 3], transmittance: 1.0 };
        Peeled { seen: 0, samples: [sample; N] }
    }

    fn draw<P: Probe>(
        &self,
        _pass: u32,
        _site: Site,
        pixel: &mut Peeled<N>,
        fragment: &Fragment,
        probe: &mut P,
    ) {
        let z: [Unorm32; N] = self.frame.depths(fragment, 32);
        let number = pixel.seen;
        pixel.seen += 1;
        let mut written = SampleMask::NONE;
        for s in fragment.coverage.iter() {
            let sample = &mut pixel.samples[s];
            let key = self.key(z[s], number);
            let behind_last = Some(key) > sample.last;
            if behind_last && sample.candidate.is_none_or(|c| key <= c.key) {
                let colour = self.store.colour(fragment.colour);
                let alpha = self.store.channel(fragment.alpha);
                sample.candidate = Some(Candidate { key, colour, alpha });
                written.insert(s);
            }
        }
        // Both tests, whatever the first finds.
        probe.compared(2 * fragment.coverage.count());
        probe.written(written);
        let counter = self.key_bits() - 32;
        probe.state(
            counter + 2 * self.key_bits() * fragment.coverage.count(),
            counter + (self.key_bits() + self.store.texel_bits()) * written.count(),
        );
    }

    /// Blends what the pass has found behind what is peeled already.
    fn end_pass<P: Probe>(&self, _pass: u32, _site: Site, pixel: &mut Peeled<N>, _probe: &mut P) {
        pixel.seen = 0;
        for sample in &mut pixel.samples {
            let Some(Candidate { key, colour, alpha }) = sample.candidate.take() else {
                continue;
            };
            for (sum, c) in sample.colour.iter_mut().zip(colour) {
                *sum = self.store.channel(*sum + sample.transmittance * alpha * c);
            }
            sample.transmittance = self.store.channel(sample.transmittance * (1.0 - alpha));
            sample.last = Some(key);
        }
    }

    fn resolve(&self, _site: Site, pixel: &Peeled<N>, behind: &[[f32; 3]; N]) -> [f64; 3] {
        let mut mean = [0.0; 3];
        for (sample, behind) in pixel.samples.iter().zip(behind) {
            for ((sum, c), b) in mean.iter_mut().zip(sample.colour).zip(behind) {
                *sum += f64::from(c) + f64::from(sample.transmittance) * f64::from(*b);
            }
        }
        mean.map(|sum| sum / N as f64)
    }

    fn contents(&self, pixel: &Peeled<N>) -> Contents {
        let depth = |key: u64| format!("{:.6}", (key >> 32) as f64 / f64::from(u32::MAX));
        let list = |of: &dyn Fn(&Peel) -> Option<u64>| {
            let words = pixel.samples.iter().map(|s| of(s).map_or("-".into(), depth));
            words.collect::<Vec<_>>().join(" ")
        };
        let passes = pixel.samples.iter().map(|s| format!("{:.3}", s.transmittance));
        Contents {
            samples: Vec::new(),
            fields: vec![
                ("peeled to", list(&|s| s.last)),
                ("nearest behind", list(&|s| s.candidate.map(|c| c.key))),
                ("transmittance", passes.collect::<Vec<_>>().join(" ")),
            ],
        }
    }
}
