//! Stochastic transparency (Enderton, Sintorn, Shirley, Luebke, TVCG 2011).

mod fast;

use arrayvec::ArrayVec;
use fearless_simd::Level;

use crate::enderton::fast::FastEnderton;
use screendoor_rop::fast::{Count, FastEngine, Width};
use screendoor_rop::shader;
use screendoor_rop::stochastic::{self, COMBINATIONS, METHOD, OPAQUE, ROUNDS, STRATA};
use screendoor_rop::{
    Blueprint, Declaration, Dither, Family, Frame, Info, OnDevice, OpaquePromise, OrderPromise,
    PixelOrder, PixelWords, Port, Probe, Promise, Promises, Reference, ReferenceKey, Round,
    Sampler, Samples, Site, Stochastic, Threshold, TiledDesign, colour, depth_bits, random_subset,
    stratified,
};
use screendoor_trace::error::Result;
use screendoor_trace::param::{Typed, Values};
use screendoor_trace::random::hash;
use screendoor_trace::tile::TileGrid;
use screendoor_trace::trace::{Fragment, MAX_SAMPLES, SampleMask};

screendoor_trace::options! {
    /// How a fragment's samples are chosen.
    pub enum MaskRule {
        Stratified = "stratified": "floor(alpha n + xi) of the fragment's n samples, at random (section 3.1)",
        Naive = "naive": "each sample on its own, with probability alpha",
        Table = "table": "a mask from a table over alpha and a random number (section 5)",
    }
}

screendoor_trace::options! {
    /// Which samples of a fragment are chosen from.
    pub enum Among {
        Passed = "passed": "those that pass the depth test (as Laine and Karras read it)",
        Covered = "covered": "all that it covers",
    }
}

screendoor_trace::options! {
    /// What, beside the pixel, a fragment's random numbers depend on (section 6).
    pub enum SeedBy {
        Primitive = "primitive": "its primitive: masks change at triangles' edges",
        Depth = "z": "its depth at the pixel's centre: still pictures only",
        Object = "object": "its object: fragments of one object hide each other",
    }
}

/// The design's entry in the registry.
pub struct Enderton;

const MASK: Typed<MaskRule> =
    Typed::choice("mask", "stratified", "how a fragment's samples are chosen");
const AMONG: Typed<Among> = Typed::choice("among", "passed", "which samples are chosen from");
const DITHER: Typed<Dither> = Typed::choice(
    "dither",
    "white",
    "how xi, which rounds the number of samples, is spread over pixels (section 3.1)",
);
const SEED_BY: Typed<SeedBy> =
    Typed::choice("seed-by", "primitive", "what names a fragment's mask");
const TABLE_WIDTH: Typed<i64> =
    Typed::integer("table-width", "2047", (1, 65535), "masks for each alpha in the table");
const ALPHA_BITS: Typed<i64> =
    Typed::integer("alpha-bits", "10", (1, 16), "bits of alpha that the table tells apart");

impl Blueprint for Enderton {
    const INFO: Info = Info {
        name: "enderton",
        family: Family::Stochastic,
        summary: "each fragment writes a random share of its samples, stratified within the fragment",
        citation: "Enderton, Sintorn, Shirley, Luebke: Stochastic Transparency, TVCG 17(8), 2011",
        params: &[
            MASK.param,
            AMONG.param,
            DITHER.param,
            SEED_BY.param,
            TABLE_WIDTH.param,
            ALPHA_BITS.param,
            METHOD.param,
            ROUNDS.param,
            STRATA.param,
            OPAQUE.param,
            depth_bits::PARAM.param,
            colour::PARAM.param,
        ],
        combinations: &COMBINATIONS_OF_ENDERTON,
    };

    const MULTIPLICATIONS: bool = true;

