//! Fragments of a tile that are drawn together.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, i32x16, u32x16};

use crate::contract::frame::Frame;
use crate::stochastic::fast::abreast::MOST_ROWS;
use crate::stochastic::fast::abreast::lists::{COVERED, Counts, LANES, Lists, Row};
use crate::stochastic::fast::abreast::met::Source;
use crate::stochastic::fast::state::boxed;
use screendoor_trace::trace::{BLOCK, Block};

/// In a row's last word: depths do not follow from 32 bits.
pub(super) const STEEP: u32 = 1 << 31;
/// In a row's last word: the threshold is 2^32.
pub(super) const OPAQUE: u32 = 1 << 30;

/// Red, green, blue and nothing.
pub(super) type Colour = [f32; 4];

/// In place of a fragment: a sample that none has been written to.
pub(super) const NOBODY: u32 = MOST_ROWS as u32;

/// Fragments of a tile that are drawn together. It is filled again and again: memory that has
/// been touched is cheaper than fresh memory.
#[derive(Debug)]
pub(in crate::stochastic::fast) struct Window {
    len: usize,
    /// How many of the rows cover a sample.
    fragments: u64,
    counts: Counts,
    within: Vec<u8>,
    rows: Vec<Row>,
    thresholds: Vec<u32>,
    /// Empty where nobody asks.
    sources: Vec<u32>,
    /// By fragment; behind them [`NOBODY`]'s.
    colours: Box<[Colour; 2 * MOST_ROWS]>,
    pub(super) lists: Lists,
}

impl Window {
    pub(in crate::stochastic::fast) fn new() -> Self {
        Window {
            len: 0,
            fragments: 0,
            counts: Counts::new(),
            within: vec![0; MOST_ROWS],
            rows: vec![[0; 4]; MOST_ROWS],
            thresholds: vec![0; MOST_ROWS],
            sources: Vec::new(),
            colours: boxed(vec![[0.0; 4]; 2 * MOST_ROWS]),
            lists: Lists::default(),
        }
    }

    /// Forgets what it holds.
    pub(in crate::stochastic::fast) fn clear(&mut self) {
        (self.len, self.fragments) = (0, 0);
        self.counts = Counts::new();
    }

    /// Whether it holds no row.
    pub(in crate::stochastic::fast) fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Whether there is room for another block.
    pub(in crate::stochastic::fast) fn has_room(&self) -> bool {
        self.len + BLOCK <= MOST_ROWS
    }

    /// How many rows cover a sample.
    pub(super) fn fragments(&self) -> u64 {
        self.fragments
    }

    /// The colour of a fragment, or of [`NOBODY`].
    #[inline(always)]
    pub(super) fn colour(&self, who: u32) -> &Colour {
        &self.colours[who as usize % (2 * MOST_ROWS)]
    }

    /// Sets the colour of [`NOBODY`].
    pub(super) fn set_background(&mut self, [r, g, b]: [f32; 3]) {
        self.colours[NOBODY as usize] = [r, g, b, 0.0];
    }

    /// Adds a block's rows up to one, if there is any, that reaches the near end of the depth
    /// range at a sample that it covers; tells which.
    #[inline(always)]
    pub(super) fn add<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        frame: &Frame,
        block: &Block,
        source: Source,
    ) -> Option<usize> {
        let room = self.len..self.len + BLOCK;
        let within: &mut [u8; BLOCK] = sized(&mut self.within[room.clone()]);
        for i in 0..BLOCK {
            within[i] = (block.y[i] << 4 | block.x[i] & 15) as u8;
        }
        let mut coverage = [0; BLOCK];
        for i in 0..BLOCK {
            coverage[i] = block.coverage[i] as u32 & COVERED;
        }
        thresholds(simd, block, sized(&mut self.thresholds[room.clone()]));
        let mut end = block.rows();
        let rows: &mut [Row; BLOCK] = sized(&mut self.rows[room.clone()]);
        for start in (0..block.rows()).step_by(LANES) {
            let of = start..start + LANES;
            let steep = sixteen(simd, block, &coverage, of.clone(), sized(&mut rows[of]));
            if steep != 0
                && let Some(near) = first_near::<N>(frame, block, start, steep)
            {
                end = near;
                break;
            }
        }
        let colours: &mut [Colour; BLOCK] = sized(&mut self.colours[room.clone()]);
        for i in 0..BLOCK {
            colours[i] = [block.r[i], block.g[i], block.b[i], 0.0];
        }
        if source != Source::Nothing {
            self.sources.resize(MOST_ROWS, 0);
            self.sources[room.clone()].copy_from_slice(match source {
                Source::Primitive | Source::Nothing => &block.primitive[..BLOCK],
                Source::Object => &block.object[..BLOCK],
                Source::Depth => &block.z[..BLOCK],
            });
        }
        self.fragments += self.counts.add(&within[..end], &coverage[..end]);
        self.len += end;
        (end < block.rows()).then_some(end)
    }

    /// Puts the fragments into lists, sixteen pixels side by side.
    #[inline(always)]
    pub(super) fn arrange(&mut self, source: Source) {
        let Window { len, counts, lists, .. } = self;
        lists.arrange(counts, source != Source::Nothing);
        let columns = self.within[..*len].iter().zip(&self.rows).zip(&self.thresholds);
        for (who, ((within, row), threshold)) in columns.enumerate() {
            let slot = lists.put(*within, *row, *threshold, who as u32);
            if source != Source::Nothing {
                lists.set_source(slot, self.sources[who]);
            }
        }
        lists.pad();
    }
}

