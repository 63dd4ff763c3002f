//! The loops over a tile's fragments. With vectors in capitals, a lane for each sample of a
//! pixel, and sets of samples as bits of a word:
//!
//! ```text
//! for the block's fragments at once:                   (Prepared: a vector holds 16 fragments)
//!     place in the tile, threshold ⌈α·2^32⌉, whether the plane is gentle
//! for each fragment f, in API order:                   (from here a vector is a pixel)
//!     if f's plane reaches the near end of the range:  plain text; next fragment
//!     Z       = f.z + (f.dzdx·X + f.dzdy·Y) >> 4
//!     passed  = f.coverage and not Z > DEPTH           (and before what is opaque)
//!     if passed is empty and the rules let it:         next fragment
//!     starts  = (passed or f.coverage) meets p.covered (choose: a new surface, figure 7)
//!     first   = numbers that the surface has had       (0 where it starts)
//!     V       = reference values of the numbers first, first + 1, …, all of them,
//!               before it is known which sample has which
//!     hits    = V < threshold                          (all or none of them: done)
//!     R       = rank of each passed sample by DEPTH    (what it has stored: the sort)
//!     written = passed and bit R of hits
//!     DEPTH, RED, GREEN, BLUE = where written: f's, elsewhere as they are
//! ```
//!
//! The plain text branches for each sample and looks up its value; here no branch depends on
//! a sample. Of the same bits they are by construction: the numbers that a surface can have
//! while it is found out which sample has which are one run, so that the values can come first.

use fearless_simd::Simd;

use crate::contract::event::{Probe, Sum};
use crate::contract::frame::Frame;
use crate::contract::opacity::Threshold;
use crate::lanes::{Count, Lanes, Width};
use crate::stochastic::fast::limit::Limit;
use crate::stochastic::fast::sampler::{FastSampler, Loaded, Offered, Row};
use crate::stochastic::fast::state::{FastTile, SIGN};
use crate::stochastic::fast::tally::Tally;
use crate::stochastic::fast::twin::FastEngine;
#[cfg(test)]
use crate::stochastic::fast::twin::Flaw;
use crate::stochastic::methods::{Round, Sampler};
use screendoor_trace::tile::{TILE_PIXELS, TileGrid};
use screendoor_trace::trace::{BLOCK, Block, Fragment, MAX_SAMPLES, SampleMask};

/// The lanes of a pixel of `N` samples.
type LanesOf<S, const N: usize> = <Count<N> as Width>::Lanes<S>;

/// What follows from a fragment alone, for a whole block: without a branch, so that the
/// compiler makes vectors of it.
struct Prepared {
    /// The rows that are fragments.
    rows: [u8; BLOCK],
    count: usize,
    /// Each fragment's place in the tile, and as much beyond all places where its plane is
    /// not gentle.
    within: [u16; BLOCK],
    /// Depths at the pixels' centres, their upper bit flipped.
    z: [i32; BLOCK],
    limit: [i32; BLOCK],
    all: [u64; BLOCK],
}

impl Prepared {
    #[inline(always)]
    fn of(block: &Block) -> Self {
        let mut prepared = Prepared {
            rows: [0; BLOCK],
            count: 0,
            within: [0; BLOCK],
            z: [0; BLOCK],
            limit: [0; BLOCK],
            all: [0; BLOCK],
        };
        // Whole vectors: what lies beyond the block's length is not looked at.
        for i in 0..block.rows().next_multiple_of(16).min(BLOCK) {
            let gentle = is_gentle(block.z[i], block.dzdx[i], block.dzdy[i]);
            let beyond = u16::from(!gentle) * TILE_PIXELS as u16;
            prepared.within[i] = TileGrid::within(block.x[i], block.y[i]) as u16 | beyond;
            prepared.z[i] = (block.z[i] ^ SIGN) as i32;
            let Limit { below, all } = Limit::of(Threshold::of(block.alpha[i]));
            (prepared.limit[i], prepared.all[i]) = (below, all);
        }
        let mut count = 0;
        for (i, coverage) in block.coverage[..block.rows().min(BLOCK)].iter().enumerate() {
            prepared.rows[count % BLOCK] = i as u8;
            count += usize::from(*coverage != 0);
        }
        prepared.count = count;
        prepared
    }

    #[inline(always)]
    fn drawn(&self) -> &[u8] {
        &self.rows[..self.count]
    }

