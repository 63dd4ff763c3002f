//! From what was captured to a trace.

use std::collections::{BTreeMap, HashMap};
use std::io::Write;

use screendoor_trace::error::{Error, Result};
use screendoor_trace::param::Options;
use screendoor_trace::picture::Space;
use screendoor_trace::trace::{
    ColourFormat, ColumnId, DepthPlane, Fragment, Header, MAX_SAMPLES, SampleMask, SamplePattern,
    Scalar, TraceWriter, Unorm32,
};
use serde::Serialize;

use crate::background::{Background, background, each_pixel, rgb};
use crate::depth::DepthRule;
use crate::folder::Captures;
use crate::format::{PixelFormat, name};
use crate::fragments::Making;
use crate::plan::{Act, Plan};
use crate::records::{HELD, Records};
use crate::target::{Chosen, TargetChoice, choose};
use crate::{Span, warnings};

/// What of a capture becomes a trace, and how.
#[derive(Clone, Debug)]
pub struct ConvertOptions {
    /// Which frame, or which submissions: of several frames the last one that is whole.
    pub span: Span,
    /// Which of the images that are drawn into.
    pub target: TargetChoice,
    /// What depths are.
    pub depth: DepthRule,
    /// A linear colour behind all, in place of what was there.
    pub background: Option<[f32; 3]>,
    /// What colours stand for, where the target's format does not say it rightly.
    pub space: Option<Space>,
    /// Precision of colours in the trace.
    pub colour: ColourFormat,
    /// Samples a pixel in the trace: a multiple of the program's own, which are repeated, so that
    /// designs can use more samples than the program did and see the same edges; that number
    /// where not given.
    pub samples: Option<u32>,
    /// How many bytes the records that are held together may take; fewer make more passes over
    /// them.
    pub memory: u64,
}

impl Default for ConvertOptions {
    fn default() -> Self {
        ConvertOptions {
            span: Span::First,
            target: TargetChoice::Largest,
            depth: DepthRule::Auto,
            background: None,
            space: None,
            colour: ColourFormat::F16,
            samples: None,
            memory: 512 << 20,
        }
    }
}

/// A program's name without its folder, which says more of a machine than of a trace.
fn file_name(program: &str) -> &str {
    program.rsplit(['/', '\\']).next().unwrap_or(program)
}

/// A program's pattern, repeated until it has `samples`.
fn repeated(own: &SamplePattern, samples: u32) -> Result<SamplePattern> {
    let n = own.samples();
    if !SamplePattern::is_count(samples) || samples < n {
        return Err(Error::config(
            format_args!("{samples} samples a pixel cannot hold the program's {n}"),
            format_args!("ask for a power of two from {n} to {MAX_SAMPLES}"),
        ));
    }
    if samples == n {
        return Ok(own.clone());
    }
    let positions = own.positions.iter().copied().cycle().take(samples as usize).collect();
    let name = format!("{}, {} times", own.name, samples / n);
    // Fewer than the program's own are the first of them.
    Ok(SamplePattern { name, positions, nested: true })
}

/// Where a program has one sample a pixel, a fragment covers all of the trace's.
fn coverage_of_all(own: u32, samples: u32) -> BTreeMap<ColumnId, Scalar> {
    let all = SampleMask::first(samples).0;
    let constant = (own == 1 && samples > 1).then_some((ColumnId::Coverage, Scalar::Unsigned(all)));
    constant.into_iter().collect()
}

/// A capture about to become a trace.
pub struct Conversion<'a> {
    pub(crate) chosen: Chosen<'a>,
    pub(crate) options: ConvertOptions,
    header: Header,
    /// Samples a pixel of the target.
    pub(crate) program_samples: u32,
    /// Of the target, as it is drawn into.
    pub(crate) format: PixelFormat,
    format_number: i32,
    background: Background<'a>,
    depth: DepthRule,
}

/// Draws of which a trace cannot have the fragments.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub struct Refusal {
    /// Why.
    pub why: String,
    /// How many draws.
    pub draws: u64,
    /// How many fragments were recorded of them.
    pub fragments: u64,
}

impl Refusal {
    /// Those with the most fragments, or else draws, first.
    pub(crate) fn list(refused: BTreeMap<String, [u64; 2]>) -> Vec<Self> {
        let of = |(why, [draws, fragments]): (_, [u64; 2])| Refusal { why, draws, fragments };
        let mut list: Vec<Refusal> = refused.into_iter().map(of).collect();
        list.sort_by_key(|r| std::cmp::Reverse((r.fragments, r.draws)));
        list
    }
}

