//! Stochastic layered alpha blending (Wyman, SIGGRAPH Talks 2016): a k-buffer into
//! which a fragment is put with the probability that stochastic transparency of `b`
//! bits would show anything of it, and in which the furthest of one layer too many
//! is dropped.
//!
//! What the publication leaves open, and what was found:
//!
//! - *Partial coverage.* A layer has the mask of the samples that it covers, besides
//!   its opacity; the b bits subdivide every sample alike. A fragment is as visible
//!   as at that of its samples where nearer layers hide it least.
//! - *Discrete opacity*: a layer keeps b random bits, and is put in if one of them can
//!   be seen. That happens with the probability `P_b` (of
//!   [`visible_stratified`](screendoor_rop::visible_stratified)); a draw beside the bits
//!   would discard fragments that are seen. Layers show as many bits as they have
//!   before all others, whatever comes later.
//! - *Continuous opacity*: "discretised" is read as `⌊αb + ξ⌋`, for a fragment and for
//!   what lies before it, each with a ξ of its own. Over both ξ a fragment is put in
//!   with the linear interpolation of `P_b` in s and t, so one random word does. A
//!   layer that is put in has all of its alpha: what is discarded is never made up
//!   for, so the picture is too transparent. A lone fragment of α = 1/(2b) is there
//!   half the time. `weigh=true`, which is not in the publication, divides alpha by
//!   the probability (made no less than alpha): then the expectation is exact as long
//!   as no layer is dropped.
//! - *b = n is stochastic transparency* with discrete opacity, where fragments cover
//!   whole pixels and come near to far: the bits are those of its samples. In other
//!   orders, layers that nearer ones have come to hide still take room, and visible
//!   ones are dropped for them; `hidden=removed` makes it true in every order. With
//!   continuous opacity the second fragment, near to far, enters as likely as
//!   stochastic transparency would show it; then it shows all of its alpha.
//! - *b without bound* (`bits=0`) is the k-buffer, bit for bit.
//! - Layers are ordered as at the pixel's centre. Where no two cross within a pixel,
//!   `normalise=none` is unbiased for discrete opacity with as many layers as bits
//!   (where samples are covered alike) and hidden ones removed, and with `weigh=true`
//!   where no layer is dropped.

use screendoor_rop::layers::{
    self, COVERAGE, Columns, Coverage, DEPTH_BITS, Deep, LAYERS, Layer, composite, contents,
    nearer, passing, room,
};
use screendoor_rop::shader;
use screendoor_rop::{
    Blueprint, Contents, Declaration, Family, Frame, Info, Layout, Normalise, OnDevice,
    OpaquePromise, OrderPromise, OverOpaque, PixelWords, Port, Probe, Promises, Site, Threshold,
    Transparent, VisibilitySums, colour, over_opaque, random_subset, visible_independent,
    visible_stratified,
};
use screendoor_trace::error::Result;
use screendoor_trace::param::{Typed, Values};
use screendoor_trace::random::hash;
use screendoor_trace::trace::{Fragment, SampleMask, Unorm32};

screendoor_trace::options! {
    /// How a layer keeps its opacity.
    pub enum Opacity {
        Continuous = "continuous": "an alpha, which is discretised to compute probabilities",
        Discrete = "discrete": "a mask of random bits",
    }
}

screendoor_trace::options! {
    /// The probability with which a fragment is put in, and how discrete bits are drawn.
    pub enum Insertion {
        Stratified = "stratified": "equation 1: floor(alpha b + xi) bits, at random",
        Independent = "independent": "each bit on its own, with probability alpha",
    }
}

screendoor_trace::options! {
    /// What becomes of layers of which nearer ones leave nothing to be seen.
    pub enum Hidden {
        Kept = "kept": "they stay, as published",
        Removed = "removed": "they make room (discrete opacity)",
    }
}

/// The design's entry in the registry.
pub struct Slab;

const BITS: Typed<i64> =
    Typed::integer("bits", "16", (0, 64), "virtual coverage bits b; 0: without bound");
