//! Layers of sixteen pixels.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over channels and halves are unrolled into registers; closures would be called"
)]

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, f64x8, mask32x16, u32x16};

use crate::contract::colour::ColourStore;
use crate::contract::event::Probe;
use crate::in_lanes::{LANES, Met, Told, Wide, counted, widened, words};
use crate::layered::layers::{Columns, Coverage, DEPTH_BITS, Layer};
use screendoor_trace::trace::{SampleMask, Unorm32};

/// A layer of each of sixteen pixels. One that is not there lies behind all others, covers
/// nothing and lets all through.
#[derive(Clone, Copy)]
pub struct LayerLanes<S: Simd> {
    /// [`Layer::depth`].
    pub depth: u32x16<S>,
    /// [`Layer::coverage`].
    pub coverage: u32x16<S>,
    /// [`Layer::colour`].
    pub colour: [f32x16<S>; 3],
    /// [`Layer::transmittance`].
    pub transmittance: f32x16<S>,
}

impl<S: Simd> LayerLanes<S> {
    /// No layers.
    #[inline(always)]
    pub fn none(simd: S) -> Self {
        LayerLanes {
            depth: u32x16::splat(simd, u32::MAX),
            coverage: u32x16::splat(simd, 0),
            colour: [f32x16::splat(simd, 0.0); 3],
            transmittance: f32x16::splat(simd, 1.0),
        }
    }

    /// This one where `mask` says, and the other elsewhere.
    #[inline(always)]
    pub fn or(self, mask: mask32x16<S>, other: Self) -> Self {
        let mut chosen = other;
        chosen.depth = mask.select(self.depth, other.depth);
        chosen.coverage = mask.select(self.coverage, other.coverage);
        for c in 0..3 {
            chosen.colour[c] = mask.select(self.colour[c], other.colour[c]);
        }
        chosen.transmittance = mask.select(self.transmittance, other.transmittance);
        chosen
    }

    /// Where they are the same.
    #[inline(always)]
    pub fn same(&self, other: &Self) -> mask32x16<S> {
        let mut same = self.depth.simd_eq(other.depth);
        same &= self.coverage.simd_eq(other.coverage);
        for c in 0..3 {
            same &= self.colour[c].simd_eq(other.colour[c]);
        }
        same & self.transmittance.simd_eq(other.transmittance)
    }

    /// [`Layer::merged`].
    #[inline(always)]
    pub fn merged(&self, simd: S, behind: &Self) -> Self {
        let (s, d) = (self, behind);
        let (nought, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
        let both = counted(simd, s.coverage & d.coverage);
        let union = s.coverage | d.coverage;
        let n = counted(simd, union);
        let alike = s.coverage.simd_eq(d.coverage);
        let mine = alike.select(nought, (counted(simd, s.coverage) - both) / n);
        let theirs = alike.select(nought, (counted(simd, d.coverage) - both) / n);
        let shared = alike.select(one, both / n);
        let (near, far) = (mine + shared, theirs + shared * s.transmittance);
        let mut merged = *s;
        merged.coverage = union;
        for c in 0..3 {
            merged.colour[c] = s.colour[c] * near + d.colour[c] * far;
        }
        merged.transmittance =
            s.transmittance * (mine + shared * d.transmittance) + theirs * d.transmittance;
        merged
    }
}

/// The layers of sixteen pixels, near ones first.
#[derive(Clone)]
pub struct ListLanes<S: Simd> {
    /// As many as there is room for.
    layers: Vec<LayerLanes<S>>,
    /// How many of them are there in any of the pixels, at most.
    used: usize,
    /// How many of them are there.
    pub held: u32x16<S>,
}

impl<S: Simd> ListLanes<S> {
    /// Empty lists.
    pub fn new(simd: S, room: usize) -> Self {
        let layers = vec![LayerLanes::none(simd); room];
        ListLanes { layers, used: 0, held: u32x16::splat(simd, 0) }
    }

    /// Empties them.
    #[inline(always)]
    pub fn clear(&mut self, simd: S) {
        self.used_mut().fill(LayerLanes::none(simd));
        self.used = 0;
        self.held = u32x16::splat(simd, 0);
    }

    /// The layers that are there in any of the pixels, near ones first.
    #[inline(always)]
    pub fn used(&self) -> &[LayerLanes<S>] {
        &self.layers[..self.used]
    }

    /// The same, to change.
    #[inline(always)]
    pub fn used_mut(&mut self) -> &mut [LayerLanes<S>] {
        &mut self.layers[..self.used]
    }

