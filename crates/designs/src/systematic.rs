//! Systematic coverage: one random number a surface, the samples' reference values
//! evenly spaced from it.
//!
//! With threshold T = ⌈α·2^32⌉ the k-th sample of a surface passes iff
//! `(ξ + T·(k+1)) mod 2^32 < T`: systematic sampling (Madow 1949), the sum of T
//! passing a multiple of 2^32. Any run of m samples in a row passes ⌊αm⌋ or ⌈αm⌉
//! times, for every m, where LK's values have that for aligned powers of two.
//!
//! At an α near 1/2 every other sample passes; the next surface, whose samples come in the
//! order of what those left, takes every other of them again: the same of two patterns
//! over and over, which aliases where there are enough samples for it. So within a fragment the
//! two samples of each pair exchange their places in the row at random (`exchange`). Elsewhere
//! that only blurs what the row keeps even.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, u32x16};

use screendoor_rop::fast::{
    Base, Count, Counted, FastEngine, FastReferences, FastTracked, Lanes, Limit, Loaded, Numbered,
    NumberedAbreast, Parameterised, Published, Tally, Width, below, is_published, teeth,
};
use screendoor_rop::shader;
use screendoor_rop::stochastic::comb::{among, comb, exchanged};
use screendoor_rop::stochastic::{self, COMBINATIONS, METHOD, OPAQUE, ROUNDS, STRATA};
use screendoor_rop::tracked::{
    COMPACT, PIXEL_ORDER, PREHASH, REFERENCE, References, SORT, SURFACES, SampleOf, TRACK,
    TrackedSampler, chance_decides_surfaces,
};
use screendoor_rop::{
    Blueprint, Declaration, Dither, Family, Frame, Info, OnDevice, OpaquePromise, OrderPromise,
    PixelWords, Port, Probe, Promise, Promises, Reference, ReferenceKey, Round, Site, Stochastic,
    Threshold, TiledDesign, colour, depth_bits,
};
use screendoor_trace::error::Result;
use screendoor_trace::param::{Typed, Values};
use screendoor_trace::random::hash;

screendoor_trace::options! {
    /// What the place of a sample in its surface is counted in.
    pub enum Phase {
        Sum = "sum": "the sum of the alphas before it: even where alpha varies, for 32 bits a pixel",
        Count = "count": "its number times its own alpha: no state, uneven where alpha varies",
    }
}

screendoor_trace::options! {
    /// Where the two samples of each pair of a fragment exchange their places at random.
    pub enum Exchange {
        Never = "never": "nowhere: aliases at an alpha of 1/2",
        Half = "half": "where more than 16 samples of a fragment follow and alpha is within half a sample's share of 1/2",
        Always = "always": "everywhere",
    }
}

impl Exchange {
    /// Whether it is done with a threshold by a fragment of so many samples.
    #[inline(always)]
    fn holds(self, threshold: Threshold, samples: u32) -> bool {
        const HALF: u64 = 1 << 31;
        match self {
            Exchange::Never => false,
            Exchange::Half => {
                samples > FEW && threshold.value().abs_diff(HALF) <= HALF / u64::from(samples)
            }
            Exchange::Always => true,
        }
    }
}

/// So many samples are too few to alias.
const FEW: u32 = 16;

const PHASE: Typed<Phase> = Typed::choice("phase", "sum", "how the samples of a surface follow");
const DITHER: Typed<Dither> =
    Typed::choice("dither", "sequence", "how xi is spread over the pixels");
const EXCHANGE: Typed<Exchange> =
    Typed::choice("exchange", "half", "where the two samples of a pair exchange places at random");

/// The design's entry in the registry.
pub struct Systematic;

