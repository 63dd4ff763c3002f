//! Windows of fragments, in three stages that run at the same time: one window is drawn
//! while the next is sorted and the batches of the one after that are read. Each stage
//! is parallel in itself.

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Mutex;

use fearless_simd::Level;
use rayon::prelude::*;

use crate::contract::event::EventCounts;
use crate::contract::frame::Frame;
use crate::contract::tiled::{Listener, TileState, TiledDesign};
use crate::replay::group::Group;
use crate::replay::unit::{Part, Sorter, Unit};
use screendoor_trace::error::Result;
use screendoor_trace::tile::{TileId, TileMap};
use screendoor_trace::trace::{Block, SampleMask, Trace};

/// Fragments of a window for each thread. With more, tiles are visited less often, but the
/// columns have left the nearer caches when they are copied: it comes to the same, and two
/// windows' batches are held.
const ROWS_PER_THREAD: usize = 1 << 15;
/// Fragments of a window, at most, however many threads there are: bounds the memory.
const WINDOW_ROWS: usize = 1 << 19;

/// Fragments that are read ahead for each thread: a batch of the usual size, so that all
/// threads can read at once.
const AHEAD_PER_THREAD: usize = 1 << 16;

/// Cuts a trace into windows of fragments.
pub(super) struct Windows<'a> {
    trace: &'a Trace,
    frame: &'a Frame,
    group: &'a Group,
    length: usize,
    ahead: usize,
    /// The next batch to read.
    next: usize,
    /// What has been read and not sorted, and how many rows that is.
    queue: VecDeque<Part>,
    queued: usize,
    /// One for each thread that ever sorted at the same time.
    sorters: Mutex<Vec<Sorter>>,
    /// A tile's place in the window's `work` plus one; all zero between windows.
    places: Vec<u32>,
}

/// A window's fragments, sorted into tiles.
pub(super) struct Window {
    level: Level,
    /// How many rows it was made of.
    pub rows: usize,
    units: Vec<Unit>,
    /// Tiles with fragments, in the order in which they were met.
    work: Vec<Work>,
    runs: Vec<Run>,
}

/// A tile's fragments: the first and the last of its runs.
struct Work {
    tile: TileId,
    first: u32,
    last: u32,
}

/// A tile's stretches in one unit, and the run in the next unit that has some, or itself.
struct Run {
    unit: u32,
    range: Range<u32>,
    next: u32,
}

impl<'a> Windows<'a> {
    /// Windows of at most `length` fragments of `group`.
    ///
    /// # Errors
    /// As [`Trace::batch`].
    pub(super) fn new(
        trace: &'a Trace,
        frame: &'a Frame,
        group: &'a Group,
        length: usize,
    ) -> Result<Self> {
        let threads = rayon::current_num_threads();
        let length = length.clamp(1, WINDOW_ROWS.min(ROWS_PER_THREAD * threads));
        let mut windows = Windows {
            trace,
            frame,
            group,
            length,
            ahead: length.max(WINDOW_ROWS.min(AHEAD_PER_THREAD * threads)),
            next: 0,
            queue: VecDeque::new(),
            queued: 0,
            sorters: Mutex::default(),
            places: vec![0; frame.grid.count()],
        };
        let batches = windows.plan();
        windows.queue = windows.read(batches)?.into();
        Ok(windows)
    }

    /// Fills `window` with the next fragments, reading ahead; `false` at the end.
    ///
    /// # Errors
    /// As [`Trace::batch`].
    pub(super) fn fill(&mut self, window: &mut Window) -> Result<bool> {
        let parts = self.take();
        let batches = self.plan();
        let this = &*self;
        let (units, read) = rayon::join(|| this.sort(&parts, window), || this.read(batches));
        self.queue.extend(read?);
        self.chain(window, units);
        Ok(!parts.is_empty())
    }

    /// A window's worth of what has been read.
    fn take(&mut self) -> Vec<Part> {
        let (mut parts, mut rows) = (Vec::new(), 0);
        while rows < self.length
            && let Some(Part { batch, rows: left }) = self.queue.pop_front()
        {
            let cut = left.end.min(left.start + self.length - rows);
            if cut < left.end {
                self.queue.push_front(Part { batch: batch.clone(), rows: cut..left.end });
            }
            if left.start < cut {
                rows += cut - left.start;
                parts.push(Part { batch, rows: left.start..cut });
            }
        }
        self.queued -= rows;
        parts
    }

    /// The batches to read now: none where what has been read makes a window.
    fn plan(&mut self) -> Range<usize> {
        let first = self.next;
        let wanted = if self.queued < self.length { self.ahead } else { 0 };
        while self.queued < wanted && self.next < self.trace.batch_count() {
            self.queued += self.trace.batch_rows(self.next) as usize;
            self.next += 1;
        }
        first..self.next
    }

