//! What was captured, pass by pass: for a user to choose of.

use std::collections::BTreeMap;

use ash::vk;
use screendoor_trace::error::Result;
use screendoor_vulkan_layer::log::{Attachment, Draw, Event, Pass};
use serde::Serialize;

use crate::blend;
use crate::folder::{Captures, DeviceCapture};
use crate::format::name;
use crate::frame::{Flaw, Step, frames};
use crate::records::Records;
use crate::target::{Numbers, Place};
use crate::{Refusal, Span};

/// All that was captured.
#[derive(Clone, Debug, Serialize)]
pub struct Listing {
    /// The devices, of all processes.
    pub devices: Vec<ListedDevice>,
}

/// A device of a process.
#[derive(Clone, Debug, Serialize)]
pub struct ListedDevice {
    /// The process' number.
    pub process: u32,
    /// The program's file, as it was started.
    pub program: String,
    /// The GPU's name and its driver's version.
    pub device: String,
    /// Frames that were presented.
    pub presented: u64,
    /// Whether the log broke off: the program was killed.
    pub torn: bool,
    /// What the layer has to say.
    pub notes: Vec<String>,
    /// Frames of which something was recorded that are not whole, with why.
    pub flawed: Vec<String>,
    /// Passes with draws or clears, in order.
    pub passes: Vec<ListedPass>,
}

/// A pass.
#[derive(Clone, Debug, Serialize)]
pub struct ListedPass {
    /// Presentations before it.
    pub frame: u64,
    /// Submissions of the device before its own.
    pub submission: u64,
    /// What is drawn into: `None` where it is depth alone.
    pub target: Option<ListedTarget>,
    /// Draws, whether or not they leave fragments.
    pub draws: u64,
    /// Draws that blend.
    pub blended: u64,
    /// Fragments recorded.
    pub fragments: u64,
    /// Draws of which a trace cannot have the fragments, by why.
    pub refused: Vec<Refusal>,
    /// Debug labels around it.
    pub label: String,
}

/// What a pass draws into.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ListedTarget {
    /// Its number, for `--target`.
    pub number: usize,
    /// As the program named it, or empty.
    pub name: String,
    /// In pixels.
    pub width: u32,
    /// In pixels.
    pub height: u32,
    /// `VkFormat`, without its prefix.
    pub format: String,
    /// Samples a pixel.
    pub samples: u32,
    /// Whether it is presented, or resolved into what is.
    pub presented: bool,
    /// What becomes of what was there: `VkAttachmentLoadOp`, without its prefix.
    pub load: String,
    /// Colour attachments beside it.
    pub others: u32,
}

impl Listing {
    /// Reads all records, to count them.
    ///
    /// # Errors
    /// [`screendoor_trace::error::Error::Invalid`] for records of draws that are not there.
    pub fn new(captures: &Captures) -> Result<Self> {
        let numbers = Numbers::new(captures);
        let devices = captures.devices.iter().enumerate();
        let devices = devices.map(|(i, capture)| device(capture, i, &numbers));
        Ok(Listing { devices: devices.collect::<Result<_>>()? })
    }
}