    /// Takes pixels' lists in.
    #[inline(always)]
    pub fn load<'a>(
        &mut self,
        simd: S,
        pixels: &[u8; LANES],
        list_of: impl Fn(usize) -> &'a [Layer],
    ) {
        let mut held = [0; LANES];
        for (held, pixel) in held.iter_mut().zip(pixels) {
            *held = list_of(usize::from(*pixel)).len() as u32;
        }
        self.clear(simd);
        self.held = u32x16::from_slice(simd, &held);
        self.used = held.into_iter().max().unwrap_or_default() as usize;
        for (i, to) in self.used_mut().iter_mut().enumerate() {
            let mut words = [[u32::MAX; LANES], [0; LANES]];
            let mut reals = [[0.0; LANES], [0.0; LANES], [0.0; LANES], [1.0; LANES]];
            for (lane, pixel) in pixels.iter().enumerate() {
                let Some(layer) = list_of(usize::from(*pixel)).get(i) else { continue };
                words[0][lane] = layer.depth.0;
                words[1][lane] = layer.coverage.0 as u32;
                let [r, g, b] = layer.colour;
                for (reals, v) in reals.iter_mut().zip([r, g, b, layer.transmittance]) {
                    reals[lane] = v;
                }
            }
            let [depth, coverage] = words.map(|w| u32x16::from_slice(simd, &w));
            let [r, g, b, transmittance] = reals.map(|w| f32x16::from_slice(simd, &w));
            *to = LayerLanes { depth, coverage, colour: [r, g, b], transmittance };
        }
    }

    /// Gives each pixel its list.
    #[inline(always)]
    pub fn store(&self, pixels: &[u8; LANES], mut give: impl FnMut(usize, Vec<Layer>)) {
        let held = words(self.held);
        let mut lists = held.map(|held| Vec::with_capacity(held as usize));
        for (i, layer) in self.used().iter().enumerate() {
            let [depth, coverage] = [layer.depth, layer.coverage].map(words);
            let [r, g, b] = layer.colour;
            let reals = [r, g, b, layer.transmittance].map(|v| words(v.bitcast()));
            for (lane, list) in lists.iter_mut().enumerate() {
                if held[lane] as usize > i {
                    list.push(Layer {
                        depth: Unorm32(depth[lane]),
                        coverage: SampleMask(coverage[lane].into()),
                        colour: [0, 1, 2].map(|c| f32::from_bits(reals[c][lane])),
                        transmittance: f32::from_bits(reals[3][lane]),
                    });
                }
            }
        }
        for (pixel, list) in pixels.iter().zip(lists) {
            give(usize::from(*pixel), list);
        }
    }

    /// Puts layers into their places, where there are any; those that come out behind all
    /// others.
    #[inline(always)]
    pub fn insert(&mut self, new: LayerLanes<S>, any: mask32x16<S>) -> LayerLanes<S> {
        // The next that is not there takes what would come out.
        self.used = (self.used + 1).min(self.layers.len());
        let mut carried = new;
        for layer in self.used_mut() {
            // Those behind it all move by one, and so do those that are not there.
            let moves = !layer.depth.simd_lt(new.depth) & any;
            let moved = layer.or(moves, carried);
            *layer = carried.or(moves, *layer);
            carried = moved;
        }
        carried
    }

    /// Tells that layers look for their places among all of `bits` bits.
    #[inline(always)]
    pub fn tell_nearer<P: Probe>(&self, simd: S, any: mask32x16<S>, told: &mut Told<S, P>) {
        let word = |word: u32| u32x16::splat(simd, word);
        told.compared(any, self.held);
        told.state(any, self.held * word(DEPTH_BITS), word(0));
    }

    /// Tells that layers of `bits` bits are about to be put into their places.
    #[inline(always)]
    pub fn tell_insert<P: Probe>(
        &self,
        simd: S,
        new: &LayerLanes<S>,
        bits: u32,
        any: mask32x16<S>,
        told: &mut Told<S, P>,
    ) {
        if !P::LISTENS {
            return;
        }
        self.tell_nearer(simd, any, told);
        let word = |word: u32| u32x16::splat(simd, word);
        let mut place = word(0);
        for layer in self.used() {
            place = layer.depth.simd_lt(new.depth).select(place + word(1), place);
        }
        let moved = self.held - place;
        let written = word(self.layers.len() as u32).min(self.held + word(1)) - place;
        told.state(any, word(bits - DEPTH_BITS) * moved, word(bits) * written);
    }
}

