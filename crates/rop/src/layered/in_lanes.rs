//! [`Bounded`] lists of layers of sixteen pixels.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over channels and halves are unrolled into registers; closures would be called"
)]

use std::marker::PhantomData;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, mask32x16, u32x16};

use crate::contract::event::Probe;
use crate::in_lanes::{HasLanes, InLanes, LANES, Met, Told, Wide};
use crate::layered::bounded::{Bounded, Eviction};
use crate::layered::lanes::{ColumnsInLanes, LayerLanes, ListLanes};
use crate::layered::layers::{Columns, DEPTH_BITS, Layer, Layering};
use screendoor_trace::tile::TILE_PIXELS;

/// [`Bounded`] with pixels in lanes.
#[derive(Debug)]
pub struct BoundedInLanes<E> {
    columns: ColumnsInLanes,
    room: usize,
    /// Bits of a layer.
    bits: u32,
    eviction: PhantomData<E>,
}

impl<E: Eviction, const N: usize> HasLanes<N> for Bounded<E, N> {
    type InLanes = BoundedInLanes<E>;

    fn in_lanes(&self) -> Option<BoundedInLanes<E>> {
        let Layering { columns, room, bits } = self.layering;
        Some(BoundedInLanes { columns: columns.into(), room, bits, eviction: PhantomData })
    }
}

impl<E: Eviction> BoundedInLanes<E> {
    /// [`Columns::layer`].
    #[inline(always)]
    fn layer<S: Simd>(&self, simd: S, met: &Met<S>) -> LayerLanes<S> {
        let (coverage, alpha) = self.columns.place(simd, met);
        let mut colour = met.colour;
        for c in 0..3 {
            colour[c] *= alpha;
        }
        let transmittance = f32x16::splat(simd, 1.0) - alpha;
        self.columns.stored(simd, LayerLanes { depth: met.z, coverage, colour, transmittance })
    }
}

impl<E: Eviction> InLanes for BoundedInLanes<E> {
    type State = Vec<Layer>;
    type Lanes<S: Simd> = ListLanes<S>;

    fn clear<S: Simd>(&self, simd: S) -> ListLanes<S> {
        ListLanes::new(simd, self.room)
    }

    #[inline(always)]
    fn clear_again<S: Simd>(&self, simd: S, list: &mut ListLanes<S>) {
        list.clear(simd);
    }

    #[inline(always)]
    fn load<S: Simd>(
        &self,
        simd: S,
        list: &mut ListLanes<S>,
        states: &[Vec<Layer>; TILE_PIXELS],
        pixels: &[u8; LANES],
    ) {
        list.load(simd, pixels, |pixel| &states[pixel]);
    }

    #[inline(always)]
    fn store<S: Simd>(
        &self,
        list: &ListLanes<S>,
        states: &mut [Vec<Layer>; TILE_PIXELS],
        pixels: &[u8; LANES],
    ) {
        list.store(pixels, |pixel, list| states[pixel] = list);
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
        list.tell_insert(simd, &new, self.bits, met.any, told);
        let evicted = list.insert(new, met.any);
        let full = list.held.simd_ge(word(self.room as u32));
        let evicts = met.any & full;
        list.held = (met.any & !full).select(list.held + word(1), list.held);
        let mut written = met.any;
        if evicts.any_true()
            && let Some(last) = list.used_mut().last_mut()
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
        self.columns.over(simd, list.used(), behind)
    }
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
        let merged = design.columns.stored(simd, self.last.merged(simd, &self.evicted));
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
