//! Stochastic transparency less the error that chance makes of it: a control variate.
//!
//! What a pixel shows is linear in what its samples hold: each fragment lets what lies behind
//! it through, whatever that is. So the error, what the samples hold less what they would
//! hold on average, obeys the dynamics of the picture: each later fragment in front of it
//! attenuates it by 1 − α. It is kept at a few depths and taken away when the pixel is
//! resolved. As long as its attenuation depends on the fragments alone, never on which
//! samples passed a test, its expectation is 0 and the picture stays unbiased, however roughly
//! the depths follow the fragments. Derivation: `docs/RESIDUAL.md`.

mod abreast;
mod choice;
mod errors;
mod fast;
mod products;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use fearless_simd::Level;

use self::choice::{Drawing, Pairs};
#[cfg(test)]
use self::errors::Flaw;
use self::errors::{Drawn, Entry, POINT, Store, Sums, Width};
use self::fast::FastResidual;
use screendoor_rop::fast::{self as fast_kit, Count, FastEngine};
use screendoor_rop::shader;
#[cfg(test)]
use screendoor_rop::stochastic::comb;
use screendoor_rop::tracked::{PIXEL_ORDER, REFERENCE, SORT};
use screendoor_rop::view_depth::fraction;
use screendoor_rop::{
    Blueprint, ColourStore, Contents, Declaration, Dither, Family, Frame, Info, Layout, OnDevice,
    OpaquePromise, OrderPromise, PixelIndex, PixelOrder, PixelWords, Port, Probe, Promise,
    Promises, Reference, ReferenceKey, Round, SampleList, Sampler, Samples, Site, Stochastic,
    Threshold, TiledDesign, colour, depth_bits, in_sample_order, sort_by_stored_depth, stochastic,
};
use screendoor_trace::error::Result;
use screendoor_trace::param::{Typed, Values};
use screendoor_trace::tile::TileGrid;
use screendoor_trace::trace::{Fragment, SampleMask, Unorm32};

screendoor_trace::options! {
    /// For what part of a pixel errors are kept.
    pub enum Per {
        Pixel = "pixel": "summed over all samples",
        Sample = "sample": "for each: what covers a part of the pixel attenuates only that",
    }
}

const LAYERS: Typed<i64> =
    Typed::integer("layers", "1", (1, 8), "at how many depths errors are kept");
const PER: Typed<Per> = Typed::choice("per", "pixel", "for what part of a pixel errors are kept");
const ERRORS: Typed<Width> =
    Typed::choice("errors", "32", "bits of each of the four sums of an error");
const DRAWN: Typed<Drawing> = Typed::choice("drawn", "paired", "how samples are chosen");
const DITHER: Typed<Dither> =
    Typed::choice("dither", "white", "how xi of 'drawn=paired' is spread over the pixels");

/// The design's entry in the registry.
pub struct Residual;

impl Blueprint for Residual {
    const INFO: Info = Info {
        name: "residual",
        family: Family::Stochastic,
        summary: "samples as evenly chosen as can be, less the error that chance makes of them",
        citation: "screendoor's own (docs/RESIDUAL.md), on Laine, Karras 2011",
        params: &[
            LAYERS.param,
            PER.param,
            ERRORS.param,
            DRAWN.param,
            DITHER.param,
            SORT.param,
            REFERENCE.param,
            PIXEL_ORDER.param,
            depth_bits::PARAM.param,
            colour::PARAM.param,
        ],
        combinations: &[
            "layers=4,per=sample",
            "layers=2,drawn=hashed",
            "per=sample,errors=8",
            "drawn=hashed,reference=white",
        ],
    };

    const MULTIPLICATIONS: bool = true;

