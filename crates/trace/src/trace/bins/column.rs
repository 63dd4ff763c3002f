//! A column's values in bins, and how they get there and out of there.

use std::fmt;

use crate::trace::bins::slabs::{RowNumber, Slabs};
use crate::trace::column::{Column, Native};
use crate::trace::fragment::SampleMask;

/// A column in bins, of values that blocks have as `V`.
pub trait Binned<V>: fmt::Debug + Send + Sync {
    /// What a row takes: nothing where all are the same.
    fn bytes(&self) -> usize;
    /// Places it after columns of which a row takes `before` bytes.
    fn place(&mut self, before: usize);
    /// Copies rows to a block, masks as far as they lie within `mask`.
    fn read(&self, from: (&Slabs, Rows), to: &mut [V], mask: SampleMask);
}

/// Rows that lie one after the other in a slab.
#[derive(Clone, Copy, Debug)]
pub struct Rows {
    pub slab: usize,
    pub start: usize,
    pub count: usize,
}

/// Where rows of a batch go, in pieces of 1, 2, 4, 8 and 16 rows: a loop for each length, that
/// is known when this is compiled. Most runs are of a few rows.
#[derive(Debug)]
pub struct Copies {
    /// For each length, the pieces' first rows there and here.
    pieces: [Box<[(u32, RowNumber); STEP + 1]>; LENGTHS],
    counts: [usize; LENGTHS],
}

/// How many lengths of pieces there are.
const LENGTHS: usize = 5;

/// Rows that are copied at a time, at most: what is copied of them, column by column, still
/// lies in the nearest cache.
pub(super) const STEP: usize = 1 << 12;

impl Default for Copies {
    fn default() -> Self {
        let pieces = std::array::from_fn(|_| Box::new([(0, RowNumber(0)); STEP + 1]));
        Copies { pieces, counts: [0; LENGTHS] }
    }
}

impl Copies {
    pub(super) fn clear(&mut self) {
        self.counts = [0; LENGTHS];
    }

    /// Adds `count` rows from `from` on, for as many from `to` on in one slab.
    #[inline]
    pub(super) fn add(&mut self, from: usize, to: RowNumber, count: u32) {
        const LONGEST: u32 = 1 << (LENGTHS - 1);
        let (mut from, mut to, mut left) = (from as u32, to.0, count);
        while left >= LONGEST {
            self.pieces[LENGTHS - 1][self.counts[LENGTHS - 1]] = (from, RowNumber(to));
            self.counts[LENGTHS - 1] += 1;
            (from, to, left) = (from + LONGEST, to + LONGEST, left - LONGEST);
        }
        // No jump depends on the count: what is no piece is written over by the next.
        for i in (0..LENGTHS - 1).rev() {
            self.pieces[i][self.counts[i]] = (from, RowNumber(to));
            let is_piece = left >> i & 1;
            self.counts[i] += is_piece as usize;
            (from, to) = (from + (is_piece << i), to + (is_piece << i));
        }
    }

    /// Copies a column's values of `size` bytes, which lack the batch's first `missing`, to
    /// where the column begins in a slab.
    pub(super) fn put(&self, size: usize, values: &[u8], missing: usize, to: (&mut Slabs, usize)) {
        match size {
            1 => self.put_sized::<1, 2, 4, 8, 16>(values, missing, to),
            2 => self.put_sized::<2, 4, 8, 16, 32>(values, missing, to),
            4 => self.put_sized::<4, 8, 16, 32, 64>(values, missing, to),
            _ => self.put_sized::<8, 16, 32, 64, 128>(values, missing, to),
        }
    }

    /// The same for pieces that take so many bytes.
    fn put_sized<const A: usize, const B: usize, const C: usize, const D: usize, const E: usize>(
        &self,
        values: &[u8],
        missing: usize,
        (slabs, start): (&mut Slabs, usize),
    ) {
        self.put_pieces::<A, E>(4, values, missing, slabs, start);
        self.put_pieces::<A, D>(3, values, missing, slabs, start);
        self.put_pieces::<A, C>(2, values, missing, slabs, start);
        self.put_pieces::<A, B>(1, values, missing, slabs, start);
        self.put_pieces::<A, A>(0, values, missing, slabs, start);
    }

    #[inline(always)]
    fn put_pieces<const SIZE: usize, const BYTES: usize>(
        &self,
        list: usize,
        values: &[u8],
        missing: usize,
        slabs: &mut Slabs,
        start: usize,
    ) {
        for &(from, to) in &self.pieces[list][..self.counts[list]] {
            let from = (from as usize - missing) * SIZE;
            let values: &[u8; BYTES] =
                values[from..from + BYTES].try_into().expect("of this length");
            let slab = slabs.bytes_mut(to.slab());
            let to = start + to.place() * SIZE;
            let to: &mut [u8; BYTES] =
                (&mut slab[to..to + BYTES]).try_into().expect("of this length");
            *to = *values;
        }
    }
}

/// A value for each row, or one for all.
#[derive(Debug)]
pub enum BinnedColumn<T> {
    Constant(T),
    /// Bytes that a row takes in the columns before it.
    Values(usize),
}

impl<T: Native> BinnedColumn<T> {
    /// One for columns like this.
    pub fn like(column: &Column<T>) -> Self {
        match column {
            Column::Constant(value) => BinnedColumn::Constant(*value),
            Column::Values(_) => BinnedColumn::Values(0),
        }
    }

    /// Copies a batch's values.
    pub fn put(&self, column: &Column<T>, slabs: &mut Slabs, copies: &Copies) {
        match (self, column) {
            (BinnedColumn::Values(before), Column::Values(values)) => {
                let start = before * slabs.rows();
                copies.put(size_of::<T>(), values.inner().as_slice(), 0, (slabs, start));
            }
            (BinnedColumn::Constant(_), Column::Constant(_)) => {}
            _ => unreachable!("a column is constant in all of a trace's batches or in none"),
        }
    }

    /// Copies rows to a block, each changed.
    #[inline(always)]
    pub fn get<V: Copy>(
        &self,
        (slabs, rows): (&Slabs, Rows),
        to: &mut [V],
        change: impl Fn(T) -> V,
    ) {
        let to = &mut to[..rows.count];
        match self {
            BinnedColumn::Constant(value) => to.fill(change(*value)),
            BinnedColumn::Values(before) => {
                let size = size_of::<T>();
                let start = before * slabs.rows() + rows.start * size;
                let values = &slabs.bytes(rows.slab)[start..start + rows.count * size];
                for (to, value) in to.iter_mut().zip(values.chunks_exact(size)) {
                    *to = change(T::from_bytes(value));
                }
            }
        }
    }

    pub fn bytes(&self) -> usize {
        match self {
            BinnedColumn::Constant(_) => 0,
            BinnedColumn::Values(_) => size_of::<T>(),
        }
    }

    pub fn place(&mut self, bytes: usize) {
        if let BinnedColumn::Values(before) = self {
            *before = bytes;
        }
    }
}
