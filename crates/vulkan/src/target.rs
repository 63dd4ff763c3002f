//! The images that are drawn into, by the numbers that a user knows them by, and the choice of
//! one of them.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use screendoor_trace::error::{Error, Result};
use screendoor_vulkan_layer::log::{Attachment, Event};
use screendoor_vulkan_layer::settings::Span;

use crate::folder::{Captures, DeviceCapture};
use crate::format::name;
use crate::frame::{At, Frame, frames, last_whole};
use crate::records::Records;

/// What is drawn into: a layer and a mip level of an image.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub(crate) struct Place {
    pub image: u64,
    pub layer: u32,
    pub level: u32,
}

impl From<&Attachment> for Place {
    fn from(a: &Attachment) -> Self {
        Place { image: a.image, layer: a.layer, level: a.level }
    }
}

/// The numbers of what is drawn into, over all devices: from 1 on, in the order of the first use.
#[derive(Debug, Default)]
pub(crate) struct Numbers(BTreeMap<(usize, Place), usize>);

impl Numbers {
    pub(crate) fn new(captures: &Captures) -> Self {
        let mut numbers = Numbers::default();
        for (device, capture) in captures.devices.iter().enumerate() {
            let events = capture.submissions.iter().flat_map(|s| &s.events);
            for event in events {
                if let Event::Pass(pass) = event
                    && let Some(colour) = &pass.colour
                {
                    let next = numbers.0.len() + 1;
                    numbers.0.entry((device, colour.into())).or_insert(next);
                }
            }
        }
        numbers
    }

    /// The number of a place that is drawn into.
    pub(crate) fn of(&self, device: usize, place: Place) -> Option<usize> {
        self.0.get(&(device, place)).copied()
    }
}

/// Which of the images that are drawn into becomes a trace.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum TargetChoice {
    /// The one with the most fragments.
    #[default]
    Largest,
    /// What is presented, or what is resolved into that.
    Present,
    /// The one of this size in pixels with the most fragments.
    Size(u32, u32),
    /// The one of this number, as [`crate::Listing`] has it.
    Number(usize),
}

impl FromStr for TargetChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let bad = || {
            format!(
                "'{text}' names no target: it is present, largest, a size such as 800x600, or #2"
            )
        };
        if let Some(number) = text.strip_prefix('#') {
            let number = number.parse().ok().filter(|n| *n > 0);
            return number.map(TargetChoice::Number).ok_or_else(bad);
        }
        match text {
            "present" => Ok(TargetChoice::Present),
            "largest" => Ok(TargetChoice::Largest),
            _ => {
                let (width, height) = text.split_once(['x', 'X']).ok_or_else(bad)?;
                let side = |text: &str| text.parse().ok().filter(|n| *n > 0).ok_or_else(bad);
                Ok(TargetChoice::Size(side(width)?, side(height)?))
            }
        }
    }
}

impl fmt::Display for TargetChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            TargetChoice::Largest => f.write_str("largest"),
            TargetChoice::Present => f.write_str("present"),
            TargetChoice::Size(width, height) => write!(f, "{width}x{height}"),
            TargetChoice::Number(number) => write!(f, "#{number}"),
        }
    }
}

/// What was chosen: a device, one of its frames, and what is drawn into there.
#[derive(Debug)]
pub(crate) struct Chosen<'a> {
    pub capture: &'a DeviceCapture,
    pub frame: Frame,
    pub place: Place,
    /// Its number for the user.
    pub number: usize,
    /// Of each submission of the frame, how many records each of its events has.
    pub counts: Vec<Vec<u64>>,
}

impl Chosen<'_> {
    /// How many records an event has.
    pub(crate) fn count(&self, at: At) -> u64 {
        self.counts[at.submission - self.frame.submissions.start][at.event]
    }
}

/// A place, and what of it is needed to choose.
struct Candidate {
    place: Place,
    number: usize,
    size: [u32; 2],
    format: i32,
    fragments: u64,
    is_presented: bool,
}

