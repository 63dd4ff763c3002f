//! The columns of a trace: their names, types and values.

use std::fmt;

use arrow_buffer::{ArrowNativeType, Buffer, ScalarBuffer};
use arrow_schema::DataType;
use half::f16;

use crate::trace::fragment::MAX_SAMPLES;

/// A column of a trace.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
#[repr(usize)]
pub enum ColumnId {
    /// Pixel column.
    X,
    /// Pixel row.
    Y,
    /// Covered samples, one bit each.
    Coverage,
    /// Depth at the pixel's centre.
    Z,
    /// Depth change per pixel to the right.
    Dzdx,
    /// Depth change per pixel downwards.
    Dzdy,
    /// Linear red.
    R,
    /// Linear green.
    G,
    /// Linear blue.
    B,
    /// Opacity.
    Alpha,
    /// Primitive number.
    Primitive,
    /// Object number.
    Object,
}

impl ColumnId {
    /// All columns, in the order in which they stand in a file.
    pub const ALL: [ColumnId; 12] = {
        use ColumnId::*;
        [X, Y, Coverage, Z, Dzdx, Dzdy, R, G, B, Alpha, Primitive, Object]
    };

    /// The column's name in a file.
    pub const fn name(self) -> &'static str {
        use ColumnId::*;
        match self {
            X => "x",
            Y => "y",
            Coverage => "coverage",
            Z => "z",
            Dzdx => "dzdx",
            Dzdy => "dzdy",
            R => "r",
            G => "g",
            B => "b",
            Alpha => "alpha",
            Primitive => "primitive",
            Object => "object",
        }
    }

    /// The types it may have in a file whose pixels have `samples` samples.
    pub fn accepts(self, value_type: ValueType, samples: u32) -> bool {
        use ColumnId::*;
        match self {
            X | Y => value_type == ValueType::U16,
            Coverage => value_type.is_unsigned() && value_type.bytes() as u32 * 8 >= samples,
            Z | Primitive | Object => value_type == ValueType::U32,
            Dzdx | Dzdy => value_type == ValueType::I32,
            R | G | B => matches!(value_type, ValueType::F16 | ValueType::F32),
            Alpha => value_type == ValueType::F32,
        }
    }

    /// The narrowest type it may have.
    pub fn narrowest(self, samples: u32) -> ValueType {
        *ValueType::ALL
            .iter()
            .find(|t| self.accepts(**t, samples.min(MAX_SAMPLES)))
            .expect("every column accepts some type for up to 64 samples")
    }
}

/// The type of a column's values.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ValueType {
    /// 8-bit unsigned.
    U8,
    /// 16-bit unsigned.
    U16,
    /// 32-bit unsigned.
    U32,
    /// 64-bit unsigned.
    U64,
    /// 32-bit signed.
    I32,
    /// IEEE half precision.
    F16,
    /// IEEE single precision.
    F32,
}

impl ValueType {
    pub(crate) const ALL: [ValueType; 7] = {
        use ValueType::*;
        [U8, U16, U32, U64, I32, F16, F32]
    };

    /// Size of one value.
    pub const fn bytes(self) -> usize {
        match self {
            ValueType::U8 => 1,
            ValueType::U16 | ValueType::F16 => 2,
            ValueType::U32 | ValueType::I32 | ValueType::F32 => 4,
            ValueType::U64 => 8,
        }
    }

    fn is_unsigned(self) -> bool {
        matches!(self, ValueType::U8 | ValueType::U16 | ValueType::U32 | ValueType::U64)
    }

    /// The same type in Arrow's terms.
    pub const fn arrow(self) -> DataType {
        match self {
            ValueType::U8 => DataType::UInt8,
            ValueType::U16 => DataType::UInt16,
            ValueType::U32 => DataType::UInt32,
            ValueType::U64 => DataType::UInt64,
            ValueType::I32 => DataType::Int32,
            ValueType::F16 => DataType::Float16,
            ValueType::F32 => DataType::Float32,
        }
    }
}

impl fmt::Display for ValueType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            ValueType::U8 => "uint8",
            ValueType::U16 => "uint16",
            ValueType::U32 => "uint32",
            ValueType::U64 => "uint64",
            ValueType::I32 => "int32",
            ValueType::F16 => "float16",
            ValueType::F32 => "float32",
        })
    }
}

