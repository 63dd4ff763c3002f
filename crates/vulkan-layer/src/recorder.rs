//! What has been recorded of a device, and the files that it goes to.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::path::Path;
use std::sync::Arc;

use ash::vk;

use crate::device::Device;
use crate::instance::name;
use crate::log::{self, Entry, Event, Files, MAGIC};
use crate::queues::Queue;
use crate::say;
use crate::settings::{Settings, Span};
use crate::steps::{refuse_twins, slots};

/// Frames that programs record ahead, at most.
const AHEAD: u64 = 4;

/// A submission that has not been waited for.
pub(crate) struct Pending {
    pub number: u64,
    pub frame: u64,
    pub events: Vec<Event>,
    /// None where it is done.
    pub fence: Option<Arc<vk::Fence>>,
    pub queue: Arc<Queue>,
    /// Submissions that the queue had been given with it.
    pub given: u64,
}

/// What has been recorded of a device, and where it goes.
pub(crate) struct Recorder {
    open: Option<Open>,
    device: log::Device,
    span: Span,
    pub frame: u64,
    pub submission: u64,
    /// Calls to submit that have not come back.
    pub in_flight: u32,
    pub pending: Vec<Pending>,
    records: u64,
    picture_bytes: u64,
    /// Records of this frame, and whether some of them did not fit.
    of_frame: u64,
    overflowed: bool,
    done: bool,
    /// The log has begun.
    begun: bool,
    notes: BTreeSet<String>,
    /// Images that were drawn into or read in this frame.
    pub known: BTreeSet<u64>,
    /// Images and pipelines that the log tells of.
    logged: BTreeSet<(bool, u64)>,
}

struct Open {
    files: Files,
    log: File,
    records: File,
    pictures: File,
}

impl Open {
    /// The files of the first number that is free: where the loader has let this library go and
    /// opened it again, nothing here tells how many there are.
    fn create(folder: &Path, process: u32) -> Option<Self> {
        for n in 0..MOST_DEVICES {
            let files = Files::new(folder, process, n);
            let log = match File::create_new(&files.log) {
                Err(error) if error.kind() == ErrorKind::AlreadyExists => continue,
                log => log.ok()?,
            };
            let records = File::create_new(&files.records).ok()?;
            let pictures = File::create_new(&files.pictures).ok()?;
            return Some(Self { files, log, records, pictures });
        }
        None
    }
}

/// Different notes of one device, at most.
const MOST_NOTES: usize = 200;

/// Devices of one process, at most.
const MOST_DEVICES: u32 = 10_000;

impl Recorder {
    pub(crate) fn open(settings: &Settings, properties: &vk::PhysicalDeviceProperties) -> Self {
        let process = std::process::id();
        let open = settings.folder.as_ref().and_then(|folder| Open::create(folder, process));
        if open.is_none() {
            say("the capture's folder cannot be written; nothing is captured");
        }
        let program = std::env::current_exe().map(|p| p.display().to_string()).unwrap_or_default();
        let device = name(&properties.device_name).to_string_lossy();
        let driver = properties.driver_version;
        Self {
            open,
            device: log::Device {
                process,
                program,
                name: format!("{device}, driver {driver:#x}"),
                capacity: 0,
                location: settings.location,
            },
            span: settings.span,
            frame: 0,
            submission: 0,
            in_flight: 0,
            pending: Vec::new(),
            records: 0,
            picture_bytes: 0,
            of_frame: 0,
            overflowed: false,
            done: false,
            begun: false,
            notes: BTreeSet::new(),
            known: BTreeSet::new(),
            logged: BTreeSet::new(),
        }
    }

    /// Begins the log.
    pub(crate) fn begin(&mut self, capacity: u64) {
        self.device.capacity = capacity;
        self.begun = true;
        let device = self.device.clone();
        self.with(|open| open.log.write_all(MAGIC));
        // Notes from before are told in their turn.
        self.entry(&Entry::Device(device));
        for text in self.notes.clone() {
            self.entry(&Entry::Note(log::Note { text }));
        }
    }

    /// Whether this process is the one that opened the files: a child has its parent's memory.
    fn at_home(&self) -> bool {
        self.device.process == std::process::id()
    }

    /// Whether nothing will be captured any more.
    pub(crate) fn over(&self) -> bool {
        self.done || self.open.is_none()
    }

    /// Nothing more can be captured.
    pub(crate) fn give_up(&mut self, why: &str) {
        self.note(why);
        self.pending.clear();
        self.done = true;
    }

    /// Whether the submission of a number is asked for.
    pub(crate) fn wants(&self, number: u64) -> bool {
        let inside = match self.span {
            Span::First => true,
            Span::Frames(first, last) => (first..=last).contains(&self.frame),
            Span::Submissions(first, last) => (first..=last).contains(&number),
        };
        inside && !self.done && self.open.is_some() && self.at_home()
    }

