//! One pixel's story.

use std::collections::VecDeque;

use crate::contract::contents::Contents;
use crate::contract::design::Design;
use crate::contract::engine::{Engine, Told};
use crate::contract::event::{NoProbe, Record};
use crate::contract::frame::{Frame, Site};
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
    /// The pixel's linear colour.
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

/// What a step takes at `samples` samples, in memory and as text: a sample has its test, and
/// its contents before and after.
fn bytes_per_step(samples: u32) -> u64 {
    size_of::<Step>() as u64 + 1024 + 256 * u64::from(samples)
}

/// Tells `each` the row and the fragment of all that cover a sample of pixel `site`, their
/// coverage cut to the frame's samples, without optional columns that the design does not
/// read.
fn for_each_fragment(
    frame: &Frame,
    trace: &Trace,
    site: Site,
    progress: &dyn Fn(u64),
    mut each: impl FnMut(u64, Fragment),
) -> Result<()> {
    let mask = SampleMask::first(frame.samples());
    let mut row = 0;
    for batch in trace.batches() {
        let batch = batch?;
        for i in (0..batch.len()).filter(|i| batch.pixel(*i) == (site.x, site.y)) {
            let mut fragment = batch.fragment(i);
            fragment.coverage = fragment.coverage & mask;
            fragment.optional = fragment.optional.only(frame.columns);
            if !fragment.coverage.is_empty() {
                each(row + i as u64, fragment);
            }
        }
        row += batch.len() as u64;
        progress(row);
    }
    Ok(())
}

/// Refuses at once what would not fit: `fragments` in the pixel, told over all passes.
fn check(design: &dyn Engine, frame: &Frame, fragments: u64, limits: ExplainLimits) -> Result<()> {
    let all = fragments * u64::from(design.passes());
    let per_step = bytes_per_step(frame.samples());
    let state = fragments * design.bytes_per_fragment().unwrap_or(0) as u64;
    let needed = all.min(limits.last as u64) * per_step + state;
    if needed <= limits.memory {
        return Ok(());
    }
    let mib = |bytes: u64| bytes.div_ceil(1 << 20);
    let left = limits.memory.saturating_sub(state) / per_step;
    let hint = match left {
        0 => "raise --memory".to_string(),
        left => format!("show the last {left} with --last, or raise --memory"),
    };
    Err(Error::config(
        format_args!(
            "the pixel holds {fragments} fragments, whose story takes {} MiB, and {} are allowed",
            mib(needed),
            limits.memory >> 20
        ),
        hint,
    ))
}

/// Replays the fragments of pixel `site` alone and writes down what happens: in all passes,
/// but for what a design of several passes does not look at.
///
/// # Errors
/// As [`Trace::batch`]; [`Error::Config`] where that takes more than `limits` allow.
pub fn explain(
    design: &dyn Engine,
    frame: &Frame,
    trace: &Trace,
    site: Site,
    limits: ExplainLimits,
    progress: &dyn Fn(u64, u64),
) -> Result<Explanation> {
    let passes = design.passes();
    let total = trace.rows() * u64::from(passes + 1);
    let watch = |before: u32| move |row| progress(u64::from(before) * trace.rows() + row, total);
    let mut fragments = 0;
    let mut few = Vec::new();
    for_each_fragment(frame, trace, site, &watch(0), |row, fragment| {
        fragments += 1;
        if few.len() < FEW {
            few.push((row, fragment));
        }
    })?;
    check(design, frame, fragments, limits)?;

    let (tile, within) = (frame.grid.tile(site.x, site.y), TileGrid::within(site.x, site.y));
    let mut state = design.clear(frame.grid, tile);
    let cleared = design.contents(&state, within);
    // The step before the first that is kept says what was there.
    let keep = limits.last.saturating_add(1);
    let (mut steps, mut ended) = (VecDeque::new(), Vec::new());
    let mut left_out = 0;
    for pass in 0..passes {
        let mut to_come = fragments;
        let mut draw = |row, fragment| {
            to_come -= 1;
            let mut record = Record::default();
            let mut one = Block::default();
            one.push(&fragment);
            design.draw(pass, &mut state, &one, Told::Record(&mut record));
            // A pass for opaque fragments does not look at the others.
            if !limits.idle && passes > 1 && record.is_idle() {
                return;
            }
            // What the pixel holds is only told of steps that can be among the last: to tell
            // it may take as long as there are fragments.
            let is_kept = passes > 1 || to_come < keep as u64;
            let contents =
                if is_kept { design.contents(&state, within) } else { Contents::default() };
            if steps.len() == keep {
                steps.pop_front();
                left_out += 1;
            }
            steps.push_back(Step { pass, row, fragment, record, contents });
        };
        if fragments as usize == few.len() {
            few.iter().for_each(|(row, fragment)| draw(*row, *fragment));
        } else {
            for_each_fragment(frame, trace, site, &watch(pass + 1), draw)?;
        }
        let mut record = Record::default();
        design.end_pass(pass, frame.grid, tile, &mut state, Told::Record(&mut record));
        ended.push(record);
    }
    let before = if steps.len() == keep { steps.pop_front() } else { None };
    left_out += u64::from(before.is_some());
    let before = before.map(|step| step.contents);
    let colour = design.resolve(frame.grid, tile, &state)[within];
    Ok(Explanation { cleared, left_out, before, steps: steps.into(), ended, colour })
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
