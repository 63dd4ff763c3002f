//! Replays of traces that fit into memory: each tile is drawn whole, all passes one after the
//! other, and its state goes before the next tile's comes.

use std::sync::{Arc, Mutex, PoisonError};

use rayon::prelude::*;

use crate::contract::event::EventCounts;
use crate::contract::tiled::{Listener, TileState};
use crate::replay::blocks::TileBlocks;
use crate::replay::{Drawn, Job};
use screendoor_trace::error::Result;
use screendoor_trace::picture::TilePixels;
use screendoor_trace::tile::{TileId, TileMap};
use screendoor_trace::trace::{Bins, Block, RowPlace, Tiles, Trace};

/// The trace's fragments sorted into tiles, those that are kept or new ones; `None` where they
/// take more than they may.
///
/// # Errors
/// As [`screendoor_trace::trace::Trace::batch`].
pub(super) fn bins(job: &Job<'_>) -> Result<Option<Arc<Bins>>> {
    let Job { trace, options, .. } = job;
    let in_windows = (options.window as u64) < trace.rows();
    let fits = |bins: &Bins| match job.design.bytes_per_fragment() {
        None => bins.bytes() <= options.memory,
        // A tile's state has to fit beside them.
        Some(bytes) => {
            let most = bins.tiles().iter().map(|(_, rows)| *rows).max();
            let state = most.unwrap_or_default().saturating_mul(bytes as u64);
            bins.bytes().saturating_add(state) <= options.memory
        }
    };
    if options.keep
        && !in_windows
        && let Some(bins) = trace.kept_bins()?
        && fits(&bins)
    {
        return Ok(Some(bins));
    }
    if options.keep {
        // What comes may take all the memory that there is for fragments.
        Trace::forget_bins();
    }
    let memory = match job.design.bytes_per_fragment() {
        None => options.memory,
        Some(_) => options.memory / 2,
    };
    if in_windows || trace.rows() > Bins::rows_within(trace, memory) {
        return Ok(None);
    }
    let mut bins = Bins::new(trace, trace.rows(), memory);
    let (end, _) = bins.fill(trace, RowPlace::default(), trace.rows(), &Tiles::All)?;
    if !end.is_end(trace) || !fits(&bins) {
        return Ok(None);
    }
    let bins = Arc::new(bins);
    if options.keep {
        trace.keep_bins(Arc::clone(&bins));
    }
    Ok(Some(bins))
}

/// Draws all tiles.
pub(super) fn draw(job: &Job<'_>, bins: &Bins) -> Drawn {
    let mut drawn = Drawn {
        tiles: TileMap::new(job.frame.grid),
        events: job.options.count_events.then(EventCounts::default),
    };
    let told = Told::new(job);
    let mut left = bins.tiles();
    while !left.is_empty() {
        let (some, others) = left.split_at(together(job, bins, left));
        left = others;
        let draw = |block: &mut Block, (tile, rows): &(TileId, u64)| {
            let result = draw_tile(job, bins, *tile, block);
            told.more(*rows);
            result
        };
        let tiles: Vec<_> = some.par_iter().map_init(Block::default, draw).collect();
        for ((tile, _), (pixels, events)) in some.iter().zip(tiles) {
            if let Some(pixels) = pixels {
                drawn.tiles.touch(*tile, || pixels);
            }
            drawn.events = drawn.events.zip(events).map(|(all, events)| all.merged(&events));
        }
    }
    told.all();
    drawn
}

/// Whether the states of all tiles fit beside the fragments, of a design whose state grows with
/// them.
pub(super) fn keeps_all(job: &Job<'_>, bins: &Bins) -> bool {
    together(job, bins, bins.tiles()) == bins.tiles().len()
}

