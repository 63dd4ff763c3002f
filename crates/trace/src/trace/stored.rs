//! How a file stores the columns, and how what other programs write becomes what the
//! format has.
//!
//! A column of another type is read where that loses nothing and needs no guess: whole
//! numbers of any width and sign where every value fits, real numbers of another width
//! where every value is exactly one of the format's. Columns may stand in any order;
//! those that no trace has are passed over.

use std::fmt;
use std::iter;

use arrow_buffer::Buffer;
use arrow_ipc::{Field, Precision, Type};
use half::f16;

use crate::error::{Error, Result};
use crate::trace::column::ValueType;
use crate::trace::columns::{ColumnId, ColumnKind};
use crate::trace::header::{ColourFormat, Header};

/// Children within children of a column, at most.
const MAX_DEPTH: usize = 32;

/// A type of numbers that a file can store, with its bytes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum StoredType {
    Unsigned(usize),
    Signed(usize),
    Real(usize),
}

impl StoredType {
    pub(super) fn bytes(self) -> usize {
        let (StoredType::Unsigned(bytes) | StoredType::Signed(bytes) | StoredType::Real(bytes)) =
            self;
        bytes
    }

    /// The format's own type that it is, if it is one.
    fn own(self) -> Option<ValueType> {
        ValueType::ALL.into_iter().find(|t| StoredType::of(*t) == self)
    }

    fn of(value_type: ValueType) -> Self {
        let bytes = value_type.bytes();
        match value_type {
            ValueType::U8 | ValueType::U16 | ValueType::U32 | ValueType::U64 => {
                StoredType::Unsigned(bytes)
            }
            ValueType::I32 => StoredType::Signed(bytes),
            ValueType::F16 | ValueType::F32 => StoredType::Real(bytes),
        }
    }

    fn of_field(field: Field<'_>) -> Option<Self> {
        match field.type_type() {
            Type::Int => {
                let int = field.type_as_int()?;
                let bytes = match int.bitWidth() {
                    bits @ (8 | 16 | 32 | 64) => bits as usize / 8,
                    _ => return None,
                };
                Some(match int.is_signed() {
                    true => StoredType::Signed(bytes),
                    false => StoredType::Unsigned(bytes),
                })
            }
            Type::FloatingPoint => match field.type_as_floating_point()?.precision() {
                Precision::HALF => Some(StoredType::Real(2)),
                Precision::SINGLE => Some(StoredType::Real(4)),
                Precision::DOUBLE => Some(StoredType::Real(8)),
                _ => None,
            },
            _ => None,
        }
    }

    /// The type as which `id` is read from it; `None` where that would be a guess.
    fn read_as(self, id: ColumnId, samples: u32) -> Option<ValueType> {
        if let Some(own) = self.own().filter(|own| id.accepts(*own, samples)) {
            return Some(own);
        }
        match (id.kind(), self) {
            (ColumnKind::Real, StoredType::Real(_)) => Some(ValueType::F32),
            // A mask narrower than the samples cannot name them all.
            (ColumnKind::Mask, StoredType::Signed(bytes)) => {
                let same = StoredType::Unsigned(bytes).own()?;
                id.accepts(same, samples).then_some(same)
            }
            (ColumnKind::Real | ColumnKind::Mask, _) | (_, StoredType::Real(_)) => None,
            _ => Some(id.narrowest(samples)),
        }
    }
}

impl fmt::Display for StoredType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = match self {
            StoredType::Unsigned(_) => "uint",
            StoredType::Signed(_) => "int",
            StoredType::Real(_) => "float",
        };
        write!(f, "{name}{}", 8 * self.bytes())
    }
}

/// A column of a trace as a file stores it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct StoredColumn {
    pub id: ColumnId,
    pub stored: StoredType,
    /// Where it stands among a batch's arrays and buffers.
    pub place: Shape,
}

/// How many arrays and buffers columns have in a batch's message.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub(crate) struct Shape {
    pub nodes: usize,
    pub buffers: usize,
    /// Arrays that have more buffers, as many as each batch says.
    pub views: usize,
}

/// The columns of a file.
#[derive(Clone, PartialEq, Eq, Default, Debug)]
pub(crate) struct StoredColumns {
    /// Those of a trace, in the file's order.
    pub list: Vec<StoredColumn>,
    /// Name and type of those that no trace has.
    pub extra: Vec<(String, String)>,
    /// Of all columns together.
    pub all: Shape,
}

