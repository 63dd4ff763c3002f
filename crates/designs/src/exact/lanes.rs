//! Layers composited at eight samples at once.

use fearless_simd::{Simd, f64x8, mask64x8, prelude::*};

use screendoor_trace::trace::DepthPlane;

/// Samples that are composited together.
pub(super) const LANES: usize = 8;

/// A layer as the lanes read it: all that is multiplied is converted once, and
/// lies in one line of the cache.
pub(super) type Row = [f64; 8];

/// The row of a layer that covers these of the lanes' samples.
#[inline(always)]
pub(super) fn row(covered: u8, depth: DepthPlane, [r, g, b]: [f32; 3], alpha: f32) -> Row {
    // As signed integers, which every instruction set converts.
    let z = f64::from((depth.z.0 ^ 1 << 31) as i32);
    let covered = f64::from_bits(u64::from(covered));
    let (dzdx, dzdy) = (f64::from(depth.dzdx), f64::from(depth.dzdy));
    [z, dzdx, dzdy, covered, r.into(), g.into(), b.into(), alpha.into()]
}

/// Whether a row's layer covers the lane's sample.
#[inline(always)]
pub(super) fn covers(row: &Row, lane: usize) -> bool {
    row[3].to_bits() >> lane & 1 == 1
}

/// A layer's depths at the samples, over [`INTEGERS`].
pub(super) type Depths = [f64; LANES];

/// The depth at the lane's sample.
#[inline(always)]
pub(super) fn depth_at(depths: &Depths, lane: usize) -> u32 {
    depths[lane].to_bits() as u32
}

/// Where the samples of the lanes lie, in pixels.
#[derive(Clone, Copy)]
pub(super) struct Offsets {
    x: [f64; LANES],
    y: [f64; LANES],
}

impl Offsets {
    /// Of up to [`LANES`] samples at `positions`, in 1/16 pixel.
    pub(super) fn new(positions: &[[i8; 2]]) -> Self {
        let mut offsets = Offsets { x: [0.0; LANES], y: [0.0; LANES] };
        for (lane, [x, y]) in positions.iter().enumerate() {
            offsets.x[lane] = f64::from(*x) / 16.0;
            offsets.y[lane] = f64::from(*y) / 16.0;
        }
        offsets
    }
}

/// Numbers this large have no fractional bits: what is added to it is rounded to
/// the nearest integer.
const INTEGERS: f64 = 3.0 * (1_u64 << 51) as f64;

/// Samples' colours while layers come in, near ones first.
pub(super) struct Composite<S: Simd> {
    simd: S,
    x: f64x8<S>,
    y: f64x8<S>,
    transmittance: f64x8<S>,
    colour: [f64x8<S>; 3],
    /// The last layer's depth at each sample, over `INTEGERS`.
    last: f64x8<S>,
    broken: mask64x8<S>,
}

impl<S: Simd> Composite<S> {
    /// Before the first layer.
    #[inline(always)]
    pub(super) fn new(simd: S, offsets: &Offsets) -> Self {
        let zero = f64x8::splat(simd, 0.0);
        Composite {
            simd,
            x: f64x8::simd_from(simd, offsets.x),
            y: f64x8::simd_from(simd, offsets.y),
            transmittance: f64x8::splat(simd, 1.0),
            colour: [zero; 3],
            last: zero,
            broken: mask64x8::from_bitmask(simd, 0),
        }
    }

    /// Adds layers, and says their depths. Each sample sees the operations of the plain text in their
    /// order, and some more that change nothing. A sample that is not covered, or is
    /// opaque already, adds ±0 to its colour; that keeps all bits, for a colour is
    /// never −0: it begins as +0, and no sum is −0 unless both its terms are.
    #[inline(always)]
    pub(super) fn add(&mut self, rows: &[Row], depths: &mut [Depths]) {
        let splat = |v| f64x8::splat(self.simd, v);
        let (zero, one) = (splat(0.0), splat(1.0));
        // Back to unsigned depths, and 15/32 less: to the nearest integer is then
        // downwards, for a depth at a sample is a multiple of 1/16.
        let unsigned = splat((1_u64 << 31) as f64 - 15.0 / 32.0);
        let (near, far) = (splat(INTEGERS), splat(INTEGERS + f64::from(u32::MAX)));
        for (row, depths) in rows.iter().zip(depths) {
            let covered = mask64x8::from_bitmask(self.simd, row[3].to_bits());
            // Exact until `near` is added: integers of fewer than 40 bits, over 32.
            let slope = splat(row[1]) * self.x + splat(row[2]) * self.y;
            let depth = (splat(row[0]) + unsigned + slope + near).max(near).min(far);
            depth.store_slice(depths);
            // Of equal depths the order is not told here.
            self.broken |= covered & depth.simd_le(self.last);
            self.last = covered.select(depth, self.last);

            let alpha = splat(row[7]);
            let weight = covered.select(self.transmittance * alpha, zero);
            for (c, l) in self.colour.iter_mut().zip(&row[4..7]) {
                *c += weight * splat(*l);
            }
            let dimmed = self.transmittance * (one - alpha);
            self.transmittance = covered.select(dimmed, self.transmittance);
        }
    }

    /// The samples' colours, channel by channel, and the set of those at which the
    /// layers did not come by strictly rising depth: their colours may be wrong.
    #[inline(always)]
    pub(super) fn over(&self, background: [f64; 3]) -> ([[f64; LANES]; 3], u64) {
        let mut colours = [[0.0; LANES]; 3];
        for (out, (c, b)) in colours.iter_mut().zip(self.colour.iter().zip(background)) {
            (*c + self.transmittance * f64x8::splat(self.simd, b)).store_slice(out);
        }
        (colours, self.broken.to_bitmask())
    }
}