const OPACITY: Typed<Opacity> =
    Typed::choice("opacity", "continuous", "how layers keep their opacity");
const INSERTION: Typed<Insertion> =
    Typed::choice("insertion", "stratified", "how likely fragments enter");
const NORMALISE: Typed<Normalise> = Typed::choice(
    "normalise",
    "both",
    "what a second pass adds up (Enderton et al. 2011, sections 3.3 and 3.4)",
);
const HIDDEN: Typed<Hidden> =
    Typed::choice("hidden", "kept", "what becomes of layers wholly hidden");
const WEIGH: Typed<bool> =
    Typed::flag("weigh", false, "divide alpha by the probability to enter (continuous)");

impl Blueprint for Slab {
    const INFO: Info = Info {
        name: "slab",
        family: Family::Stochastic,
        summary: "a k-buffer that fragments enter as likely as stochastic transparency would show them",
        citation: "Wyman: Stochastic Layered Alpha Blending, SIGGRAPH Talks 2016",
        params: &[
            over_opaque::PARAM.param,
            LAYERS.param,
            BITS.param,
            OPACITY.param,
            INSERTION.param,
            NORMALISE.param,
            HIDDEN.param,
            WEIGH.param,
            COVERAGE.param,
            colour::PARAM.param,
        ],
        combinations: &[
            "opacity=discrete,normalise=none",
            "opacity=discrete,insertion=independent,normalise=none",
            "layers=16,opacity=discrete,hidden=removed,normalise=none",
            "layers=16,opacity=discrete,hidden=removed,normalise=none,coverage=share",
            "layers=32,weigh=true,normalise=none",
            "bits=0,normalise=none",
        ],
    };

    type At<const N: usize> = OverOpaque<SlabAt<N>, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        let (columns, bits) = (Columns::of(values, frame), values.get(BITS) as u32);
        let opacity = if bits == 0 { Opacity::Continuous } else { values.get(OPACITY) };
        let inner = SlabAt {
            columns,
            seed: frame.seed,
            room: room(values),
            bits,
            opacity,
            insertion: values.get(INSERTION),
            normalise: values.get(NORMALISE),
            hidden: values.get(HIDDEN),
            weigh: values.get(WEIGH),
        };
        Ok(OverOpaque::new(values, frame, over_opaque::of(values), inner))
    }

    const PORTED: bool = true;

    fn port<const N: usize>(values: &Values, frame: &Frame) -> Result<Option<Port>> {
        let plain = Self::at::<N>(values, frame)?;
        Ok(Some(Port::of(shader!("slab"), &Self::INFO, values, frame, plain)))
    }

    fn promises(values: &Values) -> Promises {
        let bits = values.get(BITS);
        // Visible layers in a single column are never more than bits: none is dropped
        // that would be seen.
        let complete = values.get(OPACITY) == Opacity::Discrete
            && values.get(HIDDEN) == Hidden::Removed
            && values.get(LAYERS) >= bits
            && values.get(COVERAGE) == Coverage::Share;
        let unsummed = values.get(NORMALISE) == Normalise::None;
        Promises {
            // What finds no layer before it enters whatever came earlier, and where there
            // is room for one alone, the nearest such stays.
            order: match (bits == 0 || complete || values.get(LAYERS) == 1, unsummed) {
                (true, true) => OrderPromise::Independent,
                (true, false) => OrderPromise::UpToRounding,
                (false, _) => OrderPromise::Dependent,
            },
            exact_opaque: over_opaque::exactness(values, OpaquePromise::Never),
            seeded: bits != 0,
            // Samples of a pixel share their bits.
            ..Promises::NONE
        }
    }
}

/// The design for pixels of `N` samples.
#[derive(Clone, Debug)]
pub struct SlabAt<const N: usize> {
    columns: Columns<N>,
    seed: u32,
    room: usize,
    bits: u32,
    opacity: Opacity,
    insertion: Insertion,
    normalise: Normalise,
    hidden: Hidden,
    weigh: bool,
}

