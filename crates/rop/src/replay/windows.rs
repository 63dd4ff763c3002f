//! Replays of traces that do not fit into memory: windows of fragments, one after the other,
//! sorted into tiles and drawn into the tiles' states, which are kept.

use rayon::prelude::*;

use crate::contract::event::EventCounts;
use crate::contract::tiled::{Listener, TileState};
use crate::replay::blocks::TileBlocks;
use crate::replay::group::group_tiles;
use crate::replay::{Drawn, Job};
use screendoor_trace::error::{Error, Result};
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
        let (states, events) = draw_group(job, &mut bins, group, (&mut done, total))?;
        drawn.events = drawn.events.map(|all| all.merged(&events));
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

/// The states of all tiles that a fragment touches, after the last pass.
///
/// # Errors
/// As [`crate::replay()`]; [`Error::Config`] where states that grow with the fragments do not fit
/// into memory.
pub(super) fn states(job: &Job<'_>) -> Result<TileMap<TileState>> {
    let Job { design, frame, trace, options } = job;
    if let Some(bytes) = design.bytes_per_fragment() {
        let all = trace.rows().saturating_mul(bytes as u64);
        if all > options.memory {
            return Err(Error::config(
                format_args!(
                    "what the design keeps of all {} fragments takes {} MiB",
                    trace.rows(),
                    all.div_ceil(1 << 20)
                ),
                "raise the memory limit (--memory), or take a design whose state is bounded",
            ));
        }
    }
    let mut bins = Bins::new(trace, options.window as u64, options.memory);
    let total = trace.rows() * u64::from(design.passes());
    let (states, _) = draw_group(job, &mut bins, &Tiles::All, (&mut 0, total))?;
    let mut touched = TileMap::new(frame.grid);
    for (tile, state) in states.into_touched() {
        if let Some(state) = state {
            touched.touch(tile, || state);
        }
    }
    Ok(touched)
}

/// Draws a group's tiles in windows: their states, and what was counted where that is asked for.
/// `done` rows of `total` came before.
fn draw_group(
    job: &Job<'_>,
    bins: &mut Bins,
    group: &Tiles,
    (done, total): (&mut u64, u64),
) -> Result<(TileMap<Option<TileState>>, EventCounts)> {
    let Job { design, frame, trace, options } = job;
    let mut states: TileMap<Option<TileState>> = TileMap::new(frame.grid);
    let mut events = EventCounts::default();
    for pass in 0..design.passes() {
        let mut next = RowPlace::default();
        while !next.is_end(trace) {
            let (end, through) = bins.fill(trace, next, options.window as u64, group)?;
            events = events.merged(&draw_window(job, bins, pass, &mut states));
            next = end;
            *done += through;
            (options.progress)(*done, total);
        }
        events = events.merged(&end_pass(job, pass, &mut states));
    }
    Ok((states, events))
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
