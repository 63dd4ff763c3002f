//! The loop over rounds.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, i32x16, u32x16};

use crate::contract::event::Sum;
use crate::in_lanes::words as words_of;
use crate::lanes::{Count, Width};
use crate::stochastic::fast::abreast::colours::{colour, mean, sixteen};
use crate::stochastic::fast::abreast::depths::Depths;
#[cfg(test)]
use crate::stochastic::fast::abreast::held::flawed;
use crate::stochastic::fast::abreast::held::{Drawn, Held};
use crate::stochastic::fast::abreast::lists::{COVERED, Group, LANES, words};
use crate::stochastic::fast::abreast::met::{Abreast, Counted, Met};
use crate::stochastic::fast::abreast::packed::{bit, packed, unpack};
use crate::stochastic::fast::abreast::window::{OPAQUE, Window};
use crate::stochastic::fast::sampler::FastSampler;
use crate::stochastic::fast::state::FastTile;
use crate::stochastic::fast::tally::Tally;
use crate::stochastic::fast::twin::FastEngine;
use crate::stochastic::methods::{Round, Sampler};
use screendoor_trace::picture::TilePixels;
use screendoor_trace::tile::TILE_PIXELS;
use screendoor_trace::trace::{Block, MAX_SAMPLES, SampleMask};

/// Draws a window's fragments in a round of samples. Lanes hold one less than depths are: none
/// may be 0.
#[inline(always)]
pub(in crate::stochastic::fast) fn draw<S, F, P, const N: usize>(
    simd: S,
    engine: &FastEngine<F, N>,
    (sampler, round): (&F::Abreast, Round),
    tile: &mut FastTile<F, N>,
    window: &mut Window,
    probe: &mut P,
) where
    S: Simd,
    F: FastSampler<N>,
    P: Sum,
    Count<N>: Width,
{
    window.arrange(sampler.source());
    let several = !tile.sums.is_empty();
    let rounds = Rounds::of(simd, engine, (sampler, round), window, several);
    rounds.each_group(
        probe,
        #[inline(always)]
        |group, tally| {
            let pixels = group.pixels;
            let mut held = Held::<S, N>::load(simd, tile, pixels);
            let mut lanes = sampler.load(simd, &round, &tile.states, pixels);
            let occupied = rounds.draw(simd, group, &mut held, &mut lanes, tally);
            held.store(tile, pixels);
            sampler.store(&lanes, &mut tile.states, pixels);
            colour(simd, &held.winner, tile, rounds.window, pixels);
            if several {
                for (pixel, set) in pixels.iter().zip(words_of(occupied)) {
                    if let Some(sums) = &mut tile.sums[usize::from(*pixel)] {
                        sums.occupied |= SampleMask(unpack(set).into());
                    }
                }
            }
        },
    );
}

/// The picture of a tile of which a window holds all fragments, in a single pass of samples;
/// `states` are its pixels' before the first.
#[inline(always)]
pub(in crate::stochastic::fast) fn picture<S, F, P, const N: usize>(
    simd: S,
    engine: &FastEngine<F, N>,
    (sampler, round): (&F::Abreast, Round),
    states: &[F::State; TILE_PIXELS],
    window: &mut Window,
    probe: &mut P,
) -> TilePixels
where
    S: Simd,
    F: FastSampler<N>,
    P: Sum,
    Count<N>: Width,
{
    let background = engine.plain.inner.frame.background;
    window.arrange(sampler.source());
    window.set_background(background);
    let mut pixels = Box::new([background.map(f64::from); TILE_PIXELS]);
    let rounds = Rounds::of(simd, engine, (sampler, round), window, false);
    rounds.each_group(
        probe,
        #[inline(always)]
        |group, tally| {
            let mut held = Held::<S, N>::cleared(simd);
            let mut lanes = sampler.load(simd, &round, states, group.pixels);
            rounds.draw(simd, group, &mut held, &mut lanes, tally);
            let mut winners = [[0; LANES]; N];
            for s in 0..N {
                held.winner[s].store_slice(&mut winners[s]);
            }
            for (lane, pixel) in group.pixels.iter().enumerate() {
                pixels[usize::from(*pixel)] = mean(simd, rounds.window, &winners, lane);
            }
            if <F::Plain as Sampler<N>>::CORRECTS {
                let excess = sampler.excess(&lanes);
                for (pixel, excess) in group.pixels.iter().zip(excess) {
                    for (mean, excess) in pixels[usize::from(*pixel)].iter_mut().zip(excess) {
                        *mean -= excess;
                    }
                }
            }
        },
    );
    pixels
}

/// What all rounds have in common.
struct Rounds<'a, S: Simd, F: FastSampler<N>, const N: usize>
where
    Count<N>: Width,
{
    engine: &'a FastEngine<F, N>,
    sampler: &'a F::Abreast,
    round: Round,
    depths: Depths<'a, S, N>,
    window: &'a Window,
    /// Whether the samples that were written are asked for.
    several: bool,
}

