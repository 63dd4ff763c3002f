//! A tile's fragments as lists of its pixels, sixteen lists side by side.
//!
//! Fragments of different pixels do not know of each other, so that sixteen pixels can be
//! drawn at once, a fragment of each: a *round*. Pixels with lists of about the same length
//! are put together, so that few lanes are idle: of whole tiles 90 to 97 % are used.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, u32x16};

use crate::stochastic::fast::abreast::MOST_SAMPLES;
use screendoor_trace::tile::TILE_PIXELS;

/// Pixels that are drawn side by side.
pub(super) const LANES: usize = 16;
const GROUPS: usize = TILE_PIXELS / LANES;

/// A fragment as its round takes it: depth, slope to the right, slope downwards, coverage
/// with flags.
pub(super) type Row = [u32; 4];

/// Which pixels are drawn side by side, and where their fragments stand.
#[derive(Debug)]
pub(super) struct Lists {
    /// Pixels, those with the longest lists first.
    pixels: [u8; TILE_PIXELS],
    /// Where each group's slots start: a slot for each of its lanes and rounds.
    starts: [u32; GROUPS + 1],
    groups: usize,
    /// By pixel: how many fragments it has, then the slot of its next one.
    next: [u32; TILE_PIXELS],
    /// By slot.
    rows: Vec<Row>,
    /// By slot: the threshold, and the fragment's number in the order in which they were added.
    more: Vec<[u32; 2]>,
    sources: Vec<u32>,
}

impl Default for Lists {
    fn default() -> Self {
        Lists {
            pixels: [0; TILE_PIXELS],
            starts: [0; GROUPS + 1],
            groups: 0,
            next: [0; TILE_PIXELS],
            rows: Vec::new(),
            more: Vec::new(),
            sources: Vec::new(),
        }
    }
}

/// Sixteen pixels and their fragments.
#[derive(Clone, Copy)]
pub(super) struct Group<'a> {
    pub pixels: &'a [u8; LANES],
    pub rows: &'a [Row],
    pub more: &'a [[u32; 2]],
    pub sources: &'a [u32],
}

/// Counts fragments by pixel.
#[derive(Debug)]
pub(super) struct Counts([[u32; TILE_PIXELS]; 2]);

impl Counts {
    pub(super) fn new() -> Self {
        Counts([[0; TILE_PIXELS]; 2])
    }

    /// Counts rows in these places of the tile, but for those that cover nothing; tells how many.
    #[inline]
    pub(super) fn add(&mut self, within: &[u8], coverage: &[u32]) -> u64 {
        // In turn in two tables: neighbouring rows are of one pixel often enough, and the
        // second would wait for the first.
        let [even, odd] = &mut self.0;
        let (places, coverages) = (within.chunks_exact(2), coverage.chunks_exact(2));
        if let ([place], [coverage, ..]) = (places.remainder(), coverages.remainder()) {
            even[usize::from(*place)] += u32::from(*coverage != 0);
        }
        for (places, coverages) in places.zip(coverages) {
            even[usize::from(places[0])] += u32::from(coverages[0] != 0);
            odd[usize::from(places[1])] += u32::from(coverages[1] != 0);
        }
        coverage.iter().map(|coverage| u64::from(*coverage != 0)).sum()
    }
}

impl Lists {
    /// Makes room for so many fragments of each pixel.
    pub(super) fn arrange(&mut self, counts: &Counts, with_sources: bool) {
        let counts: [u32; TILE_PIXELS] = std::array::from_fn(|i| counts.0[0][i] + counts.0[1][i]);
        self.sort(&counts);
        let mut end = 0;
        self.groups = 0;
        for (g, pixels) in self.pixels.chunks_exact(LANES).enumerate() {
            let longest = counts[usize::from(pixels[0])];
            self.starts[g] = end;
            if longest == 0 {
                break;
            }
            for (lane, pixel) in pixels.iter().enumerate() {
                self.next[usize::from(*pixel)] = end + lane as u32;
            }
            // One round more: what covers nothing is put where the next should stand, which
            // may be behind the last.
            end += LANES as u32 * (longest + 1);
            self.groups = g + 1;
            self.starts[g + 1] = end;
        }
        // What covers nothing in pixels of no group goes behind all.
        for pixel in &self.pixels[self.groups * LANES..] {
            self.next[usize::from(*pixel)] = end;
        }
        let slots = end as usize + 1;
        if self.rows.len() < slots {
            self.rows.resize(slots, [0; 4]);
            self.more.resize(slots, [0; 2]);
        }
        if with_sources && self.sources.len() < slots {
            self.sources.resize(slots, 0);
        }
    }