impl StoredColumns {
    /// The columns of a schema's fields.
    pub(super) fn of<'a>(fields: impl Iterator<Item = Field<'a>>, place: &str) -> Result<Self> {
        let mut columns = StoredColumns::default();
        for field in fields {
            let name = field.name().unwrap_or("");
            let here = columns.all;
            columns.all.add(field, name, place, 0)?;
            let Some(id) = ColumnId::ALL.into_iter().find(|id| id.name() == name) else {
                columns.extra.push((name.to_string(), type_name(field)));
                continue;
            };
            if columns.list.iter().any(|column| column.id == id) {
                return Err(unreadable(place, name, "stands there twice", "write it once"));
            }
            let Some(stored) = StoredType::of_field(field) else {
                let what = format_args!("is of type {}", type_name(field)).to_string();
                return Err(unreadable(place, name, &what, &wanted(id, None, None)));
            };
            columns.list.push(StoredColumn { id, stored, place: here });
        }
        Ok(columns)
    }

    /// Holds the columns against the header: each is stored with a type that can be read,
    /// or is constant, and not both. Tells as which type each is read, and the header of
    /// which precision colours are.
    pub(super) fn complete(
        &self,
        header: &mut Header,
        place: &str,
    ) -> Result<Vec<(ColumnId, ValueType)>> {
        let samples = header.pattern.samples();
        for id in ColumnId::ALL {
            let stored = self.list.iter().any(|column| column.id == id);
            let what = match (stored, header.constants.contains_key(&id)) {
                (true, true) => format!("'{}' is both a column and a constant", id.name()),
                (false, false) if !id.is_optional() => {
                    format!("the column '{}' is missing", id.name())
                }
                _ => continue,
            };
            let hint = "correct the writer of the trace (docs/TRACE_FORMAT.md)";
            return Err(Error::invalid(place, what, hint));
        }
        let read = |column: &StoredColumn| {
            let value_type = column.stored.read_as(column.id, samples).ok_or_else(|| {
                let what = format!("is of type {}", column.stored);
                let hint = wanted(column.id, Some(samples), Some(column.stored));
                unreadable(place, column.id.name(), &what, &hint)
            })?;
            Ok((column.id, value_type))
        };
        let list = self.list.iter().map(read).collect::<Result<Vec<_>>>()?;
        let single = |(id, value_type): &(ColumnId, ValueType)| {
            id.accepts(ValueType::F16, samples) && *value_type == ValueType::F32
        };
        let single = list.iter().any(single);
        let present = list.iter().map(|(id, _)| *id).chain(header.constants.keys().copied());
        header.optional = present.filter(|id| id.is_optional()).collect();
        header.colour = if single { ColourFormat::F32 } else { ColourFormat::F16 };
        Ok(list)
    }
}

impl StoredColumn {
    /// Whether it is stored in this type.
    pub(super) fn is(&self, value_type: ValueType) -> bool {
        self.stored == StoredType::of(value_type)
    }

    /// The column's `rows` values as `to`, which it can be read as; `values` are the
    /// bytes of at least as many. Without a copy where they are of that type.
    pub(super) fn convert(
        &self,
        to: ValueType,
        values: Buffer,
        rows: usize,
        place: &str,
    ) -> Result<Buffer> {
        if self.is(to) {
            return Ok(values);
        }
        let values = &values[..rows * self.stored.bytes()];
        convert(self.stored, to, values).map(Buffer::from_vec).map_err(|(row, value)| {
            let name = self.id.name();
            Error::invalid(
                format_args!("{place}, row {row}"),
                format_args!("column '{name}' holds {value} as {}, which no {to} is", self.stored),
                format_args!("write numbers that are {to}, in the format's unit"),
            )
        })
    }
}

