//! Runs of a batch's rows that lie in one tile.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, u16x32};

use crate::tile::TILE_SIDE;
use crate::trace::batch::Batch;
use crate::trace::column::Column;

/// Rows that are compared at a time.
const STEP: usize = 32;

/// Tells `each` the runs of rows in one tile, with the pixel of the first. Primitives are
/// drawn row by row, so that runs are much fewer than fragments.
pub(super) fn for_each_run(
    level: Level,
    batch: &Batch,
    rows: Range<usize>,
    mut each: impl FnMut((u16, u16), Range<usize>),
) {
    let columns = batch.places().map(|column| match column {
        // Where all are in one column or row, nothing changes.
        Column::Constant(_) => &[],
        Column::Values(values) => &values[rows.clone()],
    });
    let mut start = rows.start;
    let mut next = |end: usize| {
        let run = std::mem::replace(&mut start, end)..end;
        each(batch.pixel(run.start), run);
    };
    dispatch!(level, simd => find_changes(simd, columns, rows.len(), |i| next(rows.start + i)));
    if !rows.is_empty() {
        next(rows.end);
    }
}

/// Tells `at` where a pixel lies in another tile than the one before it: pixels in columns
/// and rows, of which one may be left out.
#[inline(always)]
fn find_changes<S: Simd>(simd: S, columns: [&[u16]; 2], len: usize, mut at: impl FnMut(usize)) {
    const TILE: u16 = !(TILE_SIDE as u16 - 1);
    let given = || columns.into_iter().filter(|column| !column.is_empty());
    let (tile, none) = (u16x32::splat(simd, TILE), u16x32::splat(simd, 0));
    let mut i = 1;
    while i + STEP <= len {
        let mut changes = 0;
        for column in given() {
            let [before, here] = [i - 1, i].map(|i| u16x32::from_slice(simd, &column[i..i + STEP]));
            changes |= ((before ^ here) & tile).simd_gt(none).to_bitmask();
        }
        while changes != 0 {
            at(i + changes.trailing_zeros() as usize);
            changes &= changes - 1;
        }
        i += STEP;
    }
    for i in i..len {
        if given().any(|column| (column[i] ^ column[i - 1]) & TILE != 0) {
            at(i);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    /// Runs that end where a vector does, and elsewhere; one row or column for all.
    #[test]
    fn changes_are_where_the_tile_changes() {
        let mut random = Stream::new([5]);
        for len in [0, 1, 2, 31, 32, 33, 64, 65, 200] {
            for changing in [1, 3, 40] {
                let (mut x, mut y) = (0, 0);
                let mut step = |_| {
                    match random.below(changing) {
                        0 => x = random.below(40) as u16,
                        1 => y = random.below(40) as u16 * 1600,
                        _ => {}
                    }
                    (x, y)
                };
                let (x, y): (Vec<u16>, Vec<u16>) = (0..len).map(&mut step).unzip();
                for columns in [[&x[..], &y], [&x, &[]], [&[], &y], [&[], &[]]] {
                    let tile = |i: usize| columns.map(|c| c.get(i).map(|v| v / 16));
                    let expected: Vec<usize> =
                        (1..len).filter(|i| tile(*i) != tile(i - 1)).collect();
                    for level in [Level::new(), Level::fallback()] {
                        let mut found = Vec::new();
                        dispatch!(level, simd => {
                            find_changes(simd, columns, len, |i| found.push(i))
                        });
                        assert_eq!(found, expected, "{columns:?}");
                    }
                }
            }
        }
    }
}
