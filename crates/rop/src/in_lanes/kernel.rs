//! The loop over rounds.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, u32x16};

use crate::contract::event::Sum;
use crate::in_lanes::groups::Group;
use crate::in_lanes::window::Window;
use crate::in_lanes::{InLanes, LANES, Met, Told, Wide};
use screendoor_trace::picture::TilePixels;
use screendoor_trace::tile::{TILE_PIXELS, TILE_SIDE};

/// What is drawn to a tile.
pub(super) struct Drawing<'a, D> {
    pub design: &'a D,
    /// The passes that are drawn, one after the other.
    pub passes: Range<u32>,
    /// Column and row of the tile's first pixel.
    pub corner: [u32; 2],
    /// Whether fragments are told of here.
    pub tells_fragments: bool,
}

impl<D: InLanes> Drawing<'_, D> {
    /// Draws a window's fragments to pixels.
    #[inline(always)]
    pub(super) fn draw<S: Simd, P: Sum>(
        &self,
        simd: S,
        states: &mut [D::State; TILE_PIXELS],
        window: &mut Window,
        probe: &mut P,
    ) {
        window.arrange();
        let mut lanes = self.design.clear(simd);
        for group in window.groups.iter() {
            self.design.load(simd, &mut lanes, states, group.pixels);
            self.rounds(simd, window, group, &mut lanes, probe);
            self.design.store(&lanes, states, group.pixels);
        }
    }

    /// The pictures of cleared pixels that a window's fragments are drawn to; `bare` are the
    /// others'.
    #[inline(always)]
    pub(super) fn picture<S: Simd, P: Sum>(
        &self,
        simd: S,
        window: &mut Window,
        behind: &[[f32; 3]],
        bare: TilePixels,
        probe: &mut P,
    ) -> TilePixels {
        window.arrange();
        let mut pixels = bare;
        let mut lanes = self.design.clear(simd);
        let behind: Vec<_> = behind.iter().map(|c| c.map(|c| f32x16::splat(simd, c))).collect();
        for group in window.groups.iter() {
            self.design.clear_again(simd, &mut lanes);
            self.rounds(simd, window, group, &mut lanes, probe);
            let colours = self.design.resolve(simd, &lanes, &behind);
            scatter(colours, group.pixels, &mut pixels);
        }
        pixels
    }

    /// Draws a group's fragments.
    #[inline(always)]
    fn rounds<S: Simd, P: Sum>(
        &self,
        simd: S,
        window: &Window,
        group: Group<'_>,
        lanes: &mut D::Lanes<S>,
        probe: &mut P,
    ) {
        let mut told = Told::<S, P>::new(simd);
        let mut pixel = [0; LANES];
        for (to, within) in pixel.iter_mut().zip(group.pixels) {
            let [x, y] = [u32::from(*within) % SIDE, u32::from(*within) / SIDE];
            *to = (self.corner[0] + x) | (self.corner[1] + y) << 16;
        }
        let pixel = u32x16::from_slice(simd, &pixel);
        for pass in self.passes.clone() {
            for numbers in group.rounds {
                let met = Met::of(simd, window, numbers, pixel);
                if self.tells_fragments {
                    told.fragments(met.any);
                }
                self.design.draw(simd, lanes, pass, &met, &mut told);
            }
        }
        if P::LISTENS {
            probe.many(&told.events());
        }
    }
}

const SIDE: u32 = TILE_SIDE as u32;

/// The colours of all of a tile's pixels; `behind` gives a pixel's samples.
#[inline(always)]
pub(super) fn resolve<'b, S: Simd, D: InLanes>(
    simd: S,
    design: &D,
    states: &[D::State; TILE_PIXELS],
    samples: usize,
    behind: impl Fn(usize) -> &'b [[f32; 3]],
) -> TilePixels {
    let mut pixels = Box::new([[0.0; 3]; TILE_PIXELS]);
    let mut lanes = design.clear(simd);
    let mut words = vec![[[0.0_f32; LANES]; 3]; samples];
    for first in (0..TILE_PIXELS).step_by(LANES) {
        let group: [u8; LANES] = std::array::from_fn(|i| (first + i) as u8);
        design.load(simd, &mut lanes, states, &group);
        for (lane, within) in group.iter().enumerate() {
            for (words, colour) in words.iter_mut().zip(behind(usize::from(*within))) {
                for (words, c) in words.iter_mut().zip(colour) {
                    words[lane] = *c;
                }
            }
        }
        let vectors = |words: &[[f32; LANES]; 3]| words.map(|w| f32x16::from_slice(simd, &w));
        let behind: Vec<_> = words.iter().map(vectors).collect();
        scatter(design.resolve(simd, &lanes, &behind), &group, &mut pixels);
    }
    pixels
}

/// Puts lanes' colours to their pixels.
#[inline(always)]
fn scatter<S: Simd>(colours: [Wide<S>; 3], pixels: &[u8; LANES], to: &mut [[f64; 3]; TILE_PIXELS]) {
    let mut words = [[0.0; LANES]; 3];
    for (words, colour) in words.iter_mut().zip(colours) {
        for (words, half) in words.chunks_exact_mut(LANES / 2).zip(colour) {
            half.store_slice(words);
        }
    }
    for (lane, within) in pixels.iter().enumerate() {
        to[usize::from(*within)] = [0, 1, 2].map(|c| words[c][lane]);
    }
}
