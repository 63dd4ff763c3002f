//! The loop over rounds.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, f64x2, i32x4, i32x16, mask32x16, u32x4, u32x16};

use crate::contract::event::Sum;
use crate::contract::frame::Frame;
use crate::lanes::{Count, Width};
use crate::resolve::box_filter;
use crate::stochastic::fast::abreast::lists::{COVERED, Group, LANES, Row, words};
use crate::stochastic::fast::abreast::met::words_of;
use crate::stochastic::fast::abreast::met::{Abreast, Counted, Met};
use crate::stochastic::fast::abreast::packed::{bit, packed, unpack};
use crate::stochastic::fast::abreast::window::{NOBODY, OPAQUE, STEEP, Window};
use crate::stochastic::fast::sampler::FastSampler;
use crate::stochastic::fast::state::{FastTile, SIGN};
use crate::stochastic::fast::tally::Tally;
use crate::stochastic::fast::twin::FastEngine;
#[cfg(test)]
use crate::stochastic::fast::twin::Flaw;
use crate::stochastic::methods::{Round, Sampler};
use screendoor_trace::picture::TilePixels;
use screendoor_trace::tile::TILE_PIXELS;
use screendoor_trace::trace::{Block, DepthPlane, MAX_SAMPLES, SampleMask, Unorm32};

/// Draws a window's fragments in a round of samples. Lanes hold one less than depths are: none
/// may be 0.
#[inline(always)]
pub(in crate::stochastic::fast) fn draw<S, F, A, P, const N: usize>(
    simd: S,
    engine: &FastEngine<F, N>,
    sampler: &A,
    round: Round,
    tile: &mut FastTile<F, N>,
    window: &mut Window,
    probe: &mut P,
) where
    S: Simd,
    F: FastSampler<N>,
    A: Abreast<N, Kept = F::State>,
    P: Sum,
    Count<N>: Width,
{
    let methods = &engine.plain.inner;
    window.arrange(sampler.source());
    let mut lengths = [0; MAX_SAMPLES as usize + 1];
    let mut tally = Tally::<P>::new(&mut lengths);
    if P::LISTENS {
        tally.fragments += window.fragments();
    }
    let frame = &methods.frame;
    let depths = Depths::<S, N>::of(simd, frame, engine.sampler.depth_bits());
    let several = !tile.sums.is_empty();
    for group in window.lists.groups() {
        let pixels = group.pixels;
        let mut held = Held::<S, N>::load(simd, tile, pixels);
        let mut lanes = sampler.load(simd, &round, &tile.states, pixels);
        let all = Rounds {
            #[cfg(test)]
            flaw: engine.flaw,
            sampler,
            round: &round,
            depths: &depths,
            several,
        };
        let occupied = all.draw(simd, group, &mut held, &mut lanes, &mut tally);
        held.store(tile, pixels);
        sampler.store(&lanes, &mut tile.states, pixels);
        colour(simd, &held.winner, tile, window, pixels);
        if several {
            for (pixel, set) in pixels.iter().zip(words_of(occupied)) {
                if let Some(sums) = &mut tile.sums[usize::from(*pixel)] {
                    sums.occupied |= SampleMask(unpack(set).into());
                }
            }
        }
    }
    tell(engine, &tally, probe);
}

