//! The exact answer faster: a pixel's layers are sorted once instead of at every
//! sample, and composited at eight samples at once. Samples at which that order
//! proves wrong are sorted on their own.

use std::cell::Cell;

use fearless_simd::{Level, dispatch};

use crate::exact::layer::{Layer, Tags};
use crate::exact::resolve::{Octets, Room};
use crate::exact::tell;
use screendoor_rop::{
    Blocks, Contents, Frame, Layout as StateLayout, Listener, Probe, TileState, TiledDesign,
};
use screendoor_trace::picture::TilePixels;
use screendoor_trace::tile::{TILE_PIXELS, TileGrid, TileId};
use screendoor_trace::trace::{BLOCK, Block};

/// The engine. It is compiled once for all sample counts: it works in blocks of
/// eight samples.
pub(super) struct Fast {
    frame: Frame,
    octets: Octets,
    /// Is asked for what the engine says of the design.
    reference: Box<dyn TiledDesign>,
    level: Level,
}

/// Fragments of a tile that are kept in the thread's own memory, at most: 4 MiB.
const MOST_LAYERS: usize = 1 << 16;

thread_local! {
    /// Each thread's own.
    static OWN: Cell<(Vec<Layer>, Room)> = Cell::default();
}

impl Fast {
    /// The engine beside `reference`, on the instructions of `level`.
    pub(super) fn new(frame: &Frame, reference: Box<dyn TiledDesign>, level: Level) -> Self {
        Fast { frame: frame.clone(), octets: Octets::of(frame), reference, level }
    }

    fn add(&self, layers: &mut Vec<Layer>, block: &Block, listener: Listener<'_>) {
        match listener {
            Listener::Nobody => {}
            Listener::Counts(counts) => tell_all(&self.frame, block, counts),
            Listener::Record(record) => tell_all(&self.frame, block, record),
        }
        let tags = dispatch!(self.level, _simd => Tags::of(block));
        layers.reserve(block.rows());
        for i in 0..block.rows().min(BLOCK) {
            if block.coverage[i] != 0 {
                layers.push(Layer::of(block, &tags, i));
            }
        }
    }

    fn colours(&self, layers: &[Layer], room: &mut Room) -> TilePixels {
        dispatch!(self.level, simd => self.octets.resolve(simd, layers, room))
    }
}

impl TiledDesign for Fast {
    fn passes(&self) -> u32 {
        self.reference.passes()
    }

    fn layout(&self) -> StateLayout {
        self.reference.layout()
    }

    fn bytes_per_fragment(&self) -> Option<usize> {
        // A growing list can be half empty; while a tile is resolved there are two
        // lists of keys.
        Some(2 * size_of::<Layer>() + 2 * size_of::<u64>())
    }

    fn clear(&self, _grid: TileGrid, _tile: TileId) -> TileState {
        Box::new(Vec::<Layer>::with_capacity(TILE_PIXELS))
    }

    fn draw(&self, _pass: u32, state: &mut TileState, fragments: &Block, listener: Listener<'_>) {
        let layers = state.downcast_mut::<Vec<Layer>>().expect("the state is the engine's own");
        self.add(layers, fragments, listener);
    }

    fn picture(
        &self,
        _grid: TileGrid,
        _tile: TileId,
        blocks: &mut dyn Blocks,
        mut listener: Listener<'_>,
    ) -> Option<TilePixels> {
        if blocks.rows() > MOST_LAYERS {
            return None;
        }
        let (mut layers, mut room) = OWN.take();
        layers.clear();
        layers.reserve(blocks.rows());
        while let Some(block) = blocks.next() {
            self.add(&mut layers, block, listener.again());
        }
        let pixels = self.colours(&layers, &mut room);
        OWN.set((layers, room));
        Some(pixels)
    }

    fn end_pass(&self, _: u32, _: TileGrid, _: TileId, _: &mut TileState, _: Listener<'_>) {}

    fn resolve(&self, _grid: TileGrid, _tile: TileId, state: &TileState) -> TilePixels {
        let layers = state.downcast_ref::<Vec<Layer>>().expect("the state is the engine's own");
        self.colours(layers, &mut Room::default())
    }

    fn contents(&self, state: &TileState, within: usize) -> Contents {
        let layers = state.downcast_ref::<Vec<Layer>>().expect("the state is the engine's own");
        let count = layers.iter().filter(|l| usize::from(l.within) == within).count();
        Contents { samples: Vec::new(), fields: vec![("fragments", count.to_string())] }
    }
}

fn tell_all<P: Probe>(frame: &Frame, fragments: &Block, probe: &mut P) {
    for fragment in fragments.iter() {
        probe.fragment(fragment.coverage);
        tell(frame, &fragment, probe);
    }
}
