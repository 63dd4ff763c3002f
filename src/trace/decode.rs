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
pub(crate) const BLOCK: usize = 256;

/// Decodes one batch.
pub(crate) struct Decoder<'a> {
    batch: &'a Batch,
    x: Lent<'a, u16>,
    y: Lent<'a, u16>,
    coverage: [u64; BLOCK],
    z: Lent<'a, u32>,
    dzdx: Lent<'a, i32>,
    dzdy: Lent<'a, i32>,
    colour: [[f32; BLOCK]; 3],
    alpha: Lent<'a, f32>,
    primitive: Lent<'a, u32>,
    object: Lent<'a, u32>,
}

/// Where a block's fragments lie and what they cover.
pub(crate) struct Footprints<'a> {
    pub x: &'a [u16],
    pub y: &'a [u16],
    pub coverage: &'a [u64],
}

/// A column that blocks can borrow: all its values, or one block of a constant.
enum Lent<'a, T> {
    Constant([T; BLOCK]),
    Values(&'a [T]),
}

impl<'a, T: Native> Lent<'a, T> {
    fn new(column: &'a Column<T>) -> Self {
        match column {
            Column::Constant(v) => Lent::Constant([*v; BLOCK]),
            Column::Values(v) => Lent::Values(v),
        }
    }

    #[inline]
    fn rows(&self, rows: &Range<usize>) -> &[T] {
        match self {
            Lent::Constant(v) => &v[..rows.len()],
            Lent::Values(v) => &v[rows.clone()],
        }
    }
}

impl<'a> Decoder<'a> {
    pub fn new(batch: &'a Batch) -> Self {
        Decoder {
            batch,
            x: Lent::new(&batch.x),
            y: Lent::new(&batch.y),
            coverage: [0; BLOCK],
            z: Lent::new(&batch.z),
            dzdx: Lent::new(&batch.dzdx),
            dzdy: Lent::new(&batch.dzdy),
            colour: [[0.0; BLOCK]; 3],
            alpha: Lent::new(&batch.alpha),
            primitive: Lent::new(&batch.primitive),
            object: Lent::new(&batch.object),
        }
    }

    /// Pixels and coverage of `rows`, at most [`BLOCK`].
    pub fn footprints(&mut self, rows: Range<usize>) -> Footprints<'_> {
        self.widen_coverage(&rows);
        Footprints {
            x: self.x.rows(&rows),
            y: self.y.rows(&rows),
            coverage: &self.coverage[..rows.len()],
        }
    }

    /// Tells `each` the fragments of `rows`, at most [`BLOCK`], with their place among them.
    #[inline]
    pub fn fragments(&mut self, rows: Range<usize>, mut each: impl FnMut(usize, Fragment)) {
        self.widen_coverage(&rows);
        for (values, column) in self.colour.iter_mut().zip(&self.batch.colour) {
            match column {
                ChannelColumn::F16(Column::Constant(v)) => values.fill(widen(*v)),
                ChannelColumn::F16(Column::Values(v)) => {
                    convert(&v[rows.clone()], values, |v| widen(*v));
                }
                ChannelColumn::F32(Column::Constant(v)) => values.fill(*v),
                ChannelColumn::F32(Column::Values(v)) => {
                    values[..rows.len()].copy_from_slice(&v[rows.clone()]);
                }
            }
        }
        // Slices of one length: the loop below then needs no checks.
        let n = rows.len();
        let (x, y) = (&self.x.rows(&rows)[..n], &self.y.rows(&rows)[..n]);
        let coverage = &self.coverage[..n];
        let z = &self.z.rows(&rows)[..n];
        let (dzdx, dzdy) = (&self.dzdx.rows(&rows)[..n], &self.dzdy.rows(&rows)[..n]);
        let [r, g, b] = self.colour.each_ref().map(|values| &values[..n]);
        let alpha = &self.alpha.rows(&rows)[..n];
        let primitive = &self.primitive.rows(&rows)[..n];
        let object = &self.object.rows(&rows)[..n];
        for i in 0..n {
            let fragment = Fragment {
                x: x[i],
                y: y[i],
                coverage: SampleMask(coverage[i]),
                depth: DepthPlane { z: Unorm32(z[i]), dzdx: dzdx[i], dzdy: dzdy[i] },
                colour: [r[i], g[i], b[i]],
                alpha: alpha[i],
                primitive: primitive[i],
                object: object[i],
            };
            each(i, fragment);
        }
    }

    fn widen_coverage(&mut self, rows: &Range<usize>) {
        fn fill<T: Native + Into<u64>>(
            column: &Column<T>,
            rows: &Range<usize>,
            values: &mut [u64; BLOCK],
        ) {
            match column {
                Column::Constant(v) => values.fill((*v).into()),
                Column::Values(v) => convert(&v[rows.clone()], values, |v| (*v).into()),
            }
        }
        let values = &mut self.coverage;
        match &self.batch.coverage {
            CoverageColumn::U8(c) => fill(c, rows, values),
            CoverageColumn::U16(c) => fill(c, rows, values),
            CoverageColumn::U32(c) => fill(c, rows, values),
            CoverageColumn::U64(c) => fill(c, rows, values),
        }
    }
}

#[inline]
fn convert<T, U>(from: &[T], to: &mut [U; BLOCK], change: impl Fn(&T) -> U) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = change(from);
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