/// The states of all tiles that a fragment touches, after the last pass.
pub(super) fn states(job: &Job<'_>, bins: &Bins) -> TileMap<TileState> {
    let told = Told::new(job);
    let draw = |block: &mut Block, (tile, rows): &(TileId, u64)| {
        let found = drawn_tile(job, bins, *tile, block, (&mut None, true));
        told.more(*rows);
        match found {
            Found::State(state) => Some((*tile, state)),
            Found::Nothing | Found::Picture(_) => None,
        }
    };
    let drawn = bins.tiles().par_iter().map_init(Block::default, draw);
    let mut states = TileMap::new(job.frame.grid);
    for (tile, state) in drawn.collect::<Vec<_>>().into_iter().flatten() {
        states.touch(tile, || state);
    }
    told.all();
    states
}

/// How many of the tiles may be drawn at the same time: their states must fit into memory.
fn together(job: &Job<'_>, bins: &Bins, tiles: &[(TileId, u64)]) -> usize {
    let Some(bytes) = job.design.bytes_per_fragment() else { return tiles.len() };
    let mut room = job.options.memory.saturating_sub(bins.bytes());
    let fits = |(_, rows): &&(TileId, u64)| {
        let left = room.checked_sub(rows * bytes as u64);
        room = left.unwrap_or_default();
        left.is_some()
    };
    tiles.iter().take_while(fits).count().max(1)
}

/// A tile's pixels, where a fragment touches it, and what the design did.
fn draw_tile(
    job: &Job<'_>,
    bins: &Bins,
    tile: TileId,
    block: &mut Block,
) -> (Option<TilePixels>, Option<EventCounts>) {
    let mut counts = job.options.count_events.then(EventCounts::default);
    let Job { design, frame, .. } = job;
    let pixels = match drawn_tile(job, bins, tile, block, (&mut counts, false)) {
        Found::Nothing => None,
        Found::Picture(pixels) => Some(pixels),
        Found::State(state) => Some(design.resolve(frame.grid, tile, &state)),
    };
    (pixels, counts)
}

/// What is left of a tile after the last pass.
enum Found {
    /// No fragment touches it.
    Nothing,
    /// Its colours, which an engine found without a state.
    Picture(TilePixels),
    State(TileState),
}

/// Draws a tile in all passes and counts events where that is asked for. Where its state is to be
/// kept, no engine may do without.
fn drawn_tile(
    job: &Job<'_>,
    bins: &Bins,
    tile: TileId,
    block: &mut Block,
    (counts, keep): (&mut Option<EventCounts>, bool),
) -> Found {
    let Job { design, frame, .. } = job;
    let mut state = None;
    for pass in 0..design.passes() {
        let mut blocks = TileBlocks::of(bins, tile, frame, block);
        if !blocks.any() {
            return Found::Nothing;
        }
        if pass == 0 && !keep {
            let listener = counts.as_mut().map_or(Listener::Nobody, Listener::Counts);
            if let Some(pixels) = design.picture(frame.grid, tile, &mut blocks, listener) {
                return Found::Picture(pixels);
            }
        }
        let state = state.get_or_insert_with(|| design.clear(frame.grid, tile));
        let mut listener = counts.as_mut().map_or(Listener::Nobody, Listener::Counts);
        design.draw_blocks(pass, state, &mut blocks, listener.again());
        design.end_pass(pass, frame.grid, tile, state, listener);
    }
    state.map_or(Found::Nothing, Found::State)
}

/// Tells how far a replay has got, from any thread, now and then.
struct Told<'a> {
    job: &'a Job<'a>,
    total: u64,
    /// Rows that are drawn, and those of them that have been told.
    done: Mutex<(u64, u64)>,
}

impl<'a> Told<'a> {
    fn new(job: &'a Job<'a>) -> Self {
        let total = job.trace.rows() * u64::from(job.design.passes());
        Told { job, total, done: Mutex::default() }
    }

    fn more(&self, rows: u64) {
        let mut done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        done.0 += rows * u64::from(self.job.design.passes());
        // The end is told once.
        if done.0 - done.1 > self.total / 128 && done.0 < self.total {
            done.1 = done.0;
            (self.job.options.progress)(done.0, self.total);
        }
    }

    fn all(&self) {
        if self.total > 0 {
            (self.job.options.progress)(self.total, self.total);
        }
    }
}
