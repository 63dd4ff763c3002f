//! Bounded lists of layers of sixteen pixels.

use std::marker::PhantomData;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, f64x8, mask32x16, u32x16};

use crate::contract::colour::ColourStore;
use crate::contract::event::Probe;
use crate::in_lanes::{HasLanes, InLanes, LANES, Met, Told, Wide, widened};
use crate::layered::bounded::{Bounded, Eviction};
use crate::layered::layers::{Columns, Coverage, DEPTH_BITS, Layer, Layering};
use screendoor_trace::tile::TILE_PIXELS;
use screendoor_trace::trace::{SampleMask, Unorm32};

/// A layer of each of sixteen pixels. One that is not there lies behind all others, covers
/// nothing and lets all through.
#[derive(Clone, Copy)]
pub struct LayerLanes<S: Simd> {
    depth: u32x16<S>,
    coverage: u32x16<S>,
    colour: [f32x16<S>; 3],
    transmittance: f32x16<S>,
}

impl<S: Simd> LayerLanes<S> {
    #[inline(always)]
    fn none(simd: S) -> Self {
        LayerLanes {
            depth: u32x16::splat(simd, u32::MAX),
            coverage: u32x16::splat(simd, 0),
            colour: [f32x16::splat(simd, 0.0); 3],
            transmittance: f32x16::splat(simd, 1.0),
        }
    }

