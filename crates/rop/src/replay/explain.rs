//! One pixel's story.

use crate::contract::contents::Contents;
use crate::contract::design::Design;
use crate::contract::event::{NoProbe, Record};
use crate::contract::frame::{Frame, Site};
use crate::contract::tiled::{Listener, TileState, TiledDesign};
use screendoor_trace::error::{Error, Result};
use screendoor_trace::tile::TileGrid;
use screendoor_trace::trace::{Block, Fragment, SampleMask, Trace};

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
    /// How many steps before those that are told were left out.
    #[serde(skip_serializing_if = "is_zero")]
    pub left_out: u64,
    /// The pixel's state after the last of these.
    #[serde(skip)]
    pub before: Option<Contents>,
    /// Its fragments in API order, pass after pass.
    pub steps: Vec<Step>,
    /// What was done at the end of each pass, when no fragment was left.
    pub ended: Vec<Record>,
    /// The pixel's colour, in the trace's space.
    pub colour: [f64; 3],
}

fn is_zero(n: &u64) -> bool {
    *n == 0
}

impl Explanation {
    /// How many passes over the trace there were.
    pub fn passes(&self) -> u32 {
        self.steps.last().map_or(1, |step| step.pass + 1)
    }
}

/// How much an explanation may hold.
#[derive(Clone, Copy, Debug)]
pub struct ExplainLimits {
    /// Steps that are kept: the last ones of those that the design looks at.
    pub last: usize,
    /// Whether steps of passes that do not look at the fragment are among them.
    pub idle: bool,
    /// Bytes that the steps, what is written of them, and the pixel's state may take.
    pub memory: u64,
}

impl Default for ExplainLimits {
    fn default() -> Self {
        ExplainLimits { last: usize::MAX, idle: true, memory: 1 << 29 }
    }
}

/// Fragments that are kept rather than looked for again in each pass.
const FEW: usize = 1 << 16;

/// Fragments that may be gone through to tell what a pixel holds, over all steps: a design
/// whose state grows with the fragments composites all before a step to tell that.
const MOST_COMPOSITED: u64 = 1 << 28;

/// What a step takes at `samples` samples, in memory and as text: a sample has its test, and
/// its contents before and after.
fn bytes_per_step(samples: u32) -> u64 {
    size_of::<Step>() as u64 + 1024 + 256 * u64::from(samples)
}

/// The fragments of a trace that cover a sample of a pixel, their coverage cut to the
/// frame's samples.
struct Fragments<'a> {
    frame: &'a Frame,
    trace: &'a Trace,
    site: Site,
    count: u64,
    /// Their rows and themselves, where there are no more than [`FEW`].
    few: Vec<(u64, Fragment)>,
}

impl<'a> Fragments<'a> {
    fn find(
        frame: &'a Frame,
        trace: &'a Trace,
        site: Site,
        progress: &dyn Fn(u64),
    ) -> Result<Self> {
        let mut found = Fragments { frame, trace, site, count: 0, few: Vec::new() };
        let (mut count, mut few) = (0, Vec::new());
        found.read(progress, |row, fragment| {
            count += 1;
            if few.len() <= FEW {
                few.push((row, fragment));
            }
        })?;
        if few.len() > FEW {
            few = Vec::new();
        }
        (found.count, found.few) = (count, few);
        Ok(found)
    }

    /// Tells `each` their rows and themselves, in order, and `progress` the rows gone through.
    fn each(&self, progress: &dyn Fn(u64), mut each: impl FnMut(u64, Fragment)) -> Result<()> {
        if self.few.is_empty() {
            return self.read(progress, each);
        }
        for (i, (row, fragment)) in self.few.iter().enumerate() {
            each(*row, *fragment);
            if i % 256 == 0 {
                progress(self.trace.rows() * i as u64 / self.few.len() as u64);
            }
        }
        Ok(())
    }

    fn read(&self, progress: &dyn Fn(u64), mut each: impl FnMut(u64, Fragment)) -> Result<()> {
        let mask = SampleMask::first(self.frame.samples());
        let mut row = 0;
        for batch in self.trace.batches() {
            let batch = batch?;
            let here = |i: &usize| batch.pixel(*i) == (self.site.x, self.site.y);
            for i in (0..batch.len()).filter(here) {
                let mut fragment = batch.fragment(i);
                fragment.coverage = fragment.coverage & mask;
                fragment.optional = fragment.optional.only(self.frame.columns);
                if !fragment.coverage.is_empty() {
                    each(row + i as u64, fragment);
                }
            }
            row += batch.len() as u64;
            progress(row);
        }
        Ok(())
    }