    /// [`Frame::depths`] of a row, their upper bit flipped; `None` where they come near the
    /// near end of the range, which [`super::ranks`] asks for.
    #[inline(always)]
    fn depths<S: Simd, F: FastSampler<N>, const N: usize>(
        &self,
        simd: S,
        engine: &FastEngine<F, N>,
        loaded: &Loaded<LanesOf<S, N>>,
        block: &Block,
        i: usize,
    ) -> Option<LanesOf<S, N>>
    where
        Count<N>: Width,
    {
        let bits = engine.sampler.depth_bits();
        if usize::from(self.within[i]) < TILE_PIXELS {
            let plane = [self.z[i], block.dzdx[i], block.dzdy[i]];
            return Some(depths(simd, loaded, plane, bits));
        }
        let frame = &engine.plain.inner.frame;
        let row = depths_of_any::<N>(frame, &block.fragment(i), bits)?;
        Some(LanesOf::<S, N>::load(simd, row.as_ref()))
    }
}

/// Draws the fragments of one round: [`Methods::draw`](crate::Transparent::draw)
/// for a pass of samples.
#[inline(always)]
pub(super) fn draw_samples<S: Simd, F: FastSampler<N>, P: Sum, const N: usize>(
    simd: S,
    engine: &FastEngine<F, N>,
    pass: u32,
    round: Round,
    tile: &mut FastTile<F, N>,
    block: &Block,
    probe: &mut P,
) where
    Count<N>: Width,
{
    let loaded = engine.constants.load(simd);
    let prepared = Prepared::of(block);
    let (sampler, methods) = (&engine.sampler, &engine.plain.inner);
    let depth_bits = sampler.depth_bits();
    let mut lengths = [0; MAX_SAMPLES as usize + 1];
    let mut tally = Tally::<P>::new(&mut lengths);
    let (several, opaque_first) = (!tile.sums.is_empty(), !tile.opaque.is_empty());
    if P::LISTENS {
        tally.fragments += prepared.drawn().len() as u64;
    }
    for row in prepared.drawn() {
        let i = usize::from(*row);
        let within = usize::from(prepared.within[i]) % TILE_PIXELS;
        let Some(z) = prepared.depths(simd, engine, &loaded, block, i) else {
            engine.draw_plainly(pass, tile, &block.fragment(i), probe);
            continue;
        };
        let mut coverage = block.coverage[i];
        if opaque_first {
            let opaque = &mut tile.opaque[within];
            match engine.plain.cull(pass, opaque, &block.fragment(i), probe) {
                Some(SampleMask(before)) => coverage = before,
                None => continue,
            }
        }
        let held = &mut tile.held[within];
        let stored = LanesOf::<S, N>::load(simd, held.depth.as_ref());
        let behind = LanesOf::<S, N>::bits(z.greater(stored));
        let passed = coverage & !behind;
        if P::LISTENS {
            tally.tested += u64::from(coverage.count_ones());
            tally.passed += u64::from(passed.count_ones());
        }
        // With few lanes, finding out costs more than drawing nothing.
        if LanesOf::<S, N>::LEN > 8 && passed == 0 && sampler.needs_survivors() {
            continue;
        }
        let offered = Offered {
            round: &round,
            stored,
            words: held.depth.as_ref(),
            passed,
            coverage,
            limit: Limit { below: prepared.limit[i], all: prepared.all[i] },
            fragment: Row { block, i },
        };
        let state = &mut tile.states[within];
        let written = sampler.choose(simd, &loaded, state, offered, &mut tally);
        #[cfg(test)]
        let (z, written) = flawed(simd, engine.flaw, z, written, passed);
        let depth = LanesOf::<S, N>::select(written, z, stored);
        depth.store(held.depth.as_mut());
        for (row, channel) in held.colour.iter_mut().zip([&block.r, &block.g, &block.b]) {
            let new = LanesOf::<S, N>::splat(simd, channel[i].to_bits() as i32);
            let old = LanesOf::<S, N>::load(simd, row.as_ref());
            LanesOf::<S, N>::select(written, new, old).store(row.as_mut());
        }
        if P::LISTENS || several {
            let written = SampleMask(LanesOf::<S, N>::bits(written));
            tally.written += u64::from(written.count());
            if let Some(Some(sums)) = tile.sums.get_mut(within) {
                sums.occupied |= written;
            }
        }
    }
    if P::LISTENS {
        let state_bits = methods.sampler.state_bits();
        probe.many(&tally.events(depth_bits, methods.sample_bits(), state_bits));
    }
}

