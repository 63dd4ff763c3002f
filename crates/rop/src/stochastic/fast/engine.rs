//! The fast engine of a stochastic design.

use std::cell::Cell;

use crate::contract::contents::Contents;
use crate::contract::design::Design;
use crate::contract::event::{NoProbe, Probe, Sum};
use crate::contract::frame::Site;
use crate::contract::layout::Layout;
use crate::contract::over_opaque::Transparent;
use crate::contract::tiled::{Blocks, Listener, TileState, TiledDesign, sites};
use crate::lanes::{Count, Width};
use crate::stochastic::fast::sampler::FastSampler;
use crate::stochastic::fast::state::{FastTile, boxed};
use crate::stochastic::fast::twin::FastEngine;
use crate::stochastic::fast::{abreast, kernel};
use crate::stochastic::methods::{Pass, Round};
use screendoor_trace::picture::TilePixels;
use screendoor_trace::tile::{TILE_PIXELS, TileGrid, TileId};
use screendoor_trace::trace::{BLOCK, Block, Fragment, Unorm32};

impl<F: FastSampler<N>, const N: usize> FastEngine<F, N>
where
    Count<N>: Width,
{
    fn draw_all<P: Sum>(&self, pass: u32, tile: &mut FastTile<F, N>, block: &Block, probe: &mut P) {
        let methods = &self.plain.inner;
        let Some(inner) = pass.checked_sub(self.plain.own_passes()) else {
            for fragment in block.iter() {
                let within = TileGrid::within(fragment.x, fragment.y);
                probe.fragment(fragment.coverage);
                self.plain.cull(pass, &mut tile.opaque[within], &fragment, probe);
            }
            return;
        };
        match methods.pass(inner) {
            Pass::Sample(round) => {
                let round = methods.round(round);
                self.enter(round, tile);
                self.draw_samples(pass, round, tile, block, probe);
            }
            Pass::Accumulate(_) => self.accumulate(pass, tile, block, probe),
            Pass::TotalAlpha => {
                for fragment in block.iter() {
                    let within = TileGrid::within(fragment.x, fragment.y);
                    probe.fragment(fragment.coverage);
                    let Some(coverage) = self.cull(pass, tile, &fragment, probe) else { continue };
                    let fragment = Fragment { coverage, ..fragment };
                    let sums = tile.sums[within].as_mut().expect("it has sums");
                    methods.draw_alpha(sums, &fragment, probe);
                }
            }
        }
    }

    fn draw_samples<P: Sum>(
        &self,
        pass: u32,
        round: Round,
        tile: &mut FastTile<F, N>,
        block: &Block,
        probe: &mut P,
    ) {
        crate::for_level!(self.level, simd => {
            kernel::draw_samples(simd, self, pass, round, tile, block, probe)
        })
    }

    fn accumulate<P: Probe>(
        &self,
        pass: u32,
        tile: &mut FastTile<F, N>,
        block: &Block,
        probe: &mut P,
    ) {
        crate::for_level!(self.level, simd => {
            kernel::accumulate(simd, self, pass, tile, block, probe)
        })
    }
}