/// The picture of a tile of which a window holds all fragments, in a single pass of samples;
/// `states` are its pixels' before the first.
#[inline(always)]
pub(in crate::stochastic::fast) fn picture<S, F, A, P, const N: usize>(
    simd: S,
    engine: &FastEngine<F, N>,
    sampler: &A,
    round: Round,
    states: &mut [F::State; TILE_PIXELS],
    window: &mut Window,
    probe: &mut P,
) -> TilePixels
where
    S: Simd,
    F: FastSampler<N>,
    A: Abreast<N, Kept = F::State>,
    P: Sum,
    Count<N>: Width,
{
    let methods = &engine.plain.inner;
    let frame = &methods.frame;
    window.arrange(sampler.source());
    window.set_background(frame.background);
    let mut lengths = [0; MAX_SAMPLES as usize + 1];
    let mut tally = Tally::<P>::new(&mut lengths);
    if P::LISTENS {
        tally.fragments += window.fragments();
    }
    let depths = Depths::<S, N>::of(simd, frame, engine.sampler.depth_bits());
    let mut pixels = Box::new([frame.background.map(f64::from); TILE_PIXELS]);
    for group in window.lists.groups() {
        let mut held = Held::<S, N>::cleared(simd);
        let mut lanes = sampler.load(simd, &round, states, group.pixels);
        let all = Rounds {
            #[cfg(test)]
            flaw: engine.flaw,
            sampler,
            round: &round,
            depths: &depths,
            several: false,
        };
        all.draw(simd, group, &mut held, &mut lanes, &mut tally);
        let mut winners = [[0; LANES]; N];
        for s in 0..N {
            held.winner[s].store_slice(&mut winners[s]);
        }
        if <F::Plain as Sampler<N>>::CORRECTS {
            sampler.store(&lanes, states, group.pixels);
        }
        for (lane, pixel) in group.pixels.iter().enumerate() {
            let within = usize::from(*pixel);
            let mut mean = mean(simd, window, &winners, lane);
            if <F::Plain as Sampler<N>>::CORRECTS {
                let excess = engine.sampler.excess(&methods.sampler, &states[within]);
                for (mean, excess) in mean.iter_mut().zip(excess) {
                    *mean -= excess;
                }
            }
            pixels[within] = mean;
        }
    }
    tell(engine, &tally, probe);
    pixels
}

/// [`box_filter`] of the colours of a pixel's winners.
#[inline(always)]
fn mean<S: Simd, const N: usize>(
    simd: S,
    window: &Window,
    winners: &[[u32; LANES]; N],
    lane: usize,
) -> [f64; 3] {
    let colour = |s: usize| f32x4::from_slice(simd, window.colour(winners[s][lane]));
    let first = colour(0);
    let (mut sum, mut others) = (f32x4::splat(simd, 0.0), u32x4::splat(simd, 0));
    for s in 0..N {
        let colour = colour(s);
        others |= colour.bitcast::<u32x4<S>>() ^ first.bitcast::<u32x4<S>>();
        sum += colour;
    }
    let mean = sum / N as f32;
    // Sums of finite colours that are too large.
    if !mean.is_finite().all_true() {
        return slow_mean(window, winners, lane);
    }
    let same = others.simd_eq(u32x4::splat(simd, 0)).all_true();
    let mean = if same { first } else { mean };
    let mut channels = [0.0; 4];
    mean.store_slice(&mut channels);
    [channels[0], channels[1], channels[2]].map(f64::from)
}

#[cold]
#[inline(never)]
fn slow_mean<const N: usize>(
    window: &Window,
    winners: &[[u32; LANES]; N],
    lane: usize,
) -> [f64; 3] {
    let colours: [[f32; 3]; N] = std::array::from_fn(|s| {
        let [r, g, b, _] = *window.colour(winners[s][lane]);
        [r, g, b]
    });
    box_filter(&colours)
}

/// Tells what was counted.
fn tell<F: FastSampler<N>, P: Sum, const N: usize>(
    engine: &FastEngine<F, N>,
    tally: &Tally<'_, P>,
    probe: &mut P,
) where
    Count<N>: Width,
{
    if P::LISTENS {
        let methods = &engine.plain.inner;
        let depth_bits = engine.sampler.depth_bits();
        probe.many(&tally.events(depth_bits, methods.sample_bits(), methods.sampler.state_bits()));
    }
}

/// What all rounds have in common.
struct Rounds<'a, S: Simd, A, const N: usize> {
    #[cfg(test)]
    flaw: Option<Flaw>,
    sampler: &'a A,
    round: &'a Round,
    depths: &'a Depths<'a, S, N>,
    /// Whether the samples that were written are asked for.
    several: bool,
}

