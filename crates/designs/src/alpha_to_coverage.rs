//! Alpha to coverage with a fixed mask for each alpha, as multisample hardware has it:
//! the known wrong answer. Layers of one alpha cover the same samples and hide each
//! other instead of blending (Enderton et al. 2011, section 2).

use screendoor_rop::stochastic::{self, Round, Sampler, Stochastic};
use screendoor_rop::{
    Blueprint, Family, Frame, Info, OpaquePromise, OrderPromise, Probe, Promises, Samples, Site,
    Threshold, colour, depth_bits,
};
use screendoor_trace::error::Result;
use screendoor_trace::param::Values;
use screendoor_trace::trace::{Fragment, SampleMask};

/// The design's entry in the registry.
pub struct AlphaToCoverage;

impl Blueprint for AlphaToCoverage {
    const INFO: Info = Info {
        name: "alpha-to-coverage",
        family: Family::Stochastic,
        summary: "the same samples for the same alpha: layers hide each other (the known wrong answer)",
        citation: "OpenGL 4.6 specification, section 17.3.1 (GL_SAMPLE_ALPHA_TO_COVERAGE)",
        params: &[depth_bits::PARAM.param, colour::PARAM.param],
        combinations: &[],
    };

    const MULTIPLICATIONS: bool = true;

    type At<const N: usize> = Stochastic<FixedMask, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        Ok(stochastic::single_pass(values, frame, FixedMask))
    }

    fn promises(values: &Values) -> Promises {
        Promises {
            order: match depth_bits::tells_apart(values) {
                true => OrderPromise::Independent,
                false => OrderPromise::Dependent,
            },
            exact_opaque: OpaquePromise::Always,
            seeded: false,
            ..Promises::NONE
        }
    }
}

/// The first `⌊αN + ½⌋` samples: what hardware adds in a fixed order as alpha grows.
/// A trace's sample patterns are nested, so that any first ones are well spread.
#[derive(Clone, Copy, Debug)]
pub struct FixedMask;

impl<const N: usize> Sampler<N> for FixedMask {
    type State = ();

    fn clear(&self, _site: Site) {}

    fn state_bits(&self) -> u32 {
        0
    }

    fn choose<P: Probe>(
        &self,
        _round: Round,
        _site: Site,
        (): &mut (),
        _samples: &Samples<N>,
        passed: SampleMask,
        fragment: &Fragment,
        _probe: &mut P,
    ) -> SampleMask {
        const HALF: u32 = 1 << 31;
        passed & SampleMask::first(Threshold::of(fragment.alpha).of_many(N as u32, HALF))
    }
}
