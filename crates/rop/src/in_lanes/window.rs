//! Fragments of a tile that are drawn together.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, i32x16, u32x16};

use crate::in_lanes::LANES;
use crate::in_lanes::groups::Groups;
use crate::in_lanes::met::transposed;
use screendoor_trace::tile::TileGrid;
use screendoor_trace::trace::{BLOCK, Block, Fragment};

/// Rows of a window, at most: with their lists they should lie in the second-level cache.
pub(super) const MOST_ROWS: usize = 1 << 14;

/// A row that covers nothing.
pub(super) const NOTHING: u16 = MOST_ROWS as u16;

/// Room for [`NOTHING`] too, and a power of two, so that no index needs a check.
pub(super) const ROOM: usize = 2 * MOST_ROWS;

/// Four words of a fragment.
pub(super) type Row = [u32; 4];

/// Fragments of a tile that are drawn together. It is filled again and again: memory that has
/// been touched is cheaper than fresh memory.
#[derive(Debug)]
pub(super) struct Window {
    len: usize,
    within: Vec<u8>,
    /// Depth, slope to the right, slope downwards, coverage.
    rows: Box<[Row; ROOM]>,
    /// Red, green, blue, alpha.
    paints: Box<[Row; ROOM]>,
    primitives: Box<[u32; ROOM]>,
    pub(super) groups: Groups,
}

fn boxed<T: Clone, const N: usize>(value: T) -> Box<[T; N]> {
    let Ok(boxed) = vec![value; N].into_boxed_slice().try_into() else {
        unreachable!("of this length")
    };
    boxed
}

impl Window {
    pub(super) fn new() -> Self {
        Window {
            len: 0,
            within: vec![0; MOST_ROWS],
            rows: boxed([0; 4]),
            paints: boxed([0; 4]),
            primitives: boxed(0),
            groups: Groups::new(),
        }
    }

    /// Forgets what it holds.
    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    /// Whether it holds no row.
    pub(super) fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Whether there is room for another block.
    pub(super) fn has_room(&self) -> bool {
        self.len + BLOCK <= MOST_ROWS
    }

    /// Adds a fragment.
    pub(super) fn push(&mut self, fragment: &Fragment) {
        let at = self.len;
        let plane = fragment.depth;
        self.within[at] = TileGrid::within(fragment.x, fragment.y) as u8;
        self.rows[at] =
            [plane.z.0, plane.dzdx as u32, plane.dzdy as u32, fragment.coverage.0 as u32];
        let [r, g, b] = fragment.colour;
        self.paints[at] = [r, g, b, fragment.alpha].map(f32::to_bits);
        self.primitives[at] = fragment.primitive;
        self.len += 1;
    }

    /// Adds a block's rows.
    #[inline(always)]
    pub(super) fn add<S: Simd>(&mut self, simd: S, block: &Block) {
        let room = self.len..self.len + BLOCK;
        let within: &mut [u8; BLOCK] = sized(&mut self.within[room.clone()]);
        for i in 0..BLOCK {
            within[i] = (block.y[i] << 4 | block.x[i] & 15) as u8;
        }
        let rows: &mut [Row; BLOCK] = sized(&mut self.rows[room.clone()]);
        let paints: &mut [Row; BLOCK] = sized(&mut self.paints[room.clone()]);
        let mut coverage = [0_u32; BLOCK];
        for i in 0..BLOCK {
            coverage[i] = block.coverage[i] as u32;
        }
        for start in (0..block.rows()).step_by(LANES) {
            let of = start..start + LANES;
            let row = [
                u32x16::from_slice(simd, &block.z[of.clone()]),
                i32x16::from_slice(simd, &block.dzdx[of.clone()]).bitcast(),
                i32x16::from_slice(simd, &block.dzdy[of.clone()]).bitcast(),
                u32x16::from_slice(simd, &coverage[of.clone()]),
            ];
            let paint = [
                f32x16::from_slice(simd, &block.r[of.clone()]).bitcast(),
                f32x16::from_slice(simd, &block.g[of.clone()]).bitcast(),
                f32x16::from_slice(simd, &block.b[of.clone()]).bitcast(),
                f32x16::from_slice(simd, &block.alpha[of.clone()]).bitcast(),
            ];
            for (to, words) in [(&mut *rows, row), (&mut *paints, paint)] {
                let to = to[of.clone()].as_flattened_mut();
                let parts = interleaved(simd, words);
                for i in 0..4 {
                    parts[i].store_slice(&mut to[LANES * i..][..LANES]);
                }
            }
        }
        self.primitives[room].copy_from_slice(&block.primitive[..]);
        self.len += block.rows();
    }

    /// Sorts the rows into lists.
    #[inline(always)]
    pub(super) fn arrange(&mut self) {
        let Window { len, within, rows, groups, .. } = self;
        groups.arrange(
            &within[..*len],
            #[inline(always)]
            |row| rows[row % ROOM][3] != 0,
            NOTHING,
        );
    }

    /// The words of sixteen rows.
    #[inline(always)]
    pub(super) fn rows<S: Simd>(&self, simd: S, numbers: &[u16; LANES]) -> [u32x16<S>; 4] {
        transposed(simd, numbers, &self.rows)
    }

    /// Their colours and alphas, as bits.
    #[inline(always)]
    pub(super) fn paints<S: Simd>(&self, simd: S, numbers: &[u16; LANES]) -> [u32x16<S>; 4] {
        transposed(simd, numbers, &self.paints)
    }

    /// Their primitives.
    #[inline(always)]
    pub(super) fn primitives<S: Simd>(&self, simd: S, numbers: &[u16; LANES]) -> u32x16<S> {
        let mut words = [0; LANES];
        for (word, number) in words.iter_mut().zip(numbers) {
            *word = self.primitives[usize::from(*number) % ROOM];
        }
        u32x16::from_slice(simd, &words)
    }
}

fn sized<T, const N: usize>(list: &mut [T]) -> &mut [T; N] {
    list.try_into().expect("of this length")
}

/// The first words of all four vectors, then the second ones, and so on.
#[inline(always)]
fn interleaved<S: Simd>(simd: S, [a, b, c, d]: [u32x16<S>; 4]) -> [u32x16<S>; 4] {
    let (even_low, even_high) = simd.interleave_u32x16(a, c);
    let (odd_low, odd_high) = simd.interleave_u32x16(b, d);
    let (first, second) = simd.interleave_u32x16(even_low, odd_low);
    let (third, fourth) = simd.interleave_u32x16(even_high, odd_high);
    [first, second, third, fourth]
}