/// [`Columns`] of pixels in lanes, whatever the number of their samples.
#[derive(Clone, Copy, Debug)]
pub struct ColumnsInLanes {
    coverage: Coverage,
    samples: usize,
    /// [`Columns::store`].
    pub store: ColourStore,
}

impl<const N: usize> From<Columns<N>> for ColumnsInLanes {
    fn from(Columns { coverage, store }: Columns<N>) -> Self {
        ColumnsInLanes { coverage, samples: N, store }
    }
}

impl ColumnsInLanes {
    /// [`Columns::count`].
    pub fn count(&self) -> usize {
        match self.coverage {
            Coverage::Mask => self.samples,
            Coverage::Share => 1,
        }
    }

    /// [`Columns::place`].
    #[inline(always)]
    pub fn place<S: Simd>(&self, simd: S, met: &Met<S>) -> (u32x16<S>, f32x16<S>) {
        match self.coverage {
            Coverage::Mask => (met.coverage, met.alpha),
            Coverage::Share => {
                let share = counted(simd, met.coverage) / f32x16::splat(simd, self.samples as f32);
                let one = u32x16::splat(simd, 1);
                (met.any.select(one, u32x16::splat(simd, 0)), met.alpha * share)
            }
        }
    }

    /// [`Columns::stored`].
    #[inline(always)]
    pub fn stored<S: Simd>(&self, simd: S, mut layer: LayerLanes<S>) -> LayerLanes<S> {
        for c in 0..3 {
            layer.colour[c] = self.store.channels(simd, layer.colour[c]);
        }
        layer.transmittance = self.store.channels(simd, layer.transmittance);
        layer
    }

    /// [`Columns::over`] of what layers show.
    #[inline(always)]
    pub fn over<S: Simd>(
        &self,
        simd: S,
        layers: &[LayerLanes<S>],
        behind: &[[f32x16<S>; 3]],
    ) -> [Wide<S>; 3] {
        let mut sums = [[f64x8::splat(simd, 0.0); 2]; 3];
        match self.coverage {
            Coverage::Mask => {
                for (s, behind) in behind.iter().enumerate() {
                    let mut wide = sums;
                    for c in 0..3 {
                        wide[c] = widened(simd, behind[c]);
                    }
                    add_column(simd, &mut sums, layers, 1 << s, &wide);
                }
            }
            Coverage::Share => {
                let mut mean = sums;
                for sample in behind {
                    for c in 0..3 {
                        let wide = widened(simd, sample[c]);
                        for half in 0..2 {
                            mean[c][half] += wide[half];
                        }
                    }
                }
                divide(&mut mean, self.samples);
                add_column(simd, &mut sums, layers, 1, &mean);
            }
        }
        divide(&mut sums, self.count());
        sums
    }
}

#[inline(always)]
fn divide<S: Simd>(sums: &mut [Wide<S>; 3], count: usize) {
    for c in 0..3 {
        for half in 0..2 {
            sums[c][half] /= count as f64;
        }
    }
}

/// Adds what layers show in a column, over what lies behind.
#[inline(always)]
fn add_column<S: Simd>(
    simd: S,
    sums: &mut [Wide<S>; 3],
    layers: &[LayerLanes<S>],
    column: u32,
    behind: &[Wide<S>; 3],
) {
    let (colour, transmittance) = composite(simd, layers, column);
    for c in 0..3 {
        for half in 0..2 {
            sums[c][half] += colour[c][half] + transmittance[half] * behind[c][half];
        }
    }
}

/// What layers show in a column, and how much passes them. What is not covered adds nothing and
/// lets all through, which keeps all bits: a sum that begins as +0 is never −0.
#[inline(always)]
fn composite<S: Simd>(simd: S, layers: &[LayerLanes<S>], column: u32) -> ([Wide<S>; 3], Wide<S>) {
    let mut colour = [[f64x8::splat(simd, 0.0); 2]; 3];
    let mut transmittance = [f64x8::splat(simd, 1.0); 2];
    let (none, all) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    for layer in layers {
        let covers = (layer.coverage & u32x16::splat(simd, column)).simd_ne(0);
        for c in 0..3 {
            let wide = widened(simd, covers.select(layer.colour[c], none));
            for half in 0..2 {
                colour[c][half] += transmittance[half] * wide[half];
            }
        }
        let wide = widened(simd, covers.select(layer.transmittance, all));
        for half in 0..2 {
            transmittance[half] *= wide[half];
        }
    }
    (colour, transmittance)
}
