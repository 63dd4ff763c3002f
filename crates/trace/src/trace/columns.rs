//! The table of columns: what a trace's rows consist of, declared once.
//!
//! A row of the table says of a column its [`ColumnId`], its name in a file, how it is held
//! ([`crate::trace::cells`]), where a [`Fragment`](crate::trace::Fragment) has it, what is
//! checked of its values, its unit and its meaning; an optional one has a default in place
//! of the third. Batches, their builder, blocks, the text of constants, the parameters and
//! loaders of the GPU programs and the table of `docs/TRACE_FORMAT.md` come of it. A macro
//! rather than a list of values: fields have types, and the replay's copies are compiled for
//! each.

use crate::trace::cells::{Cells, ChannelColumn, CoverageColumn};
use crate::trace::column::{Column, Scalar, ValueType};
use crate::trace::fragment::MAX_SAMPLES;

/// Hands the table to the macro `$then`, as `{ required } { optional }`.
macro_rules! columns {
    ($then:ident) => {
        with_probe! { $then
            {
                X x: Column<u16>, [x], within_width,
                    "pixels, below the width", "the pixel's column, from the frame's left";
                Y y: Column<u16>, [y], within_height,
                    "pixels, below the height", "the pixel's row, from the frame's top";
                Coverage coverage: CoverageColumn, [coverage.0], some_samples,
                    "bit *s* is sample *s*; at least as wide as the sample count",
                    "the samples that the primitive covers; never 0";
                Z z: Column<u32>, [depth.z.0], anything,
                    "1/(2^32 − 1) of the depth range: 0 near, 2^32 − 1 far",
                    "depth at the pixel's centre";
                Dzdx dzdx: Column<i32>, [depth.dzdx], anything,
                    "the same, per pixel to the right", "the depth plane's slope";
                Dzdy dzdy: Column<i32>, [depth.dzdy], anything,
                    "the same, per pixel down", "the depth plane's slope";
                R r: ChannelColumn, [colour[0]], finite_colour,
                    "finite, not multiplied by alpha; linear, or as `screendoor.space` says", "red";
                G g: ChannelColumn, [colour[1]], finite_colour,
                    "finite, not multiplied by alpha; linear, or as `screendoor.space` says", "green";
                B b: ChannelColumn, [colour[2]], finite_colour,
                    "finite, not multiplied by alpha; linear, or as `screendoor.space` says", "blue";
                Alpha alpha: Column<f32>, [alpha], unit_interval,
                    "0 to 1", "opacity";
                Primitive primitive: Column<u32>, [primitive], anything,
                    "number",
                    "the triangle's or splat's number in the scene: different ones that meet in a pixel must have different numbers, as designs draw randomness from it";
                Object object: Column<u32>, [object], anything,
                    "number", "the object's number in the scene";
            }
            {
                // Optional columns: `Id name: type = default, check, unit, meaning;`.
                DirectR direct_r: ChannelColumn = 0.0, finite_colour,
                    "as `r`, of which it is a part", "what of the red comes straight from a light, if nothing lies between";
                DirectG direct_g: ChannelColumn = 0.0, finite_colour,
                    "as `g`, of which it is a part", "the same of the green";
                DirectB direct_b: ChannelColumn = 0.0, finite_colour,
                    "as `b`, of which it is a part", "the same of the blue";
            }
        }
    };
}

/// Adds an optional column that no trace of the program's own has, so that what holds for
/// optional columns can be tested while there is none: here, and with the feature `probe`
/// by the tests of what reads columns.
#[cfg(any(test, feature = "probe"))]
macro_rules! with_probe {
    ($then:ident { $($required:tt)* } { $($optional:tt)* }) => {
        $then! {
            { $($required)* }
            {
                $($optional)*
                Probe probe: Column<f32> = 0.5, finite, "none", "for tests";
            }
        }
    };
}
#[cfg(not(any(test, feature = "probe")))]
macro_rules! with_probe {
    ($then:ident $($table:tt)*) => { $then! { $($table)* } };
}

