//! Which submissions make one picture.

use std::ops::Range;

use screendoor_trace::error::{Error, Result};
use screendoor_vulkan_layer::log::{Event, Pass, Submission};
use screendoor_vulkan_layer::settings::Span;

use crate::folder::DeviceCapture;

/// Submissions that are looked at as one: those of a frame, or those that were asked for.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    /// `None` where submissions were asked for, whatever frames they belong to.
    pub number: Option<u64>,
    /// Places in [`DeviceCapture::submissions`].
    pub submissions: Range<usize>,
}

/// Why a frame cannot be used.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Flaw {
    /// There was no memory for all records of a submission, which needed so many.
    Overflow(u64),
    /// The program ended before the frame did.
    Unended,
}

/// Where something is done.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) struct At {
    /// Place in [`DeviceCapture::submissions`].
    pub submission: usize,
    /// Place in [`Submission::events`].
    pub event: usize,
}

/// What a command buffer does, and within which pass.
#[derive(Clone, Copy)]
pub(crate) struct Step<'a> {
    pub at: At,
    pub pass: Option<&'a Pass>,
    pub what: &'a Event,
}

impl Frame {
    /// How it is called in texts.
    pub(crate) fn name(&self, capture: &DeviceCapture) -> String {
        match (self.number, self.of(capture)) {
            (Some(number), _) => format!("frame {number}"),
            (None, [one]) => format!("submission {}", one.number),
            (None, [first, .., last]) => format!("submissions {}-{}", first.number, last.number),
            (None, []) => "no submission".to_string(),
        }
    }

    pub(crate) fn of<'a>(&self, capture: &'a DeviceCapture) -> &'a [Submission] {
        &capture.submissions[self.submissions.clone()]
    }

    /// All that is done in it, in order.
    pub(crate) fn steps<'a>(&self, capture: &'a DeviceCapture) -> impl Iterator<Item = Step<'a>> {
        self.submissions.clone().flat_map(|submission| {
            let mut pass = None;
            let events = capture.submissions[submission].events.iter().enumerate();
            events.map(move |(event, what)| {
                if let Event::Pass(begun) = what {
                    pass = Some(begun);
                }
                Step { at: At { submission, event }, pass, what }
            })
        })
    }

    /// What is wrong with it.
    pub(crate) fn flaw(&self, capture: &DeviceCapture) -> Option<Flaw> {
        let over = self.of(capture).iter().filter(|s| s.needed > s.records);
        if let Some(needed) = over.map(|s| s.needed).max() {
            return Some(Flaw::Overflow(needed));
        }
        let number = self.number?;
        let ended = capture.presents.iter().any(|p| p.frame >= number)
            || capture.end.is_some_and(|last| last >= number)
            // What never presents has one frame, which ends with the program.
            || capture.presents.is_empty() && !capture.is_torn;
        (!ended).then_some(Flaw::Unended)
    }
}

/// The frames among `span`.
pub(crate) fn frames(capture: &DeviceCapture, span: Span) -> Vec<Frame> {
    let all = &capture.submissions;
    if let Span::Submissions(first, last) = span {
        let start = all.partition_point(|s| s.number < first);
        let end = all.partition_point(|s| s.number <= last);
        let some = (start < end).then_some(Frame { number: None, submissions: start..end });
        return some.into_iter().collect();
    }
    let mut frames: Vec<Frame> = Vec::new();
    for (i, submission) in all.iter().enumerate() {
        match frames.last_mut() {
            Some(frame) if frame.number == Some(submission.frame) => frame.submissions.end = i + 1,
            _ => frames.push(Frame { number: Some(submission.frame), submissions: i..i + 1 }),
        }
    }
    if let Span::Frames(first, last) = span {
        frames.retain(|f| f.number.is_some_and(|n| (first..=last).contains(&n)));
    }
    frames
}

/// The last frame among `span` that is whole.
///
/// # Errors
/// [`Error::Unsupported`] where there are frames and none is whole, [`Error::Config`] where there
/// is none.
pub(crate) fn last_whole(capture: &DeviceCapture, span: Span) -> Result<Frame> {
    let frames = frames(capture, span);
    if let Some(whole) = frames.iter().rev().find(|f| f.flaw(capture).is_none()) {
        return Ok(whole.clone());
    }
    let place = capture.device.program.clone();
    let Some(last) = frames.last() else {
        return Err(none(capture, span));
    };
    let name = last.name(capture);
    Err(match last.flaw(capture) {
        Some(Flaw::Overflow(needed)) => Error::unsupported(
            place,
            format_args!(
                "{name} has {needed} fragments, and there was memory for {}",
                capture.device.capacity
            ),
            format_args!("give --capacity {}", needed.next_multiple_of(1 << 16)),
        ),
        _ => Error::unsupported(
            place,
            format_args!("it ended within {name}"),
            "capture an earlier frame with --frame, or what there is with --submits",
        ),
    })
}

/// The error where nothing of `span` was recorded.
fn none(capture: &DeviceCapture, span: Span) -> Error {
    let program = &capture.device.program;
    match span {
        Span::Frames(first, last) => {
            let wanted = match first == last {
                true => format!("frame {first} was"),
                false => format!("frames {first}-{last} were"),
            };
            let frames = capture.presents.iter().map(|p| p.frame + 1).max().unwrap_or(0);
            let (presented, hint) = match frames {
                0 => ("none".to_string(), "give --submits for what is never presented"),
                n => (
                    n.to_string(),
                    "frames are counted from 0: ask for another, or let the program run longer",
                ),
            };
            let what = format!("{wanted} not captured: {program} has presented {presented}");
            Error::config(what, hint)
        }
        Span::Submissions(first, last) => {
            let others = match capture.submissions.last() {
                None => String::new(),
                Some(other) => format!(", but others up to {}", other.number),
            };
            Error::config(
                format_args!("submissions {first}-{last} of {program} were not captured{others}"),
                "submissions are counted from 0 on each device: ask for others",
            )
        }
        Span::First => Error::unsupported(
            program,
            "it submitted nothing that leaves fragments",
            "ask for what it does later with --frame or --submits, and see --list",
        ),
    }
}
