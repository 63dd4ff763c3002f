//! What the layer left in a folder: read whole, and checked before anything uses it.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::fs;
use std::path::{Path, PathBuf};

use screendoor_trace::error::{Error, Result};
use screendoor_trace::trace::MAX_SIDE;
use screendoor_vulkan_layer::log::{
    self, Attachment, Device, Draw, Entry, Event, Files, Image, MAGIC, Pass, Picture, Pipeline,
    Present, RECORD_BYTES, Submission,
};

use crate::target::Place;

/// What to do about files that cannot be right.
const HINT: &str = "capture anew; files of a layer of another version cannot be read";

/// The slot of a draw that leaves no records.
const NO_SLOT: u32 = u32::MAX;

/// What the layer recorded of a program: of each device of each of its processes.
#[derive(Debug)]
pub struct Captures {
    folder: PathBuf,
    pub(crate) devices: Vec<DeviceCapture>,
}

/// What the layer recorded of one device.
#[derive(Debug)]
pub(crate) struct DeviceCapture {
    pub files: Files,
    pub device: Device,
    pub pipelines: BTreeMap<u64, Pipeline>,
    pub images: BTreeMap<u64, Image>,
    /// By their numbers.
    pub submissions: Vec<Submission>,
    pub pictures: Vec<Picture>,
    pub notes: Vec<String>,
    pub presents: Vec<Present>,
    /// The frame after which all that was asked for was there.
    pub end: Option<u64>,
    /// Whether the log broke off within an entry: its program was killed.
    pub is_torn: bool,
}

impl Captures {
    /// Reads a folder's logs, in the order in which their processes were started as far as
    /// numbers of processes tell it.
    ///
    /// # Errors
    /// [`Error::Io`] for what cannot be read, [`Error::Invalid`] for a log that names what is
    /// not there.
    pub fn read(folder: impl AsRef<Path>) -> Result<Self> {
        let folder = folder.as_ref();
        let fail = |e| Error::io("read", folder, e);
        let mut logs = Vec::new();
        for entry in fs::read_dir(folder).map_err(fail)? {
            let path = entry.map_err(fail)?.path();
            if path.extension().is_some_and(|e| e == "log") {
                logs.push(path);
            }
        }
        logs.sort_by_cached_key(|path| (numbers(path), path.clone()));
        let read = logs.iter().map(|log| DeviceCapture::read(log));
        let devices = read.filter_map(Result::transpose).collect::<Result<_>>()?;
        Ok(Captures { folder: folder.to_path_buf(), devices })
    }

    /// Where it stands.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Whether no process recorded anything, not even that it has a device.
    pub fn is_empty(&self) -> bool {
        self.devices.is_empty()
    }

    /// What the layer has to say of its devices.
    pub fn notes(&self) -> impl Iterator<Item = &str> {
        self.devices.iter().flat_map(|d| &d.notes).map(String::as_str)
    }

    /// As it is where the program was ended early: what it never presents is not whole.
    pub fn broken_off(mut self) -> Self {
        self.devices.iter_mut().for_each(|device| device.is_torn = true);
        self
    }

    /// Frames that the program presented, on the device that presented most.
    pub fn frames(&self) -> u64 {
        let last = |d: &DeviceCapture| d.presents.iter().map(|p| p.frame + 1).max().unwrap_or(0);
        self.devices.iter().map(last).max().unwrap_or(0)
    }
}

/// A log's numbers: of its process, and of the device within.
fn numbers(log: &Path) -> Option<(u64, u64)> {
    let (process, device) = log.file_stem()?.to_str()?.split_once('-')?;
    Some((process.parse().ok()?, device.parse().ok()?))
}

impl DeviceCapture {
    /// Reads a log. None where it has not got as far as to say whose it is.
    fn read(path: &Path) -> Result<Option<Self>> {
        let bytes = fs::read(path).map_err(|e| Error::io("read", path, e))?;
        let bad = |what: &str| Error::invalid(path.display(), what, HINT);
        if MAGIC.starts_with(&bytes) {
            return Ok(None);
        }
        let (entries, is_torn) =
            log::entries(&bytes).ok_or_else(|| bad("it is no log of this version's layer"))?;
        let mut entries = entries.into_iter();
        let device = match entries.next() {
            None => return Ok(None),
            Some(Entry::Device(device)) => device,
            Some(_) => return Err(bad("it does not begin with its device")),
        };
        let mut all = DeviceCapture {
            files: Files::of(path),
            device,
            pipelines: BTreeMap::new(),
            images: BTreeMap::new(),
            submissions: Vec::new(),
            pictures: Vec::new(),
            notes: Vec::new(),
            presents: Vec::new(),
            end: None,
            is_torn,
        };
        for entry in entries {
            match entry {
                Entry::Device(_) => return Err(bad("it tells of two devices")),
                Entry::Pipeline(p) => {
                    all.pipelines.insert(p.number, p);
                }
                Entry::Image(i) => {
                    all.images.insert(i.number, i);
                }
                Entry::Submission(s) => all.submissions.push(s),
                Entry::Picture(p) => all.pictures.push(p),
                Entry::Note(n) => all.notes.push(n.text),
                Entry::Present(p) => all.presents.push(p),
                Entry::End(e) => all.end = Some(e.frame),
            }
        }
        all.submissions.sort_by_key(|s| s.number);
        all.check()?;
        Ok(Some(all))
    }

