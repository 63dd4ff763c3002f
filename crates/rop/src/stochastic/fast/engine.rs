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
use screendoor_trace::trace::{BLOCK, Block, Fragment};

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

    fn add(
        &self,
        sampler: &F::Abreast,
        window: &mut abreast::Window,
        block: &Block,
    ) -> Option<usize> {
        crate::for_level!(self.level, simd => abreast::add(simd, self, sampler, window, block))
    }

    /// Draws fragments of which the first comes to the near end of the depth range.
    fn draw_near(
        &self,
        pass: u32,
        state: &mut TileState,
        fragments: &[Fragment],
        mut listener: Listener<'_>,
    ) {
        own::<F, N>(state).near = true;
        for block in Block::all_of(fragments) {
            self.draw(pass, state, &block, listener.again());
        }
    }

    /// The picture of a tile of which the window holds all fragments.
    fn found<P: Sum>(
        &self,
        sampler: &F::Abreast,
        round: Round,
        states: &mut [F::State; TILE_PIXELS],
        window: &mut abreast::Window,
        probe: &mut P,
    ) -> TilePixels {
        crate::for_level!(self.level, simd => {
            abreast::picture(simd, self, sampler, round, states, window, probe)
        })
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
        crate::for_level!(self.level, simd => {
            abreast::draw(simd, self, sampler, round, tile, window, probe)
        })
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

/// A block's fragments from a row on.
fn from_row(block: &Block, first: usize) -> Vec<Fragment> {
    (first..block.rows()).map(|row| block.fragment(row)).collect()
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
        while let Some(block) = blocks.next() {
            if own::<F, N>(state).near {
                self.draw(pass, state, block, listener.again());
                continue;
            }
            if !window.has_room() {
                self.draw_window(pass, own::<F, N>(state), &mut window, listener.again());
            }
            if let Some(near) = self.add(sampler, &mut window, block) {
                self.draw_window(pass, own::<F, N>(state), &mut window, listener.again());
                self.draw_near(pass, state, &from_row(block, near), listener.again());
            }
        }
        self.draw_window(pass, own::<F, N>(state), &mut window, listener.again());
        WINDOW.set(Some(window));
    }

    fn picture(
        &self,
        grid: TileGrid,
        tile: TileId,
        blocks: &mut dyn Blocks,
        mut listener: Listener<'_>,
    ) -> Option<TilePixels> {
        let fits = blocks.rows() + BLOCK <= abreast::MOST_ROWS;
        let single = TiledDesign::passes(self) == 1 && !self.plain.inner.has_sums();
        if !(fits && single && self.draws_together(0, blocks.rows(), &listener)) {
            return None;
        }
        let sampler = self.sampler.abreast()?;
        let round = self.round(0)?;
        let mut window = WINDOW.take().unwrap_or_else(|| Box::new(abreast::Window::new()));
        let mut rest = None;
        while rest.is_none()
            && let Some(block) = blocks.next()
        {
            rest = self.add(sampler, &mut window, block).map(|near| from_row(block, near));
        }
        let pixels = match rest {
            None => {
                let mut states = boxed(self.sampler.clear(grid, tile));
                self.sampler.enter(&round, &mut states);
                let pixels = match listener {
                    Listener::Counts(counts) => {
                        self.found(sampler, round, &mut states, &mut window, counts)
                    }
                    _ => self.found(sampler, round, &mut states, &mut window, &mut NoProbe),
                };
                window.clear();
                pixels
            }
            Some(rest) => {
                let mut state = TiledDesign::clear(self, grid, tile);
                self.draw_window(0, own::<F, N>(&mut state), &mut window, listener.again());
                self.draw_near(0, &mut state, &rest, listener.again());
                while let Some(block) = blocks.next() {
                    self.draw(0, &mut state, block, listener.again());
                }
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
}