/// Chooses among the whole frames of all devices.
///
/// # Errors
/// [`Error::Config`] where nothing is as asked for; as [`last_whole`].
pub(crate) fn choose(captures: &Captures, span: Span, choice: TargetChoice) -> Result<Chosen<'_>> {
    let numbers = Numbers::new(captures);
    let mut found: Vec<(Chosen<'_>, Vec<Candidate>)> = Vec::new();
    let mut error = None;
    for (device, capture) in captures.devices.iter().enumerate() {
        let frame = match last_whole(capture, span) {
            Ok(frame) => frame,
            // Of several devices, the one that recorded something tells more.
            Err(e) if error.is_none() || !frames(capture, span).is_empty() => {
                error = Some(e);
                continue;
            }
            Err(_) => continue,
        };
        let count = |s| Records::of(capture, s).counts();
        let counts = frame.of(capture).iter().map(count).collect::<Result<Vec<_>>>()?;
        let none = Place { image: 0, layer: 0, level: 0 };
        let chosen = Chosen { capture, frame, place: none, number: 0, counts };
        let candidates = candidates(&chosen, &|place| numbers.of(device, place).unwrap_or(0));
        found.push((chosen, candidates));
    }
    let fits = |c: &Candidate| match choice {
        TargetChoice::Largest => true,
        TargetChoice::Present => c.is_presented,
        TargetChoice::Size(width, height) => c.size == [width, height],
        TargetChoice::Number(number) => c.number == number,
    };
    let all = found.iter().enumerate().flat_map(|(i, (_, c))| c.iter().map(move |c| (i, c)));
    // Of several, the first.
    let best = all.filter(|(_, c)| fits(c)).rev().max_by_key(|(_, c)| c.fragments);
    let Some((device, best)) = best else {
        let candidates: Vec<&Candidate> = found.iter().flat_map(|(_, c)| c).collect();
        return Err(match (candidates.is_empty(), error) {
            (true, Some(error)) => error,
            _ => nothing(choice, &candidates),
        });
    };
    let (place, number) = (best.place, best.number);
    let (chosen, _) = found.swap_remove(device);
    Ok(Chosen { place, number, ..chosen })
}

fn candidates(chosen: &Chosen<'_>, number: &dyn Fn(Place) -> usize) -> Vec<Candidate> {
    let Chosen { capture, frame, .. } = chosen;
    let presents = capture.presents.iter().filter(|p| frame.number.is_none_or(|n| n == p.frame));
    let presented: Vec<u64> = presents.flat_map(|p| p.images.iter().copied()).collect();
    let shown = |a: &Attachment| {
        presented.contains(&a.image) || presented.is_empty() && capture.images[&a.image].swapchain
    };
    let mut all: BTreeMap<Place, Candidate> = BTreeMap::new();
    for step in frame.steps(capture) {
        let Some((pass, colour)) = step.pass.and_then(|p| Some((p, p.colour.as_ref()?))) else {
            continue;
        };
        let place = Place::from(colour);
        let candidate = all.entry(place).or_insert_with(|| Candidate {
            place,
            number: number(place),
            size: capture.size(place),
            format: colour.format,
            fragments: 0,
            is_presented: false,
        });
        candidate.is_presented |= shown(colour) || pass.resolve.as_ref().is_some_and(shown);
        candidate.fragments += chosen.count(step.at);
    }
    let mut all: Vec<Candidate> = all.into_values().collect();
    all.sort_by_key(|c| c.number);
    all
}

/// The error where no candidate is as asked for.
fn nothing(choice: TargetChoice, candidates: &[&Candidate]) -> Error {
    let list: Vec<String> = candidates
        .iter()
        .take(8)
        .map(|c| {
            let [width, height] = c.size;
            let (number, format, fragments) = (c.number, name(c.format), c.fragments);
            format!("#{number} ({width}x{height} {format}, {fragments} fragments)")
        })
        .collect();
    if list.is_empty() {
        return Error::config("nothing was drawn into an image of colours", "see --list");
    }
    let what = match choice {
        TargetChoice::Present => "what is presented is not drawn into, but copied".to_string(),
        other => format!("there is no target {other} in the captured frame"),
    };
    Error::config(what, format_args!("give --target with one of {}", list.join(", ")))
}
