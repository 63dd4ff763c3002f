//! A run of fragments, column by column, as it stands in a file.

use std::ops::BitAnd;
use std::sync::Arc;

use arrow_array::types::{
    ArrowPrimitiveType, Float16Type, Float32Type, Int32Type, UInt8Type, UInt16Type, UInt32Type,
    UInt64Type,
};
use arrow_array::{ArrayRef, PrimitiveArray, RecordBatch};
use arrow_buffer::{Buffer, ScalarBuffer};
use arrow_schema::{Field, Schema, SchemaRef};

use crate::error::{Error, Result};
use crate::trace::cells::{Cells, ChannelColumn, CoverageColumn, Source};
use crate::trace::column::{Column, Native, ValueType};
use crate::trace::columns::{ColumnId, columns, with_probe};
use crate::trace::fragment::{Fragment, SampleMask};
use crate::trace::header::Header;

/// The most fragments that one batch of a file may hold; a reader can refuse a
/// larger claim before it allocates anything.
pub const MAX_BATCH_ROWS: usize = 1 << 22;

/// Makes batches and their builder of the table of columns.
macro_rules! batches {
    (
        { $($id:ident $name:ident: $type:ty, [$($place:tt)+], $check:ident,
            $unit:literal, $what:literal;)* }
        { $($oid:ident $oname:ident: $otype:ty = $default:expr, $ocheck:ident,
            $ounit:literal, $owhat:literal;)* }
    ) => {
        /// A run of fragments in the order in which they reach the ROP.
        #[derive(Clone, Debug)]
        pub struct Batch {
            len: usize,
            $(pub(super) $name: $type,)*
            $(pub(super) $oname: Option<$otype>,)*
        }

        impl Batch {
            /// Assembles a batch of `len` rows; `source` names each column's origin, or none
            /// of an optional column. Buffers hold at least `len` values of a type that the
            /// column accepts.
            pub(crate) fn assemble(
                len: usize,
                mut source: impl FnMut(ColumnId) -> Result<Option<Source>>,
            ) -> Result<Self> {
                Ok(Batch {
                    len,
                    $($name: Cells::assemble(
                        len,
                        source(ColumnId::$id)?.expect("only optional columns may be absent"),
                    ),)*
                    $($oname: source(ColumnId::$oid)?.map(|source| Cells::assemble(len, source)),)*
                })
            }

            /// Fragment `i`.
            ///
            /// # Panics
            /// Where `i` is not below [`Batch::len`].
            #[inline]
            pub fn fragment(&self, i: usize) -> Fragment {
                let mut fragment = Fragment::default();
                $(fragment.$($place)+ = self.$name.value(i);)*
                $(if let Some(column) = &self.$oname {
                    fragment.optional.$oname = column.value(i);
                })*
                fragment
            }

            /// The stored values of each column, in file order; `None` for those that are
            /// constant or absent.
            pub fn buffers(
                &self,
            ) -> [(ColumnId, Option<(ValueType, &Buffer)>); ColumnId::COUNT] {
                [
                    $((ColumnId::$id, self.$name.bytes()),)*
                    $((ColumnId::$oid, self.$oname.as_ref().and_then(Cells::bytes)),)*
                ]
            }

            /// The first value that no trace may hold.
            fn first_bad(&self, header: &Header) -> Option<Bad> {
                $(if let Some(bad) = check::$check(&self.$name, header) {
                    return Some(bad);
                })*
                $(if let Some(bad) =
                    self.$oname.as_ref().and_then(|column| check::$ocheck(column, header))
                {
                    return Some(bad);
                })*
                None
            }
        }

        /// Collects fragments into batches.
        #[derive(Debug)]
        pub(crate) struct BatchBuilder {
            len: usize,
            $($name: <$type as Cells>::Growing,)*
            $($oname: Option<<$otype as Cells>::Growing>,)*
        }

        impl BatchBuilder {
            pub(super) fn new(header: &Header) -> Result<Self> {
                Ok(BatchBuilder {
                    len: 0,
                    $($name: grow::<$type>(header, ColumnId::$id)?,)*
                    $($oname: match header.has(ColumnId::$oid) {
                        true => Some(grow::<$otype>(header, ColumnId::$oid)?),
                        false => None,
                    },)*
                })
            }

            pub(super) fn len(&self) -> usize {
                self.len
            }

            /// Adds a fragment.
            ///
            /// # Errors
            /// The column whose declared constant the fragment breaks, or which the header
            /// does not name though the fragment has a value of it.
            #[inline]
            pub(super) fn push(&mut self, f: &Fragment) -> Result<(), ColumnId> {
                $(if !<$type as Cells>::push(&mut self.$name, f.$($place)+) {
                    return Err(ColumnId::$id);
                })*
                $(let kept = match &mut self.$oname {
                    Some(column) => <$otype as Cells>::push(column, f.optional.$oname),
                    None => f.optional.$oname == $default,
                };
                if !kept {
                    return Err(ColumnId::$oid);
                })*
                self.len += 1;
                Ok(())
            }

            /// Adds fragments, column by column, where all of them can be kept; tells whether.
            pub(super) fn extend(&mut self, fragments: &[Fragment]) -> bool {
                let keeps = true
                    $(&& <$type as Cells>::keeps(
                        &self.$name,
                        fragments.iter().map(|f| f.$($place)+),
                    ))*
                    $(&& match &self.$oname {
                        Some(column) => <$otype as Cells>::keeps(
                            column,
                            fragments.iter().map(|f| f.optional.$oname),
                        ),
                        None => fragments.iter().all(|f| f.optional.$oname == $default),
                    })*;
                if keeps {
                    $(<$type as Cells>::extend(
                        &mut self.$name,
                        fragments.iter().map(|f| f.$($place)+),
                    );)*
                    $(if let Some(column) = &mut self.$oname {
                        let values = fragments.iter().map(|f| f.optional.$oname);
                        <$otype as Cells>::extend(column, values);
                    })*
                    self.len += fragments.len();
                }
                keeps
            }

            /// Builds in the memory of a batch that was taken, where nobody else has it.
            pub(super) fn reuse(&mut self, batch: Batch) {
                $(Cells::reuse(batch.$name, &mut self.$name);)*
                $(if let (Some(column), Some(growing)) = (batch.$oname, &mut self.$oname) {
                    Cells::reuse(column, growing);
                })*
            }

            /// The fragments so far as a batch; the builder is empty after.
            pub(super) fn take(&mut self) -> Batch {
                Batch {
                    len: std::mem::take(&mut self.len),
                    $($name: Cells::take(&mut self.$name),)*
                    $($oname: self.$oname.as_mut().map(Cells::take),)*
                }
            }
        }
    };
}
columns!(batches);

