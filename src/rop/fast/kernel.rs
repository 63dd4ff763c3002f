//! The loops over a tile's fragments.

use fearless_simd::Simd;

use crate::rop::event::Probe;
use crate::rop::fast::engine::{FastEngine, FastSampler, Loaded, Offered};
use crate::rop::fast::lanes::{Count, Lanes, Width};
use crate::rop::fast::state::{FastTile, SIGN};
use crate::rop::fast::tally::Tally;
use crate::rop::stochastic::{Round, Sampler};
use crate::tile::{TILE_PIXELS, TileGrid};
use crate::trace::{DepthPlane, Fragment, MAX_SAMPLES, SampleMask};

/// The lanes of a pixel of `N` samples.
type LanesOf<S, const N: usize> = <Count<N> as Width>::Lanes<S>;

/// Draws the fragments of one round: [`Methods::draw`](crate::rop::Transparent::draw)
/// for a pass of samples.
#[inline(always)]
pub(super) fn draw_samples<S: Simd, F: FastSampler<N>, P: Probe, const N: usize>(
    simd: S,
    engine: &FastEngine<F, N>,
    pass: u32,
    round: Round,
    tile: &mut FastTile<F, N>,
    fragments: &[Fragment],
    probe: &mut P,
) where
    Count<N>: Width,
{
    let loaded = engine.constants.load(simd);
    let (sampler, methods) = (&engine.sampler, &engine.plain.inner);
    let depth_bits = sampler.depth_bits();
    let mut lengths = [0; MAX_SAMPLES as usize + 1];
    let mut tally = Tally::<P>::new(&mut lengths);
    let (several, opaque_first) = (!tile.sums.is_empty(), !tile.opaque.is_empty());
    for fragment in fragments {
        let within = TileGrid::within(fragment.x, fragment.y) % TILE_PIXELS;
        if P::LISTENS {
            tally.fragments += 1;
        }
        if !is_gentle(&fragment.depth) {
            engine.draw_plainly(pass, tile, fragment, probe);
            continue;
        }
        let mut coverage = fragment.coverage.0;
        if opaque_first {
            match engine.plain.cull(pass, &mut tile.opaque[within], fragment, probe) {
                Some(SampleMask(before)) => coverage = before,
                None => continue,
            }
        }
        let z = depths::<S, LanesOf<S, N>>(simd, &loaded, &fragment.depth, depth_bits);
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
            fragment,
        };
        let state = &mut tile.states[within];
        let written = sampler.choose(simd, &loaded, state, offered, &mut tally);
        let depth = LanesOf::<S, N>::select(written, z, stored);
        depth.store(held.depth.as_mut());
        for (row, channel) in held.colour.iter_mut().zip(fragment.colour) {
            let new = LanesOf::<S, N>::splat(simd, channel.to_bits() as i32);
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

/// Adds fragments up behind the samples that are drawn already.
#[inline(always)]
pub(super) fn accumulate<S: Simd, F: FastSampler<N>, P: Probe, const N: usize>(
    simd: S,
    engine: &FastEngine<F, N>,
    pass: u32,
    tile: &mut FastTile<F, N>,
    fragments: &[Fragment],
    probe: &mut P,
) where
    Count<N>: Width,
{
    let loaded = engine.constants.load(simd);
    for fragment in fragments {
        let within = TileGrid::within(fragment.x, fragment.y);
        probe.fragment(fragment.coverage);
        if !is_gentle(&fragment.depth) {
            engine.draw_plainly(pass, tile, fragment, probe);
            continue;
        }
        let Some(coverage) = engine.cull(pass, tile, fragment, probe) else { continue };
        let bits = engine.sampler.depth_bits();
        let z = depths::<S, LanesOf<S, N>>(simd, &loaded, &fragment.depth, bits);
        let stored = LanesOf::<S, N>::load(simd, tile.held[within].depth.as_ref());
        let behind = LanesOf::<S, N>::bits(z.greater(stored));
        let visible = SampleMask(coverage.0 & !behind);
        let sums = tile.sums[within].as_mut().expect("it has sums");
        let fragment = Fragment { coverage, ..*fragment };
        engine.plain.inner.accumulate(sums, &fragment, visible, probe);
    }
}

/// Whether a plane's depths at the samples follow from sums and products of 32 bits:
/// nowhere beyond the depth range nor at its near end (which [`super::ranks`] asks
/// for), and not very steep. Nearly all are.
#[inline(always)]
fn is_gentle(depth: &DepthPlane) -> bool {
    // Twice 2^31, where both are the steepest there is, would wrap to 0.
    let slopes = depth.dzdx.unsigned_abs().saturating_add(depth.dzdy.unsigned_abs());
    // Samples lie at most half a pixel from the centre, along each axis.
    let reach = slopes / 2 + 3;
    let nearest = depth.z.0.checked_sub(reach);
    let furthest = depth.z.0.checked_add(reach);
    (slopes < 1 << 28) & nearest.is_some() & furthest.is_some()
}

/// [`Frame::depths`](crate::rop::Frame::depths) of a gentle plane, their upper bit flipped.
#[inline(always)]
fn depths<S: Simd, L: Lanes<S>>(simd: S, loaded: &Loaded<L>, depth: &DepthPlane, bits: u32) -> L {
    let [x, y] = loaded.offsets;
    let across = x.mul(L::splat(simd, depth.dzdx));
    let down = y.mul(L::splat(simd, depth.dzdy));
    let centre = L::splat(simd, (depth.z.0 ^ SIGN) as i32);
    let z = across.add(down).shift_right(4).add(centre);
    if bits == 32 { z } else { z.or(L::splat(simd, ((1_u64 << (32 - bits)) - 1) as i32)) }
}
