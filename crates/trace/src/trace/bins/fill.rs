//! Filling bins: rows of a trace in parts, a thread each.

use std::ops::Range;
use std::sync::atomic::AtomicUsize;

use rayon::prelude::*;

use crate::error::Result;
use crate::trace::batch::Batch;
use crate::trace::bins::part::Budget;
use crate::trace::bins::{Bins, Tiles};
use crate::trace::read::Trace;

/// A row's place in a trace: a batch, and a row in it.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub struct RowPlace {
    /// The batch's number; at the trace's end, how many there are.
    pub batch: usize,
    /// The row within the batch.
    pub row: usize,
}

impl RowPlace {
    /// Whether no row of `trace` is left.
    pub fn is_end(self, trace: &Trace) -> bool {
        self.batch == trace.batch_count()
    }
}

/// Rows of batches, one batch after the other.
type Plan = Vec<(usize, Range<usize>)>;

impl Bins {
    /// Replaces the rows by those from `from` on that belong to `tiles`, at most `rows` of the
    /// trace's, and as many as there is room for. Tells where it stopped, and how many of the
    /// trace's rows were gone through: at least one, where there is any.
    ///
    /// # Errors
    /// As [`Trace::batch`]: the first in the trace's order, whichever is met first.
    pub fn fill(
        &mut self,
        trace: &Trace,
        from: RowPlace,
        rows: u64,
        tiles: &Tiles,
    ) -> Result<(RowPlace, u64)> {
        self.clear();
        let wanted = rows.min(Bins::rows_within(trace, self.bytes)).max(1);
        let plan = plan(trace, from, wanted);
        let plans = self.cut(plan);
        let held = self.held.take();
        let (level, budget) = (self.level, self.budget());
        let sort = |(part, plan): (&mut _, &Plan)| -> Result<Option<(RowPlace, Option<Batch>)>> {
            let part: &mut super::Part = part;
            for (i, rows) in plan {
                let batch = match &held {
                    Some((held, batch)) if held == i => batch.clone(),
                    _ => trace.batch(*i)?,
                };
                if let Some(row) = part.sort(level, &batch, rows.clone(), tiles, &budget) {
                    return Ok(Some((RowPlace { batch: *i, row }, Some(batch))));
                }
                if rows.end < batch.len() {
                    let next = RowPlace { batch: *i, row: rows.end };
                    return Ok(Some((next, Some(batch))));
                }
            }
            Ok(None)
        };
        let parts = self.parts.par_iter_mut().zip(&plans);
        let sorted: Vec<_> = parts.map(sort).collect();

        let (mut end, mut used) = (from, 0);
        for (found, plan) in sorted.into_iter().zip(&plans) {
            used += 1;
            match (found?, plan.last()) {
                (Some((stopped, batch)), _) => {
                    end = stopped;
                    self.held = batch.map(|batch| (stopped.batch, batch));
                    break;
                }
                (None, Some((last, _))) => end = RowPlace { batch: last + 1, row: 0 },
                (None, None) => {}
            }
        }
        // What follows a part that is full is sorted again.
        self.parts[used..].iter_mut().for_each(super::Part::clear);
        self.count_tiles();
        Ok((skip_empty(trace, end), rows_between(trace, from, end)))
    }

    /// What slabs may be added to those there are, or will be.
    fn budget(&self) -> Budget {
        let there: usize = self.parts.iter().map(|part| part.slabs().max(1)).sum();
        let all = (self.bytes / (self.row * self.slab_rows)) as usize;
        Budget(AtomicUsize::new(all.saturating_sub(there)))
    }

    /// Cuts a plan into as many parts as there are, of about as many rows, between batches.
    fn cut(&self, plan: Plan) -> Vec<Plan> {
        let all: usize = plan.iter().map(|(_, rows)| rows.len()).sum();
        let mut plans = vec![Plan::new(); self.parts.len()];
        let mut before = 0;
        for (i, rows) in plan {
            // Where the batch's middle lies.
            let middle = before + rows.len() / 2;
            before += rows.len();
            let part = (middle * self.parts.len() / all.max(1)).min(self.parts.len() - 1);
            plans[part].push((i, rows));
        }
        plans
    }

    /// Counts the tiles' rows over all parts.
    fn count_tiles(&mut self) {
        for part in &self.parts {
            for (tile, list) in part.lists() {
                *self.tiles.get_or_insert_with(*tile, || 0) += list.rows;
            }
        }
    }
}

/// At most `rows` rows from `from` on.
fn plan(trace: &Trace, from: RowPlace, mut rows: u64) -> Plan {
    let mut plan = Plan::new();
    let mut first = from.row;
    for batch in from.batch..trace.batch_count() {
        if rows == 0 {
            break;
        }
        let len = trace.batch_rows(batch) as usize;
        let end = len.min(first.saturating_add(usize::try_from(rows).unwrap_or(usize::MAX)));
        rows -= (end - first) as u64;
        // Batches without rows are read too: they may be damaged.
        plan.push((batch, std::mem::take(&mut first)..end));
    }
    plan
}

/// The place itself, or the next batch's first row where it is a batch's end.
fn skip_empty(trace: &Trace, mut place: RowPlace) -> RowPlace {
    if !place.is_end(trace) && place.row > 0 && place.row as u64 == trace.batch_rows(place.batch) {
        place = RowPlace { batch: place.batch + 1, row: 0 };
    }
    place
}

fn rows_between(trace: &Trace, from: RowPlace, to: RowPlace) -> u64 {
    let between: u64 = (from.batch..to.batch).map(|i| trace.batch_rows(i)).sum();
    between + to.row as u64 - from.row as u64
}