    /// Sorts pixels by falling count: a counting sort, in which long lists are all one.
    fn sort(&mut self, counts: &[u32; TILE_PIXELS]) {
        const KINDS: usize = 256;
        let kind = |count: u32| KINDS - 1 - (count as usize).min(KINDS - 1);
        let mut places = [0_u16; KINDS];
        for count in counts {
            places[kind(*count)] += 1;
        }
        let mut end = 0;
        for place in &mut places {
            end += std::mem::replace(place, end);
        }
        for (pixel, count) in counts.iter().enumerate() {
            let place = &mut places[kind(*count)];
            self.pixels[usize::from(*place) % TILE_PIXELS] = pixel as u8;
            *place += 1;
        }
        // Among the long ones, the longest comes first of its group.
        let long = counts.iter().filter(|count| **count as usize >= KINDS - 1).count();
        self.pixels[..long]
            .sort_unstable_by_key(|pixel| (u32::MAX - counts[usize::from(*pixel)], *pixel));
    }

    /// Puts a fragment of the pixel at `within` behind its pixel's others.
    #[inline(always)]
    pub(super) fn put(&mut self, within: u8, row: Row, threshold: u32, who: u32) -> usize {
        let next = &mut self.next[usize::from(within)];
        let slot = *next as usize;
        *next += LANES as u32 * u32::from(row[3] & COVERED != 0);
        self.rows[slot] = row;
        self.more[slot] = [threshold, who];
        slot
    }

    /// The source of the fragment in a slot.
    #[inline(always)]
    pub(super) fn set_source(&mut self, slot: usize, source: u32) {
        self.sources[slot] = source;
    }

    /// Fills the shorter lists of each group with rows that cover nothing.
    pub(super) fn pad(&mut self) {
        for g in 0..self.groups {
            let end = (self.starts[g + 1] as usize) - LANES;
            for pixel in &self.pixels[g * LANES..][..LANES] {
                let first = self.next[usize::from(*pixel)] as usize;
                for slot in (first..end).step_by(LANES) {
                    self.rows[slot] = [0; 4];
                }
            }
        }
    }

    /// The groups.
    #[inline]
    pub(super) fn groups(&self) -> impl Iterator<Item = Group<'_>> {
        (0..self.groups).map(|g| {
            let [start, end] = [self.starts[g] as usize, self.starts[g + 1] as usize - LANES];
            let pixels = self.pixels[g * LANES..][..LANES].try_into().expect("sixteen");
            Group {
                pixels,
                rows: &self.rows[start..end],
                more: &self.more[start..end],
                sources: self.sources.get(start..end).unwrap_or_default(),
            }
        })
    }
}

/// The samples that a row's last word may name.
pub(super) const COVERED: u32 = (1 << MOST_SAMPLES) - 1;

/// The four words of sixteen rows.
#[inline(always)]
pub(super) fn words<S: Simd>(simd: S, rows: &[Row; LANES]) -> [u32x16<S>; 4] {
    let flat = rows.as_flattened();
    let part = |i: usize| u32x16::from_slice(simd, &flat[LANES * i..][..LANES]);
    let (even, odd) = simd.deinterleave_u32x16(part(0), part(1));
    let (later_even, later_odd) = simd.deinterleave_u32x16(part(2), part(3));
    let (first, third) = simd.deinterleave_u32x16(even, later_even);
    let (second, fourth) = simd.deinterleave_u32x16(odd, later_odd);
    [first, second, third, fourth]
}
