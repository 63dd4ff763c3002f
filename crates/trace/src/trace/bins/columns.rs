//! All columns of bins, and blocks made of them.

use std::ops::Range;

use fearless_simd::{Level, dispatch};

use crate::tile::TILE_SIDE;
use crate::trace::batch::Batch;
use crate::trace::bins::column::{Binned, Copies, Rows, STEP};
use crate::trace::bins::slabs::Slabs;
use crate::trace::block::Block;
use crate::trace::cells::{Cells, ChannelColumn, CoverageColumn};
use crate::trace::column::Column;
use crate::trace::columns::{ColumnSet, columns, with_probe};
use crate::trace::fragment::SampleMask;

/// Makes the columns of bins of the table of columns: the pixel's column and row become its
/// place in the tile, in which a byte says both.
macro_rules! binned {
    (
        {
            X x: $x:ty, [x], $xcheck:ident, $xunit:literal, $xwhat:literal;
            Y y: $y:ty, [y], $ycheck:ident, $yunit:literal, $ywhat:literal;
            $($id:ident $name:ident: $type:ty, [$($place:tt)+], $check:ident,
                $unit:literal, $what:literal;)*
        }
        { $($oid:ident $oname:ident: $otype:ty = $default:expr, $ocheck:ident,
            $ounit:literal, $owhat:literal;)* }
    ) => {
        /// The columns of bins, in the types that the trace has them in.
        #[derive(Debug)]
        pub(super) struct BinnedColumns {
            $($name: <$type as Cells>::Binned,)*
            $($oname: Option<<$otype as Cells>::Binned>,)*
        }

        impl BinnedColumns {
            /// Columns without rows, of the types that `batch` has.
            pub(super) fn like(batch: &Batch) -> Self {
                let mut columns = BinnedColumns {
                    $($name: batch.$name.binned(),)*
                    $($oname: batch.$oname.as_ref().map(Cells::binned),)*
                };
                // The places come first.
                let mut before = size_of::<u8>();
                $(
                    columns.$name.place(before);
                    before += columns.$name.bytes();
                )*
                $(if let Some(column) = &mut columns.$oname {
                    column.place(before);
                    before += column.bytes();
                })*
                let _ = before;
                columns
            }

            /// What a row takes.
            pub(super) fn bytes(&self) -> usize {
                size_of::<u8>()
                    $(+ self.$name.bytes())*
                    $(+ self.$oname.as_ref().map_or(0, Binned::bytes))*
            }

            /// Copies a batch's rows; `within` are the places of those from `first` on.
            fn put(&self, batch: &Batch, slabs: &mut Slabs, copies: &Copies, within: (&[u8], usize)) {
                copies.put(size_of::<u8>(), within.0, within.1, (slabs, 0));
                $(batch.$name.bin(&self.$name, slabs, copies);)*
                $(if let (Some(from), Some(to)) = (&batch.$oname, &self.$oname) {
                    from.bin(to, slabs, copies);
                })*
            }

            /// Copies rows to a block's end.
            #[inline(always)]
            fn get(&self, from: (&Slabs, Rows), to: &mut Block, [left, top]: [u16; 2], wanted: Wanted) {
                let (slabs, rows) = from;
                let at = to.len..to.len + rows.count;
                let within = &slabs.bytes(rows.slab)[rows.start..rows.start + rows.count];
                let xy = to.x[at.clone()].iter_mut().zip(&mut to.y[at.clone()]);
                for ((x, y), within) in xy.zip(within) {
                    let within = u16::from(*within);
                    *x = left + within % TILE_SIDE as u16;
                    *y = top + within / TILE_SIDE as u16;
                }
                $(self.$name.read(from, &mut to.$name[at.clone()], wanted.samples);)*
                $(
                    let read = wanted.columns.contains(crate::trace::columns::ColumnId::$oid);
                    match (self.$oname.as_ref().filter(|_| read), &mut to.$oname) {
                        (Some(column), values) => {
                            let room = || Box::new([$default; crate::trace::block::BLOCK]);
                            let values = values.get_or_insert_with(room);
                            column.read(from, &mut values[at.clone()], wanted.samples);
                        }
                        (None, Some(values)) => values[at.clone()].fill($default),
                        (None, None) => {}
                    }
                )*
                to.len = at.end;
            }
        }
    };
}
columns!(binned);

/// What of the rows a replay looks at.
#[derive(Clone, Copy, Debug)]
pub struct Wanted {
    /// The samples to which coverage is cut.
    pub samples: SampleMask,
    /// Which of the optional columns.
    pub columns: ColumnSet,
}

impl BinnedColumns {
    /// Copies rows of `batch`, from row `first` on, with the instructions of `level`;
    /// `within` is where their places are put meanwhile.
    pub(super) fn copy(
        &self,
        level: Level,
        batch: &Batch,
        rows: Range<usize>,
        to: (&mut Slabs, &Copies),
        within: &mut [u8; STEP],
    ) {
        let within = &mut within[..rows.len()];
        dispatch!(level, _ => find_places(batch, rows.start, within));
        self.put(batch, to.0, to.1, (within, rows.start));
    }

    /// Copies rows of `tile` to a block's end, with the instructions of `level`.
    pub(super) fn append(
        &self,
        level: Level,
        from: (&Slabs, Rows),
        to: &mut Block,
        corner: (u32, u32),
        wanted: Wanted,
    ) {
        dispatch!(level, _ => self.get(from, to, [corner.0 as u16, corner.1 as u16], wanted));
    }
}

/// The places in their tiles of rows from `first` on.
#[inline(always)]
fn find_places(batch: &Batch, first: usize, within: &mut [u8]) {
    const LAST: u16 = TILE_SIDE as u16 - 1;
    let [x, y] = batch.places();
    match x {
        Column::Constant(x) => within.fill((x & LAST) as u8),
        Column::Values(x) => {
            for (within, x) in within.iter_mut().zip(&x[first..]) {
                *within = (x & LAST) as u8;
            }
        }
    }
    let row = |y: &u16| ((y & LAST) * TILE_SIDE as u16) as u8;
    match y {
        Column::Constant(y) => within.iter_mut().for_each(|within| *within |= row(y)),
        Column::Values(y) => {
            for (within, y) in within.iter_mut().zip(&y[first..]) {
                *within |= row(y);
            }
        }
    }
}
