//! Stratified sampling for stochastic transparency (Laine and Karras, EGSR 2011).
//!
//! The algorithm's text, after the paper's figures 4 and 7, is
//! [`crate::rop::tracked`] with [`crate::rop::Reference`].

use fearless_simd::Level;

use crate::error::Result;
use crate::param::Values;
use crate::rop::fast::{
    Count, FastEngine, FastTracked, Given, Published, PublishedHash, Width, is_published,
};
use crate::rop::stochastic::{self, COMBINATIONS, METHOD, OPAQUE, ROUNDS, STRATA};
use crate::rop::tracked::{
    COMPACT, Hashed, PIXEL_ORDER, PREHASH, REFERENCE, SORT, SURFACES, TRACK, TrackedSampler,
    chance_decides_surfaces,
};
use crate::rop::{
    Blueprint, Engine, Family, Frame, Info, OpaquePromise, OrderPromise, Promises, Reference,
    Stochastic, depth_bits,
};

/// The design's entry in the registry.
pub struct LaineKarras;

impl Blueprint for LaineKarras {
    const INFO: Info = Info {
        name: "lk",
        family: Family::Stochastic,
        summary: "surface tracking, samples sorted by stored depth, hashed reference values",
        citation: "Laine, Karras: Stratified Sampling for Stochastic Transparency, EGSR 2011",
        params: &[
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

    type At<const N: usize> = Stochastic<TrackedSampler<Hashed, N>, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        let references = Hashed(values.choice(REFERENCE.name));
        stochastic::with_methods(values, frame, TrackedSampler::new(values, frame, references))
    }

    fn fast<const N: usize>(
        values: &Values,
        frame: &Frame,
        level: Level,
    ) -> Result<Option<Box<dyn Engine>>>
    where
        Count<N>: Width,
    {
        let plain = Self::at::<N>(values, frame)?;
        if is_published(values) {
            let sampler = FastTracked::<_, _, N>::new(values, Published, PublishedHash);
            return Ok(Some(Box::new(FastEngine::new(plain, sampler, level))));
        }
        let references = Hashed(values.choice(REFERENCE.name));
        let sampler = FastTracked::<_, _, N>::new(values, Given::of(values), references);
        Ok(Some(Box::new(FastEngine::new(plain, sampler, level))))
    }

    fn promises(values: &Values) -> Promises {
        let reference: Reference = values.choice(REFERENCE.name);
        // Independent values break the link between a surface's samples.
        let by_chance = reference != Reference::White && chance_decides_surfaces(values);
        // Without scrambling, a pixel's surfaces share their reference values.
        let scrambled = reference.scrambles();
        let apart = depth_bits::tells_apart(values);
        let basic = Promises {
            unbiased: apart && scrambled && !by_chance,
            // Unscrambled values still share out each stored surface evenly, as long as
            // its samples are numbered in a row.
            consistent: apart
                && (scrambled || (values.flag(COMPACT.name) && values.flag(SORT.name))),
            order: OrderPromise::Dependent,
            exact_opaque: OpaquePromise::Always,
            seeded: true,
        };
        stochastic::promises(values, basic)
    }
}
