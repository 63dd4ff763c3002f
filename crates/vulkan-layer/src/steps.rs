//! What a command buffer does, step by step, and what becomes of it when it is run.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use ash::vk;

use crate::commands::Commands;
use crate::instance::Map;
use crate::log::{self, Event, State};
use crate::objects::{Image, Objects};
use crate::pipelines::Pipeline;

pub(crate) enum Step {
    /// A pass, a clear or a write.
    Event(Event),
    Draw(Drawn),
    /// Secondary command buffers.
    Execute(Vec<u64>),
    /// An image is in this layout from here on: followed whether or not anything is captured.
    Layout(u64, vk::ImageLayout),
}

/// A draw as it is recorded. There may be very many.
pub(crate) struct Drawn {
    pub slot: u32,
    pub pipeline: Arc<Pipeline>,
    pub command: &'static str,
    pub vertices: u32,
    pub instances: u32,
    pub state: State,
    /// Empty where its pipeline has the reason, if there is one.
    pub refused: &'static str,
    pub label: Arc<str>,
}

impl Drawn {
    fn event(&self) -> Event {
        let refused = if self.refused.is_empty() { &self.pipeline.refused } else { self.refused };
        Event::Draw(log::Draw {
            slot: self.slot,
            pipeline: self.pipeline.number,
            command: self.command.into(),
            vertices: self.vertices,
            instances: self.instances,
            state: self.state.clone(),
            refused: refused.into(),
            label: (&*self.label).into(),
        })
    }
}

/// What command buffers do when they are run.
#[derive(Default)]
pub(crate) struct Run {
    pub events: Vec<Event>,
    pub pipelines: BTreeMap<u64, Arc<Pipeline>>,
    /// Some were recorded before the capture was to begin.
    pub plain: bool,
}

impl Run {
    /// Adds a command buffer, secondaries in their places. Of one that was recorded before anything
    /// was to be captured it is known what it writes, and no more.
    pub(crate) fn add(&mut self, objects: &Objects, buffer: u64) {
        let Some(commands) = objects.commands.get(&buffer) else { return };
        self.plain |= commands.plain;
        for step in &commands.steps {
            match step {
                Step::Event(event) => self.events.push(event.clone()),
                Step::Draw(draw) => {
                    self.events.push(draw.event());
                    self.pipelines.entry(draw.pipeline.number).or_insert(draw.pipeline.clone());
                }
                Step::Execute(all) if !commands.plain => {
                    all.iter().for_each(|buffer| self.add(objects, *buffer));
                }
                Step::Execute(_) | Step::Layout(..) => {}
            }
        }
    }
}

/// Follows the layouts of images through a command buffer.
pub(crate) fn follow(objects: &mut Objects, buffer: u64) {
    let Objects { commands, images, .. } = objects;
    through(commands, images, buffer);
}

fn through(all: &Map<u64, Commands>, images: &mut Map<u64, Image>, buffer: u64) {
    let Some(commands) = all.get(&buffer) else { return };
    for step in &commands.steps {
        match step {
            Step::Layout(image, layout) => {
                if let Some(image) = images.get_mut(image) {
                    image.layout = *layout;
                }
            }
            Step::Execute(buffers) => buffers.iter().for_each(|b| through(all, images, *b)),
            Step::Event(_) | Step::Draw(_) => {}
        }
    }
}

const TWICE: &str = "its command buffer is run twice in one submission";

/// Draws that have the same number cannot be told apart: neither is used.
pub(crate) fn refuse_twins(events: &mut [Event]) {
    let (mut seen, mut twins) = (BTreeSet::new(), BTreeSet::new());
    for slot in slots(events) {
        if !seen.insert(slot) {
            twins.insert(slot);
        }
    }
    for event in events {
        if let Event::Draw(draw) = event
            && twins.contains(&draw.slot)
        {
            draw.refused = TWICE.into();
        }
    }
}

/// The numbers of draws that may leave records.
pub(crate) fn slots(events: &[Event]) -> impl Iterator<Item = u32> {
    events.iter().filter_map(|event| match event {
        Event::Draw(draw) if draw.slot != u32::MAX => Some(draw.slot),
        _ => None,
    })
}

/// The images that events draw colours to.
pub(crate) fn targets(events: &[Event]) -> impl Iterator<Item = u64> {
    let passes = events.iter().filter_map(|event| match event {
        Event::Pass(pass) => Some(pass),
        _ => None,
    });
    passes.flat_map(|p| p.colour.iter().chain(&p.resolve).map(|a| a.image))
}

/// The images that events begin with as they find them.
pub(crate) fn loaded(events: &[Event]) -> Vec<u64> {
    let (mut drawn, mut loaded) = (BTreeSet::new(), Vec::new());
    for event in events {
        if let Event::Pass(pass) = event
            && let Some(colour) = &pass.colour
        {
            let load = colour.load == vk::AttachmentLoadOp::LOAD.as_raw();
            if drawn.insert(colour.image) && load {
                loaded.push(colour.image);
            }
            // A resolve writes all of it.
            drawn.extend(pass.resolve.as_ref().map(|r| r.image));
        }
    }
    loaded
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::{Attachment, Draw, Pass};

    #[test]
    fn draws_of_one_number_are_refused() {
        let draw = |slot| Event::Draw(Draw { slot, ..Draw::default() });
        let mut events = vec![draw(1), draw(2), draw(1), draw(u32::MAX), draw(u32::MAX)];
        refuse_twins(&mut events);
        let refused = events.iter().map(|e| matches!(e, Event::Draw(d) if d.refused == TWICE));
        assert_eq!(refused.collect::<Vec<_>>(), [true, false, true, false, false]);
    }

    #[test]
    fn what_was_drawn_before_is_not_loaded() {
        let pass = |image, op: vk::AttachmentLoadOp| {
            let colour = Attachment { image, load: op.as_raw(), ..Attachment::default() };
            Event::Pass(Pass { colour: Some(colour), ..Pass::default() })
        };
        let (load, clear) = (vk::AttachmentLoadOp::LOAD, vk::AttachmentLoadOp::CLEAR);
        let events = [pass(1, clear), pass(1, load), pass(2, load), pass(2, load)];
        assert_eq!(loaded(&events), [2]);
        assert_eq!(targets(&events).collect::<Vec<_>>(), [1, 1, 2, 2]);
    }
}
