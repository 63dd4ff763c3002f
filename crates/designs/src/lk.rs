//! Stratified sampling for stochastic transparency (Laine and Karras, EGSR 2011).
//!
//! The algorithm's text, after the paper's figures 4 and 7, is
//! [`screendoor_rop::tracked`] with [`screendoor_rop::Reference`].

use fearless_simd::Level;

use screendoor_trace::error::Result;
use screendoor_trace::param::Values;
use screendoor_rop::fast::{
    Count, FastEngine, FastTracked, Given, Published, PublishedHash, Width, is_published,
};
use screendoor_rop::stochastic::{self, COMBINATIONS, METHOD, OPAQUE, ROUNDS, STRATA};
use screendoor_rop::tracked::{
    COMPACT, Hashed, PIXEL_ORDER, PREHASH, REFERENCE, SORT, SURFACES, TRACK, TrackedSampler,
    chance_decides_surfaces,
};
use screendoor_rop::{
    Blueprint, Engine, Family, Frame, Info, OpaquePromise, OrderPromise, Port, Promise, Promises,
    Reference, Stochastic, colour, depth_bits,
};
use screendoor_rop::shader;

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
            colour::PARAM,
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
        if !plain.keeps_colours() {
            return Ok(None);
        }
        if is_published(values) {
            let sampler = FastTracked::<_, _, N>::new(values, Published, PublishedHash);
            return Ok(Some(Box::new(FastEngine::new(plain, sampler, level))));
        }
        let references = Hashed(values.choice(REFERENCE.name));
        let sampler = FastTracked::<_, _, N>::new(values, Given::of(values), references);
        Ok(Some(Box::new(FastEngine::new(plain, sampler, level))))
    }

    const PORTED: bool = true;

    fn port<const N: usize>(values: &Values, frame: &Frame) -> Result<Option<Port>> {
        let plain = Self::at::<N>(values, frame)?;
        Ok(Some(stochastic::port((shader!("lk"), true), &Self::INFO, values, frame, plain)))
    }

    fn promises(values: &Values) -> Promises {
        let reference: Reference = values.choice(REFERENCE.name);
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
                apart && (scrambled || (values.flag(COMPACT.name) && values.flag(SORT.name))),
            ),
            order: OrderPromise::Dependent,
            exact_opaque: OpaquePromise::Always,
            seeded: true,
        };
        stochastic::promises(values, basic)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::configure;
    use screendoor_trace::random::Stream;
    use screendoor_rop::fast::{Flaw, levels};
    use screendoor_rop::{Contents, Told};
    use screendoor_trace::tile::{TileGrid, TileId};
    use screendoor_trace::trace::{Block, DepthPlane, Fragment, SampleMask, Unorm32};

    const PIXELS: u16 = 4;

    fn fragments(samples: u32) -> Vec<Fragment> {
        let mut random = Stream::new([0xde7ec7, samples]);
        let mut mask = || {
            let bits = u64::from(random.word()) << 32 | u64::from(random.word());
            SampleMask(bits | 1 << random.below(samples)) & SampleMask::first(samples)
        };
        let masks: Vec<SampleMask> = (0..300).map(|_| mask()).collect();
        let fragment = |coverage| Fragment {
            x: random.below(PIXELS.into()) as u16,
            y: 0,
            coverage,
            depth: DepthPlane { z: Unorm32((1 << 30) + random.below(1 << 16)), dzdx: 9, dzdy: -40 },
            colour: [random.unit(); 3],
            alpha: random.unit(),
            primitive: 0,
            object: 0,
        };
        masks.into_iter().map(fragment).collect()
    }

    /// What the pixels hold after every few fragments.
    fn held(engine: &dyn Engine, samples: u32) -> Vec<Contents> {
        let (grid, tile) = (TileGrid::new(16, 16), TileId(0));
        let mut state = engine.clear(grid, tile);
        let mut list = Vec::new();
        for part in fragments(samples).chunks(20).flat_map(Block::all_of) {
            engine.draw(0, &mut state, &part, Told::Nobody);
            list.extend((0..usize::from(PIXELS)).map(|within| engine.contents(&state, within)));
        }
        list
    }

    /// A wrong bit in any lane, of a depth or of a choice, is told from the plain text.
    fn check<const N: usize>()
    where
        Count<N>: Width,
    {
        let frame = Frame {
            grid: TileGrid::new(16, 16),
            positions: (0..N as i32)
                .map(|s| [(s % 8 * 2 - 8) as i8, (s / 8 * 2 - 8) as i8])
                .collect(),
            background: [0.5; 3],
            seed: 3,
            colour_bits: 96,
            opaque: true,
            primitive_depths: None,
        };
        let design = configure("lk", &[]).unwrap();
        let plain = || LaineKarras::at::<N>(design.values(), &frame).unwrap();
        let expected = held(&plain(), N as u32);
        for (name, level) in levels() {
            let fast = || {
                let sampler =
                    FastTracked::<_, _, N>::new(design.values(), Published, PublishedHash);
                FastEngine::new(plain(), sampler, level)
            };
            assert_eq!(held(&fast(), N as u32), expected, "{name}");
            for flaw in (0..N).flat_map(|lane| [Flaw::Depth(lane), Flaw::Choice(lane)]) {
                let found = held(&fast().with_flaw(flaw), N as u32);
                assert_ne!(found, expected, "{name}, {N} samples: {flaw:?} stays hidden");
            }
        }
    }

    #[test]
    fn a_defect_in_any_lane_is_found() {
        check::<1>();
        check::<2>();
        check::<4>();
        check::<8>();
        check::<16>();
        check::<32>();
        check::<64>();
    }
}
