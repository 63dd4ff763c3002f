//! The fast engine of a stochastic design.

use crate::contract::contents::Contents;
use crate::contract::design::Design;
use crate::contract::event::{NoProbe, Probe, Sum};
use crate::contract::frame::Site;
use crate::contract::layout::Layout;
use crate::contract::over_opaque::Transparent;
use crate::contract::tiled::{Listener, TileState, TiledDesign, sites};
use crate::lanes::{Count, Width};
use crate::stochastic::fast::kernel;
use crate::stochastic::fast::sampler::FastSampler;
use crate::stochastic::fast::state::{FastTile, boxed};
use crate::stochastic::fast::twin::FastEngine;
use crate::stochastic::methods::{Pass, Round};
use screendoor_trace::picture::TilePixels;
use screendoor_trace::tile::{TILE_PIXELS, TileGrid, TileId};
use screendoor_trace::trace::{Block, Fragment};

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
                if tile.entered != Some(round) {
                    tile.entered = Some(round);
                    self.sampler.enter(&round, &mut tile.states);
                }
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
