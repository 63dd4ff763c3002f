//! A design with its types hidden, so that the replay around it is compiled once
//! rather than for each design and sample count.

use std::any::Any;

use crate::contract::contents::Contents;
use crate::contract::design::Design;
use crate::contract::event::{Event, EventCounts, Listen, NoProbe, Probe, Record};
use crate::contract::frame::Site;
use crate::contract::layout::{Layout, StateBits};
use screendoor_trace::picture::TilePixels;
use screendoor_trace::tile::{TILE_PIXELS, TileGrid, TileId};
use screendoor_trace::trace::{Block, Unorm32};

/// The pixels of a tile as their design holds them.
pub type TileState = Box<dyn Any + Send + Sync>;

/// A design, tile by tile: a few dynamic calls for many fragments, none for each.
pub trait TiledDesign: Send + Sync {
    /// As [`Design::passes`].
    fn passes(&self) -> u32;
    /// As [`Design::layout`].
    fn layout(&self) -> Layout;
    /// Its bits.
    fn state_bits(&self) -> StateBits {
        self.layout().bits()
    }
    /// As [`Design::bytes_per_fragment`].
    fn bytes_per_fragment(&self) -> Option<usize>;
    /// A cleared tile.
    fn clear(&self, grid: TileGrid, tile: TileId) -> TileState;
    /// Draws fragments of one tile, in this order; rows that cover nothing are none.
    fn draw(&self, pass: u32, state: &mut TileState, fragments: &Block, listener: Listener<'_>);
    /// Draws all that `blocks` gives, of one tile, in this order: what an engine gains by
    /// seeing many of a tile's fragments at once is its own matter.
    fn draw_blocks(
        &self,
        pass: u32,
        state: &mut TileState,
        blocks: &mut dyn Blocks,
        mut listener: Listener<'_>,
    ) {
        while let Some(block) = blocks.next() {
            self.draw(pass, state, block, listener.again());
        }
    }
    /// The colours of a tile of which `blocks` are all fragments, of an engine that finds them
    /// without a state in memory: as of a cleared tile that they are drawn to, in all passes.
    /// `None`, and no block is taken, where it does not.
    fn picture(
        &self,
        _grid: TileGrid,
        _tile: TileId,
        _blocks: &mut dyn Blocks,
        _listener: Listener<'_>,
    ) -> Option<TilePixels> {
        None
    }
    /// Ends a pass for a tile.
    fn end_pass(
        &self,
        pass: u32,
        grid: TileGrid,
        tile: TileId,
        state: &mut TileState,
        listener: Listener<'_>,
    );
    /// The colours of a tile.
    fn resolve(&self, grid: TileGrid, tile: TileId, state: &TileState) -> TilePixels;
    /// What a tile's pixel holds; `within` is its place in the tile.
    fn contents(&self, state: &TileState, within: usize) -> Contents;
    /// As [`Design::visibility`], of a tile's pixel. An engine that cannot tell quickly says no, as
    /// here, and the plain text is asked.
    fn visibility(
        &self,
        _state: &TileState,
        _within: usize,
        _at: &[Unorm32],
        _to: &mut [f64],
    ) -> bool {
        false
    }
}

/// A tile's fragments, a block at a time.
pub trait Blocks {
    /// How many rows are left, at most.
    fn rows(&self) -> usize;
    /// The next block; `None` at the end.
    fn next(&mut self) -> Option<&Block>;
}

/// Blocks that are there already.
#[derive(Clone, Debug)]
pub struct BlockList<'a>(std::slice::Iter<'a, Block>);

impl<'a> BlockList<'a> {
    /// These, in their order.
    pub fn new(blocks: &'a [Block]) -> Self {
        BlockList(blocks.iter())
    }
}

impl Blocks for BlockList<'_> {
    fn rows(&self) -> usize {
        self.0.as_slice().iter().map(Block::rows).sum()
    }
    fn next(&mut self) -> Option<&Block> {
        self.0.next()
    }
}