/// An object of a trace, which is a draw.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize)]
pub struct Object {
    /// Its number in the trace.
    pub object: u32,
    /// Debug labels around it.
    pub label: String,
    /// The command.
    pub command: String,
    /// Its pipeline's name.
    pub pipeline: String,
    /// Fragments in the trace.
    pub fragments: u64,
}

/// Recorded fragments that are not in the trace, or not as they were, by why.
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug, Serialize)]
pub struct Dropped {
    /// Their alpha is 0, or next to it.
    pub transparent: u64,
    /// They add light and hold none back: alpha 0 in a blend of premultiplied colours.
    pub additive: u64,
    /// Their channels have alphas of their own: text smoothed for a display's subpixels.
    pub coloured: u64,
    /// Their alpha is not 0 to 1, and their target takes such numbers.
    pub beyond: u64,
    /// They failed the program's own depth test, which `--depth order` applies.
    pub hidden: u64,
    /// They cover none of the target's samples.
    pub uncovered: u64,
    /// A clear of all came after them.
    pub painted_over: u64,
    /// They are of draws that write no colour.
    pub depth_alone: u64,
    /// Pieces of a primitive in one pixel that were put together with another.
    pub merged: u64,
    /// In the trace, but with a colour that was infinite or no number: it is the greatest, or 0.
    pub not_finite: u64,
    /// In the trace, but flat: their depths are too steep for a trace, or leave its range.
    pub flattened: u64,
}

/// What a conversion has made.
#[derive(Clone, Debug, Serialize)]
pub struct Converted {
    /// The program's file.
    pub program: String,
    /// Its process' number.
    pub process: u32,
    /// The GPU's name and its driver's version.
    pub device: String,
    /// The frame, or the submissions.
    pub frame: String,
    /// The target's number in the listing.
    pub target: usize,
    /// Its `VkFormat`, without the prefix.
    pub format: String,
    /// What depths are.
    pub depth: DepthRule,
    /// Draws with fragments in the trace, by their numbers there.
    pub objects: Vec<Object>,
    /// Fragments that are not in the trace.
    pub dropped: Dropped,
    /// Draws that are not in the trace.
    pub refused: Vec<Refusal>,
    /// What the layer has to say of the device.
    pub notes: Vec<String>,
    /// What a user has to know.
    pub warnings: Vec<String>,
}

impl<'a> Conversion<'a> {
    /// Chooses frame and target, counts, and makes the trace's header.
    ///
    /// # Errors
    /// [`Error::Config`] where nothing is as asked for or the background is not known,
    /// [`Error::Unsupported`] for what no trace can hold, [`Error::Invalid`] for damaged files.
    pub fn new(captures: &'a Captures, options: ConvertOptions) -> Result<Self> {
        if options.memory < HELD {
            return Err(Error::config(
                format_args!("{} bytes hold no record", options.memory),
                format_args!("give at least {HELD}"),
            ));
        }
        let chosen = choose(captures, options.span, options.target)?;
        let plan = Plan::new(&chosen, true);
        let place = format!("target #{}", chosen.number);
        let image = &chosen.capture.images[&chosen.place.image];
        let format_number = plan.attachment.map_or(image.format, |a| a.format);
        let Some(format) = PixelFormat::of(format_number) else {
            let what =
                format!("its format {} holds no colours that can be blended", name(format_number));
            return Err(Error::unsupported(
                place,
                what,
                "choose another one of --list with --target",
            ));
        };
        let Some(own) = SamplePattern::standard(image.samples) else {
            let what = format!("where its {} samples lie is nowhere laid down", image.samples);
            return Err(Error::unsupported(place, what, "have the program use 1, 2, 4, 8 or 16"));
        };
        let pattern = repeated(&own, options.samples.unwrap_or(own.samples()))?;
        let depth = match options.depth {
            DepthRule::Auto if plan.kept().any(|p| p.tested().is_some()) => DepthRule::Program,
            DepthRule::Auto => DepthRule::Order,
            given => given,
        };
        let space = options.space.unwrap_or(format.space());
        let background = match options.background {
            Some(linear) => Background::Colour(linear.map(|v| space.of_linear(v.into()) as f32)),
            None => background(&chosen, &plan, &format)?,
        };
        let [width, height] = chosen.capture.size(chosen.place);
        let device = &chosen.capture.device;
        let program_samples = own.samples();
        let samples = pattern.samples();
        let header = Header {
            width,
            height,
            pattern,
            background: background.colour(),
            space,
            colour: options.colour,
            source: format!(
                "{} on {}, {}",
                file_name(&device.program),
                device.name,
                chosen.frame.name(chosen.capture)
            ),
            camera: "the program's own".to_string(),
            constants: coverage_of_all(program_samples, samples),
            ..Header::default()
        };
        header.check()?;
        Ok(Conversion {
            chosen,
            options,
            header,
            program_samples,
            format,
            format_number,
            background,
            depth,
        })
    }