/// Values of one type as another; the first that is none, and its row.
fn convert(from: StoredType, to: ValueType, values: &[u8]) -> Result<Vec<u8>, (usize, String)> {
    let mut converted = Vec::with_capacity(values.len() / from.bytes() * to.bytes());
    for (row, bytes) in values.chunks_exact(from.bytes()).enumerate() {
        let mut wide = [0; 8];
        wide[..bytes.len()].copy_from_slice(bytes);
        let low = u64::from_le_bytes(wide);
        if let StoredType::Real(size) = from {
            let value = match size {
                2 => f16::from_bits(low as u16).to_f64(),
                4 => f64::from(f32::from_bits(low as u32)),
                _ => f64::from_bits(low),
            };
            if f64::from(value as f32) != value {
                return Err((row, value.to_string()));
            }
            converted.extend_from_slice(&(value as f32).to_le_bytes());
            continue;
        }
        let unused = 64 - 8 * bytes.len() as u32;
        let value = match from {
            StoredType::Signed(_) => i128::from((low << unused) as i64 >> unused),
            _ => i128::from(low),
        };
        let range = match to {
            ValueType::I32 => i128::from(i32::MIN)..=i128::from(i32::MAX),
            _ => 0..=(1_i128 << (8 * to.bytes())) - 1,
        };
        if !range.contains(&value) {
            return Err((row, value.to_string()));
        }
        converted.extend_from_slice(&value.to_le_bytes()[..to.bytes()]);
    }
    Ok(converted)
}

impl Shape {
    /// Counts a field and its children.
    fn add(&mut self, field: Field<'_>, name: &str, place: &str, depth: usize) -> Result<()> {
        let refuse = |what: &str| unreadable(place, name, what, "leave it out or write it plain");
        if field.dictionary().is_some() {
            return Err(refuse("is dictionary-encoded"));
        }
        if depth == MAX_DEPTH {
            return Err(refuse("is nested too deeply"));
        }
        self.nodes += 1;
        // How many buffers an array has, its children apart, is the Arrow format's.
        self.buffers += match field.type_type() {
            Type::Null | Type::RunEndEncoded => 0,
            Type::Struct_ | Type::FixedSizeList => 1,
            Type::Int
            | Type::FloatingPoint
            | Type::Bool
            | Type::Decimal
            | Type::Date
            | Type::Time
            | Type::Timestamp
            | Type::Interval
            | Type::Duration
            | Type::FixedSizeBinary
            | Type::List
            | Type::LargeList
            | Type::Map => 2,
            Type::Binary | Type::Utf8 | Type::LargeBinary | Type::LargeUtf8 => 3,
            Type::BinaryView | Type::Utf8View => {
                self.views += 1;
                2
            }
            Type::ListView | Type::LargeListView => 3,
            // Their buffers depend on the format's version.
            _ => return Err(refuse(&format!("is of type {}", type_name(field)))),
        };
        field
            .children()
            .iter()
            .flatten()
            .try_for_each(|child| self.add(child, name, place, depth + 1))
    }

    /// Where a column's own arrays and buffers begin in a batch whose views have so many
    /// more buffers each.
    pub(super) fn buffer(&self, views: &[usize]) -> Option<usize> {
        let more = views.get(..self.views)?.iter();
        more.chain(iter::once(&self.buffers)).try_fold(0_usize, |sum, n| sum.checked_add(*n))
    }
}

/// The name of a field's type, as Arrow's documents have it.
fn type_name(field: Field<'_>) -> String {
    if let Some(stored) = StoredType::of_field(field) {
        return stored.to_string();
    }
    let name = field.type_type().variant_name().unwrap_or("unknown");
    name.trim_end_matches('_').to_lowercase()
}

/// What to do about a column of a wrong type. A cast alone would make another value of what
/// counts in another unit.
fn wanted(id: ColumnId, samples: Option<u32>, stored: Option<StoredType>) -> String {
    let types: Vec<String> = ValueType::ALL
        .into_iter()
        .filter(|t| id.accepts(*t, samples.unwrap_or(1)))
        .map(|t| t.to_string())
        .collect();
    let first = match (id.kind(), stored) {
        (ColumnKind::Real, Some(StoredType::Unsigned(_) | StoredType::Signed(_))) => {
            "divide it by what 1 is in it, 255 perhaps, and "
        }
        (ColumnKind::Whole, Some(StoredType::Real(_))) => {
            "scale it to the format's unit, round it, and "
        }
        _ => "",
    };
    format!("{first}cast it to {}", types.join(" or "))
}

fn unreadable(place: &str, name: &str, what: &str, hint: &str) -> Error {
    Error::invalid(place, format_args!("the column '{name}' {what}"), hint)
}
