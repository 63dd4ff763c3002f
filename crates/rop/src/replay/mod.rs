//! Replaying a trace through a design: streamed, binned by tile, tiles in
//! parallel.
//!
//! While a window of fragments is drawn, the next is sorted into tiles and the one
//! after that is read; each of the three is parallel in itself. Within a tile,
//! fragments stay in API order and one thread draws them, so that neither the number
//! of threads nor the size of the windows changes a bit of the result. Memory is that
//! of the touched tiles' state and of a few windows, which are small: what is sorted
//! should still lie in a cache when it is drawn. A design whose state grows with the
//! fragments is given the trace several times, for groups of tiles that fit into the
//! memory limit.

mod explain;
mod group;
mod options;
mod unit;
mod window;

use crate::contract::tiled::{Listener, TileState, TiledDesign};
use rayon::prelude::*;

pub use explain::{ExplainLimits, Explanation, Step, draw_pixel, explain};
pub use options::{Implementation, ReplayOptions};

use crate::contract::event::EventCounts;
use crate::contract::frame::Frame;
use crate::contract::layout::{Layout, StateBits};
use crate::replay::group::{Group, group_tiles};
use crate::replay::window::{Window, Windows};
use screendoor_trace::error::Result;
use screendoor_trace::picture::{Picture, TilePixels};
use screendoor_trace::tile::{TileId, TileMap};
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
    let groups = match design.bytes_per_fragment() {
        None => vec![Group::Everything],
        Some(bytes) => group_tiles(frame, trace, bytes as u64, options)?,
    };
    let grid = frame.grid;
    let mut finished: TileMap<TilePixels> = TileMap::new(grid);
    let mut events = options.count_events.then(EventCounts::default);
    let total = trace.rows() * u64::from(design.passes()) * groups.len() as u64;
    let mut done = 0;
    let (mut window, mut ahead) = (Window::default(), Window::default());
    for group in &groups {
        let mut states: TileMap<Option<TileState>> = TileMap::new(grid);
        for pass in 0..design.passes() {
            let mut windows = Windows::new(trace, frame, group, options.window)?;
            let mut more = windows.fill(&mut window)?;
            while more {
                let (drawn, filled) = rayon::join(
                    || window.draw(design, frame, pass, &mut states, options.count_events),
                    || windows.fill(&mut ahead),
                );
                events = events.map(|events| events.merged(&drawn));
                done += window.rows as u64;
                (options.progress)(done, total);
                more = filled?;
                std::mem::swap(&mut window, &mut ahead);
            }
            let ended = end_pass(design, pass, &mut states, options.count_events);
            events = events.map(|events| events.merged(&ended));
        }
        let resolved = states.filter_map(|tiles| {
            // A tile without a state was met by nothing that covers a sample.
            let resolve = |(tile, state): (TileId, Option<TileState>)| {
                Some((tile, design.resolve(grid, tile, &state?)))
            };
            tiles.into_par_iter().filter_map(resolve).collect()
        });
        merge(&mut finished, resolved, group);
    }
    let touched_tiles = finished.touched().len();
    Ok(Replayed {
        picture: Picture::from_tiles(frame.background.map(f64::from), finished)
            .in_space(frame.space),
        events,
        state_bits: design.state_bits(),
        layout: design.layout(),
        passes: design.passes(),
        touched_tiles,
    })
}

/// Ends a pass in all touched tiles; counts events where it is asked to.
fn end_pass(
    design: &dyn TiledDesign,
    pass: u32,
    states: &mut TileMap<Option<TileState>>,
    count: bool,
) -> EventCounts {
    let grid = states.grid();
    let end = |(tile, state): &mut (TileId, Option<TileState>)| {
        let mut counts = count.then(EventCounts::default);
        if let Some(state) = state {
            let listener = counts.as_mut().map_or(Listener::Nobody, Listener::Counts);
            design.end_pass(pass, grid, *tile, state, listener);
        }
        counts
    };
    let merge = |a: Option<EventCounts>, b: Option<EventCounts>| match (a, b) {
        (Some(a), Some(b)) => Some(a.merged(&b)),
        (a, b) => a.or(b),
    };
    let tiles = states.touched_mut().par_iter_mut();
    tiles.map(end).reduce(|| None, merge).unwrap_or_default()
}

/// Adds a group's tiles to the finished ones; of a tile that is done in parts,
/// only the part's pixels.
fn merge(finished: &mut TileMap<TilePixels>, part: TileMap<TilePixels>, group: &Group) {
    for (tile, pixels) in part.into_touched() {
        match group {
            Group::Part(_, within) if finished.get(tile).is_some() => {
                let whole = finished.get_or_insert_with(tile, || unreachable!("it is there"));
                whole[within.clone()].copy_from_slice(&pixels[within.clone()]);
            }
            _ => {
                finished.get_or_insert_with(tile, || pixels);
            }
        }
    }
}