impl Blueprint for Systematic {
    const INFO: Info = Info {
        name: "systematic",
        family: Family::Stochastic,
        summary: "as lk, with one random number a surface and evenly spaced reference values",
        citation: "screendoor's own: Laine, Karras 2011 with systematic sampling (Madow: On the Theory of Systematic Sampling II, 1949)",
        params: &[
            PHASE.param,
            DITHER.param,
            EXCHANGE.param,
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

    type At<const N: usize> = Stochastic<TrackedSampler<Evenly, N>, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        let sampler = TrackedSampler::new(values, frame, Evenly::of(values));
        stochastic::with_methods(values, frame, sampler)
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
        let references = Evenly::of(values);
        let summed_along_the_curve = references.phase == Phase::Sum
            && references.dither == Dither::Sequence
            && references.exchange == Exchange::Half
            && is_published(values);
        if summed_along_the_curve {
            let sampler = FastTracked::<_, _, N>::new(values, Published, Summed);
            return Ok(Some(Box::new(FastEngine::new(plain, sampler, level))));
        }
        let sampler = FastTracked::<_, _, N>::new(values, Parameterised::of(values), references);
        Ok(Some(Box::new(FastEngine::new(plain, sampler, level))))
    }

    const PORTED: bool = true;

    fn port<const N: usize>(values: &Values, frame: &Frame) -> Result<Option<Port>> {
        let plain = Self::at::<N>(values, frame)?;
        Ok(Some(stochastic::port((shader!("systematic"), true), &Self::INFO, values, frame, plain)))
    }

    fn promises(values: &Values) -> Promises {
        let scrambled = values.get(DITHER).scrambles(values.get(REFERENCE));
        let apart = depth_bits::tells_apart(values);
        let basic = Promises {
            unbiased: Promise::always_if(apart && scrambled && !chance_decides_surfaces(values)),
            // Unsorted, one surface's evenly spaced samples fall upon those of the one
            // before it in the same way however many there are.
            consistent: Promise::always_if(apart && values.get(SORT)),
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
    exchange: Exchange,
    reference: Reference,
}

impl Evenly {
    fn of(values: &Values) -> Self {
        Evenly {
            phase: values.get(PHASE),
            dither: values.get(DITHER),
            exchange: values.get(EXCHANGE),
            reference: values.get(REFERENCE),
        }
    }
}

/// Keeps the words for pairs apart from others that a surface might be hashed with.
const PAIRS: u32 = 0x0bad_cab5;

/// Which of a fragment's `count` pairs exchange their places. One hash, which has nothing to do
/// with ξ: so a sample's probability stays alpha.
fn pairs(round: &Round, key: &ReferenceKey, count: u32) -> u32 {
    among(hash([key.seed, key.pixel.0, key.surface, round.index, PAIRS]), count)
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
        let again = self.phase == Phase::Count && of.place == 0;
        let (before, hashes) = match *kept {
            Some(phase) if !again => (phase, 0),
            _ => (self.dither.in_round(of.round, of.site, of.key, self.reference), 1),
        };
        // Modulo 2^32: an opaque fragment's threshold, 2^32, leaves the phase as it is.
        let threshold = of.opacity.value() as u32;
        // Where the fragment's first sample starts, and what is kept after this one.
        let (start, after) = match self.phase {
            Phase::Sum => (
                before.wrapping_sub(threshold.wrapping_mul(of.place)),
                before.wrapping_add(threshold),
            ),
            Phase::Count => (before.wrapping_add(threshold.wrapping_mul(n - of.place)), before),
        };
        *kept = Some(after);
        if !self.exchange.holds(of.opacity, of.count) {
            return (comb(start, of.place, of.opacity), hashes);
        }
        let place = exchanged(of.place, pairs(&of.round, of.key, of.count));
        (comb(start, place, of.opacity), hashes + u32::from(of.place == 0))
    }

    fn kept_bits(&self) -> u32 {
        match self.phase {
            Phase::Sum => 32,
            Phase::Count => 0,
        }
    }
}

impl OnDevice<Option<u32>> for Evenly {
    fn declare(&self, to: &mut Declaration) {
        if let Some(ranks) = self.dither.ranks() {
            to.ranks(ranks);
        }
        // A reference value's, and the places of the rounds.
        to.iterations(u32::BITS + 8);
        // Whether there is one, behind it.
        to.field("PHASE", if self.phase == Phase::Sum { 2 } else { 0 });
    }

    fn read(&self, _: Site, from: &PixelWords<'_>) -> Option<u32> {
        let words: Vec<u32> = from.field("PHASE").collect();
        (words.get(1) == Some(&1)).then(|| words[0])
    }
}

impl<const N: usize> FastReferences<N> for Evenly {
    type Plain = Evenly;
    type Kept = Option<u32>;

    fn to_plain(kept: Option<u32>) -> Option<u32> {
        kept
    }
    fn of_plain(kept: &Option<u32>) -> Option<u32> {
        *kept
    }

    #[inline(always)]
    fn passing<S: Simd, L: Lanes<S>, P: Probe>(
        &self,
        simd: S,
        loaded: &Loaded<L>,
        kept: &mut Option<u32>,
        samples: Numbered<'_>,
        tally: &mut Tally<'_, P>,
    ) -> u64 {
        let Numbered { of, limit, first, count, .. } = samples;
        if count == 0 {
            return 0;
        }
        let threshold = of.opacity.value() as u32;
        let xi = match *kept {
            Some(phase) if self.phase == Phase::Sum => phase,
            _ => {
                tally.hashed(1);
                self.dither.in_round(of.round, of.site, of.key, self.reference)
            }
        };
        // Phases of a run of samples are even steps on; `first` is where it starts.
        let start = match self.phase {
            Phase::Sum => xi,
            Phase::Count => xi.wrapping_add(threshold.wrapping_mul(first)),
        };
        let end = start.wrapping_add(threshold.wrapping_mul(count));
        *kept = Some(if self.phase == Phase::Sum { end } else { xi });
        let exchanges = exchanges(self.exchange, &samples, tally);
        evenly(simd, loaded, (start, exchanges), limit)
    }
}

/// [`pairs`] of a fragment, where its pairs exchange their places.
#[inline(always)]
fn exchanges<P: Probe>(
    exchange: Exchange,
    samples: &Numbered<'_>,
    tally: &mut Tally<'_, P>,
) -> u32 {
    let Numbered { of, limit, count, .. } = samples;
    if *count == 0 || !exchange.holds(limit.threshold(), *count) {
        return 0;
    }
    tally.hashed(1);
    pairs(&of.round, of.key, *count)
}

/// Which of a run of samples pass whose phases follow a start in even steps, pairs exchanged.
#[inline(always)]
fn evenly<S: Simd, L: Lanes<S>>(
    simd: S,
    loaded: &Loaded<L>,
    (start, exchanges): (u32, u32),
    limit: Limit,
) -> u64 {
    below(simd, teeth(simd, loaded, start, exchanges, limit.threshold()), limit)
}

/// [`Evenly`] with the parameters that it has by default, known when the kernel is
/// compiled.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Summed;

impl<const N: usize> FastReferences<N> for Summed {
    type Plain = Evenly;
    /// The phase after the surface's last sample, and whether there was one.
    type Kept = (u32, bool);

    fn to_plain((phase, begun): (u32, bool)) -> Option<u32> {
        begun.then_some(phase)
    }
    fn of_plain(kept: &Option<u32>) -> (u32, bool) {
        (kept.unwrap_or_default(), kept.is_some())
    }

    /// One value a pixel and round.
    fn base(round: &Round, key: &ReferenceKey) -> Base {
        Base::of(round.index, round.count, key)
    }

    #[inline(always)]
    fn passing<S: Simd, L: Lanes<S>, P: Probe>(
        &self,
        simd: S,
        loaded: &Loaded<L>,
        kept: &mut (u32, bool),
        samples: Numbered<'_>,
        tally: &mut Tally<'_, P>,
    ) -> u64 {
        let Numbered { limit, base, starts, count, .. } = samples;
        let (phase, begun) = *kept;
        tally.hashed(u32::from(!begun && count > 0));
        let threshold = limit.threshold().value() as u32;
        // Of the next surface in any case: then it need not be waited for.
        let next = base.of_surface(1).first_lk2011();
        let start = match (starts, begun) {
            (true, _) => next,
            (false, true) => phase,
            (false, false) => first(base),
        };
        *kept = (start.wrapping_add(threshold.wrapping_mul(count)), begun || count > 0);
        let exchanges = exchanges(Exchange::Half, &samples, tally);
        evenly(simd, loaded, (start, exchanges), limit)
    }

    const KEEPS: bool = true;

    fn word((phase, _): (u32, bool)) -> u32 {
        phase
    }
    fn of_word(phase: u32, begun: bool) -> (u32, bool) {
        (phase, begun)
    }

    fn goes_abreast(&self) -> bool {
        // Samples as few as are drawn so exchange no places.
        N as u32 <= FEW
    }

    #[inline(always)]
    fn passing_abreast<S: Simd, P: Probe>(
        &self,
        simd: S,
        samples: &NumberedAbreast<S>,
        phase: &mut u32x16<S>,
        counted: &mut Counted<S, P>,
    ) -> u32x16<S> {
        let NumberedAbreast { fresh, count, .. } = *samples;
        let word = |word: u32| u32x16::splat(simd, word);
        let some = count.simd_gt(word(0));
        counted.hashed((fresh & some).select(word(1), word(0)));
        let mut tooth = fresh.select(samples.first_lk2011(simd), *phase);
        *phase = tooth + samples.threshold() * count;
        samples.passing::<N>(
            simd,
            #[inline(always)]
            |_| {
                tooth += samples.threshold();
                tooth
            },
        )
    }
}

/// The random number of a pixel's very first surface.
#[cold]
#[inline(never)]
fn first(base: Base) -> u32 {
    base.first_lk2011()
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_rop::PixelIndex;
    use screendoor_trace::random::Stream;

    /// Evenly spaced values.
    fn evenly(phase: Phase, exchange: Exchange) -> Evenly {
        Evenly { phase, dither: Dither::White, exchange, reference: Reference::Lk2011 }
    }

    /// Which of a surface's samples pass, their alphas given fragment by fragment.
    fn passes(evenly: Evenly, seed: u32, fragments: &[(f32, u32)]) -> Vec<bool> {
        let key = ReferenceKey { pixel: PixelIndex(5), surface: 0, seed };
        let round = Round { index: 0, count: 1, seed };
        let (mut kept, mut n, mut list) = (None, 0, Vec::new());
        for (alpha, samples) in fragments {
            let opacity = Threshold::of(*alpha);
            for place in 0..*samples {
                let (site, count) = (Site { x: 0, y: 0 }, *samples);
                let of = SampleOf { site, key: &key, round, opacity, place, count };
                let (reference, _) = evenly.value::<64>(&mut kept, n, &of);
                list.push(opacity.passes(reference));
                n += 1;
            }
        }
        list
    }

    #[test]
    fn any_run_of_samples_passes_floor_or_ceiling_times() {
        for seed in 0..50 {
            for alpha in [0.0, 0.01, 0.3, 0.5, 0.61, 0.999, 1.0] {
                for phase in [Phase::Sum, Phase::Count] {
                    let list = passes(evenly(phase, Exchange::Never), seed, &[(alpha, 64)]);
                    let exchanged = passes(evenly(phase, Exchange::Always), seed, &[(alpha, 64)]);
                    for (start, end) in (0..64).flat_map(|a| (a + 1..=64).map(move |b| (a, b))) {
                        // Pairs are whole or not at all.
                        let list = if start % 2 == 0 && end % 2 == 0 { &exchanged } else { &list };
                        let count = list[start..end].iter().filter(|p| **p).count() as f64;
                        let expected = f64::from(alpha) * (end - start) as f64;
                        // Thresholds round alpha up by less than 2^-32.
                        assert!((count - expected).abs() < 1.0 + 1e-6, "{alpha}: {start}..{end}");
                    }
                }
            }
        }
    }

    #[test]
    fn where_alpha_varies_the_sum_keeps_the_strata_and_the_count_does_not() {
        let mut random = Stream::new([9]);
        let mut worst = [0.0_f64; 2];
        let (mut means, mut expected_mean) = ([0.0; 2], 0.0);
        for seed in 0..4000 {
            let fragments: Vec<(f32, u32)> =
                (0..8).map(|_| (random.unit(), 1 + random.below(7))).collect();
            let expected: f64 =
                fragments.iter().map(|(alpha, n)| f64::from(*alpha) * f64::from(*n)).sum();
            expected_mean += expected;
            for (i, phase) in [Phase::Sum, Phase::Count].into_iter().enumerate() {
                let list = passes(evenly(phase, Exchange::Always), seed, &fragments);
                let count = list.iter().filter(|p| **p).count();
                worst[i] = worst[i].max((count as f64 - expected).abs());
                means[i] += count as f64;
            }
        }
        assert!(worst[0] < 1.0 + 1e-6 && worst[1] > 1.5, "{worst:?}");
        // Both are right on average: a surface's count deviates by at most about 1.5,
        // its mean over 4000 by 0.024; six of them.
        for mean in means {
            assert!((mean - expected_mean).abs() / 4000.0 < 0.15, "{mean} of {expected_mean}");
        }
    }

    #[test]
    fn at_an_alpha_of_a_half_two_patterns_become_many() {
        let patterns = |samples| {
            [Exchange::Never, Exchange::Half, Exchange::Always].map(|exchange| {
                let of = |seed| passes(evenly(Phase::Sum, exchange), seed, &[(0.5, samples)]);
                (0..64).map(of).collect::<std::collections::HashSet<_>>().len()
            })
        };
        // Of 2^4 with four pairs; of 2^16 with sixteen, hardly one twice.
        assert_eq!(patterns(8), [2, 2, 16]);
        let [never, half, always] = patterns(32);
        assert!(never == 2 && half > 60 && always > 60, "{never} {half} {always}");
    }
}
