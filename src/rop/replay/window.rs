//! Windows of fragments, in three stages that run at the same time: one window is drawn
//! while the next is sorted and the batches of the one after that are read. Each stage
//! is parallel in itself.

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
    /// The next batch to read, and how many of its rows lie behind.
    next: (usize, usize),
    /// What has been read of the next window.
    ready: Vec<Lot>,
    /// One for each thread that ever sorted at the same time.
    sorters: Mutex<Vec<Sorter>>,
    /// A tile's place in the window's `work` plus one; all zero between windows.
    places: Vec<u32>,
}

/// Parts of batches that one thread reads: of one large batch, or of small ones that make
/// a unit together.
type Lot = Vec<Part>;

/// Rows of batch `index`, to be read unless it is `open`.
struct Piece {
    index: usize,
    rows: Range<usize>,
    open: Option<Batch>,
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

impl<'a> Windows<'a> {
    /// Windows of at most `length` fragments of `group`.
    ///
    /// # Errors
    /// As [`Trace::batch`].
    pub fn new(
        trace: &'a Trace,
        frame: &'a Frame,
        group: &'a Group,
        length: usize,
    ) -> Result<Self> {
        let most = WINDOW_ROWS.min(ROWS_PER_THREAD * rayon::current_num_threads());
        let mut windows = Windows {
            trace,
            frame,
            group,
            length: length.clamp(1, most),
            next: (0, 0),
            ready: Vec::new(),
            sorters: Mutex::default(),
            places: vec![0; frame.grid.count()],
        };
        let plan = windows.plan(None);
        windows.ready = windows.read(plan)?;
        Ok(windows)
    }

    /// Fills `window` with the next fragments, reading ahead; `false` at the end.
    ///
    /// # Errors
    /// As [`Trace::batch`].
    pub fn fill(&mut self, window: &mut Window) -> Result<bool> {
        let lots = std::mem::take(&mut self.ready);
        let plan = self.plan(lots.last().and_then(|lot| lot.last()));
        let this = &*self;
        let (units, ready) = rayon::join(|| this.sort(&lots, window), || this.read(plan));
        self.ready = ready?;
        self.chain(window, units);
        Ok(!lots.is_empty())
    }

    /// What the next window is made of; `last` is what was read last.
    fn plan(&mut self, last: Option<&Part>) -> Vec<Vec<Piece>> {
        let mut open = last.filter(|_| self.next.1 > 0).map(|part| part.batch.clone());
        let mut lots: Vec<Vec<Piece>> = Vec::new();
        let (mut rows, mut in_lot) = (0, usize::MAX);
        while rows < self.length && self.next.0 < self.trace.batch_count() {
            let (index, first) = self.next;
            let whole = self.trace.batch_rows(index) as usize;
            let taken = (whole - first).min(self.length - rows);
            self.next = if first + taken < whole { (index, first + taken) } else { (index + 1, 0) };
            rows += taken;
            let piece = Piece { index, rows: first..first + taken, open: open.take() };
            match lots.last_mut().filter(|_| in_lot + taken <= UNIT_ROWS) {
                Some(lot) => {
                    in_lot += taken;
                    lot.push(piece);
                }
                None => {
                    in_lot = taken;
                    lots.push(vec![piece]);
                }
            }
        }
        lots
    }

    fn read(&self, plan: Vec<Vec<Piece>>) -> Result<Vec<Lot>> {
        let read = |piece: Piece| {
            let batch = piece.open.map_or_else(|| self.trace.batch(piece.index), Ok)?;
            Ok(Part { batch, rows: piece.rows })
        };
        let lots = plan.into_par_iter().map(|lot| lot.into_iter().map(read).collect());
        // The first error in the trace's order, whichever was met first.
        lots.collect::<Vec<Result<Lot>>>().into_iter().collect()
    }

    /// Sorts `lots` into the window's units; tells how many it takes.
    fn sort(&self, lots: &[Lot], window: &mut Window) -> usize {
        let rows_of = |lot: &Lot| lot.iter().map(|part| part.rows.len()).sum::<usize>();
        window.rows = lots.iter().map(rows_of).sum();
        let units = lots.iter().map(|lot| rows_of(lot).div_ceil(UNIT_ROWS)).sum();
        if window.units.len() < units {
            window.units.resize_with(units, Unit::default);
        }
        let starts = lots
            .iter()
            .flat_map(|lot| (0..rows_of(lot)).step_by(UNIT_ROWS).map(move |start| (lot, start)));
        let work: Vec<_> = window.units.iter_mut().zip(starts).collect();
        work.into_par_iter().for_each(|(unit, (lot, start))| {
            let parts = cut(lot, start..start + UNIT_ROWS);
            let idle = self.sorters.lock().expect("no thread panicked").pop();
            let mut sorter = idle.unwrap_or_else(|| Sorter::new(self.frame));
            unit.fill(&parts, self.frame, self.group, &mut sorter);
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

/// Those rows of a lot that are rows `range` of all its parts together.
fn cut(lot: &[Part], range: Range<usize>) -> Vec<Part> {
    let mut parts = Vec::with_capacity(lot.len());
    let mut start = 0;
    for Part { batch, rows } in lot {
        let end = start + rows.len();
        let (from, to) = (range.start.max(start), range.end.min(end));
        if from < to {
            let rows = rows.start + (from - start)..rows.start + (to - start);
            parts.push(Part { batch: batch.clone(), rows });
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