    /// Whether something is asked for now or in the next frames, of which programs record some
    /// before the last is presented.
    pub(crate) fn soon(&self) -> bool {
        let near = match self.span {
            Span::Frames(first, last) => self.frame + AHEAD >= first && self.frame <= last,
            Span::First | Span::Submissions(..) => true,
        };
        near && !self.done && self.open.is_some()
    }

    /// Does something with the files. Where it fails, they go: half a log would look like one.
    fn with(&mut self, what: impl FnOnce(&mut Open) -> std::io::Result<()>) {
        let home = self.at_home();
        let Some(open) = self.open.as_mut().filter(|_| home) else { return };
        if let Err(error) = what(open) {
            say(&format!("the capture cannot be written ({error}); it is given up"));
            let files = &open.files;
            for file in [&files.log, &files.records, &files.pictures] {
                let _ = fs::remove_file(file);
            }
            self.open = None;
        }
    }

    fn entry(&mut self, entry: &Entry) {
        let bytes = entry.to_bytes();
        self.with(|open| open.log.write_all(&bytes));
    }

    /// Tells something once, the user and the log.
    pub(crate) fn note(&mut self, text: &str) {
        if self.at_home() && self.notes.len() < MOST_NOTES && self.notes.insert(text.to_string()) {
            say(text);
            if self.begun {
                self.entry(&Entry::Note(log::Note { text: text.into() }));
            }
        }
    }

    /// Tells of an image before it is first named.
    pub(crate) fn image(&mut self, image: log::Image) {
        if self.logged.insert((true, image.number)) {
            self.entry(&Entry::Image(image));
        }
    }

    /// Tells of a pipeline before it is first named.
    pub(crate) fn pipeline(&mut self, pipeline: log::Pipeline) {
        if self.logged.insert((false, pipeline.number)) {
            self.entry(&Entry::Pipeline(pipeline));
        }
    }

    /// Has shaders record, unless they do for what runs already. `quiet`: no command is running.
    pub(crate) fn start(&mut self, device: &Device, quiet: bool) {
        if self.pending.is_empty() && self.in_flight == 0 {
            device.resources.start(device, quiet);
        }
        self.in_flight += 1;
    }

    /// Writes what the pending submissions left, all of which have been run.
    pub(crate) fn read_out(&mut self, device: &Device) {
        let mut pending = std::mem::take(&mut self.pending);
        device.resources.stop();
        pending.sort_by_key(|p| p.number);
        let (Some(first), Some(last)) = (pending.first(), pending.last()) else { return };
        let (number, frame, last) = (first.number, first.frame, last.number);
        if self.over() || !self.at_home() {
            return;
        }
        let mut events: Vec<Event> = pending.into_iter().flat_map(|p| p.events).collect();
        refuse_twins(&mut events);
        let (needed, there) = device.resources.counted();
        let of = slots(&events).collect();
        let mut dropped = 0;
        self.with(|open| {
            dropped = device.resources.write_to(&mut open.records, there, &of)?;
            Ok(())
        });
        let records = there - dropped;
        let submission = log::Submission {
            number,
            frame,
            first: self.records,
            records,
            needed: needed - dropped,
            events,
        };
        self.records += records;
        self.of_frame += needed - dropped;
        self.entry(&Entry::Submission(submission));
        if needed > there {
            let more = device.resources.grow(device, needed);
            // Without more room the next frame would be no better.
            self.overflowed |= more;
            let what = if more { "; the next frame has room for them" } else { "" };
            self.note(&format!("{needed} fragments in one submission, room for {there}{what}"));
        }
        if let Span::Submissions(_, end) = self.span
            && last >= end
        {
            self.end();
        }
    }

    /// A frame is presented.
    pub(crate) fn present(&mut self, images: Vec<u64>) {
        if self.done || self.open.is_none() || !self.at_home() {
            self.frame += 1;
            return;
        }
        let (frame, all) = (self.frame, self.of_frame);
        // Frames are counted in any case, so that one knows how many there were.
        let images = if self.wants(self.submission) { images } else { Vec::new() };
        self.entry(&Entry::Present(log::Present { frame, images }));
        let whole = !std::mem::take(&mut self.overflowed);
        self.of_frame = 0;
        self.known.clear();
        self.frame += 1;
        match &mut self.span {
            Span::First if whole && all > 0 => self.end(),
            Span::Frames(_, last) if *last == frame => {
                if whole {
                    self.end();
                } else {
                    *last += 1;
                }
            }
            _ => {}
        }
    }

    fn end(&mut self) {
        self.done = true;
        self.entry(&Entry::End(log::End { frame: self.frame.saturating_sub(1) }));
    }

    /// Writes an image's pixels.
    pub(crate) fn picture(&mut self, image: u64, submission: u64, after: bool, pixels: &[u8]) {
        self.with(|open| open.pictures.write_all(pixels));
        let (first, bytes) = (self.picture_bytes, pixels.len() as u64);
        self.picture_bytes += bytes;
        self.entry(&Entry::Picture(log::Picture { image, submission, after, first, bytes }));
    }
}
