//! What follows from a record and is worth a column of its own.

use std::collections::BTreeMap;

use crate::export::tree::Tree;
use screendoor_study::study::record::Record;

/// A column that is computed from a record; one for each engine and quartile where it is a
/// time.
pub struct Derived {
    /// The column's name, or the start of its columns' names.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    of: fn(&Record) -> Tree,
}

/// The columns of the exports after those of the record itself.
pub static DERIVED: &[Derived] = &[
    Derived { name: "state_bytes", unit: "bytes per pixel", of: |r| Tree::of(&r.state_bytes()) },
    Derived {
        name: "bytes_moved_per_fragment",
        unit: "bytes per fragment",
        of: |r| Tree::of(&r.bytes_moved_per_fragment()),
    },
    Derived {
        name: "hashes_per_fragment",
        unit: "hashes per fragment",
        of: |r| Tree::of(&r.hashes_per_fragment()),
    },
    Derived {
        name: "comparators_per_fragment",
        unit: "comparisons per fragment",
        of: |r| Tree::of(&r.comparators_per_fragment()),
    },
    Derived {
        name: "multiplications_per_fragment",
        unit: "products per fragment",
        of: |r| Tree::of(&r.multiplications_per_fragment()),
    },
    Derived { name: "tied_share", unit: "0 to 1", of: |r| Tree::of(&r.tied_share()) },
    Derived { name: "unbiased_here", unit: "", of: |r| Tree::of(&r.kept().unbiased) },
    Derived { name: "nanoseconds_per_fragment", unit: "ns per fragment", of: nanoseconds },
];

fn nanoseconds(record: &Record) -> Tree {
    let of_engine = |engine: &String| (engine.clone(), record.nanoseconds_per_fragment(engine));
    Tree::of(&record.speed.keys().map(of_engine).collect::<BTreeMap<_, _>>())
}

impl Derived {
    /// Its value for a record.
    pub(super) fn of(&self, record: &Record) -> Tree {
        (self.of)(record)
    }
}
