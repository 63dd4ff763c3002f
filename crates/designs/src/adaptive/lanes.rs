//! `adaptive` with sixteen pixels side by side.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over channels and halves are unrolled into registers; closures would be called"
)]

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, f64x8, mask32x16, u32x16, u64x8};
use screendoor_rop::in_lanes::{HasLanes, InLanes, LANES, Met, Told, Wide, widened, words};
use screendoor_rop::layers::DEPTH_BITS;
use screendoor_rop::{ColumnsInLanes, LayerLanes, ListLanes, Probe};
use screendoor_trace::tile::TILE_PIXELS;

use crate::adaptive::{AdaptiveAt, AdaptivePixel};

/// What sixteen pixels hold.
pub struct Pixels<S: Simd> {
    /// With room for one node more than a pixel keeps.
    nodes: ListLanes<S>,
    colour: [f32x16<S>; 3],
}

/// The design in lanes.
#[derive(Debug)]
pub struct AdaptiveInLanes {
    columns: ColumnsInLanes,
    nodes: usize,
    node_bits: u32,
}

impl<const N: usize> HasLanes<N> for AdaptiveAt<N> {
    type InLanes = AdaptiveInLanes;

    fn in_lanes(&self) -> Option<AdaptiveInLanes> {
        let node_bits = self.node_bits();
        Some(AdaptiveInLanes { columns: self.columns.into(), nodes: self.nodes, node_bits })
    }
}

impl AdaptiveInLanes {
    /// How much nodes let pass on average, of 2^32, which takes a bit more than a word.
    #[inline(always)]
    fn visibility<S: Simd>(
        &self,
        simd: S,
        passes: &mut [f32x16<S>],
        node: &LayerLanes<S>,
    ) -> [u64x8<S>; 2] {
        let mut sum = f32x16::splat(simd, 0.0);
        for (column, passes) in passes.iter_mut().enumerate() {
            let covers = (node.coverage & u32x16::splat(simd, 1 << column)).simd_ne(0);
            *passes = covers.select(*passes * node.transmittance, *passes);
            sum += *passes;
        }
        let mean = sum / passes.len() as f32;
        let all = mean.simd_ge(f32x16::splat(simd, 1.0));
        // A product by a power of two is exact.
        let part =
            simd.cvt_u32_f32x16(all.select(f32x16::splat(simd, 0.0), mean) * 4_294_967_296.0);
        let whole = all.select(u32x16::splat(simd, 1), u32x16::splat(simd, 0));
        let ((low, high), (wholes, more)) = (simd.widen_u32x16(part), simd.widen_u32x16(whole));
        [low + (wholes << 32), high + (more << 32)]
    }

    /// The places of the nodes whose removal changes the area least, in full lists.
    #[inline(always)]
    fn least<S: Simd>(&self, simd: S, list: &[LayerLanes<S>]) -> u32x16<S> {
        let mut passes = [f32x16::splat(simd, 1.0); 32];
        let passes = &mut passes[..self.columns.count()];
        let mut before = self.visibility(simd, passes, &list[0]);
        let mut best = u32x16::splat(simd, 1);
        let mut least = [u64x8::splat(simd, u64::MAX); 2];
        for i in 1..(list.len() - 1).max(2) {
            let after = self.visibility(simd, passes, &list[i]);
            let (low, high) = simd.widen_u32x16(list[i].depth - list[i - 1].depth);
            let mut better = [0; 2];
            for (half, gap) in [low, high].into_iter().enumerate() {
                // A step is 2^32 at most, and a gap less than that.
                let step = before[half] - after[half].min(before[half]);
                let area = gap * step;
                let less = area.simd_lt(least[half]);
                better[half] = less.to_bitmask();
                least[half] = less.select(area, least[half]);
            }
            let better = mask32x16::from_bitmask(simd, better[0] | better[1] << (LANES / 2));
            best = better.select(u32x16::splat(simd, i as u32), best);
            before = after;
        }
        best
    }

    /// Takes a node out of full lists: the one before it takes its step.
    #[inline(always)]
    fn remove_least<S: Simd>(&self, simd: S, of: mask32x16<S>, list: &mut [LayerLanes<S>]) {
        let place = |i: usize| u32x16::splat(simd, i as u32);
        let best = self.least(simd, list);
        let [mut kept, mut removed] = [list[0], list[1]];
        for i in 2..list.len() {
            let here = best.simd_eq(place(i));
            kept = list[i - 1].or(here, kept);
            removed = list[i].or(here, removed);
        }
        let merged = kept.merged(simd, &removed);
        for i in 0..list.len() {
            let next = if i + 1 < list.len() { list[i + 1] } else { LayerLanes::none(simd) };
            let behind = !place(i).simd_lt(best);
            let here = place(i + 1).simd_eq(best);
            list[i] = next.or(of & behind, merged.or(of & here, list[i]));
        }
    }