/// Who is told what happens.
#[derive(Debug)]
pub enum Listener<'a> {
    /// Nobody.
    Nobody,
    /// A tally.
    Counts(&'a mut EventCounts),
    /// A report of one fragment.
    Record(&'a mut Record),
}

impl<D: Design> TiledDesign for D {
    fn passes(&self) -> u32 {
        Design::passes(self)
    }

    fn layout(&self) -> Layout {
        Design::layout(self)
    }

    fn bytes_per_fragment(&self) -> Option<usize> {
        Design::bytes_per_fragment(self)
    }

    fn clear(&self, grid: TileGrid, tile: TileId) -> TileState {
        let pixels: Vec<D::Pixel> =
            sites(grid, tile).map(|site| Design::clear(self, site)).collect();
        Box::new(pixels)
    }

    fn draw(
        &self,
        pass: u32,
        state: &mut TileState,
        fragments: &Block,
        mut listener: Listener<'_>,
    ) {
        let pixels = state.downcast_mut::<Vec<D::Pixel>>().expect("the state is the design's own");
        match listener {
            Listener::Nobody => draw_all(self, pass, pixels, fragments, &mut NoProbe),
            Listener::Counts(_) | Listener::Record(_) => {
                draw_all(self, pass, pixels, fragments, &mut listener);
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
        let pixels = state.downcast_mut::<Vec<D::Pixel>>().expect("the state is the design's own");
        for (site, pixel) in sites(grid, tile).zip(pixels) {
            Design::end_pass(self, pass, site, pixel, &mut listener);
        }
    }

    fn resolve(&self, grid: TileGrid, tile: TileId, state: &TileState) -> TilePixels {
        let pixels = state.downcast_ref::<Vec<D::Pixel>>().expect("the state is the design's own");
        let mut result = Box::new([[0.0; 3]; TILE_PIXELS]);
        for ((site, pixel), out) in sites(grid, tile).zip(pixels).zip(result.iter_mut()) {
            *out = Design::resolve(self, site, pixel);
        }
        result
    }

    fn contents(&self, state: &TileState, within: usize) -> Contents {
        let pixels = state.downcast_ref::<Vec<D::Pixel>>().expect("the state is the design's own");
        Design::contents(self, &pixels[within])
    }

    fn visibility(&self, state: &TileState, within: usize, at: &[Unorm32], to: &mut [f64]) -> bool {
        let pixels = state.downcast_ref::<Vec<D::Pixel>>().expect("the state is the design's own");
        Design::visibility(self, &pixels[within], at, to)
    }
}

fn draw_all<D: Design, P: Probe>(
    design: &D,
    pass: u32,
    pixels: &mut [D::Pixel],
    fragments: &Block,
    probe: &mut P,
) {
    for fragment in fragments.iter() {
        let site = Site { x: fragment.x, y: fragment.y };
        let pixel = &mut pixels[TileGrid::within(site.x, site.y)];
        probe.fragment(fragment.coverage);
        design.draw(pass, site, pixel, &fragment, probe);
    }
}

/// The sites of a tile's pixels, including those beyond the frame's edge.
pub(crate) fn sites(grid: TileGrid, tile: TileId) -> impl Iterator<Item = Site> {
    (0..TILE_PIXELS).map(move |within| {
        let (x, y) = grid.pixel(tile, within);
        // Beyond a frame of full size this wraps; such pixels are never drawn to.
        Site { x: x as u16, y: y as u16 }
    })
}

impl Listener<'_> {
    /// The same listener, lent for a while.
    pub fn again(&mut self) -> Listener<'_> {
        match self {
            Listener::Nobody => Listener::Nobody,
            Listener::Counts(counts) => Listener::Counts(counts),
            Listener::Record(record) => Listener::Record(record),
        }
    }
}

impl Listen for Listener<'_> {
    #[inline(never)]
    fn event(&mut self, event: Event<'_>) {
        match self {
            Listener::Nobody => {}
            Listener::Counts(counts) => counts.event(event),
            Listener::Record(record) => record.event(event),
        }
    }
}