impl<F: FastSampler<N>, const N: usize> FastEngine<F, N>
where
    Count<N>: Width,
{
    /// Whether there are kernels with pixels in lanes: the compiler leaves out those that a
    /// constant says are never run.
    const ABREAST: bool = N <= abreast::MOST_SAMPLES;

    /// Whether it pays to look at many fragments of the tile at once, of which there are `rows`.
    fn draws_together(&self, pass: u32, rows: usize, listener: &Listener<'_>) -> bool {
        abreast::worth_it(N, rows)
            && self.sampler.abreast().is_some()
            && self.round(pass).is_some()
            && !matches!(listener, Listener::Record(_))
    }

    /// The round of samples that a pass draws, if it does.
    fn round(&self, pass: u32) -> Option<Round> {
        let methods = &self.plain.inner;
        match methods.pass(pass.checked_sub(self.plain.own_passes())?) {
            Pass::Sample(round) => Some(methods.round(round)),
            _ => None,
        }
    }

    /// Adds blocks' rows to a window while there is room, up to one that comes to the near end
    /// of the depth range: it and the rest of its block, if there is any.
    fn fill(
        &self,
        sampler: &F::Abreast,
        window: &mut abreast::Window,
        blocks: &mut dyn Blocks,
    ) -> Option<Vec<Fragment>> {
        while window.has_room()
            && let Some(block) = blocks.next()
        {
            if let Some(near) = self.add(sampler, window, block) {
                return Some((near..block.rows()).map(|row| block.fragment(row)).collect());
            }
        }
        None
    }

    fn add(
        &self,
        sampler: &F::Abreast,
        window: &mut abreast::Window,
        block: &Block,
    ) -> Option<usize> {
        if Self::ABREAST {
            crate::for_level!(self.level, simd => abreast::add(simd, self, sampler, window, block))
        } else {
            unreachable!("too many samples")
        }
    }

    /// Draws what a window holds, then the `rest` of a block, whose first fragment comes to the
    /// near end, and all blocks after it.
    fn draw_filled(
        &self,
        pass: u32,
        state: &mut TileState,
        window: &mut abreast::Window,
        (rest, blocks): (Option<Vec<Fragment>>, &mut dyn Blocks),
        mut listener: Listener<'_>,
    ) {
        self.draw_window(pass, own::<F, N>(state), window, listener.again());
        let Some(rest) = rest else { return };
        own::<F, N>(state).near = true;
        for block in Block::all_of(&rest) {
            self.draw(pass, state, &block, listener.again());
        }
        while let Some(block) = blocks.next() {
            self.draw(pass, state, block, listener.again());
        }
    }

    /// The picture of a tile of which the window holds all fragments.
    fn found<P: Sum>(
        &self,
        sampler: &F::Abreast,
        round: Round,
        states: &[F::State; TILE_PIXELS],
        window: &mut abreast::Window,
        probe: &mut P,
    ) -> TilePixels {
        if Self::ABREAST {
            crate::for_level!(self.level, simd => {
                abreast::picture(simd, self, (sampler, round), states, window, probe)
            })
        } else {
            unreachable!("too many samples")
        }
    }

    /// Draws a window's fragments and empties it.
    fn draw_window(
        &self,
        pass: u32,
        tile: &mut FastTile<F, N>,
        window: &mut abreast::Window,
        listener: Listener<'_>,
    ) {
        if !window.is_empty() {
            match listener {
                Listener::Counts(counts) => self.draw_abreast(pass, tile, window, counts),
                _ => self.draw_abreast(pass, tile, window, &mut NoProbe),
            }
            window.clear();
        }
    }

    fn draw_abreast<P: Sum>(
        &self,
        pass: u32,
        tile: &mut FastTile<F, N>,
        window: &mut abreast::Window,
        probe: &mut P,
    ) {
        let (Some(sampler), Some(round)) = (self.sampler.abreast(), self.round(pass)) else {
            unreachable!("it draws together")
        };
        self.enter(round, tile);
        if Self::ABREAST {
            crate::for_level!(self.level, simd => {
                abreast::draw(simd, self, (sampler, round), tile, window, probe)
            })
        } else {
            unreachable!("too many samples")
        }
    }

    /// Makes a tile's states ready for a round.
    fn enter(&self, round: Round, tile: &mut FastTile<F, N>) {
        if tile.entered != Some(round) {
            tile.entered = Some(round);
            self.sampler.enter(&round, &mut tile.states);
        }
    }
}

thread_local! {
    /// Each thread's own.
    static WINDOW: Cell<Option<Box<abreast::Window>>> = const { Cell::new(None) };
}

/// A tile of this engine's.
fn own<F: FastSampler<N>, const N: usize>(state: &mut TileState) -> &mut FastTile<F, N>
where
    Count<N>: Width,
{
    state.downcast_mut().expect("the state is the engine's own")
}

