//! Blocks of fragments, column by column: what an engine is given to draw.
//!
//! A tile's fragments stand in the batches as short stretches of rows, a few for each
//! primitive. They are copied from there column by column, into few enough bytes for the
//! nearest cache, just before they are drawn.

use fearless_simd::{Level, dispatch};

use crate::trace::batch::Batch;
use crate::trace::cells::{Cells, ChannelColumn, CoverageColumn};
use crate::trace::column::{Column, Native};
use crate::trace::columns::{ColumnSet, columns, with_probe};
use crate::trace::fragment::{Fragment, SampleMask};

/// Fragments of a block, at most.
pub const BLOCK: usize = 256;

/// Rows of a stretch, at most.
pub const STRETCH: usize = 16;

/// A column of a block, with room for what a copy writes beyond its end.
pub(super) type Values<T> = [T; BLOCK + STRETCH];

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
            len: usize,
            $(#[doc = $what] pub $name: Values<<$type as Cells>::Value>,)*
            // Of an optional column nothing is there until somebody asks for a value.
            $(#[doc = $owhat] pub $oname: Option<Box<Values<<$otype as Cells>::Value>>>,)*
        }

        impl Default for Block {
            fn default() -> Self {
                let none = Fragment::default();
                Block {
                    len: 0,
                    $($name: [none.$($place)+; BLOCK + STRETCH],)*
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
                        none => none.insert(Box::new([$default; BLOCK + STRETCH]))[i] = value,
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

            /// Copies stretches to the end, of optional columns those of `columns`.
            #[inline(always)]
            fn put(
                &mut self,
                batch: &Batch,
                list: &[Stretch],
                mask: SampleMask,
                columns: ColumnSet,
            ) {
                let from = Stretches { at: self.len, list };
                $(batch.$name.copy(from, &mut self.$name, mask);)*
                $(
                    let read = columns.contains(crate::trace::columns::ColumnId::$oid);
                    match (batch.$oname.as_ref().filter(|_| read), &mut self.$oname) {
                        (Some(column), values) => {
                            let room = || Box::new([$default; BLOCK + STRETCH]);
                            column.copy(from, values.get_or_insert_with(room), mask);
                        }
                        (None, Some(values)) => from.fill($default, values),
                        (None, None) => {}
                    }
                )*
                // Where no column is optional.
                let _ = columns;
            }
        }
    };
}
columns!(blocks);

/// At most [`STRETCH`] rows of a batch, one after the other.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Stretch(u32);

impl Stretch {
    /// `count` rows, at least one, from row `start` on.
    #[inline]
    pub fn new(start: usize, count: usize) -> Self {
        debug_assert!((1..=STRETCH).contains(&count));
        // A batch holds at most 2^22 rows.
        Stretch((start * STRETCH + (count - 1)) as u32)
    }

    /// The first row.
    #[inline]
    pub fn start(self) -> usize {
        self.0 as usize / STRETCH
    }

    /// How many rows there are.
    #[inline]
    pub fn count(self) -> usize {
        self.0 as usize % STRETCH + 1
    }
}

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

    /// Adds stretches of `batch` while there is room, their coverage within `mask`, and of
    /// optional columns those in `columns` that it has, with the instructions of `level`;
    /// tells how many.
    pub fn gather(
        &mut self,
        level: Level,
        batch: &Batch,
        stretches: &[Stretch],
        mask: SampleMask,
        columns: ColumnSet,
    ) -> usize {
        let (mut end, mut taken) = (self.len, 0);
        for stretch in stretches {
            if end + stretch.count() > BLOCK {
                break;
            }
            end += stretch.count();
            taken += 1;
        }
        let list = &stretches[..taken];
        dispatch!(level, _ => self.put(batch, list, mask, columns));
        self.len = end;
        taken
    }
}

/// Rows of a batch that go to a block, from place `at` on.
#[derive(Clone, Copy)]
pub struct Stretches<'a> {
    at: usize,
    list: &'a [Stretch],
}