    /// The place of a submission, for errors.
    pub(crate) fn place(&self, submission: &Submission) -> String {
        format!("{}, submission {}", self.files.log.display(), submission.number)
    }

    fn check(&self) -> Result<()> {
        let log = self.files.log.display();
        for image in self.images.values() {
            let sides = [image.width, image.height];
            if !sides.iter().all(|side| (1..=MAX_SIDE).contains(side)) {
                let [width, height] = sides;
                let what = format!("image {} has {width} x {height} pixels", image.number);
                return Err(Error::invalid(log, what, HINT));
            }
        }
        let length = |path: &Path| fs::metadata(path).map_or(0, |m| m.len());
        let records = length(&self.files.records) / RECORD_BYTES as u64;
        for pair in self.submissions.windows(2) {
            if pair[0].number == pair[1].number {
                return Err(Error::invalid(
                    self.place(&pair[0]),
                    "there are two of this number",
                    HINT,
                ));
            }
        }
        for submission in &self.submissions {
            let end = submission.first.checked_add(submission.records);
            if end.is_none_or(|end| end > records) {
                let (first, n) = (submission.first, submission.records);
                return Err(Error::invalid(
                    self.files.records.display(),
                    format_args!(
                        "submission {} has {n} records from record {first} on, and the file ends \
                         after {records}",
                        submission.number
                    ),
                    "capture anew: the file was cut, or the disk was full",
                ));
            }
            self.check_events(submission)?;
        }
        let pixels = length(&self.files.pictures);
        for picture in &self.pictures {
            let end = picture.first.checked_add(picture.bytes);
            if end.is_none_or(|end| end > pixels) || !self.images.contains_key(&picture.image) {
                return Err(Error::invalid(
                    self.files.pictures.display(),
                    format_args!(
                        "the picture of image {} at submission {} is not there",
                        picture.image, picture.submission
                    ),
                    "capture anew: the file was cut, or the disk was full",
                ));
            }
        }
        Ok(())
    }

    fn check_events(&self, submission: &Submission) -> Result<()> {
        let bad = |what: String| Err(Error::invalid(self.place(submission), what, HINT));
        let mut pass: Option<&Pass> = None;
        let mut slots = HashSet::new();
        for event in &submission.events {
            match event {
                Event::Pass(p) => {
                    let used = [&p.colour, &p.resolve, &p.depth].into_iter().flatten();
                    for used in used {
                        if let Some(what) = self.wrong(used) {
                            return bad(what);
                        }
                    }
                    pass = Some(p);
                }
                Event::Clear(_) if pass.is_none() => {
                    return bad("an attachment is cleared before there is a pass".to_string());
                }
                Event::Draw(draw) => {
                    if pass.is_none() {
                        return bad(format!("draw {} comes before there is a pass", draw.slot));
                    }
                    if !self.pipelines.contains_key(&draw.pipeline) {
                        let (slot, pipeline) = (draw.slot, draw.pipeline);
                        return bad(format!("draw {slot} has the unknown pipeline {pipeline}"));
                    }
                    if self.is_recorded(draw) && !slots.insert(draw.slot) {
                        return bad(format!("there are two draws {}", draw.slot));
                    }
                }
                Event::Write(write) if !self.images.contains_key(&write.image) => {
                    let (command, image) = (&write.command, write.image);
                    return bad(format!("{command} writes to the unknown image {image}"));
                }
                Event::Clear(_) | Event::Write(_) => {}
            }
        }
        Ok(())
    }

    /// Whether a draw's records are there to be used.
    pub(crate) fn is_recorded(&self, draw: &Draw) -> bool {
        draw.refused.is_empty() && self.pipelines[&draw.pipeline].refused.is_empty()
    }

    /// What is wrong with an attachment.
    fn wrong(&self, attachment: &Attachment) -> Option<String> {
        let number = attachment.image;
        let Some(image) = self.images.get(&number) else {
            return Some(format!("a pass draws into the unknown image {number}"));
        };
        let longest = image.width.max(image.height);
        let fits = longest.checked_shr(attachment.level).is_some_and(|side| side > 0);
        (!fits).then(|| format!("image {number} has no mip level {}", attachment.level))
    }

    /// Pixels of what is drawn into: width and height.
    pub(crate) fn size(&self, place: Place) -> [u32; 2] {
        let image = &self.images[&place.image];
        [image.width, image.height].map(|side| (side >> place.level).max(1))
    }

    /// Which event of a submission each slot is. Where several draws have one, they are refused.
    pub(crate) fn slots(submission: &Submission) -> HashMap<u32, usize> {
        let slot = |(i, event): (usize, &Event)| match event {
            Event::Draw(draw) if draw.slot != NO_SLOT => Some((draw.slot, i)),
            _ => None,
        };
        submission.events.iter().enumerate().filter_map(slot).collect()
    }
}
