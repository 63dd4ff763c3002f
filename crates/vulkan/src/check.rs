//! What was recorded, blended as the program blends it, against the program's own picture.

use std::collections::{BTreeMap, HashMap};
use std::rc::Rc;

use ash::vk;
use screendoor_trace::error::Result;
use screendoor_trace::picture::srgb;
use screendoor_vulkan_layer::log::{Attachment, Draw, Event, Pass, Picture, Record};
use serde::Serialize;

use crate::background::{after, each_pixel};
use crate::convert::Conversion;
use crate::depth_images::DepthImages;
use crate::equation::{blend, unknown};
use crate::format::{Kind, PixelFormat};
use crate::frame::At;
use crate::plan::{Base, Plan, shared};
use crate::records::{FRONT, Records};
use crate::samples::{Samples, covers};
use crate::target::Place;

/// How far the recorded fragments, blended as the program blends them, are from its picture.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Check {
    /// Why there is nothing to compare with; then all figures are 0.
    pub incomparable: Option<String>,
    /// What of the program's drawing could not be done again.
    pub caveats: Vec<String>,
    /// Pixels compared.
    pub pixels: u64,
    /// Pixels that are the same.
    pub exact: u64,
    /// The greatest difference of a channel, in 8-bit units.
    pub greatest: f64,
    /// Pixels that differ by more than rounding at each blend may add up to, by how much.
    pub beyond: Vec<Beyond>,
}

/// Pixels that differ by more than so much.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Beyond {
    /// The difference, in 8-bit units.
    pub units: f64,
    /// Pixels.
    pub pixels: u64,
}

/// Of so many 8-bit units pixels are counted that differ by more.
const STEPS: [f64; 3] = [0.6, 1.6, 4.0];
/// What is less is no difference: the last bit of single precision.
const SAME: f64 = 0.01;

impl Check {
    fn incomparable(why: impl Into<String>, caveats: Vec<String>) -> Self {
        let mut check = Check::new(caveats);
        check.incomparable = Some(why.into());
        check
    }

    fn new(caveats: Vec<String>) -> Self {
        Check {
            incomparable: None,
            caveats,
            pixels: 0,
            exact: 0,
            greatest: 0.0,
            beyond: STEPS.map(|units| Beyond { units, pixels: 0 }).to_vec(),
        }
    }

    fn add(&mut self, difference: f64) {
        self.pixels += 1;
        self.exact += u64::from(difference < SAME);
        self.greatest = self.greatest.max(difference);
        for beyond in self.beyond.iter_mut().filter(|b| difference > b.units) {
            beyond.pixels += 1;
        }
    }
}

/// What is done to the target or to depths.
enum Act<'a> {
    Begin(&'a Pass, bool),
    Clear(&'a Pass, bool, [f32; 4], [i32; 4], bool),
    Draw(At, &'a Pass, &'a Draw, bool),
}

/// The target under reconstruction.
struct Redrawing<'a> {
    conversion: &'a Conversion<'a>,
    format: &'a PixelFormat,
    colours: Samples<[f32; 4]>,
    depths: DepthImages<'a>,
    acts: Vec<Act<'a>>,
    done: usize,
}

