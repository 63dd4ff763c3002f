//! Blocks of fragments, column by column: what an engine is given to draw.
//!
//! A tile's fragments stand in the batches as short stretches of rows, a few for each
//! primitive. They are copied from there column by column, into few enough bytes for the
//! nearest cache, just before they are drawn.

use fearless_simd::{Level, dispatch};
use half::f16;

use crate::trace::batch::Batch;
use crate::trace::column::{ChannelColumn, Column, CoverageColumn, Native};
use crate::trace::fragment::{DepthPlane, Fragment, SampleMask, Unorm32};

/// Fragments of a block, at most.
pub const BLOCK: usize = 256;

/// Rows of a stretch, at most.
pub const STRETCH: usize = 16;

/// A column of a block, with room for what a copy writes beyond its end.
type Values<T> = [T; BLOCK + STRETCH];

/// At most [`BLOCK`] fragments, in the order in which they reach the ROP, every column in
/// one type. A row whose coverage is empty is no fragment: it covers samples that are
/// not replayed.
#[derive(Clone, Debug)]
pub struct Block {
    len: usize,
    /// Columns of the pixels, from the left.
    pub x: Values<u16>,
    /// Rows of the pixels, from the top.
    pub y: Values<u16>,
    /// Covered samples, one bit each.
    pub coverage: Values<u64>,
    /// Depths at the pixels' centres, in 2^-32 of the range (unorm32).
    pub z: Values<u32>,
    /// Change of depth over a pixel to the right, in the same units.
    pub dzdx: Values<i32>,
    /// The same downwards.
    pub dzdy: Values<i32>,
    /// Linear red, green and blue.
    pub colour: [Values<f32>; 3],
    /// Opacities, 0 to 1.
    pub alpha: Values<f32>,
    /// Numbers of the primitives.
    pub primitive: Values<u32>,
    /// Numbers of the objects.
    pub object: Values<u32>,
}

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

impl Default for Block {
    fn default() -> Self {
        const ROOM: usize = BLOCK + STRETCH;
        Block {
            len: 0,
            x: [0; ROOM],
            y: [0; ROOM],
            coverage: [0; ROOM],
            z: [0; ROOM],
            dzdx: [0; ROOM],
            dzdy: [0; ROOM],
            colour: [[0.0; ROOM]; 3],
            alpha: [0.0; ROOM],
            primitive: [0; ROOM],
            object: [0; ROOM],
        }
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

    /// Adds a fragment.
    ///
    /// # Panics
    /// Where it is full.
    pub fn push(&mut self, fragment: &Fragment) {
        let i = self.len;
        assert!(i < BLOCK, "the block is full");
        let Fragment { x, y, coverage, depth, colour, alpha, primitive, object } = *fragment;
        (self.x[i], self.y[i], self.coverage[i]) = (x, y, coverage.0);
        (self.z[i], self.dzdx[i], self.dzdy[i]) = (depth.z.0, depth.dzdx, depth.dzdy);
        for (values, channel) in self.colour.iter_mut().zip(colour) {
            values[i] = channel;
        }
        (self.alpha[i], self.primitive[i], self.object[i]) = (alpha, primitive, object);
        self.len += 1;
    }

    /// Row `i`.
    ///
    /// # Panics
    /// Where `i` is not below [`BLOCK`].
    #[inline]
    pub fn fragment(&self, i: usize) -> Fragment {
        let [r, g, b] = &self.colour;
        Fragment {
            x: self.x[i],
            y: self.y[i],
            coverage: SampleMask(self.coverage[i]),
            depth: DepthPlane { z: Unorm32(self.z[i]), dzdx: self.dzdx[i], dzdy: self.dzdy[i] },
            colour: [r[i], g[i], b[i]],
            alpha: self.alpha[i],
            primitive: self.primitive[i],
            object: self.object[i],
        }
    }

    /// The fragments in order.
    #[inline]
    pub fn iter(&self) -> impl Iterator<Item = Fragment> + '_ {
        let rows = (0..self.len).filter(|i| self.coverage[*i] != 0);
        rows.map(|i| self.fragment(i))
    }

    /// Adds stretches of `batch` while there is room, their coverage within `mask`, with the
    /// instructions of `level`; tells how many.
    pub fn gather(
        &mut self,
        level: Level,
        batch: &Batch,
        stretches: &[Stretch],
        mask: SampleMask,
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
        dispatch!(level, _ => self.put(batch, list, mask));
        self.len = end;
        taken
    }

