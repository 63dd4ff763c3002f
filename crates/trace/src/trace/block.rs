//! Blocks of fragments, column by column: what an engine is given to draw.
//!
//! They are made of a tile's rows in bins ([`crate::trace::bins`]) just before they are drawn,
//! column by column, in few enough bytes for the nearest cache.

use crate::trace::cells::{Cells, ChannelColumn, CoverageColumn};
use crate::trace::column::Column;
use crate::trace::columns::{columns, with_probe};
use crate::trace::fragment::Fragment;

/// Fragments of a block, at most.
pub const BLOCK: usize = 256;

/// A column of a block.
type Values<T> = [T; BLOCK];

/// Makes blocks of the table of columns.
macro_rules! blocks {
    (
        { $($id:ident $name:ident: $type:ty, [$($place:tt)+], $check:ident,
            $unit:literal, $what:literal;)* }
        { $($oid:ident $oname:ident: $otype:ty = $default:expr, $ocheck:ident,
            $ounit:literal, $owhat:literal;)* }
    ) => {
        /// At most [`BLOCK`] fragments, in the order in which they reach the ROP, every
        /// column in one type. A row whose coverage is empty is no fragment: it covers
        /// samples that are not replayed.
        #[derive(Clone, Debug)]
        pub struct Block {
            pub(super) len: usize,
            $(#[doc = $what] pub $name: Values<<$type as Cells>::Value>,)*
            // Of an optional column nothing is there until somebody asks for a value.
            $(#[doc = $owhat] pub $oname: Option<Box<Values<<$otype as Cells>::Value>>>,)*
        }

        impl Default for Block {
            fn default() -> Self {
                let none = Fragment::default();
                Block {
                    len: 0,
                    $($name: [none.$($place)+; BLOCK],)*
                    $($oname: None,)*
                }
            }
        }

        impl Block {
            /// Adds a fragment.
            ///
            /// # Panics
            /// Where it is full.
            pub fn push(&mut self, fragment: &Fragment) {
                let i = self.len;
                assert!(i < BLOCK, "the block is full");
                $(self.$name[i] = fragment.$($place)+;)*
                $(
                    let value = fragment.optional.$oname;
                    match &mut self.$oname {
                        Some(values) => values[i] = value,
                        None if value == $default => {}
                        none => none.insert(Box::new([$default; BLOCK]))[i] = value,
                    }
                )*
                self.len += 1;
            }

            /// Row `i`.
            ///
            /// # Panics
            /// Where `i` is not below [`BLOCK`].
            #[inline]
            pub fn fragment(&self, i: usize) -> Fragment {
                let mut fragment = Fragment::default();
                $(fragment.$($place)+ = self.$name[i];)*
                $(if let Some(values) = &self.$oname {
                    fragment.optional.$oname = values[i];
                })*
                fragment
            }
        }
    };
}
columns!(blocks);

impl Block {
    /// Blocks that hold these fragments.
    pub fn all_of(fragments: &[Fragment]) -> Vec<Block> {
        let block = |fragments: &[Fragment]| {
            let mut block = Block::default();
            fragments.iter().for_each(|fragment| block.push(fragment));
            block
        };
        fragments.chunks(BLOCK).map(block).collect()
    }

    /// How many rows it holds.
    #[inline]
    pub fn rows(&self) -> usize {
        self.len
    }

    /// Whether it holds no fragment.
    pub fn is_empty(&self) -> bool {
        self.coverage[..self.len].iter().all(|mask| *mask == 0)
    }

    /// Removes all rows.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// The fragments in order.
    #[inline]
    pub fn iter(&self) -> impl Iterator<Item = Fragment> + '_ {
        let rows = (0..self.len).filter(|i| self.coverage[*i] != 0);
        rows.map(|i| self.fragment(i))
    }
}
