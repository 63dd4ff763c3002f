//! Windows of fragments: read and binned in parallel, drawn tile by tile in parallel.

use std::ops::Range;
use std::sync::Mutex;

use rayon::prelude::*;

use crate::error::Result;
use crate::rop::design::Frame;
use crate::rop::event::EventCounts;
use crate::rop::replay::engine::{Engine, TileState, Told};
use crate::rop::replay::group::Group;
use crate::rop::replay::unit::{Part, Sorter, UNIT_ROWS, Unit};
use crate::tile::{TileId, TileMap};
use crate::trace::{Batch, Trace};

/// Fragments of a window for each thread: two windows' worth are held, decoded, and
/// what stays in the nearer caches between sorting and drawing is worth more than
/// visiting a tile less often.
const ROWS_PER_THREAD: usize = 1 << 15;
/// Fragments of a window, at most, however many threads there are: bounds the memory.
const WINDOW_ROWS: usize = 1 << 19;

/// Cuts a trace into windows of fragments.
pub(super) struct Windows<'a> {
    trace: &'a Trace,
    frame: &'a Frame,
    group: &'a Group,
    length: usize,
    /// The next batch, and how many of its rows lie behind.
    next: (usize, usize),
    /// The next batch, where it has been read: the last window ended within it.
    open: Option<Batch>,
    /// One for each thread that ever sorted at the same time.
    sorters: Mutex<Vec<Sorter>>,
    /// A tile's place in the window's `work` plus one; all zero between windows.
    places: Vec<u32>,
}

/// A window's fragments, sorted into tiles.
#[derive(Default)]
pub(super) struct Window {
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

/// A tile's fragments in one unit, and the run in the next unit that has some, or itself.
struct Run {
    unit: u32,
    range: Range<u32>,
    next: u32,
}

/// Rows of batch `index`, which may have been read.
struct Piece {
    index: usize,
    open: Option<Batch>,
    rows: Range<usize>,
}

impl<'a> Windows<'a> {
    pub fn new(trace: &'a Trace, frame: &'a Frame, group: &'a Group, length: usize) -> Self {
        Windows {
            trace,
            frame,
            group,
            length: length.min(WINDOW_ROWS.min(ROWS_PER_THREAD * rayon::current_num_threads())),
            next: (0, 0),
            open: None,
            sorters: Mutex::default(),
            places: vec![0; frame.grid.count()],
        }
    }

    /// Fills `window` with the next fragments; `false` at the end.
    ///
    /// # Errors
    /// As [`Trace::batch`].
    pub fn fill(&mut self, window: &mut Window) -> Result<bool> {
        let jobs = self.plan();
        window.rows = 0;
        window.work.clear();
        window.runs.clear();
        let mut units = 0;
        for job in &jobs {
            let rows: usize = job.iter().map(|piece| piece.rows.len()).sum();
            window.rows += rows;
            units += rows.div_ceil(UNIT_ROWS);
        }
        if window.units.len() < units {
            window.units.resize_with(units, Unit::default);
        }
        let mut rest = &mut window.units[..units];
        let mut tasks = Vec::with_capacity(jobs.len());
        for job in &jobs {
            let rows: usize = job.iter().map(|piece| piece.rows.len()).sum();
            let (units, later) = rest.split_at_mut(rows.div_ceil(UNIT_ROWS));
            tasks.push((job, units));
            rest = later;
        }
        let this = &*self;
        let run = |(job, units): (&Vec<Piece>, &mut [Unit])| -> Result<Option<Batch>> {
            let read = |piece: &Piece| match &piece.open {
                Some(batch) => Ok(batch.clone()),
                None => this.trace.batch(piece.index),
            };
            let batches = job.iter().map(read).collect::<Result<Vec<_>>>()?;
            units.par_iter_mut().enumerate().for_each(|(i, unit)| {
                let parts = cut(job, &batches, i * UNIT_ROWS..(i + 1) * UNIT_ROWS);
                let taken = this.sorters.lock().expect("no thread panicked").pop();
                let mut sorter = taken.unwrap_or_else(|| Sorter::new(this.frame));
                unit.fill(&parts, this.frame, this.group, &mut sorter);
                this.sorters.lock().expect("no thread panicked").push(sorter);
            });
            Ok(batches.into_iter().last())
        };
        let results: Vec<Result<Option<Batch>>> = tasks.into_par_iter().map(run).collect();
        for result in results {
            self.open = result?;
        }
        if self.next.1 == 0 {
            self.open = None;
        }
        self.chain(window, units);
        Ok(!jobs.is_empty())
    }

    /// What the next window is made of: large batches one by one, small ones in lots of
    /// about a unit, each of which one thread reads.
    fn plan(&mut self) -> Vec<Vec<Piece>> {
        let mut jobs: Vec<Vec<Piece>> = Vec::new();
        let (mut rows, mut in_last) = (0, usize::MAX);
        while rows < self.length && self.next.0 < self.trace.batch_count() {
            let (index, first) = self.next;
            let whole = self.trace.batch_rows(index) as usize;
            let taken = (whole - first).min(self.length - rows);
            let open = self.open.take();
            let piece = Piece { index, open, rows: first..first + taken };
            self.next = if first + taken < whole { (index, first + taken) } else { (index + 1, 0) };
            rows += taken;
            if in_last.saturating_add(taken) <= UNIT_ROWS {
                in_last += taken;
                jobs.last_mut().expect("there is a last one").push(piece);
            } else {
                in_last = taken;
                jobs.push(vec![piece]);
            }
        }
        jobs
    }

    /// Strings the tiles' runs together, unit after unit.
    fn chain(&mut self, window: &mut Window, units: usize) {
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

/// The batches' rows that are rows `range` of all the pieces together.
fn cut<'a>(pieces: &[Piece], batches: &'a [Batch], range: Range<usize>) -> Vec<Part<'a>> {
    let mut parts = Vec::with_capacity(pieces.len());
    let mut start = 0;
    for (piece, batch) in pieces.iter().zip(batches) {
        let end = start + piece.rows.len();
        let (from, to) = (range.start.max(start), range.end.min(end));
        if from < to {
            let rows = piece.rows.start + (from - start)..piece.rows.start + (to - start);
            parts.push(Part { batch, rows });
        }
        start = end;
    }
    parts
}

impl Window {
    /// Draws the window's fragments into the tiles' states, tiles in parallel; counts
    /// events where it is asked to.
    pub fn draw(
        &self,
        design: &dyn Engine,
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
        let draw_tile = |(state, work, _): &mut (Option<TileState>, &Work, usize)| {
            let mut counts = count.then(EventCounts::default);
            let state = state.get_or_insert_with(|| design.clear(frame.grid, work.tile));
            let mut next = work.first;
            loop {
                let run = &self.runs[next as usize];
                let told = counts.as_mut().map_or(Told::Nobody, Told::Counts);
                let fragments = self.units[run.unit as usize].fragments(run.range.clone());
                design.draw(pass, state, fragments, told);
                if next == work.last {
                    break counts.unwrap_or_default();
                }
                next = run.next;
            }
        };
        let events = if count {
            let merge = |a: EventCounts, b: EventCounts| a.merged(&b);
            lent.par_iter_mut().map(draw_tile).reduce(EventCounts::default, merge)
        } else {
            lent.par_iter_mut().for_each(|tile| {
                draw_tile(tile);
            });
            EventCounts::default()
        };
        for (state, _, slot) in lent {
            states.touched_mut()[slot].1 = state;
        }
        events
    }
}
