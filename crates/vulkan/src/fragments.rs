//! From records in API order to the fragments of a trace.

use screendoor_trace::error::{Error, Result};
use screendoor_trace::trace::{ColourFormat, DepthPlane, Fragment, SampleMask, Unorm32};
use screendoor_vulkan_layer::log::Record;

use crate::background::rgb;
use crate::blend::Outcome;
use crate::convert::{Conversion, Dropped, Object};
use crate::depth::{DepthRule, plane};
use crate::depth_images::DepthImages;
use crate::plan::{Act, Plan, Planned};
use crate::records::FRONT;
use crate::samples::Area;
use crate::target::Place;

type Push<'a> = &'a mut dyn FnMut(&Fragment) -> Result<()>;

/// What makes fragments.
pub(crate) struct Making<'a> {
    conversion: &'a Conversion<'a>,
    plan: &'a Plan<'a>,
    depth: DepthRule,
    reversed: bool,
    /// Samples of the target.
    samples: u64,
    /// By how much each primitive is nearer than the one before, in the order of drawing.
    step: u64,
    /// The greatest number that a colour may be.
    most: f64,
    images: DepthImages<'a>,
    /// Acts that are done.
    done: usize,
    /// Records of one primitive in one pixel.
    group: Vec<Record>,
    /// The primitive's number in the trace, and how many numbers it has used.
    primitive: u64,
    used: u64,
    /// The act of the last object.
    object: Option<u32>,
    /// What stands before the first draw's object.
    first_object: u32,
    dropped: Dropped,
    objects: Vec<Object>,
}

/// A part of a primitive in a pixel.
struct Piece {
    record: Record,
    coverage: u64,
}

impl<'a> Making<'a> {
    /// With `is_painted`, object and primitive 0 are what was there before.
    pub(crate) fn new(
        conversion: &'a Conversion<'a>,
        plan: &'a Plan<'a>,
        depth: DepthRule,
        is_painted: bool,
    ) -> Self {
        let records: u64 = plan.kept().map(|p| p.records).sum::<u64>() + plan.partial_clears;
        // A power of two, so that narrower depths tell as many apart as they can.
        let step = (u64::from(u32::MAX) - 1) / (records + 2);
        Making {
            conversion,
            plan,
            depth,
            reversed: plan.reversed().0,
            samples: SampleMask::first(conversion.program_samples).0,
            step: if step == 0 { 1 } else { 1 << step.ilog2() },
            most: match conversion.options.colour {
                ColourFormat::F16 => 65504.0,
                ColourFormat::F32 => f32::MAX.into(),
            },
            images: DepthImages::new(&conversion.chosen, plan),
            done: 0,
            group: Vec::new(),
            primitive: is_painted.into(),
            used: 0,
            object: None,
            first_object: is_painted.into(),
            dropped: Dropped::default(),
            objects: Vec::new(),
        }
    }

    /// Takes the next record in API order; its slot is the place of its act.
    pub(crate) fn take(&mut self, record: Record, push: Push<'_>) -> Result<()> {
        self.check(&record)?;
        if let Some(last) = self.group.first() {
            let of = |r: &Record| (r.slot, r.instance, r.primitive);
            let same_primitive = of(last) == of(&record);
            if !same_primitive || last.place != record.place {
                self.flush(push)?;
            }
            if !same_primitive {
                self.primitive += std::mem::take(&mut self.used);
            }
        }
        self.group.push(record);
        Ok(())
    }

    /// Ends with the last record.
    pub(crate) fn finish(mut self, push: Push<'_>) -> Result<(Dropped, Vec<Object>)> {
        self.flush(push)?;
        self.primitive += std::mem::take(&mut self.used);
        self.catch_up(self.plan.acts.len(), push)?;
        Ok((self.dropped, self.objects))
    }

    fn planned(&self, act: u32) -> Option<&'a Planned<'a>> {
        match &self.plan.acts[act as usize] {
            Act::Draw(planned) => Some(planned),
            _ => None,
        }
    }

