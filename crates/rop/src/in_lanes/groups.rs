//! A tile's fragments as lists of its pixels, sixteen lists side by side.
//!
//! Pixels with lists of about the same length are put together, so that few lanes are idle.

use screendoor_trace::tile::TILE_PIXELS;

use crate::in_lanes::LANES;

const GROUPS: usize = TILE_PIXELS / LANES;

/// Which pixels are drawn side by side, and which row each of them draws in which round.
#[derive(Debug)]
pub(super) struct Groups {
    /// Pixels, those with the longest lists first.
    pixels: [u8; TILE_PIXELS],
    /// Where each group's slots start: a slot for each of its lanes and rounds.
    starts: [u32; GROUPS + 1],
    count: usize,
    /// By slot: a row's number.
    slots: Vec<u16>,
}

/// Sixteen pixels and their rows, round by round.
#[derive(Clone, Copy)]
pub(super) struct Group<'a> {
    pub pixels: &'a [u8; LANES],
    pub rounds: &'a [[u16; LANES]],
}

impl Groups {
    pub(super) fn new() -> Self {
        Groups {
            pixels: std::array::from_fn(|i| i as u8),
            starts: [0; GROUPS + 1],
            count: 0,
            slots: Vec::new(),
        }
    }

    /// Sorts rows by the pixels at `within`, whose order in each pixel stays; those that cover
    /// nothing are none. `nothing` is the number of a row that covers nothing.
    #[inline(always)]
    pub(super) fn arrange(&mut self, within: &[u8], covers: impl Fn(usize) -> bool, nothing: u16) {
        let mut counts = [0_u32; TILE_PIXELS];
        for (row, pixel) in within.iter().enumerate() {
            counts[usize::from(*pixel)] += u32::from(covers(row));
        }
        self.pixels = std::array::from_fn(|i| i as u8);
        self.pixels.sort_by_key(|pixel| std::cmp::Reverse(counts[usize::from(*pixel)]));
        let mut next = [0; TILE_PIXELS];
        let mut end = 0;
        self.count = 0;
        for (g, pixels) in self.pixels.chunks_exact(LANES).enumerate() {
            self.starts[g] = end;
            let longest = counts[usize::from(pixels[0])];
            if longest > 0 {
                for (lane, pixel) in pixels.iter().enumerate() {
                    next[usize::from(*pixel)] = end + lane as u32;
                }
                // What covers nothing is put where the next should stand, which may be behind the
                // last: there is room for one round more.
                end += LANES as u32 * (longest + 1);
                self.count = g + 1;
                self.starts[g + 1] = end;
            } else {
                pixels.iter().for_each(|pixel| next[usize::from(*pixel)] = end);
            }
        }
        self.slots.clear();
        self.slots.resize(end as usize + LANES, nothing);
        for (row, pixel) in within.iter().enumerate() {
            let slot = &mut next[usize::from(*pixel)];
            self.slots[*slot as usize] = row as u16;
            *slot += LANES as u32 * u32::from(covers(row));
        }
    }

    /// The groups of which a fragment touches a pixel.
    pub(super) fn iter(&self) -> impl Iterator<Item = Group<'_>> {
        (0..self.count).map(|g| {
            let [start, end] = [self.starts[g] as usize, self.starts[g + 1] as usize - LANES];
            let pixels = self.pixels[g * LANES..][..LANES].try_into().expect("sixteen");
            Group { pixels, rounds: self.slots[start..end].as_chunks().0 }
        })
    }
}
