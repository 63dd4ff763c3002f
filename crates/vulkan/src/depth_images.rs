//! The depth images of a frame, as what is drawn leaves them.

use std::collections::{BTreeMap, HashSet};

use ash::vk;
use screendoor_trace::error::Result;
use screendoor_trace::trace::SamplePattern;
use screendoor_vulkan_layer::log::{Attachment, Draw, Event, Pass, Record};

use crate::depth::DepthImage;
use crate::frame::At;
use crate::plan::Plan;
use crate::records::{FRONT, Records};
use crate::samples::{Area, covers};
use crate::target::{Chosen, Place};

/// Depth images, by where they are.
pub(crate) struct DepthImages<'a> {
    chosen: &'a Chosen<'a>,
    plan: &'a Plan<'a>,
    /// Whether depths fall with distance.
    reversed: bool,
    images: BTreeMap<Place, DepthImage>,
}

impl<'a> DepthImages<'a> {
    pub(crate) fn new(chosen: &'a Chosen<'a>, plan: &'a Plan<'a>) -> Self {
        DepthImages { chosen, plan, reversed: plan.reversed().0, images: BTreeMap::new() }
    }

    fn image(&mut self, depth: &Attachment) -> &mut DepthImage {
        let capture = self.chosen.capture;
        let (place, far) = (Place::from(depth), if self.reversed { 0.0 } else { 1.0 });
        self.images.entry(place).or_insert_with(|| {
            let samples = capture.images[&place.image].samples;
            let pattern = SamplePattern::standard(samples);
            let positions = pattern.map_or_else(|| vec![[0, 0]], |p| p.positions);
            DepthImage::new(capture.size(place), depth.format, &positions, far)
        })
    }

    /// A pass begins.
    pub(crate) fn begin(&mut self, pass: &Pass) {
        if let Some(depth) = pass.depth.as_ref().filter(|d| is_cleared(d)) {
            self.clear(depth, pass.area, depth.clear[0]);
        }
    }

    /// A part is cleared.
    pub(crate) fn clear(&mut self, depth: &Attachment, area: Area, value: f32) {
        let place = Place::from(depth);
        let is_whole = covers(area, self.chosen.capture.size(place));
        let is_recorded = !self.plan.unrecorded.contains(&place);
        let image = self.image(depth);
        image.clear(area, value);
        if is_whole {
            image.is_known = is_recorded;
        }
    }

    /// Of the samples of `coverage` that a record covers those that pass the test of its draw
    /// there; their depths are written where it writes any.
    ///
    /// # Errors
    /// Those of reading records of others, where their depths are what is asked for.
    pub(crate) fn test(
        &mut self,
        (at, draw): (At, &Draw),
        depth: &Attachment,
        record: &Record,
        coverage: u64,
    ) -> Result<u64> {
        let asks_for_same = draw.state.depth_op == vk::CompareOp::EQUAL.as_raw();
        if asks_for_same && !self.image(depth).is_known {
            self.find_out(at, depth)?;
        }
        Ok(self.image(depth).test(record, coverage, &draw.state))
    }

    /// Finds out what draws have left in an image of which there are no records: they are drawn for
    /// their depth alone, so that the nearest of what is drawn again later passes, by having the
    /// same depth. The nearest of that is what they have left.
    fn find_out(&mut self, from: At, depth: &Attachment) -> Result<()> {
        let (place, reversed) = (Place::from(depth), self.reversed);
        let Self { chosen, .. } = *self;
        let mut slots: BTreeMap<usize, HashSet<u32>> = BTreeMap::new();
        for step in chosen.frame.steps(chosen.capture).skip_while(|s| s.at < from) {
            let used = step.pass.and_then(|p| Some((p, p.depth.as_ref()?)));
            let Some((pass, used)) = used.filter(|(_, d)| Place::from(*d) == place) else {
                continue;
            };
            match step.what {
                Event::Pass(_) if is_cleared(used) && self.is_whole(pass.area, place) => break,
                Event::Clear(c) if c.depth && self.is_whole(c.area, place) => break,
                Event::Draw(draw)
                    if draw.state.depth_test
                        && draw.state.depth_op == vk::CompareOp::EQUAL.as_raw()
                        && chosen.capture.is_recorded(draw) =>
                {
                    slots.entry(step.at.submission).or_default().insert(draw.slot);
                }
                _ => {}
            }
        }
        let image = self.image(depth);
        image.is_known = true;
        for (submission, slots) in slots {
            let submission = &chosen.capture.submissions[submission];
            Records::of(chosen.capture, submission).each(|record| {
                if slots.contains(&record.slot) {
                    image.bring_nearer(&record, (record.coverage & !FRONT).into(), reversed);
                }
                Ok(())
            })?;
        }
        Ok(())
    }

    fn is_whole(&self, area: Area, place: Place) -> bool {
        covers(area, self.chosen.capture.size(place))
    }
}

fn is_cleared(depth: &Attachment) -> bool {
    depth.load == vk::AttachmentLoadOp::CLEAR.as_raw()
}