/// A column under construction, of the header's type, or its constant.
fn grow<C: Cells>(header: &Header, id: ColumnId) -> Result<C::Growing> {
    let constant = header.constants.get(&id).copied();
    C::grow(header.value_type(id), constant).ok_or_else(|| {
        let value = constant.map_or(String::new(), |scalar| scalar.to_string());
        Error::config(
            format_args!("{value} is no value of the column '{}'", id.name()),
            "declare a constant of the column's type",
        )
    })
}

impl Batch {
    /// How many fragments it holds.
    #[inline]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether it holds none.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The pixel of fragment `i`: column and row.
    ///
    /// # Panics
    /// Where `i` is not below [`Batch::len`].
    #[inline]
    pub fn pixel(&self, i: usize) -> (u16, u16) {
        (self.x.get(i), self.y.get(i))
    }

    /// The pixels' columns and rows.
    pub fn places(&self) -> [&Column<u16>; 2] {
        [&self.x, &self.y]
    }

    /// The samples that fragment `i` covers.
    ///
    /// # Panics
    /// Where `i` is not below [`Batch::len`].
    #[inline]
    pub fn coverage(&self, i: usize) -> SampleMask {
        SampleMask(self.coverage.value(i))
    }

    /// Whether any of its fragments is opaque: has an alpha of 1.
    pub fn has_opaque(&self) -> bool {
        self.alpha.stored().iter().any(|alpha| *alpha >= 1.0)
    }

    /// All fragments in order.
    pub fn iter(&self) -> impl Iterator<Item = Fragment> + '_ {
        (0..self.len).map(|i| self.fragment(i))
    }

    /// The batch as Arrow's record batch, sharing its memory.
    pub(crate) fn to_record_batch(&self, schema: &SchemaRef) -> RecordBatch {
        let arrays = self.buffers().into_iter().filter_map(|(_, buffer)| {
            let (value_type, buffer) = buffer?;
            Some(array(value_type, self.len, buffer.clone()))
        });
        RecordBatch::try_new(schema.clone(), arrays.collect())
            .expect("the schema is made from the same header")
    }

    /// Checks every value against the header: nothing downstream meets a pixel
    /// outside the frame, an alpha outside [0, 1], a colour that is no number.
    pub(crate) fn check(&self, header: &Header, place: &str) -> Result<()> {
        match self.first_bad(header) {
            None => Ok(()),
            Some(Bad { row, what, hint }) => {
                Err(Error::invalid(format_args!("{place}, row {row}"), what, hint))
            }
        }
    }
}

/// A value that no trace may hold.
pub(super) struct Bad {
    row: usize,
    what: &'static str,
    hint: &'static str,
}

/// What is checked of columns, by the names that the table gives it.
mod check {
    use super::*;

    fn bad(row: Option<usize>, what: &'static str, hint: &'static str) -> Option<Bad> {
        row.map(|row| Bad { row, what, hint })
    }