    /// A fragment of the first pass.
    #[inline(always)]
    fn enter<S: Simd, P: Probe>(
        &self,
        simd: S,
        list: &mut ListLanes<S>,
        met: &Met<S>,
        told: &mut Told<S, P>,
    ) {
        let word = |word: u32| u32x16::splat(simd, word);
        let (coverage, alpha) = self.columns.place(simd, met);
        let none = LayerLanes::none(simd);
        let transmittance = f32x16::splat(simd, 1.0) - alpha;
        let node = LayerLanes { depth: met.z, coverage, transmittance, ..none };
        list.tell_insert(simd, &node, self.node_bits, met.any, told);
        list.insert(node, met.any);
        let full = met.any & list.held.simd_ge(word(self.nodes as u32));
        list.held = (met.any & !full).select(list.held + word(1), list.held);
        if full.any_true() {
            self.remove_least(simd, full, list.used_mut());
            told.compared(full, word(self.nodes.max(2) as u32 - 2));
            // All are read; those from the removed one on move back.
            let bits = word(self.node_bits * self.nodes as u32);
            told.state(full, bits, bits);
        }
    }

    /// A fragment of the second pass.
    #[inline(always)]
    fn add<S: Simd, P: Probe>(
        &self,
        simd: S,
        pixels: &mut Pixels<S>,
        met: &Met<S>,
        told: &mut Told<S, P>,
    ) {
        let list = &pixels.nodes;
        let (coverage, alpha) = self.columns.place(simd, met);
        let one = f32x16::splat(simd, 1.0);
        let mut visible = [f64x8::splat(simd, 0.0); 2];
        for column in 0..self.columns.count() {
            let bit = u32x16::splat(simd, 1 << column);
            let mut passes = [f64x8::splat(simd, 1.0); 2];
            for node in list.used() {
                let hides = (node.coverage & bit).simd_ne(0) & node.depth.simd_lt(met.z);
                let wide = widened(simd, hides.select(node.transmittance, one));
                for half in 0..2 {
                    passes[half] *= wide[half];
                }
            }
            let covers = (coverage & bit).simd_ne(0).to_bitmask();
            for half in 0..2 {
                let here = covers >> (half * LANES / 2) & 0xff;
                let here = fearless_simd::mask64x8::from_bitmask(simd, here);
                visible[half] = here.select(visible[half] + passes[half], visible[half]);
            }
        }
        let [low, high] = visible;
        let visible = simd.narrow_f64x8(low, high);
        let store = self.columns.store;
        for c in 0..3 {
            let sum = pixels.colour[c] + met.colour[c] * alpha * visible;
            pixels.colour[c] = met.any.select(store.channels(simd, sum), pixels.colour[c]);
        }
        list.tell_nearer(simd, met.any, told);
        let word = |word: u32| u32x16::splat(simd, word);
        let colour = word(store.colour_bits());
        told.state(met.any, list.held * word(self.node_bits - DEPTH_BITS) + colour, colour);
    }
}

impl InLanes for AdaptiveInLanes {
    type State = AdaptivePixel;
    type Lanes<S: Simd> = Pixels<S>;

    fn clear<S: Simd>(&self, simd: S) -> Pixels<S> {
        let nodes = ListLanes::new(simd, self.nodes + 1);
        Pixels { nodes, colour: [f32x16::splat(simd, 0.0); 3] }
    }

    #[inline(always)]
    fn clear_again<S: Simd>(&self, simd: S, pixels: &mut Pixels<S>) {
        pixels.nodes.clear(simd);
        pixels.colour = [f32x16::splat(simd, 0.0); 3];
    }

    #[inline(always)]
    fn load<S: Simd>(
        &self,
        simd: S,
        pixels: &mut Pixels<S>,
        states: &[AdaptivePixel; TILE_PIXELS],
        places: &[u8; LANES],
    ) {
        pixels.nodes.load(simd, places, |pixel| &states[pixel].nodes);
        for c in 0..3 {
            let colours = places.map(|pixel| states[usize::from(pixel)].colour[c]);
            pixels.colour[c] = f32x16::from_slice(simd, &colours);
        }
    }

    #[inline(always)]
    fn store<S: Simd>(
        &self,
        pixels: &Pixels<S>,
        states: &mut [AdaptivePixel; TILE_PIXELS],
        places: &[u8; LANES],
    ) {
        pixels.nodes.store(places, |pixel, nodes| states[pixel].nodes = nodes);
        let colours = pixels.colour.map(|c| words(c.bitcast()));
        for (lane, pixel) in places.iter().enumerate() {
            let colour = [0, 1, 2].map(|c| f32::from_bits(colours[c][lane]));
            states[usize::from(*pixel)].colour = colour;
        }
    }

    #[inline(always)]
    fn draw<S: Simd, P: Probe>(
        &self,
        simd: S,
        pixels: &mut Pixels<S>,
        pass: u32,
        met: &Met<S>,
        told: &mut Told<S, P>,
    ) {
        told.written(met.any, met.coverage);
        if pass == 0 {
            self.enter(simd, &mut pixels.nodes, met, told);
        } else {
            self.add(simd, pixels, met, told);
        }
    }

    #[inline(always)]
    fn resolve<S: Simd>(
        &self,
        simd: S,
        pixels: &Pixels<S>,
        behind: &[[f32x16<S>; 3]],
    ) -> [Wide<S>; 3] {
        let mut colours = self.columns.over(simd, pixels.nodes.used(), behind);
        for c in 0..3 {
            let own = widened(simd, pixels.colour[c]);
            for half in 0..2 {
                let own = own[half] / self.columns.count() as f64;
                colours[c][half] = own + colours[c][half];
            }
        }
        colours
    }
}