impl Conversion<'_> {
    /// Blends the records anew, exactly as the program does, and compares with its picture, which
    /// the capture has to hold ([`crate::Settings::pictures`]).
    ///
    /// # Errors
    /// As [`Conversion::write`].
    pub fn check(&self, progress: &mut dyn FnMut(u64, u64)) -> Result<Check> {
        let (acts, by_submission, total) = self.acts();
        let caveats = self.caveats(&acts);
        if self.format.kind == Kind::Integer {
            return Ok(Check::incomparable("the target holds whole numbers", caveats));
        }
        let (shown, picture) = match self.picture() {
            Ok(found) => found,
            Err(why) => return Ok(Check::incomparable(why, caveats)),
        };
        let before = match self.before()? {
            Ok(before) => before,
            Err(why) => return Ok(Check::incomparable(why, caveats)),
        };
        let size = [self.header().width, self.header().height];
        let samples = self.program_samples as usize;
        let plan = Plan::new(&self.chosen, false);
        let mut redrawing = Redrawing {
            conversion: self,
            format: &self.format,
            colours: Samples::new(size, samples, before),
            depths: DepthImages::new(&self.chosen, &plan),
            acts,
            done: 0,
        };
        let (capture, mut done) = (self.chosen.capture, 0);
        for (submission, ordinals) in by_submission {
            let records = Records::of(capture, &capture.submissions[submission]);
            records.in_order(&ordinals, self.options.memory, &mut |record| {
                redrawing.take(&record)?;
                done += 1;
                if done % (1 << 16) == 0 || done == total {
                    progress(done, total);
                }
                Ok(())
            })?;
        }
        redrawing.catch_up(redrawing.acts.len());
        let mut check = Check::new(caveats);
        let Some(format) = PixelFormat::of(shown.format) else {
            return Ok(Check::incomparable("its picture's format is not known", check.caveats));
        };
        each_pixel(capture, picture, &format, Place::from(shown), &mut |[x, y], wanted| {
            check.add(difference(&format, redrawing.resolved(x, y), wanted));
            Ok(())
        })?;
        Ok(check)
    }

    /// What has to be done again, which act each draw of each submission is, and how many records
    /// there are.
    #[allow(clippy::type_complexity)]
    fn acts(&self) -> (Vec<Act<'_>>, BTreeMap<usize, HashMap<u32, u32>>, u64) {
        let chosen = &self.chosen;
        let shared = shared(chosen);
        let mut acts = Vec::new();
        let mut by_submission: BTreeMap<usize, HashMap<u32, u32>> = BTreeMap::new();
        let mut total = 0;
        for step in chosen.frame.steps(chosen.capture) {
            let Some(pass) = step.pass else { continue };
            let on = pass.colour.as_ref().is_some_and(|c| Place::from(c) == chosen.place);
            let depth = pass.depth.as_ref().is_some_and(|d| shared.contains(&Place::from(d)));
            if !on && !depth {
                continue;
            }
            match step.what {
                Event::Pass(_) => acts.push(Act::Begin(pass, on)),
                Event::Clear(c) => acts.push(Act::Clear(pass, c.depth, c.value, c.area, on)),
                Event::Draw(draw) if chosen.capture.is_recorded(draw) => {
                    let ordinals = by_submission.entry(step.at.submission).or_default();
                    ordinals.insert(draw.slot, acts.len() as u32);
                    total += chosen.count(step.at);
                    acts.push(Act::Draw(step.at, pass, draw, on));
                }
                Event::Draw(_) | Event::Write(_) => {}
            }
        }
        (acts, by_submission, total)
    }

    fn caveats(&self, acts: &[Act<'_>]) -> Vec<String> {
        let chosen = &self.chosen;
        let mut counted: BTreeMap<String, u64> = BTreeMap::new();
        let mut add = |what: String| *counted.entry(what).or_default() += 1;
        for act in acts {
            let Act::Draw(_, pass, draw, true) = act else { continue };
            if let Some(what) = unknown(&draw.state) {
                add(format!("draws with {what}"));
            }
            if pass.layers > 1 {
                add("draws into several layers or views at once".to_string());
            }
        }
        for step in chosen.frame.steps(chosen.capture) {
            let on = step.pass.and_then(|p| p.colour.as_ref());
            let on = on.is_some_and(|c| Place::from(c) == chosen.place);
            match step.what {
                Event::Draw(draw) if on && !chosen.capture.is_recorded(draw) => {
                    let is_seen = draw.state.mask & self.format.mask() != 0;
                    let which = if is_seen { "draws" } else { "draws of depth alone" };
                    add(format!("{which} that left no records"));
                }
                Event::Write(w) if w.image == chosen.place.image => {
                    add(format!("writes by {}", w.command));
                }
                _ => {}
            }
        }
        counted.into_iter().map(|(what, count)| format!("{what}: {count}")).collect()
    }

    /// The picture after the last submission that draws into the target, and what it is of.
    fn picture(&self) -> Result<(&Attachment, &Picture), String> {
        let chosen = &self.chosen;
        let mut last = None;
        for step in chosen.frame.steps(chosen.capture) {
            if let Event::Pass(pass) = step.what
                && let Some(colour) = pass.colour.as_ref()
                && Place::from(colour) == chosen.place
            {
                last = Some((pass, colour, chosen.capture.submissions[step.at.submission].number));
            }
        }
        let Some((pass, colour, submission)) = last else {
            return Err("nothing is drawn into the target".to_string());
        };
        let is_single = self.program_samples == 1;
        let shown = match &pass.resolve {
            Some(resolve) => resolve,
            None if is_single => colour,
            None => return Err("its samples are not resolved by its last pass".to_string()),
        };
        let picture = after(chosen.capture, Place::from(shown), submission);
        picture.map(|p| (shown, p)).ok_or_else(|| match chosen.capture.pictures.is_empty() {
            true => "no picture of the program's was taken: capture with --check".to_string(),
            false => format!("there is no picture of it after submission {submission}"),
        })
    }

    /// What the target held at first.
    #[allow(clippy::type_complexity)]
    fn before(&self) -> Result<Result<Box<dyn Fn(u32, u32) -> [f32; 4]>, String>> {
        let chosen = &self.chosen;
        if self.first_base() != Some(true) {
            return Ok(Ok(Box::new(|_, _| [0.0; 4])));
        }
        let Some(picture) = self.loaded() else {
            return Ok(Err("what was there before the first draw is not known".to_string()));
        };
        let mut pixels = Vec::new();
        each_pixel(chosen.capture, picture, &self.format, chosen.place, &mut |_, colour| {
            pixels.push(colour);
            Ok(())
        })?;
        let (width, pixels) = (self.header().width, Rc::new(pixels));
        Ok(Ok(Box::new(move |x, y| {
            // A tile may lie beyond the frame.
            let inside = x < width;
            let at = y as usize * width as usize + x as usize;
            pixels.get(at).copied().filter(|_| inside).unwrap_or_default()
        })))
    }

    /// Whether the first pass loads what was there.
    fn first_base(&self) -> Option<bool> {
        let chosen = &self.chosen;
        let mut passes = chosen.frame.steps(chosen.capture).filter_map(|step| match step.what {
            Event::Pass(pass) => pass.colour.as_ref().map(|colour| (pass, colour)),
            _ => None,
        });
        let (pass, colour) = passes.find(|(_, c)| Place::from(*c) == chosen.place)?;
        let kept = [vk::AttachmentLoadOp::CLEAR, vk::AttachmentLoadOp::DONT_CARE]
            .iter()
            .all(|op| op.as_raw() != colour.load);
        Some(kept || !covers(pass.area, chosen.capture.size(chosen.place)))
    }

    /// The picture before the first draw.
    fn loaded(&self) -> Option<&Picture> {
        let plan = Plan::new(&self.chosen, false);
        match plan.base {
            Base::Loaded { submission } => {
                crate::background::before(&self.chosen, &plan, submission).ok()
            }
            _ => None,
        }
    }
}

