//! Captures that no layer wrote: each rule in a case of few fragments.

mod checks;
mod damage;
mod depths;
mod frames;
mod passes;
mod rules;

use std::fs;
use std::path::PathBuf;

use ash::vk;
use screendoor_trace::error::Result;
use screendoor_trace::trace::{Fragment, Trace, TraceWriter, WriteOptions};
use screendoor_vulkan_layer::Wire;
use screendoor_vulkan_layer::log::{
    Attachment, Clear, Device, Draw, Entry, Event, Files, Image, MAGIC, Pass, Picture, Pipeline,
    Present, Record, State, Submission, Write,
};
use tempfile::TempDir;

use crate::{Captures, Conversion, ConvertOptions, Converted};

pub(super) const UNORM: vk::Format = vk::Format::R8G8B8A8_UNORM;
pub(super) const CLEAR: vk::AttachmentLoadOp = vk::AttachmentLoadOp::CLEAR;
pub(super) const LOAD: vk::AttachmentLoadOp = vk::AttachmentLoadOp::LOAD;

/// A device's files under construction.
pub(super) struct Made {
    place: TempDir,
    process: u32,
    pub entries: Vec<Entry>,
    pub records: Vec<Record>,
    pub pictures: Vec<u8>,
    submissions: u64,
}

impl Made {
    /// A device with the image 1 of 4 x 4 pixels, the depth image 9, and the pipeline 1.
    pub(super) fn new() -> Self {
        Self::with(UNORM, 1)
    }

    pub(super) fn with(format: vk::Format, samples: u32) -> Self {
        let mut made = Made {
            place: tempfile::tempdir().unwrap(),
            process: 7,
            entries: Vec::new(),
            records: Vec::new(),
            pictures: Vec::new(),
            submissions: 0,
        };
        made.entries.push(Entry::Device(Device {
            process: 7,
            program: "prog".into(),
            name: "a GPU".into(),
            capacity: 100,
            location: 0,
        }));
        made.entries.push(Entry::Pipeline(Pipeline {
            number: 1,
            name: "pipe".into(),
            samples,
            ..Pipeline::default()
        }));
        made.image(1, format, samples, 4);
        made.image(9, vk::Format::D32_SFLOAT, samples, 4);
        made
    }

    /// A square image.
    pub(super) fn image(&mut self, number: u64, format: vk::Format, samples: u32, side: u32) {
        self.entries.push(Entry::Image(Image {
            number,
            format: format.as_raw(),
            width: side,
            height: side,
            samples,
            ..Image::default()
        }));
    }

    /// A submission of frame 0 with these events and records.
    pub(super) fn submit(&mut self, events: Vec<Event>, records: Vec<Record>) {
        self.submit_in(0, events, records);
    }

    pub(super) fn submit_in(&mut self, frame: u64, events: Vec<Event>, records: Vec<Record>) {
        let count = records.len() as u64;
        self.entries.push(Entry::Submission(Submission {
            number: self.submissions,
            frame,
            first: self.records.len() as u64,
            records: count,
            needed: count,
            events,
        }));
        self.submissions += 1;
        self.records.extend(records);
    }

    pub(super) fn present(&mut self, frame: u64, images: &[u64]) {
        self.entries.push(Entry::Present(Present { frame, images: images.to_vec() }));
    }

    /// A picture of image 1 of 16 pixels of 4 bytes.
    pub(super) fn picture(&mut self, submission: u64, after: bool, pixels: &[[u8; 4]]) {
        self.picture_of(1, submission, after, &pixels.concat());
    }

    pub(super) fn picture_of(&mut self, image: u64, submission: u64, after: bool, bytes: &[u8]) {
        self.entries.push(Entry::Picture(Picture {
            image,
            submission,
            after,
            first: self.pictures.len() as u64,
            bytes: bytes.len() as u64,
        }));
        self.pictures.extend(bytes);
    }

    pub(super) fn path(&self) -> PathBuf {
        self.place.path().to_path_buf()
    }

    pub(super) fn files(&self) -> Files {
        Files::new(self.place.path(), self.process, 0)
    }

    /// The log's bytes.
    pub(super) fn log(&self) -> Vec<u8> {
        let entries = self.entries.iter().flat_map(Entry::to_bytes);
        MAGIC.iter().copied().chain(entries).collect()
    }

    pub(super) fn write(&self) {
        let files = self.files();
        fs::write(files.log, self.log()).unwrap();
        let mut records = Vec::new();
        self.records.iter().for_each(|record| record.put(&mut records));
        fs::write(files.records, records).unwrap();
        fs::write(files.pictures, &self.pictures).unwrap();
    }