pub(crate) use {columns, with_probe};

/// What a column's values are.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ColumnKind {
    /// Whole numbers.
    Whole,
    /// Sets of samples, one bit each.
    Mask,
    /// Real numbers.
    Real,
}

macro_rules! declare {
    (
        { $($id:ident $name:ident: $type:ty, [$($place:tt)+], $check:ident,
            $unit:literal, $what:literal;)* }
        { $($oid:ident $oname:ident: $otype:ty = $default:expr, $ocheck:ident,
            $ounit:literal, $owhat:literal;)* }
    ) => {
        /// A column of a trace.
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
        #[repr(usize)]
        pub enum ColumnId {
            $(#[doc = $what] $id,)*
            $(#[doc = $owhat] $oid,)*
        }

        impl ColumnId {
            /// How many there are.
            pub const COUNT: usize = [$(stringify!($id),)* $(stringify!($oid),)*].len();

            /// All columns, in the order in which they stand in a file.
            pub const ALL: [ColumnId; Self::COUNT] =
                [$(ColumnId::$id,)* $(ColumnId::$oid,)*];

            /// The column's name in a file.
            pub const fn name(self) -> &'static str {
                match self {
                    $(ColumnId::$id => stringify!($name),)*
                    $(ColumnId::$oid => stringify!($oname),)*
                }
            }

            /// The unit of its values, and which of them there are.
            pub const fn unit(self) -> &'static str {
                match self {
                    $(ColumnId::$id => $unit,)*
                    $(ColumnId::$oid => $ounit,)*
                }
            }

            /// What they mean.
            pub const fn meaning(self) -> &'static str {
                match self {
                    $(ColumnId::$id => $what,)*
                    $(ColumnId::$oid => $owhat,)*
                }
            }

            /// Whether a trace may lack it.
            pub const fn is_optional(self) -> bool {
                match self {
                    $(ColumnId::$id => false,)*
                    $(ColumnId::$oid => true,)*
                }
            }

            /// What is meant where a trace lacks it; `None` where no trace may.
            pub fn default_value(self) -> Option<Scalar> {
                match self {
                    $(ColumnId::$id => None,)*
                    $(ColumnId::$oid => Some(<$otype as Cells>::scalar($default)),)*
                }
            }

            /// What its values are.
            pub const fn kind(self) -> ColumnKind {
                match self {
                    $(ColumnId::$id => <$type as Cells>::KIND,)*
                    $(ColumnId::$oid => <$otype as Cells>::KIND,)*
                }
            }

            /// The types it may have in a file whose pixels have `samples` samples.
            pub fn accepts(self, value_type: ValueType, samples: u32) -> bool {
                match self {
                    $(ColumnId::$id => <$type as Cells>::accepts(value_type, samples),)*
                    $(ColumnId::$oid => <$otype as Cells>::accepts(value_type, samples),)*
                }
            }

            /// Reads the decimal text of a value.
            pub(crate) fn parse(self, text: &str) -> Option<Scalar> {
                match self {
                    $(ColumnId::$id => <$type as Cells>::parse(text),)*
                    $(ColumnId::$oid => <$otype as Cells>::parse(text),)*
                }
            }
        }

        /// A fragment's values of the columns that a trace may lack.
        #[derive(Clone, Copy, PartialEq, Debug, serde::Serialize)]
        #[non_exhaustive]
        pub struct OptionalValues {
            $(#[doc = $owhat] pub $oname: <$otype as Cells>::Value,)*
        }

        impl Default for OptionalValues {
            fn default() -> Self {
                OptionalValues { $($oname: $default,)* }
            }
        }

        impl OptionalValues {
            /// Those of `columns`, and the defaults of the others.
            pub fn only(self, columns: ColumnSet) -> Self {
                let _ = columns;
                OptionalValues {
                    $($oname: match columns.contains(ColumnId::$oid) {
                        true => self.$oname,
                        false => $default,
                    },)*
                }
            }
        }
    };
}
columns!(declare);