fn sized<T, const N: usize>(list: &mut [T]) -> &mut [T; N] {
    list.try_into().expect("of this length")
}

/// [`Threshold`](crate::Threshold)s modulo 2^32.
#[inline(always)]
fn thresholds<S: Simd>(simd: S, block: &Block, to: &mut [u32; BLOCK]) {
    let (alphas, list) =
        (block.alpha[..BLOCK].as_chunks::<LANES>().0, to.as_chunks_mut::<LANES>().0);
    for (alphas, list) in alphas.iter().zip(list) {
        let alpha = f32x16::from_slice(simd, alphas);
        // A product by a power of two is exact, and what is beyond 2^23 is whole.
        let limit = simd.cvt_u32_precise_f32x16((alpha * 4_294_967_296.0).ceil());
        let whole = alpha.simd_lt(f32x16::splat(simd, 1.0));
        whole.select(limit, u32x16::splat(simd, 0)).store_slice(list);
    }
}

/// Sixteen rows as lists take them; tells which are steep.
#[inline(always)]
fn sixteen<S: Simd>(
    simd: S,
    block: &Block,
    coverage: &[u32; BLOCK],
    of: Range<usize>,
    rows: &mut [Row; LANES],
) -> u64 {
    let word = |word: u32| u32x16::splat(simd, word);
    let signed = |list: &[i32]| i32x16::from_slice(simd, list).bitcast::<u32x16<S>>();
    let z = u32x16::from_slice(simd, &block.z[of.clone()]);
    let across = signed(&block.dzdx[of.clone()]);
    let down = signed(&block.dzdy[of.clone()]);
    let alpha = f32x16::from_slice(simd, &block.alpha[of.clone()]);
    let coverage = u32x16::from_slice(simd, &coverage[of]);
    let opaque = alpha.simd_ge(f32x16::splat(simd, 1.0));
    let size = |x: u32x16<S>| {
        let negative = x.bitcast::<i32x16<S>>().simd_lt(i32x16::splat(simd, 0));
        negative.select(word(0) - x, x)
    };
    let (wide, high) = (size(across), size(down));
    // Samples lie at most half a pixel from the centre, along each axis.
    let reach = ((wide + high) >> 1) + word(3);
    let steep = (wide | high).simd_ge(word(1 << 27)) | z.simd_lt(reach) | (z + reach).simd_lt(z);
    let last = steep.select(coverage | word(STEEP), coverage);
    let last = opaque.select(last | word(OPAQUE), last);
    // One less, the upper bit flipped.
    let z = (z ^ word(1 << 31)) - word(1);
    let (even_low, even_high) = simd.interleave_u32x16(z, down);
    let (odd_low, odd_high) = simd.interleave_u32x16(across, last);
    let flat = rows.as_flattened_mut();
    for (part, (even, odd)) in [(even_low, odd_low), (even_high, odd_high)].into_iter().enumerate()
    {
        let (first, second) = simd.interleave_u32x16(even, odd);
        first.store_slice(&mut flat[32 * part..][..16]);
        second.store_slice(&mut flat[32 * part + 16..][..16]);
    }
    steep.to_bitmask()
}

/// The first of the steep rows, of sixteen, whose depth is 0 at a sample that it covers.
#[cold]
#[inline(never)]
fn first_near<const N: usize>(
    frame: &Frame,
    block: &Block,
    start: usize,
    steep: u64,
) -> Option<usize> {
    let rows =
        (start..block.rows().min(start + LANES)).filter(|row| steep >> (row - start) & 1 == 1);
    let near = |row: &usize| {
        let fragment = block.fragment(*row);
        let depths = frame.depths::<N>(&fragment, 32);
        fragment.coverage.iter().any(|s| depths[s].0 == 0)
    };
    rows.into_iter().find(near)
}