/// The value of a column that is the same in every row.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Scalar {
    /// Of an unsigned column.
    Unsigned(u64),
    /// Of a slope.
    Signed(i32),
    /// Of a colour or an alpha.
    Real(f32),
}

impl Scalar {
    /// Reads the decimal text of a value of `column`.
    pub fn parse(column: ColumnId, text: &str) -> Option<Self> {
        use ColumnId::*;
        match column {
            Dzdx | Dzdy => text.parse().ok().map(Scalar::Signed),
            R | G | B | Alpha => text.parse().ok().map(Scalar::Real),
            X | Y => text.parse::<u16>().ok().map(|v| Scalar::Unsigned(v.into())),
            Z | Primitive | Object => text.parse::<u32>().ok().map(|v| Scalar::Unsigned(v.into())),
            Coverage => text.parse().ok().map(Scalar::Unsigned),
        }
    }
}

/// Decimal, in the shortest form that reads back as the same value.
impl fmt::Display for Scalar {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Scalar::Unsigned(v) => v.fmt(f),
            Scalar::Signed(v) => v.fmt(f),
            Scalar::Real(v) => v.fmt(f),
        }
    }
}

/// A type that a column's values can have, in memory as in a file.
pub trait Native: ArrowNativeType + PartialEq {
    /// Its name in the format.
    const TYPE: ValueType;
    /// The value as a scalar.
    fn scalar(self) -> Scalar;
    /// A scalar as a value; `None` where it is of another kind or does not fit.
    fn from_scalar(scalar: Scalar) -> Option<Self>;
}

macro_rules! native {
    ($($native:ty, $name:ident, $variant:ident, $v:ident => $to:expr, $from:expr);+ $(;)?) => {
        $(impl Native for $native {
            const TYPE: ValueType = ValueType::$name;
            #[inline]
            fn scalar(self) -> Scalar {
                let $v = self;
                Scalar::$variant($to)
            }
            #[inline]
            fn from_scalar(scalar: Scalar) -> Option<Self> {
                match scalar {
                    Scalar::$variant($v) => $from,
                    _ => None,
                }
            }
        })+
    };
}

native! {
    u8, U8, Unsigned, v => v.into(), v.try_into().ok();
    u16, U16, Unsigned, v => v.into(), v.try_into().ok();
    u32, U32, Unsigned, v => v.into(), v.try_into().ok();
    u64, U64, Unsigned, v => v, Some(v);
    i32, I32, Signed, v => v, Some(v);
    f16, F16, Real, v => v.to_f32(), Some(f16::from_f32(v));
    f32, F32, Real, v => v, Some(v);
}

/// One column of a batch: a value for each row, or one for all.
#[derive(Clone, Debug)]
pub enum Column<T: Native> {
    /// The same value in every row.
    Constant(T),
    /// A value a row.
    Values(ScalarBuffer<T>),
}

impl<T: Native> Column<T> {
    /// The value in row `i`.
    ///
    /// # Panics
    /// Where `i` is not below the batch's length.
    #[inline]
    pub fn get(&self, i: usize) -> T {
        match self {
            Column::Constant(v) => *v,
            Column::Values(v) => v[i],
        }
    }

    /// The values that are stored: one for each row, or the constant once.
    #[inline]
    pub fn stored(&self) -> &[T] {
        match self {
            Column::Constant(v) => std::slice::from_ref(v),
            Column::Values(v) => v,
        }
    }

    /// The bytes of its rows as they stand in a file; `None` for a constant.
    pub(crate) fn buffer(&self) -> Option<(ValueType, &Buffer)> {
        match self {
            Column::Constant(_) => None,
            Column::Values(v) => Some((T::TYPE, v.inner())),
        }
    }
}

/// Coverage masks in the narrowest type that the file gives them.
#[derive(Clone, Debug)]
#[allow(missing_docs)]
pub enum CoverageColumn {
    U8(Column<u8>),
    U16(Column<u16>),
    U32(Column<u32>),
    U64(Column<u64>),
}

/// A colour channel in half or single precision.
#[derive(Clone, Debug)]
#[allow(missing_docs)]
pub enum ChannelColumn {
    F16(Column<f16>),
    F32(Column<f32>),
}