impl<F: FastSampler<N>, const N: usize> TiledDesign for FastEngine<F, N>
where
    Count<N>: Width,
{
    fn passes(&self) -> u32 {
        Design::passes(&self.plain)
    }

    fn layout(&self) -> Layout {
        Design::layout(&self.plain)
    }

    fn bytes_per_fragment(&self) -> Option<usize> {
        None
    }

    fn clear(&self, grid: TileGrid, tile: TileId) -> TileState {
        let states = self.sampler.clear(grid, tile);
        let frame = &self.plain.inner.frame;
        let site = Site { x: 0, y: 0 };
        let sums = self.plain.inner.clear(site).sums;
        let opaque = self.plain.own_passes() > 0;
        Box::new(FastTile::<F, N>::cleared(frame, boxed(states), sums.as_deref(), opaque))
    }

    fn draw(&self, pass: u32, state: &mut TileState, fragments: &Block, listener: Listener<'_>) {
        let tile = own::<F, N>(state);
        match listener {
            Listener::Nobody => self.draw_all(pass, tile, fragments, &mut NoProbe),
            Listener::Counts(counts) => self.draw_all(pass, tile, fragments, counts),
            Listener::Record(record) => {
                for fragment in fragments.iter() {
                    record.fragment(fragment.coverage);
                    self.draw_plainly(pass, tile, &fragment, record);
                }
            }
        }
    }

    fn draw_blocks(
        &self,
        pass: u32,
        state: &mut TileState,
        blocks: &mut dyn Blocks,
        mut listener: Listener<'_>,
    ) {
        let tile = own::<F, N>(state);
        let simple = tile.opaque.is_empty() && !tile.near;
        if !(simple && self.draws_together(pass, blocks.rows(), &listener)) {
            while let Some(block) = blocks.next() {
                self.draw(pass, state, block, listener.again());
            }
            return;
        }
        let Some(sampler) = self.sampler.abreast() else { unreachable!("it draws together") };
        let mut window = WINDOW.take().unwrap_or_else(|| Box::new(abreast::Window::new()));
        loop {
            let rest = self.fill(sampler, &mut window, blocks);
            let more = rest.is_none() && !window.has_room();
            self.draw_filled(pass, state, &mut window, (rest, blocks), listener.again());
            if !more {
                break;
            }
        }
        WINDOW.set(Some(window));
    }

    fn picture(
        &self,
        grid: TileGrid,
        tile: TileId,
        blocks: &mut dyn Blocks,
        listener: Listener<'_>,
    ) -> Option<TilePixels> {
        let fits = blocks.rows() + BLOCK <= abreast::MOST_ROWS;
        if !(fits
            && TiledDesign::passes(self) == 1
            && self.draws_together(0, blocks.rows(), &listener))
        {
            return None;
        }
        let sampler = self.sampler.abreast()?;
        let round = self.round(0)?;
        let mut window = WINDOW.take().unwrap_or_else(|| Box::new(abreast::Window::new()));
        let rest = self.fill(sampler, &mut window, blocks);
        let pixels = match rest {
            None => {
                let mut states = boxed(self.sampler.clear(grid, tile));
                self.sampler.enter(&round, &mut states);
                let pixels = match listener {
                    Listener::Counts(counts) => {
                        self.found(sampler, round, &states, &mut window, counts)
                    }
                    _ => self.found(sampler, round, &states, &mut window, &mut NoProbe),
                };
                window.clear();
                pixels
            }
            rest => {
                let mut state = TiledDesign::clear(self, grid, tile);
                self.draw_filled(0, &mut state, &mut window, (rest, blocks), listener);
                TiledDesign::resolve(self, grid, tile, &state)
            }
        };
        WINDOW.set(Some(window));
        Some(pixels)
    }

    fn end_pass(
        &self,
        pass: u32,
        grid: TileGrid,
        tile: TileId,
        state: &mut TileState,
        mut listener: Listener<'_>,
    ) {
        let state = own::<F, N>(state);
        if state.sums.is_empty() {
            return;
        }
        for (within, site) in sites(grid, tile).enumerate() {
            self.change(state, within, |pixel| {
                Design::end_pass(&self.plain, pass, site, pixel, &mut listener);
            });
        }
    }

    fn resolve(&self, grid: TileGrid, tile: TileId, state: &TileState) -> TilePixels {
        let state: &FastTile<F, N> = state.downcast_ref().expect("the state is the engine's own");
        let mut result = Box::new([[0.0; 3]; TILE_PIXELS]);
        let single = state.sums.is_empty() && state.opaque.is_empty();
        for ((within, site), out) in sites(grid, tile).enumerate().zip(result.iter_mut()) {
            *out = if single {
                let colour = &state.held[within].colour;
                let colours: [[f32; 3]; N] = std::array::from_fn(|s| {
                    std::array::from_fn(|c| f32::from_bits(colour[c].as_ref()[s] as u32))
                });
                let plain = &self.plain.inner;
                plain.mean(&colours, || self.sampler.excess(&plain.sampler, &state.states[within]))
            } else {
                let pixel = state.plain(&self.sampler, within);
                Design::resolve(&self.plain, site, &pixel)
            };
        }
        result
    }

    fn contents(&self, state: &TileState, within: usize) -> Contents {
        let state: &FastTile<F, N> = state.downcast_ref().expect("the state is the engine's own");
        Design::contents(&self.plain, &state.plain(&self.sampler, within))
    }

    fn visibility(&self, state: &TileState, within: usize, at: &[Unorm32], to: &mut [f64]) -> bool {
        let state: &FastTile<F, N> = state.downcast_ref().expect("the state is the engine's own");
        Design::visibility(&self.plain, &state.plain(&self.sampler, within), at, to)
    }
}