    /// Writes the files and reads them.
    pub(super) fn captures(&self) -> Captures {
        self.write();
        Captures::read(self.place.path()).unwrap()
    }

    /// The trace that is made, and what is said of it.
    pub(super) fn converted(&self, options: ConvertOptions) -> (Trace, Converted) {
        self.convert(options).unwrap()
    }

    pub(super) fn convert(&self, options: ConvertOptions) -> Result<(Trace, Converted)> {
        self.write();
        convert(&Captures::read(self.place.path())?, options)
    }

    pub(super) fn error(&self, options: ConvertOptions) -> String {
        self.convert(options).map(|_| ()).unwrap_err().to_string()
    }
}

pub(super) fn convert(captures: &Captures, options: ConvertOptions) -> Result<(Trace, Converted)> {
    let conversion = Conversion::new(captures, options)?;
    let header = conversion.header().clone();
    let mut writer = TraceWriter::new(Vec::new(), "t", header, WriteOptions::default())?;
    let converted = conversion.write(&mut writer, &mut |_, _| ())?;
    Ok((Trace::from_bytes(writer.finish()?.0, "t")?, converted))
}

pub(super) fn fragments(trace: &Trace) -> Vec<Fragment> {
    trace.batches().flat_map(|batch| batch.unwrap().iter().collect::<Vec<_>>()).collect()
}

/// An image as a pass uses it.
pub(super) fn attachment(image: u64, load: vk::AttachmentLoadOp, clear: [f32; 4]) -> Attachment {
    let format = if image == 9 { vk::Format::D32_SFLOAT } else { UNORM };
    Attachment {
        image,
        format: format.as_raw(),
        load: load.as_raw(),
        clear,
        ..Attachment::default()
    }
}

/// A pass over all of image 1.
pub(super) fn pass(load: vk::AttachmentLoadOp, clear: [f32; 4]) -> Pass {
    Pass {
        colour: Some(attachment(1, load, clear)),
        area: [0, 0, 4, 4],
        layers: 1,
        ..Pass::default()
    }
}

/// The same with the depth image, which is cleared.
pub(super) fn with_depth(pass: Pass, clear: f32) -> Pass {
    Pass { depth: Some(attachment(9, CLEAR, [clear, 0.0, 0.0, 0.0])), ..pass }
}

pub(super) fn begin(pass: Pass) -> Event {
    Event::Pass(pass)
}

/// A clear within a pass.
pub(super) fn clear(value: [f32; 4], area: [i32; 4]) -> Event {
    Event::Clear(Clear { depth: false, value, area })
}

pub(super) fn write_to(image: u64, command: &str) -> Event {
    Event::Write(Write { image, command: command.into() })
}

/// A draw of all channels that covers what is there.
pub(super) fn opaque(slot: u32) -> Draw {
    let state = State { mask: 15, ..State::default() };
    Draw {
        slot,
        pipeline: 1,
        command: "vkCmdDraw".into(),
        vertices: 3,
        instances: 1,
        state,
        ..Draw::default()
    }
}

pub(super) fn blended(slot: u32, source: vk::BlendFactor, destination: vk::BlendFactor) -> Draw {
    let mut draw = opaque(slot);
    draw.state.blend = true;
    draw.state.source = source.as_raw();
    draw.state.destination = destination.as_raw();
    draw
}

/// A draw of straight alpha.
pub(super) fn over(slot: u32) -> Draw {
    blended(slot, vk::BlendFactor::SRC_ALPHA, vk::BlendFactor::ONE_MINUS_SRC_ALPHA)
}

/// The same draw with a depth test.
pub(super) fn testing(mut draw: Draw, op: vk::CompareOp, write: bool) -> Draw {
    draw.state.depth_test = true;
    draw.state.depth_write = write;
    draw.state.depth_op = op.as_raw();
    draw
}

pub(super) fn draw(draw: Draw) -> Event {
    Event::Draw(draw)
}

/// A fragment that covers the first sample of pixel (x, 0).
pub(super) fn record(slot: u32, primitive: u32, x: u32, colour: [f32; 4]) -> Record {
    Record { place: x, slot, primitive, coverage: 1, z: 0.5, colour, ..Record::default() }
}

/// A grey one.
pub(super) fn grey(slot: u32, x: u32, alpha: f32) -> Record {
    record(slot, 0, x, [0.5, 0.5, 0.5, alpha])
}