impl ColumnId {
    /// The narrowest type it may have.
    pub fn narrowest(self, samples: u32) -> ValueType {
        *ValueType::ALL
            .iter()
            .find(|t| self.accepts(**t, samples.min(MAX_SAMPLES)))
            .expect("every column accepts some type for up to 64 samples")
    }
}

/// A set of columns.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub struct ColumnSet(u64);

impl ColumnSet {
    /// None.
    pub const NONE: ColumnSet = ColumnSet(0);
    /// All of them.
    pub const ALL: ColumnSet = ColumnSet::of(&ColumnId::ALL);

    /// Of these.
    pub const fn of(columns: &[ColumnId]) -> Self {
        let (mut bits, mut i) = (0, 0);
        while i < columns.len() {
            bits |= 1 << columns[i] as usize;
            i += 1;
        }
        ColumnSet(bits)
    }

    /// These without some.
    pub const fn without(self, others: ColumnSet) -> Self {
        ColumnSet(self.0 & !others.0)
    }

    /// Whether `column` is among them.
    #[inline]
    pub const fn contains(self, column: ColumnId) -> bool {
        self.0 >> column as usize & 1 == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The columns of the format, without the tests' own.
    fn documented() -> impl Iterator<Item = ColumnId> {
        ColumnId::ALL.into_iter().filter(|id| *id != ColumnId::Probe)
    }

    #[test]
    fn the_documentation_has_the_table() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/TRACE_FORMAT.md");
        let text = std::fs::read_to_string(path).unwrap();
        let row = |id: ColumnId| {
            let types: Vec<String> = ValueType::ALL
                .into_iter()
                .filter(|t| id.accepts(*t, 1))
                .map(|t| t.to_string())
                .collect();
            let optional = id.default_value().map_or(String::new(), |default| {
                format!("; optional, {default} where it is absent")
            });
            let (name, unit, what) = (id.name(), id.unit(), id.meaning());
            format!("| `{name}` | {} | {unit} | {what}{optional} |\n", types.join(", "))
        };
        let table: String = documented().map(row).collect();
        assert!(text.contains(&table), "docs/TRACE_FORMAT.md should have this table:\n{table}");
        let names: Vec<&str> = documented().map(ColumnId::name).collect();
        let listed = format!("COLUMNS = \"{}\"", names.join(" "));
        assert!(text.contains(&listed), "docs/TRACE_FORMAT.md should have {listed}");
    }

    #[test]
    fn columns_stand_in_their_order_and_sets_hold_what_they_are_made_of() {
        for (i, id) in ColumnId::ALL.into_iter().enumerate() {
            assert_eq!(id as usize, i);
            let set = ColumnSet::of(&[id, ColumnId::Z]);
            for other in ColumnId::ALL {
                assert_eq!(set.contains(other), other == id || other == ColumnId::Z);
            }
            assert!(ColumnSet::ALL.contains(id) && !ColumnSet::NONE.contains(id));
            let without = ColumnSet::ALL.without(set);
            assert!(!without.contains(id) && without.contains(ColumnId::R) == (id != ColumnId::R));
        }
    }

    #[test]
    fn constants_are_read_in_the_range_of_their_column() {
        for (id, good, bad) in [
            (ColumnId::X, "65535", "65536"),
            (ColumnId::Coverage, "18446744073709551615", "-1"),
            (ColumnId::Z, "4294967295", "4294967296"),
            (ColumnId::Dzdx, "-2147483648", "2147483648"),
            (ColumnId::R, "1e30", "red"),
            (ColumnId::Alpha, "0.1", ""),
        ] {
            let value = id.parse(good).unwrap();
            assert_eq!(id.parse(&value.to_string()), Some(value));
            assert_eq!(id.parse(bad), None, "{}: {bad}", id.name());
        }
    }
}