impl<S: Simd, A: Abreast<N>, const N: usize> Rounds<'_, S, A, N> {
    /// Draws a group's fragments; the samples that were written.
    #[inline(always)]
    fn draw<P: Sum>(
        &self,
        simd: S,
        group: Group<'_>,
        held: &mut Held<S, N>,
        lanes: &mut A::Lanes<S>,
        tally: &mut Tally<'_, P>,
    ) -> u32x16<S> {
        let mut counted = Counted::<S, P>::new(simd);
        let mut occupied = u32x16::splat(simd, 0);
        for (number, rows) in group.rows.as_chunks::<LANES>().0.iter().enumerate() {
            let step = Step { group, rows, number };
            let drawn = self.step(simd, held, &step, lanes, &mut counted);
            #[cfg(test)]
            let drawn = flawed(simd, self.flaw, drawn);
            held.write(&drawn);
            if P::LISTENS || self.several {
                let written = drawn.set(simd);
                counted.samples(drawn.coverage, drawn.passed, written);
                occupied |= written;
            }
            counted.next_round(tally);
        }
        counted.tell(tally);
        occupied
    }

    /// Draws a fragment of each pixel.
    #[inline(always)]
    fn step<P: Sum>(
        &self,
        simd: S,
        held: &Held<S, N>,
        step: &Step<'_>,
        lanes: &mut A::Lanes<S>,
        counted: &mut Counted<S, P>,
    ) -> Drawn<S, N> {
        let word = |word: u32| u32x16::splat(simd, word);
        let none = word(0);
        let [z, across, down, last] = words(simd, step.rows);
        let z = self.depths.at(simd, [z, across, down, last], step.rows);
        let mut passes = [none.simd_gt(none); N];
        let mut keys = [i32x16::splat(simd, i32::MAX); N];
        let mut passed = none;
        for i in 0..N {
            let covers = (last & word(1 << i)).simd_gt(none);
            passes[i] = covers & !z[i].simd_gt(held.depth[i]);
            keys[i] = passes[i].select(held.depth[i], keys[i]);
            passed = passes[i].select(passed | word(bit(i)), passed);
        }
        let first = step.number * LANES;
        let source = match step.group.sources.get(first..first + LANES) {
            Some(sources) => u32x16::from_slice(simd, sources),
            None => none,
        };
        let [threshold, who] = pairs(simd, &step.group.more[first..first + LANES]);
        let met = Met {
            round: self.round,
            passed,
            coverage: packed::<S, N>(simd, last & word(COVERED)),
            stored: &held.depth,
            keys: &keys,
            passes: &passes,
            threshold,
            opaque: (last & word(OPAQUE)).simd_gt(none),
            source,
        };
        let written = self.sampler.choose(simd, lanes, &met, counted);
        let coverage = met.coverage;
        Drawn { z, who, coverage, passed, written }
    }
}

/// Adds a block's rows to a window: [`Window::add`].
#[inline(always)]
pub(in crate::stochastic::fast) fn add<S, F, A, const N: usize>(
    simd: S,
    engine: &FastEngine<F, N>,
    sampler: &A,
    window: &mut Window,
    block: &Block,
) -> Option<usize>
where
    S: Simd,
    F: FastSampler<N>,
    A: Abreast<N, Kept = F::State>,
    Count<N>: Width,
{
    window.add::<S, N>(simd, &engine.plain.inner.frame, block, sampler.source())
}

/// What a group's samples hold, in lanes of pixels.
struct Held<S: Simd, const N: usize> {
    /// One less than they are, their upper bit flipped.
    depth: [i32x16<S>; N],
    /// The fragments that were written last, or [`NOBODY`].
    winner: [u32x16<S>; N],
}

/// A round of a group.
struct Step<'a> {
    group: Group<'a>,
    rows: &'a [Row; LANES],
    number: usize,
}