/// What is written, with the lane's defect.
#[cfg(test)]
fn flawed<S: Simd, L: Lanes<S>>(
    simd: S,
    flaw: Option<Flaw>,
    z: L,
    written: L::Mask,
    passed: u64,
) -> (L, L::Mask) {
    match flaw {
        Some(Flaw::Depth(lane)) => {
            let mut bit = [0; MAX_SAMPLES as usize];
            bit[lane] = 1;
            (z.xor(L::load(simd, &bit[..L::LEN])), written)
        }
        Some(Flaw::Choice(lane)) => (z, L::mask(simd, L::bits(written) ^ (1 << lane & passed))),
        None => (z, written),
    }
}

/// Adds fragments up behind the samples that are drawn already.
#[inline(always)]
pub(super) fn accumulate<S: Simd, F: FastSampler<N>, P: Probe, const N: usize>(
    simd: S,
    engine: &FastEngine<F, N>,
    pass: u32,
    tile: &mut FastTile<F, N>,
    block: &Block,
    probe: &mut P,
) where
    Count<N>: Width,
{
    let loaded = engine.constants.load(simd);
    let prepared = Prepared::of(block);
    for row in prepared.drawn() {
        let i = usize::from(*row);
        let within = usize::from(prepared.within[i]) % TILE_PIXELS;
        let fragment = block.fragment(i);
        probe.fragment(fragment.coverage);
        let Some(z) = prepared.depths(simd, engine, &loaded, block, i) else {
            engine.draw_plainly(pass, tile, &fragment, probe);
            continue;
        };
        let Some(coverage) = engine.cull(pass, tile, &fragment, probe) else { continue };
        let stored = LanesOf::<S, N>::load(simd, tile.held[within].depth.as_ref());
        let behind = LanesOf::<S, N>::bits(z.greater(stored));
        let visible = SampleMask(coverage.0 & !behind);
        let sums = tile.sums[within].as_mut().expect("it has sums");
        let fragment = Fragment { coverage, ..fragment };
        engine.plain.inner.accumulate(sums, &fragment, visible, probe);
    }
}

/// Whether a plane's depths at the samples follow from sums and products of 32 bits:
/// nowhere beyond the depth range nor at its near end, and not very steep. Nearly all are.
#[inline(always)]
fn is_gentle(z: u32, dzdx: i32, dzdy: i32) -> bool {
    // Each apart: their sum might wrap.
    const STEEP: u32 = 1 << 27;
    let (across, down) = (dzdx.unsigned_abs(), dzdy.unsigned_abs());
    // Samples lie at most half a pixel from the centre, along each axis.
    let reach = across.wrapping_add(down) / 2 + 3;
    (across < STEEP) & (down < STEEP) & (z >= reach) & (z <= u32::MAX - reach)
}

/// Depths of a gentle plane, their upper bit flipped, as the plane's own is.
#[inline(always)]
fn depths<S: Simd, L: Lanes<S>>(
    simd: S,
    loaded: &Loaded<L>,
    [z, dzdx, dzdy]: [i32; 3],
    bits: u32,
) -> L {
    let [x, y] = loaded.offsets;
    let across = x.mul(L::splat(simd, dzdx));
    let down = y.mul(L::splat(simd, dzdy));
    let z = across.add(down).shift_right(4).add(L::splat(simd, z));
    if bits == 32 { z } else { z.or(L::splat(simd, ((1_u64 << (32 - bits)) - 1) as i32)) }
}

/// [`Frame::depths`] of any plane, their upper bit flipped; `None` where one is at the near
/// end of the range.
#[cold]
#[inline(never)]
fn depths_of_any<const N: usize>(
    frame: &Frame,
    fragment: &Fragment,
    bits: u32,
) -> Option<<Count<N> as Width>::Row>
where
    Count<N>: Width,
{
    let depths = frame.depths::<N>(fragment, bits);
    let word = |s: usize| depths.get(s).map_or(0, |z| (z.0 ^ SIGN) as i32);
    depths.iter().all(|z| z.0 > 0).then(|| Count::<N>::row(word))
}