    type At<const N: usize> = Stochastic<EndertonSampler<N>, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        stochastic::with_methods(values, frame, EndertonSampler::new(values, frame))
    }

    fn fast<const N: usize>(
        values: &Values,
        frame: &Frame,
        level: Level,
    ) -> Result<Option<Box<dyn TiledDesign>>>
    where
        Count<N>: Width,
    {
        if stochastic::strata_over_rounds(values) {
            return Ok(None);
        }
        let sampler = EndertonSampler::new(values, frame);
        let Some(sampler) = FastEnderton::new(sampler, depth_bits::of(values)) else {
            return Ok(None);
        };
        let plain = Self::at::<N>(values, frame)?;
        if !plain.keeps_colours() {
            return Ok(None);
        }
        Ok(Some(Box::new(FastEngine::new(plain, sampler, level))))
    }

    const PORTED: bool = true;

    fn port<const N: usize>(values: &Values, frame: &Frame) -> Result<Option<Port>> {
        let plain = Self::at::<N>(values, frame)?;
        Ok(Some(stochastic::port((shader!("enderton"), false), &Self::INFO, values, frame, plain)))
    }

    fn promises(values: &Values) -> Promises {
        // What a fragment chooses follows from its primitive alone, unless it
        // chooses among the samples that earlier fragments have left it.
        let mask: MaskRule = values.get(MASK);
        let of_itself = mask != MaskRule::Stratified || values.get(AMONG) == Among::Covered;
        let apart = depth_bits::tells_apart(values);
        // One object's surfaces share their masks, and so do fragments of one depth; a
        // table's alphas are rounded.
        let own_masks = match values.get(SEED_BY) {
            SeedBy::Primitive => Promise::Always,
            SeedBy::Depth => Promise::DistinctDepths,
            SeedBy::Object => Promise::Never,
        };
        let basic = Promises {
            unbiased: Promise::always_if(apart && mask != MaskRule::Table).min(own_masks),
            // As far as the most samples that a pixel can have tell.
            consistent: Promise::always_if(
                apart && (mask != MaskRule::Table || values.get(ALPHA_BITS) >= 8),
            )
            .min(own_masks),
            order: match apart && of_itself {
                true => OrderPromise::Independent,
                false => OrderPromise::Dependent,
            },
            exact_opaque: OpaquePromise::Always,
            seeded: true,
        };
        stochastic::promises(values, basic)
    }
}

const COMBINATIONS_OF_ENDERTON: [&str; COMBINATIONS.len() + 4] = [
    COMBINATIONS[0],
    COMBINATIONS[1],
    COMBINATIONS[2],
    COMBINATIONS[3],
    "mask=naive,method=alpha-correction",
    "mask=naive,method=depth",
    "mask=table,alpha-bits=3,table-width=64",
    "dither=blue-noise,method=depth-correction",
];

/// The choice of samples for pixels of `N` samples.
#[derive(Clone, Debug)]
pub struct EndertonSampler<const N: usize> {
    grid: TileGrid,
    mask: MaskRule,
    among: Among,
    dither: Dither,
    seed_by: SeedBy,
    table_width: u32,
    alpha_levels: u32,
}

/// The most samples of all rounds that are stratified together.
const MAX_SLOTS: usize = 8 * MAX_SAMPLES as usize;

/// Random words as they are drawn for one fragment.
#[derive(Clone, Copy)]
struct Words {
    seed: u32,
    pixel: u32,
    /// What the fragment is seeded by.
    source: u32,
}

/// A pixel as it is hashed.
fn pixel_word(site: Site) -> u32 {
    u32::from(site.y) << 16 | u32::from(site.x)
}

impl Words {
    fn word(&self, place: u32) -> u32 {
        hash([self.seed, self.pixel, self.source, place])
    }
}

impl<const N: usize> EndertonSampler<N> {
    fn new(values: &Values, frame: &Frame) -> Self {
        EndertonSampler {
            grid: frame.grid,
            mask: values.get(MASK),
            among: values.get(AMONG),
            dither: values.get(DITHER),
            seed_by: values.get(SEED_BY),
            table_width: values.get(TABLE_WIDTH) as u32,
            alpha_levels: (1 << values.get(ALPHA_BITS)) - 1,
        }
    }

    /// The fragment's random words.
    #[inline]
    fn words(&self, round: Round, site: Site, fragment: &Fragment) -> Words {
        Words {
            seed: round.seed,
            pixel: pixel_word(site),
            // The random words belong to what the fragment is part of, so that it is
            // treated alike wherever it stands in the stream.
            source: match self.seed_by {
                SeedBy::Primitive => fragment.primitive,
                SeedBy::Depth => fragment.depth.z.0,
                SeedBy::Object => fragment.object,
            },
        }
    }

    /// ξ of the fragment, and where it comes from.
    fn xi(&self, round: Round, site: Site, words: Words) -> u32 {
        if self.dither == Dither::White {
            // One word further than the samples'.
            return words.word(N as u32 * round.count);
        }
        self.dither.value(site, &self.key(site, words), Reference::Lk2011)
    }

    /// What a dither is told of the fragment.
    fn key(&self, site: Site, words: Words) -> ReferenceKey {
        let pixel = PixelOrder::Hilbert.index(site, self.grid);
        ReferenceKey { pixel, surface: words.source, seed: words.seed }
    }

