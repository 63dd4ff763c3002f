//! Decoding a batch's columns, block by block.
//!
//! How a column is stored is asked once for a block, not once for a value: a block
//! lends every column as a slice of one type, be it the file's own bytes, widened
//! values, or a constant written out.

use std::ops::Range;

use half::f16;

use crate::trace::batch::Batch;
use crate::trace::column::{ChannelColumn, Column, CoverageColumn, Native};
use crate::trace::fragment::{DepthPlane, Fragment, SampleMask, Unorm32};

/// Fragments that are decoded at a time: few enough for the nearest cache.
pub(crate) const BLOCK: usize = 128;

/// Decodes one batch.
pub(crate) struct Decoder<'a> {
    batch: &'a Batch,
    block: Box<Block>,
}

/// Columns side by side: one base address reaches all of them.
struct Block {
    x: [u16; BLOCK],
    y: [u16; BLOCK],
    coverage: [u64; BLOCK],
    z: [u32; BLOCK],
    dzdx: [i32; BLOCK],
    dzdy: [i32; BLOCK],
    colour: [[f32; BLOCK]; 3],
    alpha: [f32; BLOCK],
    primitive: [u32; BLOCK],
    object: [u32; BLOCK],
}

impl<'a> Decoder<'a> {
    pub fn new(batch: &'a Batch) -> Self {
        let mut block = Block {
            x: [0; BLOCK],
            y: [0; BLOCK],
            coverage: [0; BLOCK],
            z: [0; BLOCK],
            dzdx: [0; BLOCK],
            dzdy: [0; BLOCK],
            colour: [[0.0; BLOCK]; 3],
            alpha: [0.0; BLOCK],
            primitive: [0; BLOCK],
            object: [0; BLOCK],
        };
        // Constants are written out once.
        constant(&batch.x, &mut block.x, |v| v);
        constant(&batch.y, &mut block.y, |v| v);
        match &batch.coverage {
            CoverageColumn::U8(c) => constant(c, &mut block.coverage, u64::from),
            CoverageColumn::U16(c) => constant(c, &mut block.coverage, u64::from),
            CoverageColumn::U32(c) => constant(c, &mut block.coverage, u64::from),
            CoverageColumn::U64(c) => constant(c, &mut block.coverage, |v| v),
        }
        constant(&batch.z, &mut block.z, |v| v);
        constant(&batch.dzdx, &mut block.dzdx, |v| v);
        constant(&batch.dzdy, &mut block.dzdy, |v| v);
        for (values, column) in block.colour.iter_mut().zip(&batch.colour) {
            match column {
                ChannelColumn::F16(c) => constant(c, values, widen),
                ChannelColumn::F32(c) => constant(c, values, |v| v),
            }
        }
        constant(&batch.alpha, &mut block.alpha, |v| v);
        constant(&batch.primitive, &mut block.primitive, |v| v);
        constant(&batch.object, &mut block.object, |v| v);
        Decoder { batch, block: Box::new(block) }
    }

    /// Columns, rows and coverage of the fragments in `rows`, at most [`BLOCK`]; what
    /// follows them means nothing.
    pub fn footprints(&mut self, rows: &Range<usize>) -> Footprints<'_> {
        self.decode_footprints(rows);
        let Block { x, y, coverage, .. } = &*self.block;
        Footprints { x, y, coverage }
    }

    /// Tells `each` the fragments of `rows`, at most [`BLOCK`], with their place among them.
    #[inline]
    pub fn fragments(&mut self, rows: &Range<usize>, mut each: impl FnMut(usize, Fragment)) {
        self.decode_footprints(rows);
        let (batch, block) = (self.batch, &mut *self.block);
        copy(&batch.z, rows, &mut block.z);
        copy(&batch.dzdx, rows, &mut block.dzdx);
        copy(&batch.dzdy, rows, &mut block.dzdy);
        for (channel, column) in block.colour.iter_mut().zip(&batch.colour) {
            match column {
                ChannelColumn::F16(c) => values(c, rows, channel, widen),
                ChannelColumn::F32(c) => copy(c, rows, channel),
            }
        }
        copy(&batch.alpha, rows, &mut block.alpha);
        copy(&batch.primitive, rows, &mut block.primitive);
        copy(&batch.object, rows, &mut block.object);
        let [r, g, b] = &block.colour;
        for i in 0..rows.len().min(BLOCK) {
            let fragment = Fragment {
                x: block.x[i],
                y: block.y[i],
                coverage: SampleMask(block.coverage[i]),
                depth: DepthPlane {
                    z: Unorm32(block.z[i]),
                    dzdx: block.dzdx[i],
                    dzdy: block.dzdy[i],
                },
                colour: [r[i], g[i], b[i]],
                alpha: block.alpha[i],
                primitive: block.primitive[i],
                object: block.object[i],
            };
            each(i, fragment);
        }
    }

    fn decode_footprints(&mut self, rows: &Range<usize>) {
        let (batch, block) = (self.batch, &mut *self.block);
        copy(&batch.x, rows, &mut block.x);
        copy(&batch.y, rows, &mut block.y);
        match &batch.coverage {
            CoverageColumn::U8(c) => values(c, rows, &mut block.coverage, u64::from),
            CoverageColumn::U16(c) => values(c, rows, &mut block.coverage, u64::from),
            CoverageColumn::U32(c) => values(c, rows, &mut block.coverage, u64::from),
            CoverageColumn::U64(c) => copy(c, rows, &mut block.coverage),
        }
    }
}

/// Where a block's fragments lie and what they cover.
pub(crate) struct Footprints<'a> {
    pub x: &'a [u16; BLOCK],
    pub y: &'a [u16; BLOCK],
    pub coverage: &'a [u64; BLOCK],
}

#[inline]
fn constant<T: Native, U: Copy>(column: &Column<T>, to: &mut [U], change: impl Fn(T) -> U) {
    if let Column::Constant(value) = column {
        to.fill(change(*value));
    }
}

#[inline]
fn values<T: Native, U>(
    column: &Column<T>,
    rows: &Range<usize>,
    to: &mut [U; BLOCK],
    change: impl Fn(T) -> U,
) {
    if let Column::Values(values) = column {
        for (to, value) in to.iter_mut().zip(&values[rows.clone()]) {
            *to = change(*value);
        }
    }
}

/// As [`values`], through the fastest copy that the machine has.
#[inline]
fn copy<T: Native>(column: &Column<T>, rows: &Range<usize>, to: &mut [T; BLOCK]) {
    if let Column::Values(values) = column {
        to[..rows.len()].copy_from_slice(&values[rows.clone()]);
    }
}

/// A finite half-precision value in single precision, exactly. The multiplication by
/// 2^112 moves one format's exponents, denormals included, to the other's; unlike
/// `f16::to_f32` it asks for no instruction that a machine may lack.
#[inline]
fn widen(value: f16) -> f32 {
    const SCALE: f32 = f32::from_bits((112 + 127) << 23);
    let bits = u32::from(value.to_bits());
    let magnitude = f32::from_bits((bits & 0x7fff) << 13) * SCALE;
    f32::from_bits(magnitude.to_bits() | (bits & 0x8000) << 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_finite_half_is_widened_exactly() {
        for value in (0..=u16::MAX).map(f16::from_bits).filter(|v| v.is_finite()) {
            assert_eq!(widen(value).to_bits(), value.to_f32().to_bits(), "{value}");
        }
    }
}