    /// Every value of the column's type is good.
    pub(super) fn anything<C>(_: &C, _: &Header) -> Option<Bad> {
        None
    }

    // Compared in the columns' own types, of which a vector holds the most.
    fn within(column: &Column<u16>, side: u32, what: &'static str) -> Option<Bad> {
        let last = side.wrapping_sub(1).min(u16::MAX.into()) as u16;
        let row = first(column.stored(), |v| *v > last);
        bad(row, what, "write coordinates within the frame")
    }

    pub(super) fn within_width(column: &Column<u16>, header: &Header) -> Option<Bad> {
        within(column, header.width, "x lies outside the frame")
    }

    pub(super) fn within_height(column: &Column<u16>, header: &Header) -> Option<Bad> {
        within(column, header.height, "y lies outside the frame")
    }

    pub(super) fn some_samples(column: &CoverageColumn, header: &Header) -> Option<Bad> {
        let all = SampleMask::first(header.pattern.samples());
        let row = match column {
            CoverageColumn::U8(c) => stray(c.stored(), all),
            CoverageColumn::U16(c) => stray(c.stored(), all),
            CoverageColumn::U32(c) => stray(c.stored(), all),
            CoverageColumn::U64(c) => stray(c.stored(), all),
        };
        let what = "the coverage is empty or names samples that do not exist";
        bad(row, what, "a fragment covers at least one of its pixel's samples and no others")
    }

    pub(super) fn unit_interval(column: &Column<f32>, _: &Header) -> Option<Bad> {
        let row = first(column.stored(), |a| !(0.0..=1.0).contains(a));
        bad(row, "alpha is not in [0, 1]", "clamp alpha when writing")
    }

    pub(super) fn finite_colour(column: &ChannelColumn, _: &Header) -> Option<Bad> {
        let row = match column {
            ChannelColumn::F16(c) => first(c.stored(), |v| !v.is_finite()),
            ChannelColumn::F32(c) => first(c.stored(), |v| !v.is_finite()),
        };
        let hint = "write finite colours; beyond 65504 in single precision";
        bad(row, "the colour is not finite", hint)
    }

    #[cfg(any(test, feature = "probe"))]
    pub(super) fn finite(column: &Column<f32>, _: &Header) -> Option<Bad> {
        bad(first(column.stored(), |v| !v.is_finite()), "a number is not finite", "write numbers")
    }
}

/// The first place where `fails` holds. Looks at whole blocks without an early
/// exit, which the compiler turns into vector code: nearly every block is good.
fn first<T>(values: &[T], fails: impl Fn(&T) -> bool) -> Option<usize> {
    const BLOCK: usize = 1024;
    values.chunks(BLOCK).enumerate().find_map(|(i, block)| {
        let any = block.iter().fold(false, |any, v| any | fails(v));
        any.then(|| i * BLOCK + block.iter().position(&fails).unwrap_or(0))
    })
}

/// The first mask that is empty or names others than `all` samples.
fn stray<T>(masks: &[T], all: SampleMask) -> Option<usize>
where
    T: Native + Default + TryFrom<u64> + BitAnd<Output = T>,
{
    let width = u64::MAX >> (64 - 8 * T::TYPE.bytes());
    let others = T::try_from(!all.0 & width).unwrap_or_default();
    let none = T::default();
    first(masks, |mask| *mask == none || *mask & others != none)
}

fn array(value_type: ValueType, len: usize, buffer: Buffer) -> ArrayRef {
    fn typed<P: ArrowPrimitiveType>(len: usize, buffer: Buffer) -> ArrayRef {
        Arc::new(PrimitiveArray::<P>::new(ScalarBuffer::new(buffer, 0, len), None))
    }
    match value_type {
        ValueType::U8 => typed::<UInt8Type>(len, buffer),
        ValueType::U16 => typed::<UInt16Type>(len, buffer),
        ValueType::U32 => typed::<UInt32Type>(len, buffer),
        ValueType::U64 => typed::<UInt64Type>(len, buffer),
        ValueType::I32 => typed::<Int32Type>(len, buffer),
        ValueType::F16 => typed::<Float16Type>(len, buffer),
        ValueType::F32 => typed::<Float32Type>(len, buffer),
    }
}

/// The Arrow schema of a file with this header.
pub(crate) fn schema(header: &Header) -> SchemaRef {
    let fields: Vec<Field> = ColumnId::ALL
        .iter()
        .filter(|id| header.stores(**id))
        .map(|id| Field::new(id.name(), header.value_type(*id).arrow(), false))
        .collect();
    let metadata = header.to_metadata().into_iter().collect::<std::collections::HashMap<_, _>>();
    Arc::new(Schema::new(fields).with_metadata(metadata))
}