    type At<const N: usize> = Stochastic<ResidualSampler<N>, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        Ok(stochastic::single_pass(values, frame, ResidualSampler::of(values, frame)))
    }

    fn fast<const N: usize>(
        values: &Values,
        frame: &Frame,
        level: Level,
    ) -> Result<Option<Box<dyn TiledDesign>>>
    where
        Count<N>: fast_kit::Width,
    {
        let plain = Self::at::<N>(values, frame)?;
        let sampler = FastResidual::new(ResidualSampler::of(values, frame));
        let sampler = sampler.filter(|_| plain.keeps_colours());
        Ok(sampler.map(|sampler| {
            let engine: Box<dyn TiledDesign> = Box::new(FastEngine::new(plain, sampler, level));
            engine
        }))
    }

    const PORTED: bool = true;

    fn port<const N: usize>(values: &Values, frame: &Frame) -> Result<Option<Port>> {
        let plain = Self::at::<N>(values, frame)?;
        let shader = shader!("residual");
        stochastic::port_of_single_pass(shader, &Self::INFO, values, frame, plain).map(Some)
    }

    fn promises(values: &Values) -> Promises {
        let reference = values.get(REFERENCE);
        let scrambled = match values.get(DRAWN) {
            Drawing::Paired => values.get(DITHER).scrambles(reference),
            Drawing::Hashed => reference.scrambles(),
        };
        let chance = scrambled && depth_bits::tells_apart(values);
        // Sums of 16 bits are rounded to nearest, which is a bias, if a small one.
        let to_nearest = values.get(ERRORS) == Width::Half;
        Promises {
            unbiased: Promise::always_if(chance && !to_nearest),
            // Rounding at random is noise that no more samples take away.
            consistent: Promise::always_if(chance && values.get(ERRORS) != Width::Byte),
            order: OrderPromise::Dependent,
            exact_opaque: OpaquePromise::Always,
            seeded: true,
        }
    }
}

/// The choice of samples and the account of its errors, for pixels of `N` samples.
#[derive(Clone, Debug)]
pub struct ResidualSampler<const N: usize> {
    store: Store,
    drawing: Drawing,
    dither: Dither,
    reference: Reference,
    sort: bool,
    pixel_order: PixelOrder,
    depth_bits: u32,
    colours: ColourStore,
    grid: TileGrid,
    positions: Arc<[[i8; 2]]>,
    background: [f32; 3],
    state_bits: u32,
}

/// What a pixel keeps beside its samples.
#[derive(Clone, Debug)]
pub struct Residue {
    /// Its number along the curve.
    index: PixelIndex,
    /// Fragments so far: the next one's number.
    fragments: u32,
    /// From near to far.
    errors: Vec<Entry>,
}

impl<const N: usize> ResidualSampler<N> {
    fn of(values: &Values, frame: &Frame) -> Self {
        let parts = match values.get(PER) {
            Per::Pixel => 1,
            Per::Sample => N,
        };
        let store = Store {
            samples: N as u32,
            parts,
            layers: values.get(LAYERS) as usize,
            width: values.get(ERRORS),
            #[cfg(test)]
            flaw: None,
        };
        ResidualSampler {
            state_bits: store.layout().bits().extra,
            store,
            drawing: values.get(DRAWN),
            dither: values.get(DITHER),
            reference: values.get(REFERENCE),
            sort: values.get(SORT),
            pixel_order: values.get(PIXEL_ORDER),
            depth_bits: depth_bits::of(values),
            colours: ColourStore::of(values, frame),
            grid: frame.grid,
            positions: frame.positions.clone(),
            background: frame.background,
        }
    }

    /// A colour less the background's, and 1, in units of 2^-20.
    ///
    /// No sum of a pixel's samples is beyond 2^29: colours are cut there, which leaves the noise
    /// of what is beyond as it is, and no bias: what is added of a colour is 0 in the mean
    /// whatever the colour.
    fn fixed(&self, colour: [f32; 3]) -> Sums {
        let most = ((1 << 29) / N) as f32;
        let [r, g, b] = std::array::from_fn(|i| {
            let scaled = (colour[i] - self.background[i]) * (1 << POINT) as f32;
            scaled.clamp(-most, most) as i32
        });
        [r, g, b, 1 << POINT]
    }

    /// The samples of `passed` that a fragment with this key and ξ writes.
    fn draw<P: Probe>(
        &self,
        stored: &[Unorm32; N],
        (key, xi): (&ReferenceKey, u32),
        passed: SampleMask,
        threshold: Threshold,
        probe: &mut P,
    ) -> SampleMask {
        let mut list: SampleList<N> = in_sample_order(passed);
        if self.sort {
            sort_by_stored_depth(&mut list, stored);
            probe.sorted(&list);
        }
        let pairs = Pairs::of(xi);
        let mut written = SampleMask::NONE;
        for (n, s) in (0..).zip(&list) {
            let value = match self.drawing {
                #[cfg(test)]
                Drawing::Paired if self.has(Flaw::NoExchange) => comb::comb(xi, n, threshold),
                Drawing::Paired => pairs.value(n, threshold),
                Drawing::Hashed => self.reference.value(n, N as u32, key),
            };
            probe.reference(*s, n, value, threshold);
            if threshold.passes(value) {
                written.insert(usize::from(*s));
            }
        }
        // With a hash a sample another one is needed for rounding alone.
        let at_random = u32::from(self.store.width == Width::Byte);
        let chosen_by = match self.drawing {
            Drawing::Paired => 1,
            Drawing::Hashed => list.len() as u32,
        };
        probe.hashed(chosen_by + at_random);
        written
    }

