//! Stochastic transparency (Enderton, Sintorn, Shirley, Luebke, TVCG 2011): the
//! single-pass method.

use crate::error::Result;
use crate::param::{Param, Values};
use crate::random::hash;
use crate::resolve::box_filter;
use crate::rop::{
    Blueprint, Contents, Design, Family, Frame, Info, OpaquePromise, OrderPromise, Probe, Promises,
    Samples, Site, StateBits, Threshold, depth_bits,
};
use crate::trace::{Fragment, SampleMask, Unorm32};

crate::options! {
    /// How a fragment's samples are chosen.
    pub enum MaskRule {
        Stratified = "stratified": "floor(alpha n + xi) of the fragment's n samples, at random (section 3.1)",
        Naive = "naive": "each sample on its own, with probability alpha",
    }
}

crate::options! {
    /// Which samples of a fragment are chosen from.
    pub enum Among {
        Passed = "passed": "those that pass the depth test (as Laine and Karras read it)",
        Covered = "covered": "all that it covers",
    }
}

/// The design's entry in the registry.
pub struct Enderton;

impl Blueprint for Enderton {
    const INFO: Info = Info {
        name: "enderton",
        family: Family::Stochastic,
        summary: "each fragment writes a random share of its samples, stratified within the fragment",
        citation: "Enderton, Sintorn, Shirley, Luebke: Stochastic Transparency, TVCG 17(8), 2011",
        params: &[
            Param::choice::<MaskRule>("mask", "stratified", "how a fragment's samples are chosen"),
            Param::choice::<Among>("among", "passed", "which samples are chosen from"),
            depth_bits::PARAM,
        ],
        combinations: &[],
    };

    type At<const N: usize> = EndertonAt<N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<EndertonAt<N>> {
        Ok(EndertonAt {
            frame: frame.clone(),
            mask: values.choice("mask"),
            among: values.choice("among"),
            depth_bits: depth_bits::of(values),
        })
    }

    fn promises(values: &Values) -> Promises {
        // What a fragment chooses follows from its primitive alone, unless it
        // chooses among the samples that earlier fragments have left it.
        let naive = values.choice::<MaskRule>("mask") == MaskRule::Naive;
        let among_all = values.choice::<Among>("among") == Among::Covered;
        let apart = depth_bits::tells_apart(values);
        Promises {
            unbiased: apart,
            consistent: apart,
            order: if apart && (naive || among_all) {
                OrderPromise::Independent
            } else {
                OrderPromise::Dependent
            },
            exact_opaque: OpaquePromise::Always,
            seeded: true,
        }
    }
}

/// The design for pixels of `N` samples.
#[derive(Clone, Debug)]
pub struct EndertonAt<const N: usize> {
    frame: Frame,
    mask: MaskRule,
    among: Among,
    depth_bits: u32,
}

impl<const N: usize> EndertonAt<N> {
    /// Random words that belong to (seed, pixel, primitive), so that a primitive
    /// is treated alike wherever it stands in the stream.
    fn word(&self, site: Site, primitive: u32, place: u32) -> u32 {
        let pixel = u32::from(site.y) << 16 | u32::from(site.x);
        hash([self.frame.seed, pixel, primitive, place])
    }

    /// The samples of `from` that the fragment is allowed to write.
    fn choose<P: Probe>(
        &self,
        site: Site,
        fragment: &Fragment,
        from: SampleMask,
        probe: &mut P,
    ) -> SampleMask {
        let opacity = Threshold::of(fragment.alpha);
        let word = |place| self.word(site, fragment.primitive, place);
        match self.mask {
            MaskRule::Naive => {
                probe.hashed(from.count());
                let passes = |s: &usize| {
                    let x = word(*s as u32);
                    probe.reference(*s as u8, *s as u32, x, opacity);
                    opacity.passes(x)
                };
                from.iter().filter(passes).collect()
            }
            MaskRule::Stratified => {
                probe.hashed(1 + from.count());
                // ξ is one word further than the samples'.
                let count = opacity.of_many(from.count(), word(N as u32));
                // A random subset: the samples with the smallest of as many words.
                let mut keyed = [(0_u32, 0_u8); N];
                let n = from.count() as usize;
                for (slot, s) in keyed.iter_mut().zip(from.iter()) {
                    *slot = (word(s as u32), s as u8);
                }
                keyed[..n].sort_unstable();
                keyed[..count as usize].iter().map(|(_, s)| usize::from(*s)).collect()
            }
        }
    }
}

impl<const N: usize> Design for EndertonAt<N> {
    type Pixel = Samples<N>;

    fn state_bits(&self) -> StateBits {
        StateBits {
            samples: N as u32 * (self.depth_bits + self.frame.colour_bits),
            extra: 0,
            unbounded: false,
        }
    }

    fn clear(&self, _site: Site) -> Samples<N> {
        Samples::cleared(self.frame.background)
    }

    fn draw<P: Probe>(
        &self,
        _pass: u32,
        site: Site,
        samples: &mut Samples<N>,
        fragment: &Fragment,
        probe: &mut P,
    ) {
        let z: [Unorm32; N] = self.frame.depths(fragment, self.depth_bits);
        let passed = samples.depth_test(fragment.coverage, &z);
        probe.depth_test(fragment.coverage, passed);
        probe.state(self.depth_bits * fragment.coverage.count(), 0);
        if passed.is_empty() {
            return;
        }
        let from = match self.among {
            Among::Passed => passed,
            Among::Covered => fragment.coverage,
        };
        let written = self.choose(site, fragment, from, probe) & passed;
        for s in written.iter() {
            samples.write(s, z[s], fragment.colour);
        }
        probe.written(written);
        probe.state(0, (self.depth_bits + self.frame.colour_bits) * written.count());
    }

    fn resolve(&self, _site: Site, samples: &Samples<N>) -> [f64; 3] {
        box_filter(&samples.colour)
    }

    fn contents(&self, samples: &Samples<N>) -> Contents {
        Contents { samples: samples.contents(), fields: Vec::new() }
    }
}