/// A layer. With discrete opacity it is opaque where it has a bit.
#[derive(Clone, Copy, Debug)]
struct SlabLayer {
    layer: Layer,
    bits: SampleMask,
}

impl Deep for SlabLayer {
    fn depth(&self) -> Unorm32 {
        self.layer.depth
    }
}

/// A pixel.
#[derive(Clone, Debug, Default)]
pub struct SlabPixel {
    /// From near to far.
    layers: Vec<SlabLayer>,
    sums: VisibilitySums,
}

impl<const N: usize> SlabAt<N> {
    /// What a layer holds.
    fn fields(&self) -> [(u32, &'static str); 4] {
        let store = self.columns.store;
        [
            (DEPTH_BITS, "depth"),
            (self.columns.mask_bits(), "coverage"),
            (store.colour_bits(), "colour"),
            match self.opacity {
                Opacity::Continuous => (store.channel_bits(), "alpha"),
                Opacity::Discrete => (self.bits, "opacity bits"),
            },
        ]
    }

    fn layer_bits(&self) -> u32 {
        self.fields().iter().map(|(bits, _)| bits).sum()
    }

    /// The bits that layers leave free in a column.
    fn free(&self, layers: &[SlabLayer], column: usize) -> SampleMask {
        let here = layers.iter().filter(|l| l.layer.coverage.contains(column));
        SampleMask(here.fold(SampleMask::first(self.bits).0, |free, l| free & !l.bits.0))
    }

    /// What layers show in a column, and how much passes them.
    fn through(&self, layers: &[SlabLayer], column: usize) -> ([f64; 3], f64) {
        if self.opacity == Opacity::Continuous {
            return composite(layers.iter().map(|l| &l.layer), column);
        }
        let share = |bits: SampleMask| f64::from(bits.count()) / f64::from(self.bits);
        let mut free = SampleMask::first(self.bits);
        let mut colour = [0.0; 3];
        for SlabLayer { layer, bits } in layers.iter().filter(|l| l.layer.coverage.contains(column))
        {
            for (sum, c) in colour.iter_mut().zip(layer.colour) {
                *sum += share(*bits & free) * f64::from(c);
            }
            free.0 &= !bits.0;
        }
        (colour, share(free))
    }

    /// How much passes layers in each column.
    fn passes(&self, layers: &[SlabLayer]) -> [f64; N] {
        if self.opacity == Opacity::Continuous {
            return passing(layers.iter().map(|l| &l.layer));
        }
        let share = |column| f64::from(self.free(layers, column).count()) / f64::from(self.bits);
        std::array::from_fn(share)
    }

    /// The probability with which a fragment of this alpha enters behind layers that
    /// leave `passes`: `P_b`, linear between whole numbers of bits, which is its mean
    /// over `s = ⌊(1 − passes)·b + ξ⌋` and `t = ⌊α·b + ξ'⌋`.
    fn probability(&self, passes: f64, alpha: f64) -> f64 {
        let b = f64::from(self.bits);
        let ends = |x: f64| {
            let whole = (x * b).clamp(0.0, b).floor();
            [(whole as u32, 1.0 - (x * b - whole)), (whole as u32 + 1, x * b - whole)]
        };
        let mut mean = 0.0;
        for (s, of_s) in ends((1.0 - passes).clamp(0.0, 1.0)) {
            for (t, of_t) in ends(alpha).iter().filter(|(t, w)| *t <= self.bits && *w > 0.0) {
                if s <= self.bits && of_s > 0.0 {
                    mean += of_s
                        * of_t
                        * match self.insertion {
                            Insertion::Stratified => visible_stratified(self.bits, s, *t),
                            Insertion::Independent => visible_independent(self.bits, s, *t),
                        };
                }
            }
        }
        // So that no alpha exceeds 1, and nothing is hidden that in part is not.
        if self.weigh { mean.max(alpha) } else { mean }
    }

    /// Draws a fragment's bits.
    fn random_bits<P: Probe>(
        &self,
        alpha: f32,
        word: impl Fn(u32) -> u32,
        probe: &mut P,
    ) -> SampleMask {
        let (threshold, all) = (Threshold::of(alpha), SampleMask::first(self.bits));
        match self.insertion {
            Insertion::Stratified => {
                probe.hashed(1 + self.bits);
                random_subset(all, threshold.of_many(self.bits, word(self.bits)), word)
            }
            Insertion::Independent => {
                probe.hashed(self.bits);
                all.iter().filter(|i| threshold.passes(word(*i as u32))).collect()
            }
        }
    }

    /// The layer that a fragment becomes behind those `before` it, if it enters.
    fn layer<P: Probe>(
        &self,
        site: Site,
        before: &[SlabLayer],
        fragment: &Fragment,
        probe: &mut P,
    ) -> Option<SlabLayer> {
        let pixel = u32::from(site.y) << 16 | u32::from(site.x);
        let word = |place| hash([self.seed, pixel, fragment.primitive, place]);
        let (coverage, alpha) = self.columns.place(fragment);
        if self.opacity == Opacity::Discrete {
            let bits = self.random_bits(alpha, word, probe);
            let layer = Layer {
                depth: fragment.depth.z,
                coverage,
                colour: self.columns.store.colour(fragment.colour),
                transmittance: 0.0,
            };
            let seen = coverage.iter().any(|s| !(self.free(before, s) & bits).is_empty());
            return seen.then_some(SlabLayer { layer, bits });
        }
        let whole = SlabLayer { layer: self.columns.layer(fragment), bits: SampleMask::NONE };
        if self.bits == 0 {
            return Some(whole);
        }
        let passes = self.passes(before);
        let most = coverage.iter().map(|s| passes[s]).fold(0.0, f64::max);
        let p = self.probability(most, alpha.into());
        probe.hashed(1);
        if !Threshold::of(p as f32).passes(word(0)) {
            return None;
        }
        if !self.weigh {
            return Some(whole);
        }
        let alpha = (f64::from(alpha) / p) as f32;
        Some(SlabLayer {
            layer: self.columns.stored(Layer {
                colour: fragment.colour.map(|c| c * alpha),
                transmittance: 1.0 - alpha,
                ..whole.layer
            }),
            ..whole
        })
    }

    /// Removes layers of which nearer ones leave nothing to be seen.
    fn remove_hidden(&self, layers: &mut Vec<SlabLayer>) {
        let mut i = 0;
        while i < layers.len() {
            let (before, SlabLayer { layer, bits }) = (&layers[..i], layers[i]);
            if layer.coverage.iter().any(|s| !(self.free(before, s) & bits).is_empty()) {
                i += 1;
            } else {
                layers.remove(i);
            }
        }
    }

    fn enter<P: Probe>(&self, site: Site, pixel: &mut SlabPixel, f: &Fragment, probe: &mut P) {
        let layers = &mut pixel.layers;
        let place = nearer(layers, f.depth.z, probe);
        if place == self.room {
            return;
        }
        let unread = self.layer_bits() - DEPTH_BITS;
        if self.bits != 0 {
            // What lies before decides whether it enters.
            probe.state(unread * place as u32, 0);
        }
        let Some(layer) = self.layer(site, &layers[..place], f, probe) else {
            return;
        };
        // What lies behind moves, if it stays.
        probe.state(unread * (layers.len() - place) as u32, 0);
        layers.insert(place, layer);
        if self.hidden == Hidden::Removed && self.opacity == Opacity::Discrete {
            self.remove_hidden(layers);
        }
        layers.truncate(self.room);
        probe.state(0, self.layer_bits() * layers.len().saturating_sub(place) as u32);
        probe.written(f.coverage);
    }
}

impl<const N: usize> Transparent<N> for SlabAt<N> {
    type Pixel = SlabPixel;