    /// This one where `mask` says, and the other elsewhere.
    #[inline(always)]
    fn or(self, mask: mask32x16<S>, other: Self) -> Self {
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
    fn same(&self, other: &Self) -> mask32x16<S> {
        let mut same = self.depth.simd_eq(other.depth);
        same &= self.coverage.simd_eq(other.coverage);
        for c in 0..3 {
            same &= self.colour[c].simd_eq(other.colour[c]);
        }
        same & self.transmittance.simd_eq(other.transmittance)
    }

    /// [`Layer::merged`].
    #[inline(always)]
    fn merged(&self, simd: S, behind: &Self) -> Self {
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

/// How many samples sets have.
#[inline(always)]
fn counted<S: Simd>(simd: S, sets: u32x16<S>) -> f32x16<S> {
    simd.cvt_f32_u32x16(simd.count_ones_u32x16(sets))
}

/// The layers of sixteen pixels, near ones first.
pub struct ListLanes<S: Simd> {
    layers: Vec<LayerLanes<S>>,
    held: u32x16<S>,
}

/// [`Bounded`] with pixels in lanes.
#[derive(Debug)]
pub struct BoundedInLanes<E> {
    coverage: Coverage,
    store: ColourStore,
    samples: usize,
    room: usize,
    /// Bits of a layer.
    bits: u32,
    eviction: PhantomData<E>,
}

impl<E: Eviction, const N: usize> HasLanes<N> for Bounded<E, N> {
    type InLanes = BoundedInLanes<E>;

    fn in_lanes(&self) -> Option<BoundedInLanes<E>> {
        let Layering { columns, room, bits } = self.layering;
        let Columns { coverage, store } = columns;
        Some(BoundedInLanes { coverage, store, samples: N, room, bits, eviction: PhantomData })
    }
}

impl<E: Eviction> BoundedInLanes<E> {
    /// [`Columns::layer`].
    #[inline(always)]
    fn layer<S: Simd>(&self, simd: S, met: &Met<S>) -> LayerLanes<S> {
        let (coverage, alpha) = match self.coverage {
            Coverage::Mask => (met.coverage, met.alpha),
            Coverage::Share => {
                let share = counted(simd, met.coverage) / f32x16::splat(simd, self.samples as f32);
                let one = u32x16::splat(simd, 1);
                (met.any.select(one, u32x16::splat(simd, 0)), met.alpha * share)
            }
        };
        let mut colour = met.colour;
        for c in 0..3 {
            colour[c] = colour[c] * alpha;
        }
        let transmittance = f32x16::splat(simd, 1.0) - alpha;
        self.stored(simd, LayerLanes { depth: met.z, coverage, colour, transmittance })
    }

    /// [`Columns::stored`].
    #[inline(always)]
    fn stored<S: Simd>(&self, simd: S, mut layer: LayerLanes<S>) -> LayerLanes<S> {
        for c in 0..3 {
            layer.colour[c] = self.store.channels(simd, layer.colour[c]);
        }
        layer.transmittance = self.store.channels(simd, layer.transmittance);
        layer
    }

    /// Puts layers into their places, where there are any; those that come out behind all others.
    #[inline(always)]
    fn insert<S: Simd, P: Probe>(
        &self,
        simd: S,
        list: &mut ListLanes<S>,
        new: LayerLanes<S>,
        any: mask32x16<S>,
        told: &mut Told<S, P>,
    ) -> LayerLanes<S> {
        let word = |word: u32| u32x16::splat(simd, word);
        if P::LISTENS {
            let mut place = word(0);
            for layer in &list.layers {
                place = layer.depth.simd_lt(new.depth).select(place + word(1), place);
            }
            told.compared(any, list.held);
            told.state(any, list.held * word(DEPTH_BITS), word(0));
            let moved = list.held - place;
            let written = word(self.room as u32).min(list.held + word(1)) - place;
            let [read, all] = [self.bits - DEPTH_BITS, self.bits].map(word);
            told.state(any, read * moved, all * written);
        }
        let mut carried = new;
        for layer in &mut list.layers {
            // Those behind it all move by one, and so do those that are not there.
            let moves = !layer.depth.simd_lt(new.depth) & any;
            let moved = layer.or(moves, carried);
            *layer = carried.or(moves, *layer);
            carried = moved;
        }
        carried
    }
}

impl<E: Eviction> InLanes for BoundedInLanes<E> {
    type State = Vec<Layer>;
    type Lanes<S: Simd> = ListLanes<S>;

    fn clear<S: Simd>(&self, simd: S) -> ListLanes<S> {
        let layers = vec![LayerLanes::none(simd); self.room];
        ListLanes { layers, held: u32x16::splat(simd, 0) }
    }

    #[inline(always)]
    fn clear_again<S: Simd>(&self, simd: S, list: &mut ListLanes<S>) {
        list.layers.fill(LayerLanes::none(simd));
        list.held = u32x16::splat(simd, 0);
    }

    #[inline(always)]
    fn load<S: Simd>(
        &self,
        simd: S,
        list: &mut ListLanes<S>,
        states: &[Vec<Layer>; TILE_PIXELS],
        pixels: &[u8; LANES],
    ) {
        let mut held = [0; LANES];
        for (held, pixel) in held.iter_mut().zip(pixels) {
            *held = states[usize::from(*pixel)].len() as u32;
        }
        list.held = u32x16::from_slice(simd, &held);
        for (i, to) in list.layers.iter_mut().enumerate() {
            let mut words = [[u32::MAX; LANES], [0; LANES]];
            let mut reals = [[0.0; LANES], [0.0; LANES], [0.0; LANES], [1.0; LANES]];
            for (lane, pixel) in pixels.iter().enumerate() {
                let Some(layer) = states[usize::from(*pixel)].get(i) else { continue };
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

    #[inline(always)]
    fn store<S: Simd>(
        &self,
        list: &ListLanes<S>,
        states: &mut [Vec<Layer>; TILE_PIXELS],
        pixels: &[u8; LANES],
    ) {
        let mut held = [0; LANES];
        list.held.store_slice(&mut held);
        for (held, pixel) in held.iter().zip(pixels) {
            let state = &mut states[usize::from(*pixel)];
            state.clear();
            state.reserve_exact(*held as usize);
        }
        for (i, layer) in list.layers.iter().enumerate() {
            let words = [layer.depth, layer.coverage].map(|v| {
                let mut words = [0; LANES];
                v.store_slice(&mut words);
                words
            });
            let [r, g, b] = layer.colour;
            let reals = [r, g, b, layer.transmittance].map(|v| {
                let mut words = [0.0; LANES];
                v.store_slice(&mut words);
                words
            });
            for (lane, pixel) in pixels.iter().enumerate() {
                if held[lane] as usize > i {
                    states[usize::from(*pixel)].push(Layer {
                        depth: Unorm32(words[0][lane]),
                        coverage: SampleMask(words[1][lane].into()),
                        colour: [0, 1, 2].map(|c| reals[c][lane]),
                        transmittance: reals[3][lane],
                    });
                }
            }
        }
    }

    #[inline(always)]
    fn draw<S: Simd, P: Probe>(
        &self,
        simd: S,
        list: &mut ListLanes<S>,
        _pass: u32,
        met: &Met<S>,
        told: &mut Told<S, P>,
    ) {
        let word = |word: u32| u32x16::splat(simd, word);
        let new = self.layer(simd, met);
        told.multiplied(met.any, word(Columns::<1>::LAYERED));
        let evicted = self.insert(simd, list, new, met.any, told);
        let full = list.held.simd_ge(word(self.room as u32));
        let evicts = met.any & full;
        list.held = (met.any & !full).select(list.held + word(1), list.held);
        let mut written = met.any;
        if evicts.any_true()
            && let Some(last) = list.layers.last_mut()
        {
            let lanes = EvictedLanes { last, new: &new, evicted, of: evicts };
            written = (met.any & !full) | (E::evict_lanes(self, simd, lanes, told) & evicts);
        }
        told.written(written, met.coverage);
    }

    #[inline(always)]
    fn resolve<S: Simd>(
        &self,
        simd: S,
        list: &ListLanes<S>,
        behind: &[[f32x16<S>; 3]],
    ) -> [Wide<S>; 3] {
        let mut sums = [[f64x8::splat(simd, 0.0); 2]; 3];
        let columns = match self.coverage {
            Coverage::Mask => {
                for (s, behind) in behind.iter().enumerate() {
                    let mut wide = sums;
                    for c in 0..3 {
                        wide[c] = widened(simd, behind[c]);
                    }
                    add_column(simd, &mut sums, &list.layers, 1 << s, &wide);
                }
                self.samples
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
                add_column(simd, &mut sums, &list.layers, 1, &mean);
                1
            }
        };
        divide(&mut sums, columns);
        sums
    }
}

#[inline(always)]
fn divide<S: Simd>(sums: &mut [Wide<S>; 3], count: usize) {
    for c in 0..3 {
        for half in 0..2 {
            sums[c][half] = sums[c][half] / count as f64;
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

/// Layers too many: [`Eviction::evict`].
pub struct EvictedLanes<'a, S: Simd> {
    /// The last layers that stay.
    pub last: &'a mut LayerLanes<S>,
    /// Those that came.
    pub new: &'a LayerLanes<S>,
    /// Those that are taken from behind.
    pub evicted: LayerLanes<S>,
    /// Where that is so.
    pub of: mask32x16<S>,
}

impl<S: Simd> EvictedLanes<'_, S> {
    /// Where the new ones are those that are taken.
    #[inline(always)]
    pub fn same(&self) -> mask32x16<S> {
        self.evicted.same(self.new)
    }

    /// Merges them with the last ones.
    #[inline(always)]
    pub fn merge<E: Eviction, P: Probe>(
        self,
        design: &BoundedInLanes<E>,
        simd: S,
        told: &mut Told<S, P>,
    ) {
        let merged = design.stored(simd, self.last.merged(simd, &self.evicted));
        let word = |word: u32| u32x16::splat(simd, word);
        told.multiplied(self.of, word(Layer::MERGED));
        if P::LISTENS {
            // Where all moved, the last was read and is written anyway.
            let [read, all] = [design.bits - DEPTH_BITS, design.bits].map(word);
            told.state(self.of & self.same(), read, all);
        }
        *self.last = merged.or(self.of, *self.last);
    }
}