impl Redrawing<'_> {
    fn catch_up(&mut self, act: usize) {
        while self.done < act {
            match self.acts[self.done] {
                Act::Draw(..) => {}
                Act::Begin(pass, on) => {
                    let clears = |a: &Attachment| a.load == vk::AttachmentLoadOp::CLEAR.as_raw();
                    if let Some(colour) = pass.colour.as_ref().filter(|c| on && clears(c)) {
                        self.colours.clear(pass.area, self.format.stored(colour.clear));
                    }
                    self.depths.begin(pass);
                }
                Act::Clear(_, false, value, area, on) => {
                    if on {
                        self.colours.clear(area, self.format.stored(value));
                    }
                }
                Act::Clear(pass, true, value, area, _) => {
                    if let Some(depth) = &pass.depth {
                        self.depths.clear(depth, area, value[0]);
                    }
                }
            }
            self.done += 1;
        }
    }

    fn take(&mut self, record: &Record) -> Result<()> {
        let act = record.slot as usize;
        self.catch_up(act);
        let Act::Draw(at, pass, draw, on) = self.acts[act] else { return Ok(()) };
        let mut coverage = u64::from(record.coverage & !FRONT);
        if let Some(depth) = pass.depth.as_ref().filter(|_| draw.state.depth_test) {
            coverage = self.depths.test((at, draw), depth, record, coverage)?;
        }
        let header = self.conversion.header();
        if !on || record.x() >= header.width || record.y() >= header.height {
            return Ok(());
        }
        let format = self.format;
        let samples = self.colours.at(record.x() as u16, record.y() as u16);
        for (s, held) in samples.iter_mut().enumerate() {
            if coverage >> s & 1 == 1 {
                *held = blend(&draw.state, format, record.colour, *held);
            }
        }
        Ok(())
    }

    /// The mean of a pixel's samples.
    fn resolved(&self, x: u16, y: u16) -> [f32; 4] {
        let mut sum = [0.0_f64; 4];
        for colour in self.colours.look(x, y) {
            (0..4).for_each(|i| sum[i] += f64::from(colour[i]));
        }
        sum.map(|v| (v / self.colours.count() as f64) as f32)
    }
}

/// The greatest difference of a channel, in 8-bit units of what a display is sent.
fn difference(format: &PixelFormat, found: [f32; 4], wanted: [f32; 4]) -> f64 {
    let mask = format.mask();
    let shown = |i: usize, v: f32| match format.kind {
        Kind::Srgb if i < 3 => srgb::encode(v.into()),
        _ => f64::from(v),
    };
    let channels = (0..4).filter(|i| mask >> i & 1 == 1);
    let differences = channels.map(|i| {
        let [a, b] = [found, wanted].map(|colour| shown(i, colour[i]));
        if a == b || a.is_nan() && b.is_nan() { 0.0 } else { (a - b).abs() * 255.0 }
    });
    // What is no number on one side alone is as far away as can be.
    differences.fold(0.0, |most, d| if d.is_nan() { f64::INFINITY } else { most.max(d) })
}