    fn check(&self, record: &Record) -> Result<()> {
        let Some(pass) = self.planned(record.slot).map(|p| p.pass) else { return Ok(()) };
        let capture = self.conversion.chosen.capture;
        let drawn = pass.colour.as_ref().or(pass.depth.as_ref());
        let Some(place) = drawn.map(Place::from) else { return Ok(()) };
        let [width, height] = capture.size(place);
        if record.x() < width && record.y() < height {
            return Ok(());
        }
        Err(Error::invalid(
            capture.files.records.display(),
            format_args!(
                "a fragment lies at pixel {},{} of an image of {width} x {height}",
                record.x(),
                record.y()
            ),
            "capture anew",
        ))
    }

    /// Makes fragments of the group.
    fn flush(&mut self, push: Push<'_>) -> Result<()> {
        let group = std::mem::take(&mut self.group);
        let Some(act) = group.first().map(|r| r.slot) else { return Ok(()) };
        self.catch_up(act as usize, push)?;
        let Some(planned) = self.planned(act) else { return Ok(()) };
        let per_sample =
            self.conversion.chosen.capture.pipelines[&planned.draw.pipeline].per_sample;
        // Pieces that share a number cover none of each other's samples.
        let mut layers: Vec<(u64, Vec<Piece>)> = Vec::new();
        for record in &group {
            let Some(coverage) = self.tested(planned, record)? else { continue };
            let layer = layers.iter().position(|(covered, _)| covered & coverage == 0);
            let layer = layer.unwrap_or_else(|| {
                layers.push((0, Vec::new()));
                layers.len() - 1
            });
            let (covered, pieces) = &mut layers[layer];
            *covered |= coverage;
            let same = pieces.iter_mut().find(|p| !per_sample || looks_same(&p.record, record));
            match same {
                Some(piece) => {
                    piece.coverage |= coverage;
                    self.dropped.merged += 1;
                }
                None => pieces.push(Piece { record: record.clone(), coverage }),
            }
        }
        self.group = group;
        self.group.clear();
        for (i, (_, pieces)) in layers.iter().enumerate() {
            for piece in pieces {
                self.emit(planned, act, piece, i as u64, push)?;
            }
        }
        Ok(())
    }

    /// The samples of a record that are drawn; `None` where there are none, or where the draw is
    /// looked at for its depths alone.
    fn tested(&mut self, planned: &Planned<'_>, record: &Record) -> Result<Option<u64>> {
        let is_kept = planned.rule.is_some();
        let samples = match &planned.pass.colour {
            // Another target's samples may be more.
            _ if !is_kept => u64::from(!FRONT),
            _ => self.samples,
        };
        let mut coverage = u64::from(record.coverage & !FRONT) & samples;
        if coverage == 0 {
            self.dropped.uncovered += u64::from(is_kept);
            return Ok(None);
        }
        if self.depth == DepthRule::Order
            && let Some(depth) = planned.tested()
        {
            let draw = (planned.at, planned.draw);
            coverage = self.images.test(draw, depth, record, coverage)?;
            if coverage == 0 {
                self.dropped.hidden += u64::from(is_kept);
                return Ok(None);
            }
        }
        Ok(is_kept.then_some(coverage))
    }

    /// Does what comes before an act.
    fn catch_up(&mut self, act: usize, push: Push<'_>) -> Result<()> {
        while self.done < act {
            match &self.plan.acts[self.done] {
                Act::Draw(_) => {}
                Act::Begin(pass, _) => self.images.begin(pass),
                Act::ClearDepth(depth, area, value) => self.images.clear(depth, *area, *value),
                Act::Paint(area, colour) => self.paint(*area, *colour, push)?,
            }
            self.done += 1;
        }
        Ok(())
    }

    /// Covers a part of the frame with a colour, where the order of drawing decides.
    fn paint(&mut self, area: Area, colour: [f32; 4], push: Push<'_>) -> Result<()> {
        if self.depth != DepthRule::Order {
            return Ok(());
        }
        let primitive = self.number(0)?;
        let depth = self.ordered(0);
        self.primitive += 1;
        self.object = None;
        let object = self
            .new_object(Object { command: "a clear of a part".to_string(), ..Object::default() });
        let header = self.conversion.header();
        let colour = rgb(self.conversion.format.stored(colour));
        let sides = |from: i32, length: i32, most: u32| {
            let within = |at: i64| at.clamp(0, most.into()) as u32;
            within(from.into())..within(i64::from(from) + i64::from(length))
        };
        let [left, upper, width, height] = area;
        for y in sides(upper, height, header.height) {
            for x in sides(left, width, header.width) {
                self.count();
                push(&Fragment {
                    x: x as u16,
                    y: y as u16,
                    coverage: self.conversion.spread(self.samples),
                    depth,
                    colour,
                    alpha: 1.0,
                    primitive,
                    object,
                    ..Fragment::default()
                })?;
            }
        }
        Ok(())
    }

