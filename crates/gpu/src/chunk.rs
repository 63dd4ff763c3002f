//! A trace in chunks: columns as they are in the file, one after the other in a buffer that
//! a program can bind.

use std::ops::Range;

use crate::device::Gpu;
use crate::loaders;
use crate::params::{Column, Params, words};
use screendoor_rop::Constant;
use screendoor_trace::error::Result;
use screendoor_trace::trace::{ColumnId, ColumnSet, Scalar, Trace, ValueType};

/// Rows of a batch.
#[derive(Clone, Debug, PartialEq)]
struct Part {
    batch: usize,
    rows: Range<usize>,
}

/// How a trace is cut, and how its columns are stored.
#[derive(Debug)]
pub(super) struct Chunks {
    list: Vec<Vec<Part>>,
    /// The columns that are stored, in the file's order.
    stored: Vec<(ColumnId, ValueType)>,
    constants: Vec<(ColumnId, Scalar)>,
}

/// A chunk on the device.
#[derive(Debug)]
pub(super) struct Uploaded {
    pub columns: wgpu::Buffer,
    /// Rows and columns; the rest is the frame's.
    pub params: Params,
}

impl Chunks {
    /// Cuts `trace` so that neither a chunk's columns nor a word for each of its rows take
    /// more than `bytes`, nor more than `rows` rows; of optional columns there are `read`.
    pub(crate) fn of(trace: &Trace, bytes: u64, rows: u64, read: ColumnSet) -> Self {
        let header = trace.header();
        let wanted = |id: ColumnId| !id.is_optional() || read.contains(id);
        let stored: Vec<_> =
            trace.columns().iter().copied().filter(|(id, _)| wanted(*id)).collect();
        let constant = |id: ColumnId| {
            let given = header.constants.get(&id).copied().filter(|_| wanted(id));
            Some((id, given.or(id.default_value())?))
        };
        let is_stored = |id: &ColumnId| stored.iter().any(|(stored, _)| stored == id);
        let others = ColumnId::ALL.into_iter().filter(|id| !is_stored(id));
        let constants = others.filter_map(constant).collect();
        let row: usize = stored.iter().map(|(_, value_type)| value_type.bytes()).sum();
        // A column begins with a whole word.
        let room = bytes.saturating_sub(4 * ColumnId::ALL.len() as u64);
        let most = (room / row.max(8) as u64).min(rows).max(1);
        let sizes = (0..trace.batch_count()).map(|i| trace.batch_rows(i) as usize);
        Chunks { list: cut(sizes, most as usize), stored, constants }
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.list.len()
    }

    /// How many rows the `i`-th has.
    pub(crate) fn rows(&self, i: usize) -> usize {
        self.list[i].iter().map(|part| part.rows.len()).sum()
    }

    /// The bytes that the `i`-th takes.
    pub(crate) fn bytes(&self, i: usize) -> u64 {
        self.places(self.rows(i)).1
    }

    /// For each column, how many bytes its values have: none of a constant.
    pub(crate) fn types(&self) -> impl Iterator<Item = (String, Constant)> {
        ColumnId::ALL.into_iter().map(|id| {
            let bytes = self.stored.iter().find(|(s, _)| *s == id).map_or(0, |(_, t)| t.bytes());
            (loaders::bytes_constant(id), Constant::Whole(bytes as u32))
        })
    }

    /// Where the stored columns of `rows` rows begin, and the bytes of all.
    fn places(&self, rows: usize) -> (Vec<u64>, u64) {
        let mut end = 0;
        let place = |(_, value_type): &(ColumnId, ValueType)| {
            let start = end;
            end += ((rows * value_type.bytes()) as u64).next_multiple_of(4);
            start
        };
        let places = self.stored.iter().map(place).collect();
        (places, end)
    }

    /// Brings the `i`-th chunk to the device.
    ///
    /// # Errors
    /// As [`Trace::batch`] and [`Gpu::buffer`].
    pub(crate) fn upload(
        &self,
        gpu: &Gpu,
        trace: &Trace,
        i: usize,
        frame: &Params,
    ) -> Result<Uploaded> {
        let rows = self.rows(i);
        let (places, bytes) = self.places(rows);
        let mut params = Params { rows: rows as u32, ..*frame };
        for (id, value) in &self.constants {
            let [low, high] = match value {
                Scalar::Unsigned(v) => words(*v),
                Scalar::Signed(v) => [*v as u32, 0],
                Scalar::Real(v) => [v.to_bits(), 0],
            };
            params.columns[*id as usize] = Column { low, high, ..Column::default() };
        }
        for ((id, _), place) in self.stored.iter().zip(&places) {
            let at = (place / 4) as u32;
            params.columns[*id as usize] = Column { at, ..Column::default() };
        }
        let usage = wgpu::BufferUsages::STORAGE;
        let buffer = gpu.mapped("a chunk's columns", bytes, usage, |mut to| {
            let mut row = 0;
            for part in &self.list[i] {
                let batch = trace.batch(part.batch)?;
                for (id, buffer) in batch.buffers() {
                    let Some((value_type, values)) = buffer else { continue };
                    let column = self.stored.iter().position(|(stored, _)| *stored == id);
                    let Some(column) = column else { continue };
                    let size = value_type.bytes();
                    let values = &values[part.rows.start * size..part.rows.end * size];
                    let start = places[column] as usize + row * size;
                    to.slice(start..start + values.len()).copy_from_slice(values);
                }
                row += part.rows.len();
            }
            Ok(())
        })?;
        Ok(Uploaded { columns: buffer, params })
    }
}

/// Cuts batches of so many rows into chunks of at most `most`.
fn cut(batches: impl Iterator<Item = usize>, most: usize) -> Vec<Vec<Part>> {
    let mut list: Vec<Vec<Part>> = Vec::new();
    let mut room = 0;
    for (batch, rows) in batches.enumerate() {
        let mut start = 0;
        while start < rows {
            if room == 0 {
                list.push(Vec::new());
                room = most;
            }
            let end = rows.min(start + room);
            list.last_mut().expect("one was begun").push(Part { batch, rows: start..end });
            room -= end - start;
            start = end;
        }
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_hold_every_row_once_and_in_order() {
        for most in [1, 3, 7, 100] {
            let sizes = [5, 0, 4, 12];
            let list = cut(sizes.into_iter(), most);
            let rows = |chunk: &Vec<Part>| chunk.iter().map(|p| p.rows.len()).sum::<usize>();
            assert!(list.iter().all(|chunk| (1..=most).contains(&rows(chunk))));
            // All but the last are full.
            assert!(list.iter().rev().skip(1).all(|chunk| rows(chunk) == most));
            let all: Vec<(usize, usize)> =
                list.iter().flatten().flat_map(|p| p.rows.clone().map(|r| (p.batch, r))).collect();
            let expected = sizes.iter().enumerate().flat_map(|(b, n)| (0..*n).map(move |r| (b, r)));
            assert!(expected.eq(all));
        }
    }
}
