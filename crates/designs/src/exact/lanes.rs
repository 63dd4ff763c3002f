//! Layers composited at eight samples at once.

use fearless_simd::{Simd, f64x8, i32x8, mask32x8, mask64x8, prelude::*};

use crate::exact::layer::Layer;

/// Samples that are composited together.
pub(super) const LANES: usize = 8;

/// Where the samples of the lanes lie, in 1/16 pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Offsets {
    x: [i32; LANES],
    y: [i32; LANES],
}

impl Offsets {
    /// Of up to [`LANES`] samples.
    pub(super) fn new(positions: &[[i8; 2]]) -> Self {
        let mut offsets = Offsets { x: [0; LANES], y: [0; LANES] };
        for (lane, [x, y]) in positions.iter().enumerate() {
            (offsets.x[lane], offsets.y[lane]) = (i32::from(*x), i32::from(*y));
        }
        offsets
    }
}

/// Samples' colours while layers come in, near ones first.
pub(super) struct Composite<S: Simd> {
    simd: S,
    x: i32x8<S>,
    y: i32x8<S>,
    transmittance: f64x8<S>,
    colour: [f64x8<S>; 3],
    /// The last layer's depth at each sample.
    last: i32x8<S>,
    broken: u64,
}

/// A layer at each sample, not the same one at all of them.
#[derive(Clone, Copy)]
struct Mixed<S: Simd> {
    depth: i32x8<S>,
    alpha: f64x8<S>,
    colour: [f64x8<S>; 3],
}

/// [`Composite`] where layers come nearly by rising depth: each waits until it is seen that the
/// next one does not lie in front of it.
pub(super) struct Waiting<S: Simd> {
    composite: Composite<S>,
    waits: Mixed<S>,
}

impl<S: Simd> Waiting<S> {
    /// Before the first layer.
    #[inline(always)]
    pub(super) fn new(simd: S, offsets: &Offsets) -> Self {
        let zero = f64x8::splat(simd, 0.0);
        // What no sample shows, nearer than all that is not rough.
        let waits =
            Mixed { depth: i32x8::splat(simd, i32::MIN + 1), alpha: zero, colour: [zero; 3] };
        Waiting { composite: Composite::new(simd, offsets), waits }
    }

    /// As [`Composite::add`].
    #[inline(always)]
    pub(super) fn add(&mut self, layer: &Layer, covered: u8) {
        let Waiting { composite, waits } = self;
        let simd = composite.simd;
        let depth = composite.depth(layer);
        let tied = depth.simd_eq(waits.depth).to_bitmask() | u64::from(layer.rough);
        composite.broken |= u64::from(covered) & tied;
        // As a mask where the next layer waits for it, as bits where masks are of another width.
        let nearer = depth.simd_lt(waits.depth);
        let stays = mask32x8::from_bitmask(simd, covered.into()) & !nearer;
        let new = Mixed {
            depth,
            alpha: f64x8::splat(simd, layer.alpha),
            colour: layer.colour.map(|c| f64x8::splat(simd, c)),
        };
        let next = new.or(simd, nearer, waits);
        composite.add_mixed(&next, covered);
        *waits = new.or(simd, stays, waits);
    }

    /// As [`Composite::over`].
    #[inline(always)]
    pub(super) fn over(mut self, background: [f64; 3]) -> ([[f64; LANES]; 3], u64) {
        self.composite.add_mixed(&self.waits, u8::MAX);
        self.composite.over(background)
    }
}

impl<S: Simd> Mixed<S> {
    /// This at the samples of the set, the other one elsewhere.
    #[inline(always)]
    fn or(&self, simd: S, set: mask32x8<S>, other: &Self) -> Self {
        let wide = mask64x8::from_bitmask(simd, set.to_bitmask());
        let mut mixed = *other;
        mixed.depth = set.select(self.depth, other.depth);
        mixed.alpha = wide.select(self.alpha, other.alpha);
        for (mixed, own) in mixed.colour.iter_mut().zip(self.colour) {
            *mixed = wide.select(own, *mixed);
        }
        mixed
    }
}

impl<S: Simd> Composite<S> {
    /// Before the first layer.
    #[inline(always)]
    pub(super) fn new(simd: S, offsets: &Offsets) -> Self {
        let zero = f64x8::splat(simd, 0.0);
        Composite {
            simd,
            x: i32x8::simd_from(simd, offsets.x),
            y: i32x8::simd_from(simd, offsets.y),
            transmittance: f64x8::splat(simd, 1.0),
            colour: [zero; 3],
            last: i32x8::splat(simd, i32::MIN),
            broken: 0,
        }
    }

    /// Adds a layer that covers these of the lanes' samples. Each sample sees the operations
    /// of the plain text in their order, and some more that change nothing. A sample that is
    /// not covered, or is opaque already, adds ±0 to its colour; that keeps all bits, for a
    /// colour is never −0: it begins as +0, and no sum is −0 unless both its terms are.
    #[inline(always)]
    pub(super) fn add(&mut self, layer: &Layer, covered: u8) {
        let covered = u64::from(covered);
        let depth = self.depth(layer);
        // Of equal depths the order is not told here.
        let disorder = depth.simd_le(self.last).to_bitmask() | u64::from(layer.rough);
        self.broken |= covered & disorder;
        self.last = mask32x8::from_bitmask(self.simd, covered).select(depth, self.last);

        let splat = |v| f64x8::splat(self.simd, v);
        let covered = mask64x8::from_bitmask(self.simd, covered);
        let weight = covered.select(self.transmittance * splat(layer.alpha), splat(0.0));
        for (c, l) in self.colour.iter_mut().zip(layer.colour) {
            *c += weight * splat(l);
        }
        let dimmed = self.transmittance * splat(layer.rest);
        self.transmittance = covered.select(dimmed, self.transmittance);
    }

    /// A layer's depths. They wrap where it is rough, which marks all of its samples as broken.
    #[inline(always)]
    fn depth(&self, layer: &Layer) -> i32x8<S> {
        let whole = |word| i32x8::splat(self.simd, word);
        let slope = whole(layer.dzdx) * self.x + whole(layer.dzdy) * self.y;
        whole(layer.z) + (slope >> 4)
    }

    /// The same of a layer at each sample.
    #[inline(always)]
    fn add_mixed(&mut self, layer: &Mixed<S>, covered: u8) {
        let covered = u64::from(covered);
        self.broken |= covered & layer.depth.simd_le(self.last).to_bitmask();
        self.last = mask32x8::from_bitmask(self.simd, covered).select(layer.depth, self.last);
        let covered = mask64x8::from_bitmask(self.simd, covered);
        let zero = f64x8::splat(self.simd, 0.0);
        let weight = covered.select(self.transmittance * layer.alpha, zero);
        for (c, l) in self.colour.iter_mut().zip(layer.colour) {
            *c += weight * l;
        }
        let dimmed = self.transmittance * (f64x8::splat(self.simd, 1.0) - layer.alpha);
        self.transmittance = covered.select(dimmed, self.transmittance);
    }

    /// The samples' colours, channel by channel, and the set of those at which the
    /// layers did not come by strictly rising depth: their colours may be wrong.
    #[inline(always)]
    pub(super) fn over(&self, background: [f64; 3]) -> ([[f64; LANES]; 3], u64) {
        let mut colours = [[0.0; LANES]; 3];
        for (out, (c, b)) in colours.iter_mut().zip(self.colour.iter().zip(background)) {
            (*c + self.transmittance * f64x8::splat(self.simd, b)).store_slice(out);
        }
        (colours, self.broken)
    }
}