    /// The number in the trace of a layer of the primitive.
    fn number(&self, layer: u64) -> Result<u32> {
        u32::try_from(self.primitive + layer).map_err(|_| {
            Error::unsupported(
                &self.conversion.header().source,
                "more than 2^32 primitives leave fragments",
                "capture less at a time, with --submits",
            )
        })
    }

    /// The depth of a layer of the primitive by the order of drawing.
    fn ordered(&self, layer: u64) -> DepthPlane {
        let back = u64::from(u32::MAX) - 1;
        let z = back.saturating_sub((self.primitive + layer) * self.step) as u32;
        DepthPlane { z: Unorm32(z), dzdx: 0, dzdy: 0 }
    }

    fn emit(
        &mut self,
        planned: &Planned<'_>,
        act: u32,
        piece: &Piece,
        layer: u64,
        push: Push<'_>,
    ) -> Result<()> {
        let Some(rule) = &planned.rule else { return Ok(()) };
        let raw = piece.record.colour;
        let is_finite = raw.iter().all(|v| v.is_finite());
        let finite = |v: f32| if v.is_nan() { 0.0 } else { v.clamp(f32::MIN, f32::MAX) };
        let (colour, alpha) = match rule.apply(raw.map(finite)) {
            Outcome::Seen(colour, alpha) => (colour, alpha),
            other => {
                let counter = match other {
                    Outcome::Additive => &mut self.dropped.additive,
                    Outcome::Coloured => &mut self.dropped.coloured,
                    Outcome::Beyond => &mut self.dropped.beyond,
                    _ => &mut self.dropped.transparent,
                };
                *counter += 1;
                return Ok(());
            }
        };
        self.dropped.not_finite += u64::from(!is_finite);
        let primitive = self.number(layer)?;
        self.used = self.used.max(layer + 1);
        let depth = match self.depth {
            DepthRule::Order => self.ordered(layer),
            _ => {
                let (plane, flat) = plane(&piece.record, self.reversed);
                self.dropped.flattened += u64::from(flat);
                plane
            }
        };
        let object = self.object(planned, act);
        let most = self.most;
        push(&Fragment {
            x: piece.record.x() as u16,
            y: piece.record.y() as u16,
            coverage: self.conversion.spread(piece.coverage),
            depth,
            colour: colour.map(|v| v.clamp(-most, most) as f32),
            alpha: alpha as f32,
            primitive,
            object,
            ..Fragment::default()
        })
    }

    /// The number of the draw's object, which has one fragment more.
    fn object(&mut self, planned: &Planned<'_>, act: u32) -> u32 {
        if self.object != Some(act) {
            self.object = Some(act);
            let pipelines = &self.conversion.chosen.capture.pipelines;
            self.new_object(Object {
                label: planned.draw.label.clone(),
                command: planned.draw.command.clone(),
                pipeline: pipelines[&planned.draw.pipeline].name.clone(),
                ..Object::default()
            });
        }
        self.count();
        self.objects.last().map_or(0, |object| object.object)
    }

    /// Gives an object its number.
    fn new_object(&mut self, object: Object) -> u32 {
        let number = self.first_object + self.objects.len() as u32;
        self.objects.push(Object { object: number, ..object });
        number
    }

    /// The last object has one fragment more.
    fn count(&mut self) {
        self.objects.iter_mut().next_back().into_iter().for_each(|object| object.fragments += 1);
    }
}

/// Whether two pieces differ in nothing but the samples that they cover.
fn looks_same(a: &Record, b: &Record) -> bool {
    let bits = |r: &Record| {
        let [red, green, blue, alpha] = r.colour.map(f32::to_bits);
        let [z, dx, dy] = [r.z, r.dzdx, r.dzdy].map(f32::to_bits);
        [red, green, blue, alpha, z, dx, dy]
    };
    bits(a) == bits(b)
}
