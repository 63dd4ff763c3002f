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
use half::f16;

use crate::error::{Error, Result};
use crate::trace::column::{
    ChannelColumn, Column, ColumnId, CoverageColumn, Native, Scalar, ValueType,
};
use crate::trace::fragment::{DepthPlane, Fragment, SampleMask, Unorm32};
use crate::trace::header::Header;

/// The most fragments that one batch of a file may hold; a reader can refuse a
/// larger claim before it allocates anything.
pub const MAX_BATCH_ROWS: usize = 1 << 22;

/// A run of fragments in the order in which they reach the ROP.
#[derive(Clone, Debug)]
pub struct Batch {
    len: usize,
    pub(super) x: Column<u16>,
    pub(super) y: Column<u16>,
    pub(super) coverage: CoverageColumn,
    pub(super) z: Column<u32>,
    pub(super) dzdx: Column<i32>,
    pub(super) dzdy: Column<i32>,
    pub(super) colour: [ChannelColumn; 3],
    pub(super) alpha: Column<f32>,
    pub(super) primitive: Column<u32>,
    pub(super) object: Column<u32>,
}

/// Applies `$f` to the typed column inside a coverage or channel column.
macro_rules! typed {
    ($column:expr, $enum:ident :: { $($variant:ident),+ }, $v:ident => $f:expr) => {
        match $column {
            // A conversion to the widest type is useless for one of the variants.
            $(#[allow(clippy::useless_conversion)] $enum::$variant($v) => $f),+
        }
    };
}

/// Where a batch's columns come from: the header's constant, or the bytes and
/// type that a file gives them.
pub(crate) enum Source {
    Constant(Scalar),
    Bytes(ValueType, Buffer),
}

impl Batch {
    /// Assembles a batch of `len` rows; `source` names each column's origin.
    /// Buffers hold at least `len` values of a type that the column accepts.
    pub(crate) fn assemble(
        len: usize,
        mut source: impl FnMut(ColumnId) -> Result<Source>,
    ) -> Result<Self> {
        fn column<T: Native>(len: usize, source: Source) -> Column<T> {
            match source {
                Source::Constant(scalar) => Column::Constant(
                    T::from_scalar(scalar).expect("constants are parsed for their column"),
                ),
                Source::Bytes(value_type, bytes) => {
                    assert_eq!(value_type, T::TYPE);
                    Column::Values(aligned(len, bytes))
                }
            }
        }
        fn coverage(len: usize, source: Source) -> CoverageColumn {
            match source {
                Source::Bytes(ValueType::U8, _) => CoverageColumn::U8(column(len, source)),
                Source::Bytes(ValueType::U16, _) => CoverageColumn::U16(column(len, source)),
                Source::Bytes(ValueType::U32, _) => CoverageColumn::U32(column(len, source)),
                _ => CoverageColumn::U64(column(len, source)),
            }
        }
        fn channel(len: usize, source: Source) -> ChannelColumn {
            match source {
                Source::Bytes(ValueType::F16, _) => ChannelColumn::F16(column(len, source)),
                _ => ChannelColumn::F32(column(len, source)),
            }
        }
        use ColumnId::*;
        Ok(Batch {
            len,
            x: column(len, source(X)?),
            y: column(len, source(Y)?),
            coverage: coverage(len, source(Coverage)?),
            z: column(len, source(Z)?),
            dzdx: column(len, source(Dzdx)?),
            dzdy: column(len, source(Dzdy)?),
            colour: [channel(len, source(R)?), channel(len, source(G)?), channel(len, source(B)?)],
            alpha: column(len, source(Alpha)?),
            primitive: column(len, source(Primitive)?),
            object: column(len, source(Object)?),
        })
    }

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
        SampleMask(
            typed!(&self.coverage, CoverageColumn::{U8, U16, U32, U64}, c => u64::from(c.get(i))),
        )
    }

    /// Fragment `i`.
    ///
    /// # Panics
    /// Where `i` is not below [`Batch::len`].
    #[inline]
    pub fn fragment(&self, i: usize) -> Fragment {
        let channel = |c: &ChannelColumn| match c {
            ChannelColumn::F16(c) => c.get(i).to_f32(),
            ChannelColumn::F32(c) => c.get(i),
        };
        let [r, g, b] = &self.colour;
        Fragment {
            x: self.x.get(i),
            y: self.y.get(i),
            coverage: self.coverage(i),
            depth: DepthPlane {
                z: Unorm32(self.z.get(i)),
                dzdx: self.dzdx.get(i),
                dzdy: self.dzdy.get(i),
            },
            colour: [channel(r), channel(g), channel(b)],
            alpha: self.alpha.get(i),
            primitive: self.primitive.get(i),
            object: self.object.get(i),
        }
    }

    /// Whether any of its fragments is opaque: has an alpha of 1.
    pub fn has_opaque(&self) -> bool {
        self.alpha.stored().iter().any(|alpha| *alpha >= 1.0)
    }

    /// All fragments in order.
    pub fn iter(&self) -> impl Iterator<Item = Fragment> + '_ {
        (0..self.len).map(|i| self.fragment(i))
    }

    /// The stored values of each column, in file order; `None` for constants.
    pub fn buffers(&self) -> [(ColumnId, Option<(ValueType, &Buffer)>); 12] {
        use ColumnId::*;
        let channel =
            |c: usize| typed!(&self.colour[c], ChannelColumn::{F16, F32}, c => c.buffer());
        [
            (X, self.x.buffer()),
            (Y, self.y.buffer()),
            (
                Coverage,
                typed!(&self.coverage, CoverageColumn::{U8, U16, U32, U64}, c => c.buffer()),
            ),
            (Z, self.z.buffer()),
            (Dzdx, self.dzdx.buffer()),
            (Dzdy, self.dzdy.buffer()),
            (R, channel(0)),
            (G, channel(1)),
            (B, channel(2)),
            (Alpha, self.alpha.buffer()),
            (Primitive, self.primitive.buffer()),
            (Object, self.object.buffer()),
        ]
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
        let bad = |row: usize, what: &str, hint: &str| {
            Error::invalid(format_args!("{place}, row {row}"), what, hint)
        };
        let outside = "write coordinates within the frame";
        // Compared in the columns' own types, of which a vector holds the most.
        let last = |side: u32| side.wrapping_sub(1).min(u16::MAX.into()) as u16;
        let (right, bottom) = (last(header.width), last(header.height));
        if let Some(row) = first(self.x.stored(), |x| *x > right) {
            return Err(bad(row, "x lies outside the frame", outside));
        }
        if let Some(row) = first(self.y.stored(), |y| *y > bottom) {
            return Err(bad(row, "y lies outside the frame", outside));
        }
        let all = SampleMask::first(header.pattern.samples());
        let row = typed!(&self.coverage, CoverageColumn::{U8, U16, U32, U64}, c => {
            stray(c.stored(), all)
        });
        if let Some(row) = row {
            let hint = "a fragment covers at least one of its pixel's samples and no others";
            return Err(bad(row, "the coverage is empty or names samples that do not exist", hint));
        }
        if let Some(row) = first(self.alpha.stored(), |a| !(0.0..=1.0).contains(a)) {
            return Err(bad(row, "alpha is not in [0, 1]", "clamp alpha when writing"));
        }
        for channel in &self.colour {
            let row = match channel {
                ChannelColumn::F16(c) => first(c.stored(), |v| !v.is_finite()),
                ChannelColumn::F32(c) => first(c.stored(), |v| !v.is_finite()),
            };
            if let Some(row) = row {
                let hint = "write finite colours; beyond 65504 in single precision";
                return Err(bad(row, "the colour is not finite", hint));
            }
        }
        Ok(())
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

/// The first `len` values of `bytes`, without a copy where they are aligned.
fn aligned<T: Native>(len: usize, bytes: Buffer) -> ScalarBuffer<T> {
    let size = T::TYPE.bytes();
    if bytes.as_ptr().align_offset(size) == 0 {
        ScalarBuffer::new(bytes, 0, len)
    } else {
        // Buffers of their own are aligned to at least 8 bytes.
        ScalarBuffer::new(Buffer::from_slice_ref(&bytes.as_slice()[..len * size]), 0, len)
    }
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
        .filter(|id| !header.constants.contains_key(id))
        .map(|id| Field::new(id.name(), header.value_type(*id).arrow(), false))
        .collect();
    let metadata = header.to_metadata().into_iter().collect::<std::collections::HashMap<_, _>>();
    Arc::new(Schema::new(fields).with_metadata(metadata))
}

/// A column under construction.
#[derive(Debug)]
struct Growing<T: Native> {
    constant: Option<T>,
    values: Vec<T>,
}

impl<T: Native> Growing<T> {
    fn new(header: &Header, id: ColumnId) -> Result<Self> {
        let constant = match header.constants.get(&id) {
            None => None,
            Some(scalar) => Some(T::from_scalar(*scalar).ok_or_else(|| {
                Error::config(
                    format_args!("{scalar} is no value of the column '{}'", id.name()),
                    "declare a constant of the column's type",
                )
            })?),
        };
        Ok(Growing { constant, values: Vec::new() })
    }

    /// Whether the value could be kept.
    #[inline]
    fn push(&mut self, value: T) -> bool {
        match self.constant {
            Some(constant) => constant == value,
            None => {
                self.values.push(value);
                true
            }
        }
    }

    fn take(&mut self) -> Column<T> {
        match self.constant {
            Some(v) => Column::Constant(v),
            None => {
                let capacity = self.values.capacity();
                let full = std::mem::replace(&mut self.values, Vec::with_capacity(capacity));
                Column::Values(full.into())
            }
        }
    }
}

#[derive(Debug)]
enum GrowingCoverage {
    U8(Growing<u8>),
    U16(Growing<u16>),
    U32(Growing<u32>),
    U64(Growing<u64>),
}

#[derive(Debug)]
enum GrowingChannel {
    F16(Growing<f16>),
    F32(Growing<f32>),
}

/// Collects fragments into batches.
#[derive(Debug)]
pub(crate) struct BatchBuilder {
    len: usize,
    x: Growing<u16>,
    y: Growing<u16>,
    coverage: GrowingCoverage,
    z: Growing<u32>,
    dzdx: Growing<i32>,
    dzdy: Growing<i32>,
    colour: [GrowingChannel; 3],
    alpha: Growing<f32>,
    primitive: Growing<u32>,
    object: Growing<u32>,
}

impl BatchBuilder {
    pub fn new(header: &Header) -> Result<Self> {
        use ColumnId::*;
        let channel = |id| -> Result<GrowingChannel> {
            Ok(match header.value_type(id) {
                ValueType::F16 => GrowingChannel::F16(Growing::new(header, id)?),
                _ => GrowingChannel::F32(Growing::new(header, id)?),
            })
        };
        Ok(BatchBuilder {
            len: 0,
            x: Growing::new(header, X)?,
            y: Growing::new(header, Y)?,
            coverage: match header.value_type(Coverage) {
                ValueType::U8 => GrowingCoverage::U8(Growing::new(header, Coverage)?),
                ValueType::U16 => GrowingCoverage::U16(Growing::new(header, Coverage)?),
                ValueType::U32 => GrowingCoverage::U32(Growing::new(header, Coverage)?),
                _ => GrowingCoverage::U64(Growing::new(header, Coverage)?),
            },
            z: Growing::new(header, Z)?,
            dzdx: Growing::new(header, Dzdx)?,
            dzdy: Growing::new(header, Dzdy)?,
            colour: [channel(R)?, channel(G)?, channel(B)?],
            alpha: Growing::new(header, Alpha)?,
            primitive: Growing::new(header, Primitive)?,
            object: Growing::new(header, Object)?,
        })
    }

    pub fn len(&self) -> usize {
        self.len
    }

    /// Adds a fragment.
    ///
    /// # Errors
    /// The column whose declared constant the fragment breaks.
    #[inline]
    pub fn push(&mut self, f: &Fragment) -> Result<(), ColumnId> {
        use ColumnId::*;
        let kept = |kept: bool, id: ColumnId| if kept { Ok(()) } else { Err(id) };
        kept(self.x.push(f.x), X)?;
        kept(self.y.push(f.y), Y)?;
        let mask = f.coverage.0;
        // A bit beyond the column's width is a sample that does not exist: the mask
        // becomes empty, which the check of the finished batch refuses.
        let coverage = match &mut self.coverage {
            GrowingCoverage::U8(c) => c.push(u8::try_from(mask).unwrap_or(0)),
            GrowingCoverage::U16(c) => c.push(u16::try_from(mask).unwrap_or(0)),
            GrowingCoverage::U32(c) => c.push(u32::try_from(mask).unwrap_or(0)),
            GrowingCoverage::U64(c) => c.push(mask),
        };
        kept(coverage, Coverage)?;
        kept(self.z.push(f.depth.z.0), Z)?;
        kept(self.dzdx.push(f.depth.dzdx), Dzdx)?;
        kept(self.dzdy.push(f.depth.dzdy), Dzdy)?;
        for (i, id) in [R, G, B].into_iter().enumerate() {
            let pushed = match &mut self.colour[i] {
                GrowingChannel::F16(c) => c.push(f16::from_f32(f.colour[i])),
                GrowingChannel::F32(c) => c.push(f.colour[i]),
            };
            kept(pushed, id)?;
        }
        kept(self.alpha.push(f.alpha), Alpha)?;
        kept(self.primitive.push(f.primitive), Primitive)?;
        kept(self.object.push(f.object), Object)?;
        self.len += 1;
        Ok(())
    }

    /// The fragments so far as a batch; the builder is empty after.
    pub fn take(&mut self) -> Batch {
        Batch {
            len: std::mem::take(&mut self.len),
            x: self.x.take(),
            y: self.y.take(),
            coverage: match &mut self.coverage {
                GrowingCoverage::U8(c) => CoverageColumn::U8(c.take()),
                GrowingCoverage::U16(c) => CoverageColumn::U16(c.take()),
                GrowingCoverage::U32(c) => CoverageColumn::U32(c.take()),
                GrowingCoverage::U64(c) => CoverageColumn::U64(c.take()),
            },
            z: self.z.take(),
            dzdx: self.dzdx.take(),
            dzdy: self.dzdy.take(),
            colour: self.colour.each_mut().map(|c| match c {
                GrowingChannel::F16(c) => ChannelColumn::F16(c.take()),
                GrowingChannel::F32(c) => ChannelColumn::F32(c.take()),
            }),
            alpha: self.alpha.take(),
            primitive: self.primitive.take(),
            object: self.object.take(),
        }
    }
}
