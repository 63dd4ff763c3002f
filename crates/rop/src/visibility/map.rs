//! A light's trace as a design has drawn it, to be asked.

use crate::contract::frame::Frame;
use crate::contract::layout::StateBits;
use crate::contract::tiled::{TileState, TiledDesign};
use crate::replay::{ReplayOptions, states};
use screendoor_trace::error::Result;
use screendoor_trace::tile::{TileGrid, TileId, TileMap};
use screendoor_trace::trace::{MAX_SAMPLES, Trace, Unorm32};

/// A light's trace drawn by a design whose state tells visibility. It takes the state of all
/// touched tiles.
pub struct VisibilityMap {
    design: Box<dyn TiledDesign>,
    grid: TileGrid,
    samples: usize,
    tiles: TileMap<TileState>,
}

impl VisibilityMap {
    /// Whether the state of a design tells visibility.
    pub fn answers(design: &dyn TiledDesign, frame: &Frame) -> bool {
        let pixel = design.clear(TileGrid::new(1, 1), TileId(0));
        let samples = frame.samples() as usize;
        let mut to = [0.0; MAX_SAMPLES as usize];
        design.visibility(&pixel, 0, &[Unorm32(0); MAX_SAMPLES as usize][..samples], {
            &mut to[..samples]
        })
    }

    /// Draws `trace`, a light's.
    ///
    /// # Errors
    /// As [`replay`](crate::replay()); [`screendoor_trace::error::Error::Config`] where the state of a design that
    /// grows with the fragments does not fit into the memory limit.
    ///
    /// # Panics
    /// Where the design does not [answer](VisibilityMap::answers).
    pub fn draw(
        design: Box<dyn TiledDesign>,
        frame: &Frame,
        trace: &Trace,
        options: &ReplayOptions<'_>,
    ) -> Result<Self> {
        assert!(Self::answers(&*design, frame), "the design tells no visibility");
        let tiles = states(&*design, frame, trace, options)?;
        Ok(VisibilityMap { grid: frame.grid, samples: frame.samples() as usize, design, tiles })
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.grid.width(), self.grid.height()]
    }

    /// State of a pixel. Colours, for which nobody asks here, are left out.
    pub fn state_bits(&self) -> StateBits {
        self.design.layout().without_colours().bits()
    }

    /// How many times the light's trace was read.
    pub fn passes(&self) -> u32 {
        self.design.passes()
    }

    /// The share of the light that reaches the depth `z` within the pixel in this column and row:
    /// 0 to 1, the mean over its samples. What lies outside the map is lit.
    pub fn pixel(&self, x: u32, y: u32, z: Unorm32) -> f64 {
        let (Ok(x), Ok(y), true) = (x.try_into(), y.try_into(), self.grid.contains((x, y))) else {
            return 1.0;
        };
        let Some(state) = self.tiles.get(self.grid.tile(x, y)) else { return 1.0 };
        let at = [z; MAX_SAMPLES as usize];
        let mut passes = [0.0; MAX_SAMPLES as usize];
        let passes = &mut passes[..self.samples];
        let within = TileGrid::within(x, y);
        let told = self.design.visibility(state, within, &at[..self.samples], passes);
        debug_assert!(told, "whether it tells was asked");
        passes.iter().sum::<f64>() / self.samples as f64
    }
}

impl std::fmt::Debug for VisibilityMap {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let touched = self.tiles.touched().len();
        write!(f, "VisibilityMap({:?}, {} samples, {touched} tiles)", self.grid, self.samples)
    }
}
