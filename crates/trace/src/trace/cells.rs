//! How a column's values are held: in a batch, while a batch is built, and in bins.
//!
//! A column of one type holds it everywhere. Masks and colour channels are held in the
//! width that the file gives them, and widened when they are read.

use std::fmt;

use arrow_buffer::{Buffer, ScalarBuffer};
use half::f16;
use half::slice::HalfFloatSliceExt;

use crate::trace::bins::{Binned, BinnedColumn, Copies, Rows, Slabs};
use crate::trace::column::{Column, Native, Scalar, ValueType};
use crate::trace::columns::ColumnKind;
use crate::trace::fragment::SampleMask;

/// Where a batch's column comes from: the header's constant, or the bytes and type that a
/// file gives it.
pub enum Source {
    Constant(Scalar),
    Bytes(ValueType, Buffer),
}

/// A column as a batch holds it.
pub trait Cells: Sized {
    /// What its values are.
    const KIND: ColumnKind;
    /// A value as fragments and blocks have it.
    type Value: Copy + PartialEq + fmt::Debug;
    /// The column under construction.
    type Growing: fmt::Debug;
    /// The column in bins.
    type Binned: Binned<Self::Value>;

    /// The types it may have in a file whose pixels have `samples` samples.
    fn accepts(value_type: ValueType, samples: u32) -> bool;
    /// Reads the decimal text of a value.
    fn parse(text: &str) -> Option<Scalar>;
    /// A value as a scalar.
    fn scalar(value: Self::Value) -> Scalar;
    /// The column of `len` rows. Buffers hold at least as many values of a type that the
    /// column accepts.
    fn assemble(len: usize, source: Source) -> Self;
    /// The value in row `i`.
    fn value(&self, i: usize) -> Self::Value;
    /// The bytes of its rows as they stand in a file; `None` for a constant.
    fn bytes(&self) -> Option<(ValueType, &Buffer)>;
    /// Begins a column that is kept in this type; `None` where the constant is no value of it.
    fn grow(value_type: ValueType, constant: Option<Scalar>) -> Option<Self::Growing>;
    /// Adds a value; tells whether it could be kept.
    fn push(growing: &mut Self::Growing, value: Self::Value) -> bool;
    /// Whether all of these values could be kept.
    fn keeps(growing: &Self::Growing, values: impl Iterator<Item = Self::Value>) -> bool;
    /// Adds values that can all be kept.
    fn extend(growing: &mut Self::Growing, values: impl Iterator<Item = Self::Value>);
    /// The values so far; the growing column is empty after.
    fn take(growing: &mut Self::Growing) -> Self;
    /// Gives the memory of a column that was taken back, where nobody else has it.
    fn reuse(self, growing: &mut Self::Growing);
    /// The column in bins that have no rows yet.
    fn binned(&self) -> Self::Binned;
    /// Copies rows to bins.
    fn bin(&self, to: &Self::Binned, slabs: &mut Slabs, copies: &Copies);
}

impl<T: Native> Cells for Column<T> {
    const KIND: ColumnKind = match T::TYPE {
        ValueType::F16 | ValueType::F32 => ColumnKind::Real,
        _ => ColumnKind::Whole,
    };
    type Value = T;
    type Growing = Growing<T>;
    type Binned = BinnedColumn<T>;

    fn accepts(value_type: ValueType, _: u32) -> bool {
        value_type == T::TYPE
    }

    fn parse(text: &str) -> Option<Scalar> {
        text.parse().ok().map(T::scalar)
    }

    fn scalar(value: T) -> Scalar {
        value.scalar()
    }

    fn assemble(len: usize, source: Source) -> Self {
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

    #[inline]
    fn value(&self, i: usize) -> T {
        self.get(i)
    }

    fn bytes(&self) -> Option<(ValueType, &Buffer)> {
        match self {
            Column::Constant(_) => None,
            Column::Values(v) => Some((T::TYPE, v.inner())),
        }
    }

    fn grow(_: ValueType, constant: Option<Scalar>) -> Option<Growing<T>> {
        let constant = match constant {
            None => None,
            Some(scalar) => Some(T::from_scalar(scalar)?),
        };
        Some(Growing { constant, values: Vec::new() })
    }

    #[inline]
    fn push(growing: &mut Growing<T>, value: T) -> bool {
        match growing.constant {
            Some(constant) => constant == value,
            None => {
                growing.values.push(value);
                true
            }
        }
    }

    #[inline]
    fn keeps(growing: &Growing<T>, mut values: impl Iterator<Item = T>) -> bool {
        growing.constant.is_none_or(|constant| values.all(|value| value == constant))
    }

    #[inline]
    fn extend(growing: &mut Growing<T>, values: impl Iterator<Item = T>) {
        if growing.constant.is_none() {
            growing.values.extend(values);
        }
    }

    fn take(growing: &mut Growing<T>) -> Self {
        match growing.constant {
            Some(v) => Column::Constant(v),
            None => Column::Values(std::mem::take(&mut growing.values).into()),
        }
    }

    fn reuse(self, growing: &mut Growing<T>) {
        if let Column::Values(values) = self
            && let Ok(mut values) = values.into_inner().into_vec::<T>()
            && growing.values.is_empty()
        {
            values.clear();
            growing.values = values;
        }
    }

    fn binned(&self) -> BinnedColumn<T> {
        BinnedColumn::like(self)
    }

    fn bin(&self, to: &BinnedColumn<T>, slabs: &mut Slabs, copies: &Copies) {
        to.put(self, slabs, copies);
    }
}

impl<T: Native> Binned<T> for BinnedColumn<T> {
    fn bytes(&self) -> usize {
        BinnedColumn::bytes(self)
    }