impl<S: Simd, const N: usize> Held<S, N>
where
    Count<N>: Width,
{
    #[inline(always)]
    fn load<F: FastSampler<N>>(simd: S, tile: &FastTile<F, N>, pixels: &[u8; LANES]) -> Self {
        let mut words = [[0; LANES]; N];
        for (lane, pixel) in pixels.iter().enumerate() {
            let depths = tile.held[usize::from(*pixel)].depth.as_ref();
            for (row, depth) in words.iter_mut().zip(depths) {
                row[lane] = depth.wrapping_sub(1);
            }
        }
        let mut depth = [i32x16::splat(simd, 0); N];
        for i in 0..N {
            depth[i] = i32x16::from_slice(simd, &words[i]);
        }
        Held { depth, winner: [u32x16::splat(simd, NOBODY); N] }
    }

    #[inline(always)]
    fn store<F: FastSampler<N>>(&self, tile: &mut FastTile<F, N>, pixels: &[u8; LANES]) {
        let mut words = [[0; LANES]; N];
        for i in 0..N {
            self.depth[i].store_slice(&mut words[i]);
        }
        for (lane, pixel) in pixels.iter().enumerate() {
            let depths = tile.held[usize::from(*pixel)].depth.as_mut();
            for (row, depth) in words.iter().zip(depths) {
                *depth = row[lane].wrapping_add(1);
            }
        }
    }
}

impl<S: Simd, const N: usize> Held<S, N> {
    /// Samples that nothing was written to.
    #[inline(always)]
    fn cleared(simd: S) -> Self {
        let far = ((Unorm32::FAR.0 ^ SIGN) as i32).wrapping_sub(1);
        Held { depth: [i32x16::splat(simd, far); N], winner: [u32x16::splat(simd, NOBODY); N] }
    }

    #[inline(always)]
    fn write(&mut self, drawn: &Drawn<S, N>) {
        for i in 0..N {
            self.depth[i] = drawn.written[i].select(drawn.z[i], self.depth[i]);
            self.winner[i] = drawn.written[i].select(drawn.who, self.winner[i]);
        }
    }
}

/// The words of sixteen pairs.
#[inline(always)]
fn pairs<S: Simd>(simd: S, pairs: &[[u32; 2]]) -> [u32x16<S>; 2] {
    let flat = pairs.as_flattened();
    let part = |i: usize| u32x16::from_slice(simd, &flat[LANES * i..][..LANES]);
    simd.deinterleave_u32x16(part(0), part(1)).into()
}

/// What came of a round.
struct Drawn<S: Simd, const N: usize> {
    z: [i32x16<S>; N],
    who: u32x16<S>,
    coverage: u32x16<S>,
    passed: u32x16<S>,
    written: [mask32x16<S>; N],
}

impl<S: Simd, const N: usize> Drawn<S, N> {
    /// The samples that were written.
    #[inline(always)]
    fn set(&self, simd: S) -> u32x16<S> {
        let mut set = u32x16::splat(simd, 0);
        for i in 0..N {
            set = self.written[i].select(set | u32x16::splat(simd, bit(i)), set);
        }
        set
    }
}

/// Where samples lie, and how wide depths are.
struct Depths<'a, S: Simd, const N: usize> {
    offsets: [[i32x16<S>; 2]; N],
    /// Whether a sample lies at the centre.
    central: [bool; N],
    frame: &'a Frame,
    bits: u32,
}

impl<'a, S: Simd, const N: usize> Depths<'a, S, N> {
    #[inline(always)]
    fn of(simd: S, frame: &'a Frame, bits: u32) -> Self {
        let mut offsets = [[i32x16::splat(simd, 0); 2]; N];
        let mut central = [false; N];
        for i in 0..N {
            let position = frame.positions[i];
            offsets[i] = position.map(|p| i32x16::splat(simd, p.into()));
            central[i] = position == [0, 0];
        }
        Depths { offsets, central, frame, bits }
    }

    /// Depths of rows at each sample, one less, their upper bit flipped.
    #[inline(always)]
    fn at(&self, simd: S, row: [u32x16<S>; 4], rows: &[Row; LANES]) -> [i32x16<S>; N] {
        let signed = |word: u32x16<S>| word.bitcast::<i32x16<S>>();
        let [z, across, down] = [row[0], row[1], row[2]].map(signed);
        let mut depths = [z; N];
        for i in 0..N {
            if i > 0 || !self.central[i] {
                let [x, y] = self.offsets[i];
                depths[i] = z + ((across * x + down * y) >> 4);
            }
        }
        if i32x16::splat(simd, 0).simd_gt(signed(row[3])).any_true() {
            let mut words = [[0; LANES]; N];
            for i in 0..N {
                depths[i].store_slice(&mut words[i]);
            }
            self.correct(rows, &mut words);
            for i in 0..N {
                depths[i] = i32x16::from_slice(simd, &words[i]);
            }
        }
        if self.bits < 32 {
            let one = i32x16::splat(simd, 1);
            let narrow = i32x16::splat(simd, ((1_u64 << (32 - self.bits)) - 1) as i32);
            for i in 0..N {
                depths[i] = ((depths[i] + one) | narrow) - one;
            }
        }
        depths
    }

