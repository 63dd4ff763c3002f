//! Replaying a trace through a design: sorted into tiles, tiles in parallel.
//!
//! A pass over the file copies the fragments to bins, tile by tile. Where all of them fit
//! into the memory limit, each tile is then drawn whole, all passes one after the other, and
//! the bins are kept for the trace's next replay. Where they do not, the trace is replayed
//! in windows that do, and the touched tiles' states are kept from one to the next; a design
//! whose state grows with the fragments is given the trace several times then, for groups of
//! tiles that fit.
//!
//! Within a tile, fragments stay in API order and one thread draws them, so that neither
//! the number of threads nor the size of the windows changes a bit of the result.

mod blocks;
mod explain;
mod group;
mod options;
#[cfg(test)]
mod tests;
mod whole;
mod windows;

pub use explain::{ExplainLimits, Explanation, Step, draw_pixel, explain};
pub use options::{Implementation, ReplayOptions};

use crate::contract::event::EventCounts;
use crate::contract::frame::Frame;
use crate::contract::layout::{Layout, StateBits};
use crate::contract::tiled::{TileState, TiledDesign};
use screendoor_trace::error::Result;
use screendoor_trace::picture::{Picture, TilePixels};
use screendoor_trace::tile::TileMap;
use screendoor_trace::trace::Trace;

/// The result of a replay.
#[derive(Clone, Debug)]
pub struct Replayed {
    /// The picture.
    pub picture: Picture,
    /// What the design did, if it was asked to count.
    pub events: Option<EventCounts>,
    /// State per pixel.
    pub state_bits: StateBits,
    /// How it is made up.
    pub layout: Layout,
    /// How many times the design read the trace.
    pub passes: u32,
    /// Tiles that at least one fragment touched.
    pub touched_tiles: usize,
}

/// What is replayed.
struct Job<'a> {
    design: &'a dyn TiledDesign,
    frame: &'a Frame,
    trace: &'a Trace,
    options: &'a ReplayOptions<'a>,
}

/// What was drawn: tiles that at least one fragment touched.
struct Drawn {
    tiles: TileMap<TilePixels>,
    events: Option<EventCounts>,
}

/// The states of all tiles that a fragment touches when the whole of `trace` is drawn.
///
/// # Errors
/// As [`replay()`]; [`screendoor_trace::error::Error::Config`] where states that grow with the fragments do not
/// fit into the memory limit.
pub(crate) fn states(
    design: &dyn TiledDesign,
    frame: &Frame,
    trace: &Trace,
    options: &ReplayOptions<'_>,
) -> Result<TileMap<TileState>> {
    let job = Job { design, frame, trace, options };
    match whole::bins(&job)? {
        Some(bins) if whole::keeps_all(&job, &bins) => Ok(whole::states(&job, &bins)),
        _ => windows::states(&job),
    }
}

/// Replays `trace` through `design`.
///
/// # Errors
/// As [`Trace::batch`]; [`screendoor_trace::error::Error::Config`] where one pixel's fragments do not fit
/// into the memory limit.
pub fn replay(
    design: &dyn TiledDesign,
    frame: &Frame,
    trace: &Trace,
    options: &ReplayOptions<'_>,
) -> Result<Replayed> {
    let job = Job { design, frame, trace, options };
    let Drawn { tiles, events } = match whole::bins(&job)? {
        Some(bins) => whole::draw(&job, &bins),
        None => windows::draw(&job)?,
    };
    let touched_tiles = tiles.touched().len();
    Ok(Replayed {
        picture: Picture::from_tiles(frame.background.map(f64::from), tiles).in_space(frame.space),
        events,
        state_bits: design.state_bits(),
        layout: design.layout(),
        passes: design.passes(),
        touched_tiles,
    })
}
