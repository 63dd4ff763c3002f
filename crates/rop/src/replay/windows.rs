//! Replays of traces that do not fit into memory: windows of fragments, one after the other,
//! sorted into tiles and drawn into the tiles' states, which are kept.

use rayon::prelude::*;

use crate::contract::event::EventCounts;
use crate::contract::tiled::{Listener, TileState};
use crate::replay::blocks::TileBlocks;
use crate::replay::group::group_tiles;
use crate::replay::{Drawn, Job};
use screendoor_trace::error::Result;
use screendoor_trace::picture::TilePixels;
use screendoor_trace::tile::{TileId, TileMap};
use screendoor_trace::trace::{Bins, Block, RowPlace, Tiles};

/// Bytes of a window, at most, for a design whose state takes what memory there is.
const BESIDE_STATE: u64 = 32 << 20;

/// Draws all tiles.
///
/// # Errors
/// As [`crate::replay()`].
pub(super) fn draw(job: &Job<'_>) -> Result<Drawn> {
    let Job { design, frame, trace, options } = job;
    let (groups, memory) = match design.bytes_per_fragment() {
        None => (vec![Tiles::All], options.memory),
        Some(bytes) => {
            let groups = group_tiles(frame, trace, bytes as u64, options)?;
            (groups, options.memory.min(BESIDE_STATE))
        }
    };
    let mut drawn = Drawn {
        tiles: TileMap::new(frame.grid),
        events: options.count_events.then(EventCounts::default),
    };
    let total = trace.rows() * u64::from(design.passes()) * groups.len() as u64;
    let mut done = 0;
    let rows = options.window as u64;
    let mut bins = Bins::new(trace, rows, memory);
    for group in &groups {
        let mut states: TileMap<Option<TileState>> = TileMap::new(frame.grid);
        for pass in 0..design.passes() {
            let mut next = RowPlace::default();
            while !next.is_end(trace) {
                let (end, through) = bins.fill(trace, next, rows, group)?;
                let events = draw_window(job, &bins, pass, &mut states);
                drawn.events = drawn.events.map(|all| all.merged(&events));
                next = end;
                done += through;
                (options.progress)(done, total);
            }
            let events = end_pass(job, pass, &mut states);
            drawn.events = drawn.events.map(|all| all.merged(&events));
        }
        let resolved = states.filter_map(|tiles| {
            // A tile without a state was met by nothing that covers a sample.
            let resolve = |(tile, state): (TileId, Option<TileState>)| {
                Some((tile, design.resolve(frame.grid, tile, &state?)))
            };
            tiles.into_par_iter().filter_map(resolve).collect()
        });
        merge(&mut drawn.tiles, resolved, group);
    }
    Ok(drawn)
}

/// Draws a window's fragments into the tiles' states, tiles in parallel; counts events where
/// it is asked to.
fn draw_window(
    job: &Job<'_>,
    bins: &Bins,
    pass: u32,
    states: &mut TileMap<Option<TileState>>,
) -> EventCounts {
    let Job { design, frame, options, .. } = job;
    // Tiles are lent to the threads that draw them; new ones are cleared there.
    let mut lent = Vec::with_capacity(bins.tiles().len());
    for (tile, _) in bins.tiles() {
        let slot = states.touch(*tile, || None);
        lent.push((*tile, states.touched_mut()[slot].1.take(), slot));
    }
    let draw_tile =
        |block: &mut Block, (tile, state, _): &mut (TileId, Option<TileState>, usize)| {
            let mut counts = options.count_events.then(EventCounts::default);
            let mut blocks = TileBlocks::of(bins, *tile, frame, block);
            if blocks.any() {
                let state = state.get_or_insert_with(|| design.clear(frame.grid, *tile));
                let listener = counts.as_mut().map_or(Listener::Nobody, Listener::Counts);
                design.draw_blocks(pass, state, &mut blocks, listener);
            }
            counts.unwrap_or_default()
        };
    let events = if options.count_events {
        let tiles = lent.par_iter_mut().map_init(Block::default, draw_tile);
        tiles.reduce(EventCounts::default, |a, b| a.merged(&b))
    } else {
        lent.par_iter_mut().for_each_init(Block::default, |block, tile| {
            draw_tile(block, tile);
        });
        EventCounts::default()
    };
    for (_, state, slot) in lent {
        states.touched_mut()[slot].1 = state;
    }
    events
}

/// Ends a pass in all touched tiles; counts events where it is asked to.
fn end_pass(job: &Job<'_>, pass: u32, states: &mut TileMap<Option<TileState>>) -> EventCounts {
    let end = |(tile, state): &mut (TileId, Option<TileState>)| {
        let mut counts = job.options.count_events.then(EventCounts::default);
        if let Some(state) = state {
            let listener = counts.as_mut().map_or(Listener::Nobody, Listener::Counts);
            job.design.end_pass(pass, job.frame.grid, *tile, state, listener);
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
fn merge(finished: &mut TileMap<TilePixels>, part: TileMap<TilePixels>, group: &Tiles) {
    for (tile, pixels) in part.into_touched() {
        match group {
            Tiles::Part(_, within) if finished.get(tile).is_some() => {
                let whole = finished.get_or_insert_with(tile, || unreachable!("it is there"));
                whole[within.clone()].copy_from_slice(&pixels[within.clone()]);
            }
            _ => {
                finished.get_or_insert_with(tile, || pixels);
            }
        }
    }
}
