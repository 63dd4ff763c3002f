//! The engine of a design that has lanes.

use std::cell::Cell;
use std::ops::Range;

use fearless_simd::Level;

use crate::contract::contents::Contents;
use crate::contract::design::Design;
use crate::contract::event::{NoProbe, Probe, Sum};
use crate::contract::frame::Site;
use crate::contract::layout::Layout;
use crate::contract::over_opaque::OverOpaque;
use crate::contract::samples::Samples;
use crate::contract::tiled::{Blocks, Listener, TileState, TiledDesign, sites};
use crate::for_level;
use crate::in_lanes::kernel::{Drawing, resolve};
use crate::in_lanes::window::{MOST_ROWS, Window};
use crate::in_lanes::{HasLanes, MOST_SAMPLES};
use screendoor_trace::picture::TilePixels;
use screendoor_trace::tile::{TILE_PIXELS, TILE_SIDE, TileGrid, TileId};
use screendoor_trace::trace::{BLOCK, Block, Fragment, Unorm32};

/// The design `plain` with the instructions of `level`, sixteen pixels at a time where a tile has
/// fragments enough; `None` where it has no lanes.
pub fn engine<T: HasLanes<N> + 'static, const N: usize>(
    plain: OverOpaque<T, N>,
    level: Level,
) -> Option<Box<dyn TiledDesign>> {
    let lanes = plain.inner.in_lanes().filter(|_| N <= MOST_SAMPLES)?;
    Some(Box::new(Engine { plain, lanes, level }))
}

/// The fewest rows of a tile that are drawn in lanes.
const LEAST_ROWS: usize = 200;

struct Engine<T: HasLanes<N>, const N: usize> {
    plain: OverOpaque<T, N>,
    lanes: T::InLanes,
    level: Level,
}

/// A tile's pixels.
struct Tile<X, const N: usize> {
    opaque: Vec<Option<Box<Samples<N>>>>,
    inner: Box<[X; TILE_PIXELS]>,
}

thread_local! {
    /// Each thread's own.
    static WINDOW: Cell<Option<Box<Window>>> = const { Cell::new(None) };
}

/// Lends this thread's window, which is empty.
fn with_window<R>(f: impl FnOnce(&mut Window) -> R) -> R {
    let mut window = WINDOW.take().unwrap_or_else(|| Box::new(Window::new()));
    let result = f(&mut window);
    window.clear();
    WINDOW.set(Some(window));
    result
}

impl<T: HasLanes<N> + 'static, const N: usize> Engine<T, N> {
    /// Draws a block's fragments one by one.
    fn draw_plainly<P: Probe>(
        &self,
        pass: u32,
        tile: &mut Tile<T::Pixel, N>,
        block: &Block,
        probe: &mut P,
    ) {
        for fragment in block.iter() {
            let site = Site { x: fragment.x, y: fragment.y };
            let within = TileGrid::within(site.x, site.y);
            probe.fragment(fragment.coverage);
            let pixel = (&mut tile.opaque[within], &mut tile.inner[within]);
            self.plain.draw_parts(pass, site, pixel, &fragment, probe);
        }
    }

    /// Draws fragments many at a time.
    fn draw_together<P: Sum>(
        &self,
        pass: u32,
        tile: &mut Tile<T::Pixel, N>,
        blocks: &mut dyn Blocks,
        probe: &mut P,
    ) {
        with_window(|window| {
            let mut corner = [0; 2];
            while let Some(block) = blocks.next() {
                corner = corner_of(block);
                if !window.has_room() {
                    self.draw_window(pass, corner, tile, window, probe);
                }
                if self.plain.own_passes() == 0 {
                    self.add(window, block);
                    continue;
                }
                for fragment in block.iter() {
                    let within = TileGrid::within(fragment.x, fragment.y);
                    probe.fragment(fragment.coverage);
                    let opaque = &mut tile.opaque[within];
                    if let Some(coverage) = self.plain.cull(pass, opaque, &fragment, probe) {
                        window.push(&Fragment { coverage, ..fragment });
                    }
                }
            }
            self.draw_window(pass, corner, tile, window, probe);
        });
    }

    /// Draws a window's fragments and empties it.
    fn draw_window<P: Sum>(
        &self,
        pass: u32,
        corner: [u32; 2],
        tile: &mut Tile<T::Pixel, N>,
        window: &mut Window,
        probe: &mut P,
    ) {
        if !window.is_empty() {
            self.draw_rows(pass, corner, &mut tile.inner, window, probe);
            window.clear();
        }
    }

    fn add(&self, window: &mut Window, block: &Block) {
        for_level!(self.level, simd => window.add(simd, block))
    }

    /// What draws these of the design's own passes.
    fn drawing(&self, passes: Range<u32>, corner: [u32; 2]) -> Drawing<'_, T::InLanes> {
        // Where opaque fragments come first, who culls tells of each fragment.
        let tells_fragments = self.plain.own_passes() == 0;
        Drawing { design: &self.lanes, passes, corner, tells_fragments }
    }

    fn draw_rows<P: Sum>(
        &self,
        pass: u32,
        corner: [u32; 2],
        states: &mut [T::Pixel; TILE_PIXELS],
        window: &mut Window,
        probe: &mut P,
    ) {
        let pass = pass - self.plain.own_passes();
        let drawing = self.drawing(pass..pass + 1, corner);
        for_level!(self.level, simd => drawing.draw(simd, states, window, probe))
    }

    fn found<P: Sum>(
        &self,
        corner: [u32; 2],
        window: &mut Window,
        bare: TilePixels,
        probe: &mut P,
    ) -> TilePixels {
        let drawing = self.drawing(0..self.plain.inner.passes(), corner);
        let behind = [self.plain.background(); N];
        for_level!(self.level, simd => drawing.picture(simd, window, &behind, bare, probe))
    }

    fn colours(&self, tile: &Tile<T::Pixel, N>) -> TilePixels {
        let background = [self.plain.background(); N];
        let behind = |within: usize| match &tile.opaque[within] {
            Some(samples) => &samples.colour[..],
            None => &background[..],
        };
        for_level!(self.level, simd => resolve(simd, &self.lanes, &tile.inner, N, behind))
    }
}