fn device(capture: &DeviceCapture, device: usize, numbers: &Numbers) -> Result<ListedDevice> {
    let (mut passes, mut flawed) = (Vec::new(), Vec::new());
    for frame in frames(capture, Span::First) {
        match frame.flaw(capture) {
            None => {}
            Some(Flaw::Overflow(needed)) => flawed.push(format!(
                "{}: {needed} fragments, and memory for {}",
                frame.name(capture),
                capture.device.capacity
            )),
            Some(Flaw::Unended) => {
                flawed.push(format!("{}: the program ended before it did", frame.name(capture)));
            }
        }
        let mut counts = Vec::new();
        let mut open: Option<Building> = None;
        for step in frame.steps(capture) {
            let submission = &capture.submissions[step.at.submission];
            if step.at.event == 0 {
                counts = Records::of(capture, submission).counts()?;
            }
            let begins = matches!(step.what, Event::Pass(_)) || step.at.event == 0;
            if begins && let Some(pass) = open.take() {
                passes.push(pass.finish());
            }
            if let (true, Some(pass)) = (begins, step.pass) {
                let target = pass.colour.as_ref().map(|colour| {
                    let number = numbers.of(device, colour.into()).unwrap_or(0);
                    target(capture, pass, colour, number)
                });
                let (frame, submission) = (submission.frame, submission.number);
                open = Some(Building::new(frame, submission, target, pass));
            }
            if let (Some(building), Event::Draw(draw)) = (&mut open, step.what) {
                building.draw(capture, &step, draw, counts[step.at.event]);
            }
        }
        passes.extend(open.map(Building::finish));
    }
    Ok(ListedDevice {
        process: capture.device.process,
        program: capture.device.program.clone(),
        device: capture.device.name.clone(),
        presented: capture.presents.iter().map(|p| p.frame + 1).max().unwrap_or(0),
        torn: capture.is_torn,
        notes: capture.notes.clone(),
        flawed,
        passes,
    })
}

fn target(
    capture: &DeviceCapture,
    pass: &Pass,
    colour: &Attachment,
    number: usize,
) -> ListedTarget {
    let image = &capture.images[&colour.image];
    let [width, height] = capture.size(Place::from(colour));
    let load = format!("{:?}", vk::AttachmentLoadOp::from_raw(colour.load));
    ListedTarget {
        number,
        name: image.name.clone(),
        width,
        height,
        format: name(colour.format),
        samples: image.samples,
        presented: [Some(colour), pass.resolve.as_ref()]
            .into_iter()
            .flatten()
            .any(|a| capture.images[&a.image].swapchain),
        load,
        others: pass.others,
    }
}

/// A pass whose draws are still being counted.
struct Building {
    pass: ListedPass,
    /// By why: draws and fragments.
    refused: BTreeMap<String, [u64; 2]>,
}

impl Building {
    fn new(frame: u64, submission: u64, target: Option<ListedTarget>, pass: &Pass) -> Self {
        let pass = ListedPass {
            frame,
            submission,
            target,
            draws: 0,
            blended: 0,
            fragments: 0,
            refused: Vec::new(),
            label: pass.label.clone(),
        };
        Building { pass, refused: BTreeMap::new() }
    }

    fn draw(&mut self, capture: &DeviceCapture, step: &Step<'_>, draw: &Draw, fragments: u64) {
        self.pass.draws += 1;
        self.pass.blended += u64::from(draw.state.blend);
        self.pass.fragments += fragments;
        let Some(pass) = step.pass.filter(|p| p.colour.is_some()) else { return };
        if let Err(why) = blend::rule(capture, pass, draw) {
            let [draws, of] = self.refused.entry(why).or_default();
            *draws += 1;
            *of += fragments;
        }
    }

    fn finish(mut self) -> ListedPass {
        self.pass.refused = Refusal::list(self.refused);
        self.pass
    }
}

impl ListedPass {
    /// Its figures for a table, each with its heading.
    pub fn cells(&self) -> Vec<(&'static str, String)> {
        let of = |text: &dyn Fn(&ListedTarget) -> String| {
            self.target.as_ref().map_or_else(|| "-".to_string(), text)
        };
        let name = |t: &ListedTarget| match t.name.as_str() {
            "" => format!("#{}", t.number),
            name => format!("#{} {name}", t.number),
        };
        vec![
            ("target", of(&name)),
            ("frame", self.frame.to_string()),
            ("submission", self.submission.to_string()),
            ("size", of(&|t| format!("{}x{}", t.width, t.height))),
            ("format", of(&|t| t.format.clone())),
            ("samples", of(&|t| t.samples.to_string())),
            ("shown", of(&|t| if t.presented { "yes" } else { "no" }.to_string())),
            ("load", of(&|t| t.load.to_lowercase())),
            ("draws", self.draws.to_string()),
            ("blended", self.blended.to_string()),
            ("fragments", self.fragments.to_string()),
            ("label", self.label.clone()),
        ]
    }
}
