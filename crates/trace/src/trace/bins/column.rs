//! A column's values in bins, and how they get there and out of there.

use std::fmt;

use crate::trace::batch::MAX_BATCH_ROWS;
use crate::trace::column::{Column, Native};
use crate::trace::fragment::SampleMask;

/// Rows that are copied at a time, at least.
pub(super) const STRETCH: usize = 16;

/// A column in bins, of values that blocks have as `V`.
pub trait Binned<V>: fmt::Debug + Send + Sync {
    /// What a row takes: nothing where all are the same.
    fn bytes(&self) -> usize;
    /// Adds room for `rows` rows.
    fn add_slab(&mut self, rows: usize);
    /// Copies rows to a block, masks as far as they lie within `mask`.
    fn read(&self, rows: Rows, to: &mut [V], mask: SampleMask);
}

/// Rows that lie one after the other in a slab.
#[derive(Clone, Copy, Debug)]
pub struct Rows {
    pub slab: usize,
    pub start: usize,
    pub count: usize,
}

/// Where rows of a batch go. Rows are numbered through all slabs.
#[derive(Debug, Default)]
pub struct Copies {
    /// The binary logarithm of a slab's rows.
    shift: u32,
    /// First rows there and here: a whole stretch's worth is copied for each, and what is too
    /// much is written over by the tile's next rows. A length known when this is compiled is
    /// worth more than a copy that ends where it should.
    stretches: Vec<(u32, u32)>,
    /// Those that would write beyond their chunk or read beyond their batch, and their
    /// counts. They come last of what is copied to a chunk.
    ends: Vec<(u32, u32, u32)>,
}

impl Copies {
    pub(super) fn new(shift: u32) -> Self {
        Copies { shift, ..Copies::default() }
    }

    pub(super) fn clear(&mut self) {
        self.stretches.clear();
        self.ends.clear();
    }

    /// Adds `count` rows, of those that a batch of `len` has from `from` on, for a chunk
    /// that has `room` for as many from `to` on.
    #[inline]
    pub(super) fn add(&mut self, from: usize, len: usize, to: u32, room: u32, count: usize) {
        debug_assert!(count <= STRETCH && len <= MAX_BATCH_ROWS);
        if room >= STRETCH as u32 && len - from >= STRETCH {
            self.stretches.push((from as u32, to));
        } else {
            self.ends.push((from as u32, to, count as u32));
        }
    }

    /// Copies `values`, which lack the batch's first `missing`.
    #[inline(always)]
    pub(super) fn put<T: Copy>(&self, values: &[T], missing: usize, slabs: &mut [Box<[T]>]) {
        let last = (1_usize << self.shift) - 1;
        for &(from, to) in &self.stretches {
            let (from, to) = (from as usize - missing, to as usize);
            let values: &[T; STRETCH] =
                values[from..from + STRETCH].try_into().expect("of this length");
            let slab = &mut slabs[to >> self.shift];
            let to = to & last;
            let to: &mut [T; STRETCH] =
                (&mut slab[to..to + STRETCH]).try_into().expect("of this length");
            *to = *values;
        }
        for &(from, to, count) in &self.ends {
            let (from, to, count) = (from as usize - missing, to as usize, count as usize);
            let slab = &mut slabs[to >> self.shift];
            let to = &mut slab[to & last..][..count];
            for (to, value) in to.iter_mut().zip(&values[from..from + count]) {
                *to = *value;
            }
        }
    }
}

/// Values in slabs, or one for all.
#[derive(Debug)]
pub enum BinnedColumn<T> {
    Constant(T),
    Values(Vec<Box<[T]>>),
}

impl<T: Native> BinnedColumn<T> {
    /// One without rows, for columns like this.
    pub fn like(column: &Column<T>) -> Self {
        match column {
            Column::Constant(value) => BinnedColumn::Constant(*value),
            Column::Values(_) => BinnedColumn::Values(Vec::new()),
        }
    }

    /// Copies a batch's values.
    #[inline(always)]
    pub fn put(&mut self, column: &Column<T>, copies: &Copies) {
        match (self, column) {
            (BinnedColumn::Values(slabs), Column::Values(values)) => copies.put(values, 0, slabs),
            (BinnedColumn::Constant(_), Column::Constant(_)) => {}
            _ => unreachable!("a column is constant in all of a trace's batches or in none"),
        }
    }

    /// Copies rows to a block, each changed.
    #[inline(always)]
    pub fn get<V: Copy>(&self, rows: Rows, to: &mut [V], change: impl Fn(T) -> V) {
        match self {
            BinnedColumn::Constant(value) => to[..rows.count].fill(change(*value)),
            BinnedColumn::Values(slabs) => {
                let values = &slabs[rows.slab][rows.start..rows.start + rows.count];
                for (to, value) in to[..rows.count].iter_mut().zip(values) {
                    *to = change(*value);
                }
            }
        }
    }

    pub fn bytes(&self) -> usize {
        match self {
            BinnedColumn::Constant(_) => 0,
            BinnedColumn::Values(_) => T::TYPE.bytes(),
        }
    }

    pub fn add_slab(&mut self, rows: usize) {
        if let BinnedColumn::Values(slabs) = self {
            slabs.push(slab(rows));
        }
    }
}

/// Room for so many rows. It is zero as it comes from the system: nothing is touched before
/// rows arrive.
pub(super) fn slab<T: Native>(rows: usize) -> Box<[T]> {
    vec![T::default(); rows].into_boxed_slice()
}