    /// What a fragment does to the errors that there are, in words.
    fn attenuation(&self, errors: &[Entry], drawn: &Drawn) -> String {
        let alpha = drawn.threshold.value() as f64 / 2_f64.powi(32);
        let covered = f64::from(drawn.coverage.count()) / N as f64;
        let (front, behind) = errors.split_at(errors.partition_point(|e| e.z < drawn.z));
        let [.., coverage] = self.store.of_whole_pixel(front);
        let part = alpha * covered;
        let shown = -part * coverage;
        match (front.len(), behind.len()) {
            (0, 0) => "no errors so far".to_string(),
            (0, n) => format!("lets {:.4} of {n} errors behind it through", 1.0 - part),
            (n, 0) => format!("{n} errors in front of it let {shown:+.4} of it through wrongly"),
            (n, m) => format!(
                "{n} errors in front of it let {shown:+.4} of it through wrongly; of {m} behind it \
                 lets {:.4} through",
                1.0 - part
            ),
        }
    }

    /// Brings the errors up to date with a fragment of which chance lets `written` of the
    /// samples that `passed` be written.
    fn account<P: Probe>(
        &self,
        errors: &mut Vec<Entry>,
        samples: &Samples<N>,
        drawn: &Drawn,
        [passed, written]: [SampleMask; 2],
        probe: &mut P,
    ) {
        // The fragment finds its place among them.
        probe.compared(errors.len() as u32);
        #[cfg(test)]
        let drawn = &self.flawed(drawn, passed);
        probe.remark(|| self.attenuation(errors, drawn));
        if P::LISTENS {
            let front = errors.iter().filter(|entry| entry.z < drawn.z).count();
            probe.multiplied(self.store.attenuating(drawn, [front, errors.len() - front]));
        }
        let own = self.store.attenuate(errors, drawn);
        let own = self.store.make_room(errors, own, probe);
        probe.remark(|| {
            let due = drawn.threshold.value() as f64 / 2_f64.powi(32) * f64::from(passed.count());
            let came = f64::from(written.count()) - due;
            let z = depth(errors[own].z);
            format!("writes {due:.3} samples on average: {came:+.3} of it go to the error at z {z}")
        });
        #[cfg(test)]
        let own = if self.has(Flaw::Misplaced) { errors.len() - 1 } else { own };

        // Where the error of what a sample holds belongs.
        let full = |s: &usize| samples.depth[*s] != Unorm32::FAR;
        let mut nearest = [usize::MAX; N];
        for s in passed.iter().filter(full) {
            nearest[s] = self.store.nearest(errors, samples.depth[s].0);
            probe.compared(errors.len() as u32 - 1);
        }
        for (place, entry) in errors.iter_mut().enumerate() {
            for (part, sums) in entry.parts.iter_mut().enumerate() {
                // What comes, less what goes, if all that passed were written, and what is.
                let mut changes = [[0; 2]; 4];
                let mut changed = false;
                let samples_of_part = match self.store.parts {
                    1 => passed,
                    _ => passed & SampleMask(1 << part),
                };
                for s in samples_of_part.iter() {
                    changed |= place == own || place == nearest[s];
                    let write = i32::from(written.contains(s));
                    let mut change = |colour: Sums, sign: i32| {
                        for (change, x) in changes.iter_mut().zip(colour) {
                            change[0] += sign * x;
                            change[1] += sign * write * x;
                        }
                    };
                    if place == own {
                        change(drawn.colour, 1);
                    }
                    if place == nearest[s] {
                        change(self.fixed(samples.colour[s]), -1);
                    }
                }
                for (sum, change) in sums.iter_mut().zip(changes) {
                    self.store.innovate(sum, drawn.threshold, change);
                }
                probe.multiplied(if changed { 4 } else { 0 });
            }
        }
        self.store.round(errors, drawn.random);
        let entries = self.state_bits;
        let colours = self.colours.colour_bits() * passed.iter().filter(full).count() as u32;
        probe.state(entries + colours, entries);
    }
}

