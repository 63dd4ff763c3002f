//! Stratified sampling for stochastic transparency (Laine and Karras, EGSR 2011).
//!
//! The algorithm's text, after the paper's figures 4 and 7, is
//! [`screendoor_rop::tracked`] with [`screendoor_rop::Reference`].

use fearless_simd::Level;

use screendoor_rop::fast::{
    Count, FastEngine, FastTracked, Parameterised, Published, PublishedHash, Width, is_published,
};
use screendoor_rop::shader;
use screendoor_rop::stochastic::{self, COMBINATIONS, METHOD, OPAQUE, ROUNDS, STRATA};
use screendoor_rop::tracked::{
    COMPACT, Hashed, PIXEL_ORDER, PREHASH, REFERENCE, SORT, SURFACES, TRACK, TrackedSampler,
    chance_decides_surfaces,
};
use screendoor_rop::{
    Blueprint, Family, Frame, Info, OpaquePromise, OrderPromise, Port, Promise, Promises,
    Reference, Stochastic, TiledDesign, colour, depth_bits,
};
use screendoor_trace::error::Result;
use screendoor_trace::param::Values;

/// The design's entry in the registry.
pub struct LaineKarras;

impl Blueprint for LaineKarras {
    const INFO: Info = Info {
        name: "lk",
        family: Family::Stochastic,
        summary: "surface tracking, samples sorted by stored depth, hashed reference values",
        citation: "Laine, Karras: Stratified Sampling for Stochastic Transparency, EGSR 2011",
        params: &[
            SORT.param,
            COMPACT.param,
            SURFACES.param,
            TRACK.param,
            PIXEL_ORDER.param,
            REFERENCE.param,
            PREHASH.param,
            METHOD.param,
            ROUNDS.param,
            STRATA.param,
            OPAQUE.param,
            depth_bits::PARAM.param,
            colour::PARAM.param,
        ],
        combinations: &COMBINATIONS,
    };

    const MULTIPLICATIONS: bool = true;

    type At<const N: usize> = Stochastic<TrackedSampler<Hashed, N>, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        let references = Hashed(values.get(REFERENCE));
        stochastic::with_methods(values, frame, TrackedSampler::new(values, frame, references))
    }

    fn fast<const N: usize>(
        values: &Values,
        frame: &Frame,
        level: Level,
    ) -> Result<Option<Box<dyn TiledDesign>>>
    where
        Count<N>: Width,
    {
        let plain = Self::at::<N>(values, frame)?;
        if !plain.keeps_colours() {
            return Ok(None);
        }
        if is_published(values) {
            let sampler = FastTracked::<_, _, N>::new(values, Published, PublishedHash);
            return Ok(Some(Box::new(FastEngine::new(plain, sampler, level))));
        }
        let references = Hashed(values.get(REFERENCE));
        let sampler = FastTracked::<_, _, N>::new(values, Parameterised::of(values), references);
        Ok(Some(Box::new(FastEngine::new(plain, sampler, level))))
    }

    const PORTED: bool = true;

    fn port<const N: usize>(values: &Values, frame: &Frame) -> Result<Option<Port>> {
        let plain = Self::at::<N>(values, frame)?;
        Ok(Some(stochastic::port((shader!("lk"), true), &Self::INFO, values, frame, plain)))
    }

    fn promises(values: &Values) -> Promises {
        let reference: Reference = values.get(REFERENCE);
        // Independent values break the link between a surface's samples.
        let by_chance = reference != Reference::White && chance_decides_surfaces(values);
        // Without scrambling, a pixel's surfaces share their reference values.
        let scrambled = reference.scrambles();
        let apart = depth_bits::tells_apart(values);
        let basic = Promises {
            unbiased: Promise::always_if(apart && scrambled && !by_chance),
            // Unscrambled values still share out each stored surface evenly, as long as
            // its samples are numbered in a row.
            consistent: Promise::always_if(
                apart && (scrambled || (values.get(COMPACT) && values.get(SORT))),
            ),
            order: OrderPromise::Dependent,
            exact_opaque: OpaquePromise::Always,
            seeded: true,
        };
        stochastic::promises(values, basic)
    }
}
