//! Systematic coverage: one random number a surface, the samples' reference values
//! evenly spaced from it.
//!
//! With threshold T = ⌈α·2^32⌉ the k-th sample of a surface passes iff
//! `(ξ + T·(k+1)) mod 2^32 < T`: systematic sampling (Madow 1949), the sum of T
//! passing a multiple of 2^32. Any run of m samples in a row passes ⌊αm⌋ or ⌈αm⌉
//! times, for every m, where LK's values have that for aligned powers of two.

use crate::error::Result;
use crate::param::{Param, Values};
use crate::rop::stochastic::{self, COMBINATIONS, METHOD, OPAQUE, ROUNDS, STRATA};
use crate::rop::tracked::{
    COMPACT, PIXEL_ORDER, PREHASH, REFERENCE, References, SORT, SURFACES, SampleOf, TRACK,
    TrackedSampler, chance_decides_surfaces,
};
use crate::rop::{
    Blueprint, Dither, Family, Frame, Info, OpaquePromise, OrderPromise, Promises, Reference,
    Stochastic, depth_bits,
};

crate::options! {
    /// What the place of a sample in its surface is counted in.
    pub enum Phase {
        Sum = "sum": "the sum of the alphas before it: even where alpha varies, for 32 bits a pixel",
        Count = "count": "its number times its own alpha: no state, uneven where alpha varies",
    }
}

const PHASE: Param = Param::choice::<Phase>("phase", "sum", "how the samples of a surface follow");
const DITHER: Param =
    Param::choice::<Dither>("dither", "sequence", "how xi is spread over the pixels");

/// The design's entry in the registry.
pub struct Systematic;

impl Blueprint for Systematic {
    const INFO: Info = Info {
        name: "systematic",
        family: Family::Stochastic,
        summary: "as lk, with one random number a surface and evenly spaced reference values",
        citation: "screendoor's own: Laine, Karras 2011 with systematic sampling (Madow: On the Theory of Systematic Sampling II, 1949)",
        params: &[
            PHASE,
            DITHER,
            SORT,
            COMPACT,
            SURFACES,
            TRACK,
            PIXEL_ORDER,
            REFERENCE,
            PREHASH,
            METHOD,
            ROUNDS,
            STRATA,
            OPAQUE,
            depth_bits::PARAM,
        ],
        combinations: &COMBINATIONS,
    };

    type At<const N: usize> = Stochastic<TrackedSampler<Evenly, N>, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        let references = Evenly {
            phase: values.choice(PHASE.name),
            dither: values.choice(DITHER.name),
            reference: values.choice(REFERENCE.name),
        };
        stochastic::with_methods(values, frame, TrackedSampler::new(values, frame, references))
    }

    fn promises(values: &Values) -> Promises {
        let scrambled = values.choice::<Dither>(DITHER.name) != Dither::Sequence
            || values.choice::<Reference>(REFERENCE.name).scrambles();
        let apart = depth_bits::tells_apart(values);
        let basic = Promises {
            unbiased: apart && scrambled && !chance_decides_surfaces(values),
            consistent: apart,
            order: OrderPromise::Dependent,
            exact_opaque: OpaquePromise::Always,
            seeded: true,
        };
        stochastic::promises(values, basic)
    }
}

/// Evenly spaced reference values.
///
/// Where alpha varies within a surface, the phase is the sum of the thresholds of
/// the samples before. Added to a uniform ξ it stays uniform, so that each sample
/// passes with probability α whatever the alphas before it: unbiased. And samples
/// pass where the sum passes a whole number, so that any run passes ⌊Σα⌋ or ⌈Σα⌉
/// times: stratified. A phase of k times the sample's own threshold is as unbiased,
/// but jumps where alpha changes, so that the count is no longer within one of Σα.
#[derive(Clone, Copy, Debug)]
pub struct Evenly {
    phase: Phase,
    dither: Dither,
    reference: Reference,
}

impl References for Evenly {
    /// The last phase of the surface; with [`Phase::Count`], ξ within a fragment.
    type Kept = Option<u32>;

    fn value<const N: usize>(
        &self,
        kept: &mut Option<u32>,
        n: u32,
        of: &SampleOf<'_>,
    ) -> (u32, u32) {
        let again = self.phase == Phase::Count && of.first;
        let (before, hashes) = match *kept {
            Some(phase) if !again => (phase, 0),
            _ => (self.dither.value(of.site, of.key, self.reference), 1),
        };
        // Modulo 2^32: an opaque fragment's threshold, 2^32, leaves the phase as it is.
        let threshold = of.opacity.value() as u32;
        // Rounds that are stratified together number their samples one after the other.
        let earlier = threshold.wrapping_mul(of.round.index * N as u32);
        match self.phase {
            Phase::Sum => {
                let start = if kept.is_none() { before.wrapping_add(earlier) } else { before };
                let phase = start.wrapping_add(threshold);
                *kept = Some(phase);
                (phase, hashes)
            }
            Phase::Count => {
                *kept = Some(before);
                let steps = threshold.wrapping_mul(n + 1);
                (before.wrapping_add(earlier).wrapping_add(steps), hashes)
            }
        }
    }

    fn kept_bits(&self) -> u32 {
        match self.phase {
            Phase::Sum => 32,
            Phase::Count => 0,
        }
    }
}