/// A depth as `explain` shows it.
fn depth(z: u32) -> String {
    format!("{:.6}", fraction(Unorm32(z)))
}

impl<const N: usize> Sampler<N> for ResidualSampler<N> {
    type State = Residue;

    fn clear(&self, site: Site) -> Residue {
        let index = self.pixel_order.index(site, self.grid);
        Residue { index, fragments: 0, errors: Vec::new() }
    }

    fn state_bits(&self) -> u32 {
        self.state_bits
    }

    fn layout(&self) -> Layout {
        self.store.layout()
    }

    fn choose<P: Probe>(
        &self,
        round: Round,
        site: Site,
        p: &mut Residue,
        samples: &Samples<N>,
        passed: SampleMask,
        fragment: &Fragment,
        probe: &mut P,
    ) -> SampleMask {
        let Some(lowest) = fragment.coverage.iter().next() else { return SampleMask::NONE };
        let threshold = Threshold::of(fragment.alpha);
        let key = ReferenceKey { pixel: p.index, surface: p.fragments, seed: round.seed };
        let xi = self.dither.in_round(round, site, &key, self.reference);
        let written = self.draw(&samples.depth, (&key, xi), passed, threshold, probe);
        let drawn = Drawn {
            z: fragment.depth.at(self.positions[lowest]).narrowed(self.depth_bits).0,
            coverage: fragment.coverage,
            colour: self.fixed(self.colours.colour(fragment.colour)),
            threshold,
            random: xi,
        };
        self.account(&mut p.errors, samples, &drawn, [passed, written], probe);
        p.fragments = p.fragments.wrapping_add(1);
        written
    }

    const CORRECTS: bool = true;

    fn excess(&self, p: &Residue) -> [f64; 3] {
        let [r, g, b, _] = self.store.of_whole_pixel(&p.errors);
        [r, g, b]
    }

    fn fields(&self, p: &Residue) -> Vec<(&'static str, String)> {
        let words = |entry: &Entry| {
            let [r, g, b, coverage] = self.store.fractions(entry.parts.iter());
            let (z, mass) = (depth(entry.z), f64::from(entry.mass) / f64::from(1 << 15));
            format!("z {z} rgb {r:+.4} {g:+.4} {b:+.4} coverage {coverage:+.4}, mass {mass:.3}")
        };
        let errors = Contents::list(p.errors.iter().map(words));
        vec![("fragments", p.fragments.to_string()), ("errors", errors)]
    }
}

impl<const N: usize> OnDevice<Residue> for ResidualSampler<N> {
    fn declare(&self, to: &mut Declaration) {
        let (samples, layers) = (N as u32, self.store.layers as u32);
        to.field("FRAGMENTS", 1);
        to.field("ENTRIES", 1);
        to.field("ERROR_DEPTH", layers);
        to.field("ERROR_MASS", layers);
        to.field("ERROR_SUMS", 4 * layers * self.store.parts as u32);
        if let Some(ranks) = self.dither.ranks() {
            to.ranks(ranks);
        }
        // Each sample finds its place among all, and its entry; entries are moved, attenuated,
        // merged and rounded part by part.
        let parts = self.store.parts as u32;
        to.iterations(samples * (samples + 1 + self.reference.iterations()));
        to.iterations(layers * samples * (layers + 2) + (layers + 1) * (8 * parts + 8));
    }

    fn read(&self, site: Site, from: &PixelWords<'_>) -> Residue {
        let depths = from.field("ERROR_DEPTH").zip(from.field("ERROR_MASS"));
        let words: Vec<i32> = from.field("ERROR_SUMS").map(|word| word as i32).collect();
        let sums = words.chunks_exact(4).map(|four| [four[0], four[1], four[2], four[3]]);
        let sums: Vec<Sums> = sums.collect();
        let entries = depths.zip(sums.chunks_exact(self.store.parts));
        let entries = entries.take(from.word("ENTRIES") as usize);
        let errors = entries.map(|((z, mass), parts)| Entry { z, mass, parts: parts.into() });
        Residue {
            index: self.pixel_order.index(site, self.grid),
            fragments: from.word("FRAGMENTS"),
            errors: errors.collect(),
        }
    }
}