    fn passes(&self) -> u32 {
        if self.normalise == Normalise::None { 1 } else { 2 }
    }

    fn layout(&self) -> Layout {
        let sums = self.normalise.layout(self.columns.count() as u32, self.columns.store);
        Layout::of(self.room as u32, &self.fields()).joined(sums)
    }

    fn clear(&self, _site: Site) -> SlabPixel {
        SlabPixel::default()
    }

    fn draw<P: Probe>(
        &self,
        pass: u32,
        site: Site,
        pixel: &mut SlabPixel,
        fragment: &Fragment,
        probe: &mut P,
    ) {
        if pass == 0 {
            return self.enter(site, pixel, fragment, probe);
        }
        let (coverage, alpha) = self.columns.place(fragment);
        let visible = if self.normalise.by_depth() {
            let place = nearer(&pixel.layers, fragment.depth.z, probe);
            probe.state((self.layer_bits() - DEPTH_BITS) * pixel.layers.len() as u32, 0);
            let passes = self.passes(&pixel.layers[..place]);
            coverage.iter().map(|s| passes[s]).sum()
        } else {
            0.0
        };
        let columns = self.columns.count();
        let store = self.columns.store;
        let colour = fragment.colour;
        pixel.sums.add(self.normalise, store, columns, coverage, colour, alpha, visible);
        probe.written(fragment.coverage);
        let bits = self.normalise.bits(coverage.count(), store);
        probe.state(bits, bits);
    }