/// Column and row of the first pixel of a block's tile.
fn corner_of(block: &Block) -> [u32; 2] {
    let first = |at: u16| u32::from(at) / TILE_SIDE as u32 * TILE_SIDE as u32;
    [first(block.x[0]), first(block.y[0])]
}

fn own<X: 'static, const N: usize>(state: &mut TileState) -> &mut Tile<X, N> {
    state.downcast_mut().expect("the state is the engine's own")
}

fn seen<X: 'static, const N: usize>(state: &TileState) -> &Tile<X, N> {
    state.downcast_ref().expect("the state is the engine's own")
}

impl<T: HasLanes<N> + 'static, const N: usize> TiledDesign for Engine<T, N> {
    fn passes(&self) -> u32 {
        Design::passes(&self.plain)
    }

    fn layout(&self) -> Layout {
        Design::layout(&self.plain)
    }

    fn bytes_per_fragment(&self) -> Option<usize> {
        Design::bytes_per_fragment(&self.plain)
    }

    fn clear(&self, grid: TileGrid, tile: TileId) -> TileState {
        let (opaque, inner): (Vec<_>, Vec<_>) = sites(grid, tile)
            .map(|site| Design::clear(&self.plain, site))
            .map(|pixel| (pixel.opaque, pixel.inner))
            .unzip();
        let Ok(inner) = inner.into_boxed_slice().try_into() else {
            unreachable!("a tile has as many")
        };
        Box::new(Tile::<T::Pixel, N> { opaque, inner })
    }

    fn draw(&self, pass: u32, state: &mut TileState, fragments: &Block, listener: Listener<'_>) {
        let tile = own::<T::Pixel, N>(state);
        match listener {
            Listener::Nobody => self.draw_plainly(pass, tile, fragments, &mut NoProbe),
            Listener::Counts(counts) => self.draw_plainly(pass, tile, fragments, counts),
            Listener::Record(record) => self.draw_plainly(pass, tile, fragments, record),
        }
    }

    fn draw_blocks(
        &self,
        pass: u32,
        state: &mut TileState,
        blocks: &mut dyn Blocks,
        mut listener: Listener<'_>,
    ) {
        let together = pass >= self.plain.own_passes() && blocks.rows() >= LEAST_ROWS;
        let tile = own::<T::Pixel, N>(state);
        match &mut listener {
            Listener::Nobody if together => self.draw_together(pass, tile, blocks, &mut NoProbe),
            Listener::Counts(counts) if together => {
                self.draw_together(pass, tile, blocks, *counts);
            }
            _ => {
                while let Some(block) = blocks.next() {
                    self.draw(pass, state, block, listener.again());
                }
            }
        }
    }

    fn picture(
        &self,
        grid: TileGrid,
        tile: TileId,
        blocks: &mut dyn Blocks,
        listener: Listener<'_>,
    ) -> Option<TilePixels> {
        let rows = blocks.rows();
        let fits = (LEAST_ROWS..=MOST_ROWS - BLOCK).contains(&rows);
        let opaque_first = self.plain.own_passes() > 0;
        if !fits || opaque_first || matches!(listener, Listener::Record(_)) {
            return None;
        }
        let site = Site { x: 0, y: 0 };
        let bare = Design::resolve(&self.plain, site, &Design::clear(&self.plain, site));
        let bare = Box::new([bare; TILE_PIXELS]);
        let (x, y) = grid.pixel(tile, 0);
        Some(with_window(|window| {
            while let Some(block) = blocks.next() {
                self.add(window, block);
            }
            match listener {
                Listener::Counts(counts) => self.found([x, y], window, bare, counts),
                _ => self.found([x, y], window, bare, &mut NoProbe),
            }
        }))
    }

    fn end_pass(
        &self,
        pass: u32,
        grid: TileGrid,
        tile: TileId,
        state: &mut TileState,
        mut listener: Listener<'_>,
    ) {
        let state = own::<T::Pixel, N>(state);
        let pixels = state.opaque.iter().zip(state.inner.iter_mut());
        for (site, (opaque, inner)) in sites(grid, tile).zip(pixels) {
            self.plain.end_parts(pass, site, (opaque, inner), &mut listener);
        }
    }

    fn resolve(&self, _grid: TileGrid, _tile: TileId, state: &TileState) -> TilePixels {
        self.colours(seen::<T::Pixel, N>(state))
    }

    fn contents(&self, state: &TileState, within: usize) -> Contents {
        let tile = seen::<T::Pixel, N>(state);
        self.plain.contents_of((&tile.opaque[within], &tile.inner[within]))
    }

    fn visibility(&self, state: &TileState, within: usize, at: &[Unorm32], to: &mut [f64]) -> bool {
        let tile = seen::<T::Pixel, N>(state);
        self.plain.visibility_of((&tile.opaque[within], &tile.inner[within]), at, to)
    }
}