    #[inline(always)]
    fn put(&mut self, batch: &Batch, list: &[Stretch], mask: SampleMask) {
        let from = Stretches { at: self.len, list };
        from.put(&batch.x, &mut self.x, same);
        from.put(&batch.y, &mut self.y, same);
        let coverage = &mut self.coverage;
        match &batch.coverage {
            CoverageColumn::U8(c) => from.put_masks(c, coverage, mask),
            CoverageColumn::U16(c) => from.put_masks(c, coverage, mask),
            CoverageColumn::U32(c) => from.put_masks(c, coverage, mask),
            CoverageColumn::U64(c) => from.put_masks(c, coverage, mask),
        }
        from.put(&batch.z, &mut self.z, same);
        from.put(&batch.dzdx, &mut self.dzdx, same);
        from.put(&batch.dzdy, &mut self.dzdy, same);
        for (values, column) in self.colour.iter_mut().zip(&batch.colour) {
            match column {
                ChannelColumn::F16(c) => from.put(c, values, widen),
                ChannelColumn::F32(c) => from.put(c, values, same),
            }
        }
        from.put(&batch.alpha, &mut self.alpha, same);
        from.put(&batch.primitive, &mut self.primitive, same);
        from.put(&batch.object, &mut self.object, same);
    }
}

/// Rows of a batch that go to a block, from place `at` on.
#[derive(Clone, Copy)]
struct Stretches<'a> {
    at: usize,
    list: &'a [Stretch],
}

impl Stretches<'_> {
    /// Copies masks, as far as they lie within another.
    #[inline(always)]
    fn put_masks<T: Native + Into<u64>>(
        self,
        column: &Column<T>,
        to: &mut Values<u64>,
        mask: SampleMask,
    ) {
        self.put(
            column,
            to,
            #[inline(always)]
            |v| v.into() & mask.0,
        );
    }

    /// Copies a column's values. A whole stretch's worth is copied for each, however short
    /// it is, and what is too much is written over by the next: a length known when this
    /// is compiled is worth more than a copy that ends where it should.
    #[inline(always)]
    fn put<T: Native, U: Copy>(
        self,
        column: &Column<T>,
        to: &mut Values<U>,
        change: impl Fn(T) -> U,
    ) {
        let mut at = self.at;
        match column {
            Column::Constant(value) => {
                let count: usize = self.list.iter().map(|s| s.count()).sum();
                to[at..at + count].fill(change(*value));
            }
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

/// For columns that are copied as they are.
#[inline(always)]
fn same<T>(value: T) -> T {
    value
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

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::random::Stream;
    use crate::trace::batch::BatchBuilder;
    use crate::trace::{ColourFormat, ColumnId, Header, SamplePattern, Scalar};

    #[test]
    fn every_finite_half_is_widened_exactly() {
        for value in (0..=u16::MAX).map(f16::from_bits).filter(|v| v.is_finite()) {
            assert_eq!(widen(value).to_bits(), value.to_f32().to_bits(), "{value}");
        }
    }

    /// A batch of random fragments, with columns of all types: masks for so many samples,
    /// colours in either precision, and two constants or none.
    fn batch(random: &mut Stream, samples: u32, colour: ColourFormat, constants: bool) -> Batch {
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
            constants: BTreeMap::new(),
        };
        if constants {
            header.constants.insert(ColumnId::X, Scalar::Unsigned(7));
            header.constants.insert(ColumnId::Alpha, Scalar::Real(0.25));
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
                for (constants, level) in
                    [(false, Level::new()), (true, Level::new()), (false, Level::fallback())]
                {
                    let batch = batch(&mut random, samples, colour, constants);
                    let mask = SampleMask::first(samples.div_ceil(2));
                    let stretch = |_| {
                        let count = 1 + random.below(STRETCH as u32) as usize;
                        let start = random.below(batch.len() as u32 - count as u32 + 1) as usize;
                        Stretch::new(start.max(batch.len() - 30 - count), count)
                    };
                    let stretches: Vec<Stretch> = (0..60).map(stretch).collect();
                    let mut block = Block::default();
                    let first = block.gather(level, &batch, &stretches[..3], mask);
                    let more = block.gather(level, &batch, &stretches[3..], mask);
                    let (taken, left) = stretches.split_at(first + more);
                    assert!(first == 3 && block.rows() + left[0].count() > BLOCK);
                    let rows = taken.iter().flat_map(|s| s.start()..s.start() + s.count());
                    let expected: Vec<Fragment> = rows
                        .map(|row| {
                            let fragment = batch.fragment(row);
                            Fragment { coverage: fragment.coverage & mask, ..fragment }
                        })
                        .collect();
                    let found: Vec<Fragment> =
                        (0..block.rows()).map(|i| block.fragment(i)).collect();
                    assert_eq!(found, expected);
                    let covered = expected.iter().filter(|f| !f.coverage.is_empty());
                    assert!(block.iter().eq(covered.copied()));
                }
            }
        }
    }
}
