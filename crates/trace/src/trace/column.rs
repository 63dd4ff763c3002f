//! The types and values of columns, and columns in memory.

use std::fmt;

use arrow_buffer::{ArrowNativeType, ScalarBuffer};
use arrow_schema::DataType;
use half::f16;

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

    pub(crate) fn is_unsigned(self) -> bool {
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
    /// Whether the two are one value, bit for bit: 0 is not −0.
    pub fn is(self, other: Scalar) -> bool {
        match (self, other) {
            (Scalar::Real(a), Scalar::Real(b)) => a.to_bits() == b.to_bits(),
            _ => self == other,
        }
    }

    /// Its bits; of one column, different values have different ones.
    pub fn bits(self) -> u64 {
        match self {
            Scalar::Unsigned(v) => v,
            Scalar::Signed(v) => u64::from(v as u32),
            Scalar::Real(v) => v.to_bits().into(),
        }
    }

    /// The nearest number of double precision.
    pub fn number(self) -> f64 {
        match self {
            Scalar::Unsigned(v) => v as f64,
            Scalar::Signed(v) => v.into(),
            Scalar::Real(v) => v.into(),
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
pub trait Native: ArrowNativeType + PartialEq + std::str::FromStr {
    /// Its name in the format.
    const TYPE: ValueType;
    /// The value as a scalar.
    fn scalar(self) -> Scalar;
    /// A scalar as a value; `None` where it is of another kind or does not fit.
    fn from_scalar(scalar: Scalar) -> Option<Self>;
    /// The value with these bytes, as many as it takes.
    fn from_bytes(bytes: &[u8]) -> Self;
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
            #[inline(always)]
            fn from_bytes(bytes: &[u8]) -> Self {
                Self::from_le_bytes(bytes.try_into().expect("as many as it takes"))
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
}