    fn resolve(&self, _site: Site, pixel: &SlabPixel, behind: &[[f32; 3]; N]) -> [f64; 3] {
        let own = |column| self.through(&pixel.layers, column);
        pixel.sums.resolve(self.normalise, self.columns, behind, own)
    }

    fn visibility(&self, pixel: &SlabPixel, at: &[Unorm32; N]) -> Option<[f64; N]> {
        let passes = |nearer: &[SlabLayer], column: usize| self.through(nearer, column).1;
        Some(self.columns.passing_nearer(&pixel.layers, at, passes))
    }

    fn contents(&self, pixel: &SlabPixel) -> Contents {
        let mut contents = contents(pixel.layers.iter().map(|l| &l.layer));
        if self.opacity == Opacity::Discrete {
            let bits = pixel.layers.iter().map(|l| format!("{:#x}", l.bits.0));
            contents.fields.push(("bits", bits.collect::<Vec<_>>().join(" ")));
        }
        contents.fields.extend(pixel.sums.words(self.normalise));
        contents
    }
}

impl<const N: usize> OnDevice<SlabPixel> for SlabAt<N> {
    fn declare(&self, to: &mut Declaration) {
        layers::declare(self.room, to);
        let (room, columns, bits) = (self.room as u32, self.columns.count() as u32, self.bits);
        let discrete = self.opacity == Opacity::Discrete;
        to.field("BITS", if discrete { 2 * room } else { 0 });
        let sums = u32::from(self.normalise != Normalise::None);
        to.field("SUMMED", sums);
        to.field("SUM", 4 * sums);
        to.field("PASSES", columns * sums);
        // What is seen behind the layers, before and after the fragment is among them; its
        // bits, each held against all, or its probability.
        let hidden = if self.hidden == Hidden::Removed { room + 1 } else { 0 };
        to.iterations((columns + 1) * (room + 2) * (1 + hidden) + bits * (bits + 1).max(8));
    }

    fn read(&self, _: Site, from: &PixelWords<'_>) -> SlabPixel {
        let words: Vec<u32> = from.field("BITS").collect();
        let mut bits = words.chunks(2).map(|pair| u64::from(pair[1]) << 32 | u64::from(pair[0]));
        let layer = |layer| SlabLayer { layer, bits: SampleMask(bits.next().unwrap_or_default()) };
        SlabPixel {
            layers: layers::read(from).into_iter().map(layer).collect(),
            sums: match self.normalise {
                Normalise::None => VisibilitySums::default(),
                _ => VisibilitySums::read(self.normalise, from),
            },
        }
    }
}