/// A round of a group.
struct Step<'a> {
    group: Group<'a>,
    number: usize,
}

impl<'a, S: Simd, F: FastSampler<N>, const N: usize> Rounds<'a, S, F, N>
where
    Count<N>: Width,
{
    #[inline(always)]
    fn of(
        simd: S,
        engine: &'a FastEngine<F, N>,
        (sampler, round): (&'a F::Abreast, Round),
        window: &'a Window,
        several: bool,
    ) -> Self {
        let frame = &engine.plain.inner.frame;
        let depths = Depths::of(simd, frame, engine.sampler.depth_bits());
        Rounds { engine, sampler, round, depths, window, several }
    }

    /// Has the window's groups drawn one after the other, and tells what was counted.
    #[inline(always)]
    fn each_group<P: Sum>(
        &self,
        probe: &mut P,
        mut draw: impl FnMut(Group<'_>, &mut Tally<'_, P>),
    ) {
        let mut lengths = [0; MAX_SAMPLES as usize + 1];
        let mut tally = Tally::<P>::new(&mut lengths);
        for group in self.window.lists.groups() {
            draw(group, &mut tally);
        }
        if P::LISTENS {
            tally.fragments += self.window.fragments();
            let methods = &self.engine.plain.inner;
            let [depth, sample, state] = [
                self.engine.sampler.depth_bits(),
                methods.sample_bits(),
                methods.sampler.state_bits(),
            ];
            probe.many(&tally.events(depth, sample, state));
        }
    }

    /// Draws a group's fragments; the samples that were written.
    #[inline(always)]
    fn draw<P: Sum>(
        &self,
        simd: S,
        group: Group<'_>,
        held: &mut Held<S, N>,
        lanes: &mut LanesOf<S, F, N>,
        tally: &mut Tally<'_, P>,
    ) -> u32x16<S> {
        let mut counted = Counted::<S, P>::new(simd);
        let mut occupied = u32x16::splat(simd, 0);
        for number in 0..group.rows.len() / LANES {
            let drawn = self.step(simd, held, &Step { group, number }, lanes, &mut counted);
            #[cfg(test)]
            let drawn = flawed(simd, self.engine.flaw, drawn);
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
        lanes: &mut LanesOf<S, F, N>,
        counted: &mut Counted<S, P>,
    ) -> Drawn<S, N> {
        let word = |word: u32| u32x16::splat(simd, word);
        let none = word(0);
        let first = step.number * LANES;
        let rows = &step.group.rows[first..].first_chunk().expect("sixteen");
        let [z, across, down, last] = words(simd, rows);
        let z = self.depths.at(simd, [z, across, down, last], rows);
        let mut passes = [none.simd_gt(none); N];
        let mut keys = [i32x16::splat(simd, i32::MAX); N];
        let mut passed = none;
        for i in 0..N {
            let covers = (last & word(1 << i)).simd_gt(none);
            passes[i] = covers & !z[i].simd_gt(held.depth[i]);
            keys[i] = passes[i].select(held.depth[i], keys[i]);
            passed = passes[i].select(passed | word(bit(i)), passed);
        }
        let source = match step.group.sources.get(first..first + LANES) {
            Some(sources) => u32x16::from_slice(simd, sources),
            None => none,
        };
        let [threshold, who] = pairs(simd, &step.group.more[first..first + LANES]);
        let met = Met {
            round: &self.round,
            passed,
            coverage: packed::<S, N>(simd, last & word(COVERED)),
            stored: &held.depth,
            depths: &z,
            keys: &keys,
            passes: &passes,
            threshold,
            opaque: (last & word(OPAQUE)).simd_gt(none),
            source,
            colours: match F::Abreast::COLOURS {
                true => sixteen(simd, self.window, who),
                false => [f32x16::splat(simd, 0.0); 3],
            },
        };
        let written = self.sampler.choose(simd, lanes, &met, counted);
        let coverage = met.coverage;
        Drawn { z, who, coverage, passed, written }
    }
}

/// What a sampler keeps of sixteen pixels.
type LanesOf<S, F, const N: usize> = <<F as FastSampler<N>>::Abreast as Abreast<N>>::Lanes<S>;

/// Adds a block's rows to a window: [`Window::add`].
#[inline(always)]
pub(in crate::stochastic::fast) fn add<S, F, const N: usize>(
    simd: S,
    engine: &FastEngine<F, N>,
    sampler: &F::Abreast,
    window: &mut Window,
    block: &Block,
) -> Option<usize>
where
    S: Simd,
    F: FastSampler<N>,
    Count<N>: Width,
{
    window.add::<S, N>(simd, &engine.plain.inner.frame, block, sampler.source())
}

/// The words of sixteen pairs.
#[inline(always)]
fn pairs<S: Simd>(simd: S, pairs: &[[u32; 2]]) -> [u32x16<S>; 2] {
    let flat = pairs.as_flattened();
    let part = |i: usize| u32x16::from_slice(simd, &flat[LANES * i..][..LANES]);
    simd.deinterleave_u32x16(part(0), part(1)).into()
}