    /// Depths of steep planes, and of those near an end of the range.
    #[cold]
    #[inline(never)]
    fn correct(&self, rows: &[Row; LANES], words: &mut [[i32; LANES]; N]) {
        for (lane, row) in rows.iter().enumerate().filter(|(_, row)| row[3] & STEEP != 0) {
            let z = Unorm32(row[0].wrapping_add(1) ^ SIGN);
            let plane = DepthPlane { z, dzdx: row[1] as i32, dzdy: row[2] as i32 };
            for (i, words) in words.iter_mut().enumerate() {
                let depth = plane.at(self.frame.positions[i]);
                words[lane] = ((depth.0 ^ SIGN) as i32).wrapping_sub(1);
            }
        }
    }
}

/// Gives samples the colours of the fragments that they were written by.
#[inline(always)]
fn colour<S: Simd, F: FastSampler<N>, const N: usize>(
    simd: S,
    winner: &[u32x16<S>; N],
    tile: &mut FastTile<F, N>,
    window: &Window,
    pixels: &[u8; LANES],
) where
    Count<N>: Width,
{
    let mut winners = [[0; LANES]; N];
    for s in 0..N {
        winner[s].store_slice(&mut winners[s]);
    }
    for (lane, pixel) in pixels.iter().enumerate() {
        let colours = &mut tile.held[usize::from(*pixel)].colour;
        if N < 4 {
            for s in 0..N {
                if winners[s][lane] != NOBODY {
                    let colour = window.colour(winners[s][lane]);
                    for (row, channel) in colours.iter_mut().zip(colour) {
                        row.as_mut()[s] = channel.to_bits() as i32;
                    }
                }
            }
            continue;
        }
        for s in (0..N).step_by(4) {
            let who = [0, 1, 2, 3].map(
                #[inline(always)]
                |i| winners[s + i][lane],
            );
            let written = u32x4::simd_from(simd, who).simd_ne(u32x4::splat(simd, NOBODY));
            if written.any_true() {
                let channels = four(simd, window, who);
                for (row, new) in colours.iter_mut().zip(channels) {
                    let row: &mut [i32] = &mut row.as_mut()[s..s + 4];
                    written.select(new, i32x4::from_slice(simd, row)).store_slice(row);
                }
            }
        }
    }
}

/// Red, green and blue of four fragments.
#[inline(always)]
fn four<S: Simd>(simd: S, window: &Window, who: [u32; 4]) -> [i32x4<S>; 3] {
    let colour = |i: usize| f32x4::from_slice(simd, window.colour(who[i]));
    let [a, b, c, d] = [colour(0), colour(1), colour(2), colour(3)];
    let pairs = |x: f32x4<S>, y: f32x4<S>| {
        [x.zip_low(y), x.zip_high(y)].map(|pair| pair.bitcast::<f64x2<S>>())
    };
    let ([rg, b_], [rg_later, b_later]) = (pairs(a, b), pairs(c, d));
    [rg.zip_low(rg_later), rg.zip_high(rg_later), b_.zip_low(b_later)]
        .map(|channel| channel.bitcast::<i32x4<S>>())
}

/// What is written, with the lane's defect.
#[cfg(test)]
fn flawed<S: Simd, const N: usize>(
    simd: S,
    flaw: Option<Flaw>,
    mut drawn: Drawn<S, N>,
) -> Drawn<S, N> {
    match flaw {
        Some(Flaw::Depth(lane)) => drawn.z[lane] ^= i32x16::splat(simd, 1),
        Some(Flaw::Choice(lane)) => {
            let mine =
                (drawn.passed & u32x16::splat(simd, bit(lane))).simd_gt(u32x16::splat(simd, 0));
            drawn.written[lane] ^= mine;
        }
        None => {}
    }
    drawn
}