impl Stretches<'_> {
    /// The same value in all rows.
    #[inline(always)]
    fn fill<T: Copy>(self, value: T, to: &mut Values<T>) {
        let count: usize = self.list.iter().map(|s| s.count()).sum();
        to[self.at..self.at + count].fill(value);
    }

    /// Copies a column's values. A whole stretch's worth is copied for each, however short
    /// it is, and what is too much is written over by the next: a length known when this
    /// is compiled is worth more than a copy that ends where it should.
    #[inline(always)]
    pub fn put<T: Native, U: Copy>(
        self,
        column: &Column<T>,
        to: &mut Values<U>,
        change: impl Fn(T) -> U,
    ) {
        let mut at = self.at;
        match column {
            Column::Constant(value) => self.fill(change(*value), to),
            Column::Values(values) => {
                let values: &[T] = values;
                for stretch in self.list {
                    let to: &mut [U; STRETCH] =
                        (&mut to[at..at + STRETCH]).try_into().expect("of this length");
                    let start = stretch.start();
                    if let Some(values) = values.get(start..start + STRETCH) {
                        // All is read before anything is written: nothing can overlap.
                        let mut copy = *to;
                        for (to, value) in copy.iter_mut().zip(values) {
                            *to = change(*value);
                        }
                        *to = copy;
                    } else {
                        for (to, value) in to.iter_mut().zip(&values[start..]) {
                            *to = change(*value);
                        }
                    }
                    at += stretch.count();
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;
    use crate::trace::batch::BatchBuilder;
    use crate::trace::{
        ColourFormat, ColumnId, DepthPlane, Header, OptionalValues, SamplePattern, Scalar, Unorm32,
    };

    /// A batch of random fragments, with columns of all types: masks for so many samples,
    /// colours in either precision, two constants or none, and an optional column or not.
    fn batch(
        random: &mut Stream,
        samples: u32,
        colour: ColourFormat,
        constants: bool,
        optional: bool,
    ) -> Batch {
        let mut header = Header {
            width: 1 << 16,
            height: 1 << 16,
            pattern: SamplePattern {
                name: String::new(),
                positions: vec![[0, 0]; samples as usize],
                nested: false,
            },
            background: [0.0; 3],
            colour,
            source: String::new(),
            camera: String::new(),
            ..Header::default()
        };
        if constants {
            header.constants.insert(ColumnId::X, Scalar::Unsigned(7));
            header.constants.insert(ColumnId::Alpha, Scalar::Real(0.25));
        }
        if optional {
            header.optional.insert(ColumnId::Probe);
        }
        let mut builder = BatchBuilder::new(&header).unwrap();
        for _ in 0..100 {
            let bits = u64::from(random.word()) << 32 | u64::from(random.word());
            let fragment = Fragment {
                x: if constants { 7 } else { random.word() as u16 },
                y: random.word() as u16,
                coverage: SampleMask(bits) & SampleMask::first(samples),
                depth: DepthPlane {
                    z: Unorm32(random.word()),
                    dzdx: random.word() as i32,
                    dzdy: random.word() as i32,
                },
                colour: [random.unit(), -random.unit(), random.unit() * 1000.0],
                alpha: if constants { 0.25 } else { random.unit() },
                primitive: random.word(),
                object: random.word(),
                optional: OptionalValues {
                    probe: if optional { random.unit() } else { 0.5 },
                    ..OptionalValues::default()
                },
            };
            builder.push(&fragment).unwrap();
        }
        builder.take()
    }

    /// Stretches of all lengths, in any order, the batch's last row among them, until the
    /// block is full.
    #[test]
    fn stretches_are_gathered_whole_and_in_order() {
        let mut random = Stream::new([3]);
        for samples in [1, 8, 16, 32, 64] {
            for colour in [ColourFormat::F16, ColourFormat::F32] {
                for (constants, optional, columns, level) in [
                    (false, false, ColumnSet::NONE, Level::new()),
                    (true, true, ColumnSet::NONE, Level::new()),
                    (false, true, ColumnSet::ALL, Level::new()),
                    (true, false, ColumnSet::ALL, Level::new()),
                    (false, true, ColumnSet::ALL, Level::fallback()),
                ] {
                    let batch = batch(&mut random, samples, colour, constants, optional);
                    let mask = SampleMask::first(samples.div_ceil(2));
                    let stretch = |_| {
                        let count = 1 + random.below(STRETCH as u32) as usize;
                        let start = random.below(batch.len() as u32 - count as u32 + 1) as usize;
                        Stretch::new(start.max(batch.len() - 30 - count), count)
                    };
                    let stretches: Vec<Stretch> = (0..60).map(stretch).collect();
                    let mut block = Block::default();
                    let first = block.gather(level, &batch, &stretches[..3], mask, columns);
                    let more = block.gather(level, &batch, &stretches[3..], mask, columns);
                    let (taken, left) = stretches.split_at(first + more);
                    assert!(first == 3 && block.rows() + left[0].count() > BLOCK);
                    let rows = taken.iter().flat_map(|s| s.start()..s.start() + s.count());
                    let expected: Vec<Fragment> = rows
                        .map(|row| {
                            let f = batch.fragment(row);
                            let optional = f.optional.only(columns);
                            Fragment { coverage: f.coverage & mask, optional, ..f }
                        })
                        .collect();
                    let found: Vec<Fragment> =
                        (0..block.rows()).map(|i| block.fragment(i)).collect();
                    assert_eq!(found, expected);
                    let covered = expected.iter().filter(|f| !f.coverage.is_empty());
                    assert!(block.iter().eq(covered.copied()));
                    // What is not asked for, or not there, takes no memory.
                    let read = optional && columns.contains(ColumnId::Probe);
                    assert_eq!(block.probe.is_some(), read);
                }
            }
        }
    }

    /// A block that has had values of an optional column serves a batch that has none, and
    /// fragments one by one.
    #[test]
    fn a_block_is_filled_again_without_what_it_held() {
        let mut random = Stream::new([4]);
        let mut batch = |optional| batch(&mut random, 8, ColourFormat::F16, false, optional);
        let (with, without) = (batch(true), batch(false));
        let mut block = Block::default();
        let stretches = [Stretch::new(0, 16), Stretch::new(40, 9)];
        let all = SampleMask::first(8);
        block.gather(Level::new(), &with, &stretches, all, ColumnSet::ALL);
        block.clear();
        block.gather(Level::new(), &without, &stretches, all, ColumnSet::ALL);
        for fragment in with.iter().take(3) {
            block.push(&fragment);
        }
        let rows = (0..16).chain(40..49).map(|row| without.fragment(row));
        let expected: Vec<Fragment> = rows.chain((0..3).map(|row| with.fragment(row))).collect();
        let found: Vec<Fragment> = (0..block.rows()).map(|i| block.fragment(i)).collect();
        assert_eq!(found, expected);
        // One by one, too, it is made when a fragment has a value.
        let mut block = Block::default();
        block.push(&without.fragment(0));
        assert!(block.probe.is_none());
        block.push(&with.fragment(1));
        assert_eq!([block.fragment(0), block.fragment(1)], [without.fragment(0), with.fragment(1)]);
    }
}
