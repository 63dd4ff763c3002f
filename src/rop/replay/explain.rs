//! One pixel's story.

use crate::error::Result;
use crate::rop::design::{Contents, Design, Frame, Site};
use crate::rop::event::{NoProbe, Record};
use crate::rop::replay::engine::{Engine, Told};
use crate::tile::TileGrid;
use crate::trace::{Block, Fragment, SampleMask, Trace};

/// One fragment's way through a design.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Step {
    /// Which of the design's passes.
    pub pass: u32,
    /// The fragment's row in the trace.
    pub row: u64,
    /// The fragment, its coverage cut to the replay's samples.
    pub fragment: Fragment,
    /// What the design did.
    pub record: Record,
    /// The pixel's state after it.
    pub contents: Contents,
}

/// What a design did at one pixel.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Explanation {
    /// The pixel's state before the first fragment.
    pub cleared: Contents,
    /// Its fragments in API order, pass after pass.
    pub steps: Vec<Step>,
    /// What was done at the end of each pass, when no fragment was left.
    pub ended: Vec<Record>,
    /// The pixel's linear colour.
    pub colour: [f64; 3],
}

impl Explanation {
    /// How many passes over the trace there were.
    pub fn passes(&self) -> u32 {
        self.steps.last().map_or(1, |step| step.pass + 1)
    }
}

/// Replays the fragments of pixel `site` alone and writes down what happens.
///
/// # Errors
/// As [`Trace::batch`].
pub fn explain(
    design: &dyn Engine,
    frame: &Frame,
    trace: &Trace,
    site: Site,
    progress: &dyn Fn(u64, u64),
) -> Result<Explanation> {
    let mask = SampleMask::first(frame.samples());
    let mut fragments: Vec<(u64, Fragment)> = Vec::new();
    let mut row = 0;
    for batch in trace.batches() {
        let batch = batch?;
        for i in (0..batch.len()).filter(|i| batch.pixel(*i) == (site.x, site.y)) {
            let mut fragment = batch.fragment(i);
            fragment.coverage = fragment.coverage & mask;
            if !fragment.coverage.is_empty() {
                fragments.push((row + i as u64, fragment));
            }
        }
        row += batch.len() as u64;
        progress(row, trace.rows());
    }
    let (tile, within) = (frame.grid.tile(site.x, site.y), TileGrid::within(site.x, site.y));
    let mut state = design.clear(frame.grid, tile);
    let cleared = design.contents(&state, within);
    let (mut steps, mut ended) = (Vec::new(), Vec::new());
    for pass in 0..design.passes() {
        for (row, fragment) in &fragments {
            let mut record = Record::default();
            let mut one = Block::default();
            one.push(fragment);
            design.draw(pass, &mut state, &one, Told::Record(&mut record));
            let contents = design.contents(&state, within);
            steps.push(Step { pass, row: *row, fragment: *fragment, record, contents });
        }
        let mut record = Record::default();
        design.end_pass(pass, frame.grid, tile, &mut state, Told::Record(&mut record));
        ended.push(record);
    }
    let colour = design.resolve(frame.grid, tile, &state)[within];
    Ok(Explanation { cleared, steps, ended, colour })
}

/// Draws fragments into one pixel, for tests of designs.
pub fn draw_pixel<D: Design>(design: &D, site: Site, fragments: &[Fragment]) -> D::Pixel {
    let mut pixel = design.clear(site);
    for pass in 0..design.passes() {
        for fragment in fragments {
            design.draw(pass, site, &mut pixel, fragment, &mut NoProbe);
        }
        design.end_pass(pass, site, &mut pixel, &mut NoProbe);
    }
    pixel
}