    /// The header of the trace.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Hands the fragments to `writer`, which was made with [`Conversion::header`], in API order.
    /// `progress` is told how many records are done, and of how many.
    ///
    /// # Errors
    /// As [`TraceWriter::push`]; [`Error::Invalid`] for damaged records.
    pub fn write<W: Write>(
        &self,
        writer: &mut TraceWriter<W>,
        progress: &mut dyn FnMut(u64, u64),
    ) -> Result<Converted> {
        let chosen = &self.chosen;
        let plan = Plan::new(chosen, self.depth == DepthRule::Order);
        let mut push = |fragment: &Fragment| writer.push(fragment);
        let is_painted = self.paint(&mut push)?;
        let mut making = Making::new(self, &plan, self.depth, is_painted);
        let draws = plan.acts.iter().enumerate().filter_map(|(i, act)| match act {
            Act::Draw(planned) => Some((i as u32, planned)),
            _ => None,
        });
        let mut by_submission: BTreeMap<usize, HashMap<u32, u32>> = BTreeMap::new();
        let mut total = 0;
        for (act, planned) in draws {
            by_submission.entry(planned.at.submission).or_default().insert(planned.draw.slot, act);
            total += planned.records;
        }
        let mut done = 0;
        for (submission, acts) in by_submission {
            let records = Records::of(chosen.capture, &chosen.capture.submissions[submission]);
            records.in_order(&acts, self.options.memory, &mut |record| {
                making.take(record, &mut push)?;
                done += 1;
                if done % (1 << 16) == 0 || done == total {
                    progress(done, total);
                }
                Ok(())
            })?;
        }
        let (mut dropped, objects) = making.finish(&mut push)?;
        dropped.painted_over = plan.painted_over.fragments;
        dropped.depth_alone = plan.depth_alone.fragments;
        let device = &chosen.capture.device;
        let mut converted = Converted {
            program: device.program.clone(),
            process: device.process,
            device: device.name.clone(),
            frame: chosen.frame.name(chosen.capture),
            target: chosen.number,
            format: name(self.format_number),
            depth: self.depth,
            objects,
            dropped,
            refused: Refusal::list(plan.refused.clone()),
            notes: chosen.capture.notes.clone(),
            warnings: Vec::new(),
        };
        converted.warnings = warnings::of(self, &plan, &converted);
        Ok(converted)
    }

    /// Hands on what was there before the first draw, where that is no single colour: opaque, as
    /// far away as can be.
    fn paint(&self, push: &mut dyn FnMut(&Fragment) -> Result<()>) -> Result<bool> {
        let Background::Picture(picture) = self.background else { return Ok(false) };
        let Chosen { capture, place, .. } = self.chosen;
        let coverage = SampleMask::first(self.header.pattern.samples());
        let depth = DepthPlane { z: Unorm32::FAR, dzdx: 0, dzdy: 0 };
        each_pixel(capture, picture, &self.format, place, &mut |[x, y], colour| {
            let colour = rgb(colour);
            let alpha = 1.0;
            push(&Fragment { x, y, coverage, depth, colour, alpha, ..Fragment::default() })
        })?;
        Ok(true)
    }

    /// What covers some of the program's samples, as samples of the trace.
    pub(crate) fn spread(&self, coverage: u64) -> SampleMask {
        let all = SampleMask::first(self.program_samples).0;
        let times = (0..self.header.pattern.samples()).step_by(self.program_samples as usize);
        SampleMask(times.fold(0, |mask, at| mask | (coverage & all) << at))
    }

    /// What depths are, by its name.
    pub fn depth(&self) -> &'static str {
        self.depth.name()
    }
}
