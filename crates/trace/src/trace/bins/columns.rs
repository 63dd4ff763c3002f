//! All columns of bins, and blocks made of them.

use fearless_simd::{Level, dispatch};

use crate::tile::{TILE_SIDE, TileGrid, TileId};
use crate::trace::batch::Batch;
use crate::trace::bins::column::{Binned, Copies, Rows, slab};
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
            within: Vec<Box<[u8]>>,
            $($name: <$type as Cells>::Binned,)*
            $($oname: Option<<$otype as Cells>::Binned>,)*
        }

        impl BinnedColumns {
            /// Columns without rows, of the types that `batch` has.
            pub(super) fn like(batch: &Batch) -> Self {
                BinnedColumns {
                    within: Vec::new(),
                    $($name: batch.$name.binned(),)*
                    $($oname: batch.$oname.as_ref().map(Cells::binned),)*
                }
            }

            /// What a row takes.
            pub(super) fn bytes(&self) -> usize {
                size_of::<u8>()
                    $(+ self.$name.bytes())*
                    $(+ self.$oname.as_ref().map_or(0, Binned::bytes))*
            }

            /// Adds room for `rows` rows.
            pub(super) fn add_slab(&mut self, rows: usize) {
                self.within.push(slab(rows));
                $(self.$name.add_slab(rows);)*
                $(if let Some(column) = &mut self.$oname {
                    column.add_slab(rows);
                })*
            }

            /// Copies a batch's rows; `within` are the places of those from `first` on.
            #[inline(always)]
            fn put(&mut self, batch: &Batch, copies: &Copies, within: &[u8], first: usize) {
                copies.put(within, first, &mut self.within);
                $(batch.$name.bin(&mut self.$name, copies);)*
                $(if let (Some(from), Some(to)) = (&batch.$oname, &mut self.$oname) {
                    from.bin(to, copies);
                })*
            }

            /// Copies rows to a block's end.
            #[inline(always)]
            fn get(&self, rows: Rows, to: &mut Block, [left, top]: [u16; 2], wanted: Wanted) {
                let at = to.len..to.len + rows.count;
                let within = &self.within[rows.slab][rows.start..rows.start + rows.count];
                let xy = to.x[at.clone()].iter_mut().zip(&mut to.y[at.clone()]);
                for ((x, y), within) in xy.zip(within) {
                    let within = u16::from(*within);
                    *x = left + within % TILE_SIDE as u16;
                    *y = top + within / TILE_SIDE as u16;
                }
                $(self.$name.read(rows, &mut to.$name[at.clone()], wanted.samples);)*
                $(
                    let read = wanted.columns.contains(crate::trace::columns::ColumnId::$oid);
                    match (self.$oname.as_ref().filter(|_| read), &mut to.$oname) {
                        (Some(column), values) => {
                            let room = || Box::new([$default; crate::trace::block::BLOCK]);
                            let values = values.get_or_insert_with(room);
                            column.read(rows, &mut values[at.clone()], wanted.samples);
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

/// Rows whose places in the tile are worked out at a time: what is copied of them, column by
/// column, still lies in the nearest cache.
pub(super) const STEP: usize = 1 << 12;

/// Places in the tile, and room to read a stretch beyond them.
pub(super) type Within = [u8; STEP + super::column::STRETCH];

impl BinnedColumns {
    /// Copies rows of `batch`, from row `first` on, with the instructions of `level`;
    /// `within` is where their places are put meanwhile.
    pub(super) fn copy(
        &mut self,
        level: Level,
        batch: &Batch,
        first: usize,
        count: usize,
        copies: &Copies,
        within: &mut Within,
    ) {
        dispatch!(level, _ => {
            find_places(batch, first, &mut within[..count]);
            self.put(batch, copies, within, first);
        });
    }

    /// Copies rows of `tile` to a block's end, with the instructions of `level`.
    pub(super) fn append(
        &self,
        level: Level,
        rows: Rows,
        to: &mut Block,
        grid: TileGrid,
        tile: TileId,
        wanted: Wanted,
    ) {
        let (x, y) = grid.pixel(tile, 0);
        dispatch!(level, _ => self.get(rows, to, [x as u16, y as u16], wanted));
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