    /// ξ of the fragment in one of several rounds that are stratified together. What other
    /// rounds have left of the fragment need not be known: where it is the same n samples
    /// in each of R, they write ⌊R·αn⌋ or ⌈R·αn⌉ together, as one round of as many would.
    fn xi_of_round(&self, round: Round, site: Site, words: Words) -> u32 {
        if self.dither == Dither::White {
            let first = N as u32 * round.count + 1;
            return stratified(round, self.xi(round, site, words), |r| words.word(first + r));
        }
        self.dither.in_round(round, site, &self.key(site, words), Reference::Lk2011)
    }

    /// `⌊α·n + ξ⌋` of the `n` slots at random: those with the smallest of as many
    /// words; those of the round, as samples.
    fn subset(round: Round, from: SampleMask, count: u32, word: impl Fn(u32) -> u32) -> SampleMask {
        if round.count == 1 {
            return random_subset(from, count, word);
        }
        let mut keyed: ArrayVec<(u32, u16), MAX_SLOTS> = ArrayVec::new();
        for r in 0..round.count {
            keyed.extend(from.iter().map(|s| {
                let slot = r * N as u32 + s as u32;
                (word(slot), slot as u16)
            }));
        }
        keyed.sort_unstable();
        let chosen = keyed[..count as usize].iter().map(|(_, slot)| usize::from(*slot));
        chosen.filter(|slot| slot / N == round.index as usize).map(|slot| slot % N).collect()
    }
}

impl<const N: usize> Sampler<N> for EndertonSampler<N> {
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
        if passed.is_empty() {
            return SampleMask::NONE;
        }
        let words = self.words(round, site, fragment);
        let from = match self.among {
            Among::Passed => passed,
            Among::Covered => fragment.coverage,
        };
        let opacity = Threshold::of(fragment.alpha);
        let chosen = match self.mask {
            MaskRule::Naive => {
                probe.hashed(from.count());
                let passes = |s: &usize| {
                    let x = words.word(round.index * N as u32 + *s as u32);
                    probe.reference(*s as u8, *s as u32, x, opacity);
                    opacity.passes(x)
                };
                from.iter().filter(passes).collect()
            }
            // What other rounds leave of a fragment is not known: its ξ alone are
            // stratified over the rounds.
            MaskRule::Stratified if self.among == Among::Passed => {
                let ordered = if round.count > 1 { round.count } else { 0 };
                probe.hashed(1 + from.count() + ordered);
                let count = opacity.of_many(from.count(), self.xi_of_round(round, site, words));
                random_subset(from, count, |s| words.word(round.index * N as u32 + s))
            }
            MaskRule::Stratified => {
                let slots = from.count() * round.count;
                probe.hashed(1 + slots);
                let count = opacity.of_many(slots, self.xi(round, site, words));
                Self::subset(round, from, count, |slot| words.word(slot))
            }
            MaskRule::Table => {
                probe.hashed(1);
                self.look_up(round, fragment.alpha, words)
            }
        };
        chosen & passed
    }
}

impl<const N: usize> EndertonSampler<N> {
    /// A mask of the table: of the alpha's row, the column that the fragment's hash
    /// names. The table belongs to the run's seed; its entries are computed when they
    /// are read. The columns' ξ are even, so that each row has its alpha on average.
    fn look_up(&self, round: Round, alpha: f32, words: Words) -> SampleMask {
        let levels = self.alpha_levels;
        let row = (alpha * levels as f32).round() as u32;
        let column = ((u64::from(words.word(N as u32)) * u64::from(self.table_width)) >> 32) as u32;
        let slots = u64::from(round.count) * N as u64;
        let xi =
            (2 * u64::from(column) + 1) * u64::from(levels) / (2 * u64::from(self.table_width));
        let count = (u64::from(row) * slots + xi) / u64::from(levels);
        let word = |slot| hash([words.seed, row, column, slot]);
        Self::subset(round, SampleMask::first(N as u32), count as u32, word)
    }
}

impl<const N: usize> OnDevice<()> for EndertonSampler<N> {
    fn declare(&self, to: &mut Declaration) {
        // Each sample finds its place among the slots of all rounds.
        let slots = MAX_SLOTS as u32 / MAX_SAMPLES * N as u32;
        to.iterations(slots * (N as u32 + 1));
        if let Some(ranks) = self.dither.ranks() {
            to.ranks(ranks);
        }
    }

    fn read(&self, _: Site, _: &PixelWords<'_>) {}
}