    fn read(&self, batches: Range<usize>) -> Result<Vec<Part>> {
        let read = |i| self.trace.batch(i).map(|batch| Part { rows: 0..batch.len(), batch });
        // The first error in the trace's order, whichever was met first.
        batches.into_par_iter().map(read).collect::<Vec<_>>().into_iter().collect()
    }

    /// Sorts `parts` into the window's units; tells how many it takes.
    fn sort(&self, parts: &[Part], window: &mut Window) -> usize {
        window.rows = parts.iter().map(|part| part.rows.len()).sum();
        let parts: Vec<Part> = parts.iter().flat_map(Part::cut).collect();
        let units = parts.len();
        if window.units.len() < units {
            window.units.resize_with(units, Unit::default);
        }
        window.units[..units].par_iter_mut().zip(&parts).for_each(|(unit, part)| {
            let idle = self.sorters.lock().expect("no thread panicked").pop();
            let mut sorter = idle.unwrap_or_else(|| Sorter::new(self.frame));
            unit.fill(part, self.frame, self.group, &mut sorter);
            self.sorters.lock().expect("no thread panicked").push(sorter);
        });
        units
    }

    /// Strings the tiles' runs together, unit after unit.
    fn chain(&mut self, window: &mut Window, units: usize) {
        window.work.clear();
        window.runs.clear();
        for (i, unit) in window.units[..units].iter().enumerate() {
            for (tile, range) in unit.tiles() {
                let run = window.runs.len() as u32;
                window.runs.push(Run { unit: i as u32, range, next: run });
                let place = &mut self.places[tile.0 as usize];
                if *place == 0 {
                    window.work.push(Work { tile, first: run, last: run });
                    *place = window.work.len() as u32;
                } else {
                    let work = &mut window.work[*place as usize - 1];
                    window.runs[work.last as usize].next = run;
                    work.last = run;
                }
            }
        }
        for work in &window.work {
            self.places[work.tile.0 as usize] = 0;
        }
    }
}

impl Default for Window {
    fn default() -> Self {
        let (units, work, runs) = Default::default();
        Window { level: Level::new(), rows: 0, units, work, runs }
    }
}

impl Window {
    /// Draws the window's fragments into the tiles' states, tiles in parallel; counts
    /// events where it is asked to.
    pub(super) fn draw(
        &self,
        design: &dyn TiledDesign,
        frame: &Frame,
        pass: u32,
        states: &mut TileMap<Option<TileState>>,
        count: bool,
    ) -> EventCounts {
        // Tiles are lent to the threads that draw them; new ones are cleared there.
        let mut lent = Vec::with_capacity(self.work.len());
        for work in &self.work {
            let slot = states.touch(work.tile, || None);
            lent.push((states.touched_mut()[slot].1.take(), work, slot));
        }
        let draw_tile =
            |block: &mut Block, (state, work, _): &mut (Option<TileState>, &Work, usize)| {
                let mut counts = count.then(EventCounts::default);
                self.for_each_block(work, frame, block, |block| {
                    let state = state.get_or_insert_with(|| design.clear(frame.grid, work.tile));
                    let listener = counts.as_mut().map_or(Listener::Nobody, Listener::Counts);
                    design.draw(pass, state, block, listener);
                });
                counts.unwrap_or_default()
            };
        let events = if count {
            let merge = |a: EventCounts, b: EventCounts| a.merged(&b);
            let tiles = lent.par_iter_mut().map_init(Block::default, draw_tile);
            tiles.reduce(EventCounts::default, merge)
        } else {
            lent.par_iter_mut().for_each_init(Block::default, |block, tile| {
                draw_tile(block, tile);
            });
            EventCounts::default()
        };
        for (state, _, slot) in lent {
            states.touched_mut()[slot].1 = state;
        }
        events
    }

    /// Tells `each` a tile's fragments, a block at a time; `block` is where they are put.
    fn for_each_block(
        &self,
        work: &Work,
        frame: &Frame,
        block: &mut Block,
        mut each: impl FnMut(&Block),
    ) {
        let mask = SampleMask::first(frame.samples());
        let mut pass_on = |block: &mut Block| {
            if !block.is_empty() {
                each(block);
            }
            block.clear();
        };
        let mut next = work.first;
        loop {
            let run = &self.runs[next as usize];
            let unit = &self.units[run.unit as usize];
            let mut stretches = unit.stretches(run.range.clone());
            loop {
                let taken = block.gather(self.level, unit.batch(), stretches, mask, frame.columns);
                stretches = &stretches[taken..];
                if stretches.is_empty() {
                    break;
                }
                pass_on(block);
            }
            if next == work.last {
                break;
            }
            next = run.next;
        }
        pass_on(block);
    }
}