    fn place(&mut self, before: usize) {
        BinnedColumn::place(self, before);
    }

    #[inline(always)]
    fn read(&self, from: (&Slabs, Rows), to: &mut [T], _: SampleMask) {
        self.get(
            from,
            to,
            #[inline(always)]
            |v| v,
        );
    }
}

/// A column under construction.
#[derive(Debug)]
pub struct Growing<T: Native> {
    constant: Option<T>,
    values: Vec<T>,
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

/// A type in which values of a wider one can be stored.
trait Narrow<Wide>: Native {
    fn wide(self) -> Wide;
    fn narrow(value: Wide) -> Self;
    /// Adds values, narrowed.
    #[inline]
    fn append(values: impl Iterator<Item = Wide>, to: &mut Vec<Self>) {
        to.extend(values.map(Self::narrow));
    }
}

macro_rules! masks {
    ($($native:ty),+) => {
        $(#[allow(clippy::useless_conversion)]
        impl Narrow<u64> for $native {
            #[inline(always)]
            fn wide(self) -> u64 {
                self.into()
            }
            // A bit beyond the column's width is a sample that does not exist: the mask
            // becomes empty, which the check of the finished batch refuses.
            #[inline]
            fn narrow(mask: u64) -> Self {
                Self::try_from(mask).unwrap_or(0)
            }
        })+
    };
}
masks!(u8, u16, u32, u64);

impl Narrow<f32> for f16 {
    #[inline(always)]
    fn wide(self) -> f32 {
        widen(self)
    }
    #[inline]
    fn narrow(value: f32) -> Self {
        f16::from_f32(value)
    }
    /// Several at a time, for which processors have an instruction.
    #[inline]
    fn append(mut values: impl Iterator<Item = f32>, to: &mut Vec<f16>) {
        let mut wide = [0.0; 64];
        loop {
            let mut count = 0;
            wide.iter_mut().zip(&mut values).for_each(|(wide, value)| {
                *wide = value;
                count += 1;
            });
            let start = to.len();
            to.resize(start + count, f16::ZERO);
            to[start..].convert_from_f32_slice(&wide[..count]);
            if count < wide.len() {
                return;
            }
        }
    }
}

impl Narrow<f32> for f32 {
    #[inline(always)]
    fn wide(self) -> f32 {
        self
    }
    #[inline]
    fn narrow(value: f32) -> Self {
        value
    }
}

/// A finite half-precision value in single precision, exactly. The multiplication by
/// 2^112 moves one format's exponents, denormals included, to the other's; unlike
/// `f16::to_f32` it asks for no instruction that a machine may lack.
#[inline(always)]
fn widen(value: f16) -> f32 {
    const SCALE: f32 = f32::from_bits((112 + 127) << 23);
    let bits = u32::from(value.to_bits());
    let magnitude = f32::from_bits((bits & 0x7fff) << 13) * SCALE;
    f32::from_bits(magnitude.to_bits() | (bits & 0x8000) << 16)
}

/// A column whose values are stored in one of several types and read as the widest.
macro_rules! either {
    (
        $(#[$meta:meta])*
        $name:ident, $growing:ident, $binned:ident of $wide:ty, $kind:ident:
        $($variant:ident($native:ty)),+; widest $last:ident;
        accepts ($type:ident, $samples:ident) => $accepts:expr;
        copied ($value:ident, $mask:ident) => $copied:expr
    ) => {
        $(#[$meta])*
        #[derive(Clone, Debug)]
        #[allow(missing_docs)]
        pub enum $name {
            $($variant(Column<$native>),)+
            $last(Column<$wide>),
        }

        #[derive(Debug)]
        pub enum $growing {
            $($variant(Growing<$native>),)+
            $last(Growing<$wide>),
        }

        impl Cells for $name {
            const KIND: ColumnKind = ColumnKind::$kind;
            type Value = $wide;
            type Growing = $growing;
            type Binned = $binned;

            fn accepts($type: ValueType, $samples: u32) -> bool {
                $accepts
            }

            fn parse(text: &str) -> Option<Scalar> {
                Column::<$wide>::parse(text)
            }

            fn scalar(value: $wide) -> Scalar {
                value.scalar()
            }

            fn assemble(len: usize, source: Source) -> Self {
                match source {
                    $(Source::Bytes(ValueType::$variant, _) => {
                        $name::$variant(Column::assemble(len, source))
                    })+
                    _ => $name::$last(Column::assemble(len, source)),
                }
            }

            #[inline]
            fn value(&self, i: usize) -> $wide {
                match self {
                    $($name::$variant(column) => column.get(i).wide(),)+
                    $name::$last(column) => column.get(i),
                }
            }

            fn bytes(&self) -> Option<(ValueType, &Buffer)> {
                match self {
                    $($name::$variant(column) => column.bytes(),)+
                    $name::$last(column) => column.bytes(),
                }
            }

            fn grow(value_type: ValueType, constant: Option<Scalar>) -> Option<$growing> {
                Some(match value_type {
                    $(ValueType::$variant => {
                        $growing::$variant(Column::<$native>::grow(value_type, constant)?)
                    })+
                    _ => $growing::$last(Column::<$wide>::grow(value_type, constant)?),
                })
            }

            #[inline]
            fn push(growing: &mut $growing, value: $wide) -> bool {
                match growing {
                    $($growing::$variant(column) => {
                        Column::push(column, <$native>::narrow(value))
                    })+
                    $growing::$last(column) => Column::push(column, value),
                }
            }

            #[inline]
            fn keeps(growing: &$growing, values: impl Iterator<Item = $wide>) -> bool {
                match growing {
                    $($growing::$variant(column) => {
                        Column::keeps(column, values.map(<$native>::narrow))
                    })+
                    $growing::$last(column) => Column::keeps(column, values),
                }
            }

            #[inline]
            fn extend(growing: &mut $growing, values: impl Iterator<Item = $wide>) {
                match growing {
                    $($growing::$variant(column) if column.constant.is_none() => {
                        <$native>::append(values, &mut column.values);
                    })+
                    $($growing::$variant(_) => {})+
                    $growing::$last(column) => Column::extend(column, values),
                }
            }

            fn take(growing: &mut $growing) -> Self {
                match growing {
                    $($growing::$variant(column) => $name::$variant(Column::take(column)),)+
                    $growing::$last(column) => $name::$last(Column::take(column)),
                }
            }

            fn reuse(self, growing: &mut $growing) {
                match (self, growing) {
                    $(($name::$variant(column), $growing::$variant(growing)) => {
                        column.reuse(growing);
                    })+
                    ($name::$last(column), $growing::$last(growing)) => column.reuse(growing),
                    _ => {}
                }
            }

            fn binned(&self) -> $binned {
                match self {
                    $($name::$variant(column) => $binned::$variant(column.binned()),)+
                    $name::$last(column) => $binned::$last(column.binned()),
                }
            }

            fn bin(&self, to: &$binned, slabs: &mut Slabs, copies: &Copies) {
                match (self, to) {
                    $(($name::$variant(column), $binned::$variant(to)) => to.put(column, slabs, copies),)+
                    ($name::$last(column), $binned::$last(to)) => to.put(column, slabs, copies),
                    _ => unreachable!("a column has one type in all of a trace's batches"),
                }
            }
        }

        #[derive(Debug)]
        pub enum $binned {
            $($variant(BinnedColumn<$native>),)+
            $last(BinnedColumn<$wide>),
        }

        impl Binned<$wide> for $binned {
            fn bytes(&self) -> usize {
                match self {
                    $($binned::$variant(column) => column.bytes(),)+
                    $binned::$last(column) => column.bytes(),
                }
            }

            fn place(&mut self, before: usize) {
                match self {
                    $($binned::$variant(column) => column.place(before),)+
                    $binned::$last(column) => column.place(before),
                }
            }

            #[inline(always)]
            fn read(&self, from: (&Slabs, Rows), to: &mut [$wide], mask: SampleMask) {
                #[inline(always)]
                fn copied($value: $wide, $mask: SampleMask) -> $wide {
                    $copied
                }
                match self {
                    $($binned::$variant(column) => column.get(
                        from,
                        to,
                        #[inline(always)]
                        |v| copied(v.wide(), mask),
                    ),)+
                    $binned::$last(column) => column.get(
                        from,
                        to,
                        #[inline(always)]
                        |v| copied(v, mask),
                    ),
                }
            }
        }
    };
}

either! {
    /// Coverage masks in the narrowest type that the file gives them.
    CoverageColumn, GrowingCoverage, BinnedCoverage of u64, Mask: U8(u8), U16(u16), U32(u32); widest U64;
    accepts (t, samples) => t.is_unsigned() && t.bytes() as u32 * 8 >= samples;
    copied (value, mask) => value & mask.0
}

either! {
    /// A colour channel in half or single precision.
    ChannelColumn, GrowingChannel, BinnedChannel of f32, Real: F16(f16); widest F32;
    accepts (t, _samples) => matches!(t, ValueType::F16 | ValueType::F32);
    copied (value, _mask) => value
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