    /// Refuses at once what would not fit, told over all passes, or take too long.
    fn check(&self, design: &dyn TiledDesign, limits: ExplainLimits) -> Result<()> {
        let fragments = self.count;
        let steps = (fragments * u64::from(design.passes())).min(limits.last as u64);
        let refuse = |why: String, left: u64, otherwise: &str| {
            let hint = match left {
                0 => otherwise.to_string(),
                left => format!("show the last {left} with --last{otherwise}"),
            };
            Err(Error::config(format_args!("the pixel holds {fragments} fragments, {why}"), hint))
        };
        let per_step = bytes_per_step(self.frame.samples());
        let state = fragments * design.bytes_per_fragment().unwrap_or(0) as u64;
        let needed = steps * per_step + state;
        if needed > limits.memory {
            let left = limits.memory.saturating_sub(state) / per_step;
            let why = format!(
                "whose story takes {} MiB, and {} are allowed",
                needed.div_ceil(1 << 20),
                limits.memory >> 20
            );
            return refuse(
                why,
                left,
                if left == 0 { "raise --memory" } else { ", or raise --memory" },
            );
        }
        let composited = steps * fragments;
        if design.bytes_per_fragment().is_some() && composited > MOST_COMPOSITED && steps > 1 {
            let left = (MOST_COMPOSITED / fragments).max(1);
            let why =
                format!("all of which the design composites anew for each of up to {steps} steps");
            return refuse(why, left, "");
        }
        Ok(())
    }

    /// Draws them in all passes. `each` is told the pass, the row, the fragment, what the design
    /// did and the tile's state after it. Returns the state and what was done at the end of
    /// each pass.
    fn draw(
        &self,
        design: &dyn TiledDesign,
        progress: &dyn Fn(u64),
        mut each: impl FnMut(u32, u64, Fragment, Record, &TileState),
    ) -> Result<(TileState, Vec<Record>)> {
        let grid = self.frame.grid;
        let tile = grid.tile(self.site.x, self.site.y);
        let mut state = design.clear(grid, tile);
        let mut ended = Vec::new();
        for pass in 0..design.passes() {
            let before = u64::from(pass) * self.trace.rows();
            self.each(&|row| progress(before + row), |row, fragment| {
                let mut record = Record::default();
                let mut one = Block::default();
                one.push(&fragment);
                design.draw(pass, &mut state, &one, Listener::Record(&mut record));
                each(pass, row, fragment, record, &state);
            })?;
            let mut record = Record::default();
            design.end_pass(pass, grid, tile, &mut state, Listener::Record(&mut record));
            ended.push(record);
        }
        Ok((state, ended))
    }
}

/// Replays the fragments of pixel `site` alone and writes down what happens: in all passes,
/// but for what a design of several passes does not look at.
///
/// What the pixel holds is told of the steps that are kept alone: to tell that may take as
/// long as there are fragments. Where it is not known which these are, all is drawn once to
/// count them.
///
/// # Errors
/// As [`Trace::batch`]; [`Error::Config`] where that takes more than `limits` allow.
pub fn explain(
    design: &dyn TiledDesign,
    frame: &Frame,
    trace: &Trace,
    site: Site,
    limits: ExplainLimits,
    progress: &dyn Fn(u64, u64),
) -> Result<Explanation> {
    let passes = design.passes();
    // A pass for opaque fragments does not look at the others.
    let is_told = |record: &Record| limits.idle || passes == 1 || !record.is_idle();
    let is_counted = passes > 1 && !limits.idle && limits.last < usize::MAX;
    let drawn = u64::from(passes) * trace.rows();
    let total = trace.rows() + drawn * if is_counted { 2 } else { 1 };
    let fragments = Fragments::find(frame, trace, site, &|row| progress(row, total))?;
    fragments.check(design, limits)?;

    let mut before = trace.rows();
    let mut steps_in_all = fragments.count * u64::from(passes);
    if is_counted {
        steps_in_all = 0;
        fragments.draw(design, &|done| progress(before + done, total), |_, _, _, record, _| {
            steps_in_all += u64::from(is_told(&record))
        })?;
        before += drawn;
    }
    let (tile, within) = (frame.grid.tile(site.x, site.y), TileGrid::within(site.x, site.y));
    let cleared = design.contents(&design.clear(frame.grid, tile), within);
    // The step before the first that is kept says what was there.
    let skipped = steps_in_all.saturating_sub(limits.last.saturating_add(1) as u64);
    let (mut steps, mut seen) = (Vec::new(), 0);
    let watch = |done| progress(before + done, total);
    let (state, ended) = fragments.draw(design, &watch, |pass, row, fragment, record, state| {
        if !is_told(&record) {
            return;
        }
        seen += 1;
        if seen > skipped {
            let contents = design.contents(state, within);
            steps.push(Step { pass, row, fragment, record, contents });
        }
    })?;
    let mut left_out = skipped;
    let before = (steps.len() > limits.last).then(|| {
        left_out += 1;
        steps.remove(0).contents
    });
    let colour = design.resolve(frame.grid, tile, &state)[within];
    Ok(Explanation { cleared, left_out, before, steps, ended, colour })
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
