//! What the Vulkan layer leaves of a program, made up.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;

use screendoor_vulkan_layer::Wire;
use screendoor_vulkan_layer::log::{
    Attachment, Device, Draw, Entry, Event, Files, Image, MAGIC, Pass, Pipeline, Record, State,
    Submission,
};
use screendoor_vulkan_layer::vk;

/// The log of a device with the pipeline 1 and the image 1, which is presented.
pub struct Left {
    pub entries: Vec<Entry>,
}

impl Left {
    /// Of a program, whose image has `side` x `side` pixels.
    pub fn new(program: &str, side: u32) -> Self {
        let device = Device {
            process: 7,
            program: program.to_string(),
            name: "a GPU".to_string(),
            capacity: 100,
            location: 0,
        };
        let image = Image {
            number: 1,
            format: vk::Format::R8G8B8A8_UNORM.as_raw(),
            width: side,
            height: side,
            samples: 1,
            swapchain: true,
            ..Image::default()
        };
        let pipeline = Pipeline { number: 1, samples: 1, ..Pipeline::default() };
        let entries = vec![Entry::Device(device), Entry::Image(image), Entry::Pipeline(pipeline)];
        Left { entries }
    }

    /// The first submission, with so many records.
    pub fn submit(&mut self, events: Vec<Event>, records: u64) {
        let needed = records;
        let submission = Submission { records, needed, events, ..Submission::default() };
        self.entries.push(Entry::Submission(submission));
    }

    /// Writes the three files to a folder.
    pub fn write(&self, folder: &Path, records: impl IntoIterator<Item = Record>, pictures: &[u8]) {
        let files = Files::new(folder, 7, 0);
        let entries = self.entries.iter().flat_map(Entry::to_bytes);
        fs::write(files.log, MAGIC.iter().copied().chain(entries).collect::<Vec<u8>>()).unwrap();
        let mut file = BufWriter::new(File::create(files.records).unwrap());
        let mut bytes = Vec::new();
        for record in records {
            bytes.clear();
            record.put(&mut bytes);
            file.write_all(&bytes).unwrap();
        }
        file.flush().unwrap();
        fs::write(files.pictures, pictures).unwrap();
    }
}

/// A pass over all of the image, which it clears.
pub fn pass(side: i32) -> Pass {
    let colour = Attachment {
        image: 1,
        format: vk::Format::R8G8B8A8_UNORM.as_raw(),
        load: vk::AttachmentLoadOp::CLEAR.as_raw(),
        clear: [0.2, 0.4, 0.6, 1.0],
        ..Attachment::default()
    };
    Pass { colour: Some(colour), area: [0, 0, side, side], layers: 1, ..Pass::default() }
}

/// A draw of straight alpha, labelled glass.
pub fn over(slot: u32) -> Draw {
    let state = State {
        blend: true,
        source: vk::BlendFactor::SRC_ALPHA.as_raw(),
        destination: vk::BlendFactor::ONE_MINUS_SRC_ALPHA.as_raw(),
        mask: 15,
        ..State::default()
    };
    Draw { slot, pipeline: 1, label: "glass".to_string(), state, ..Draw::default() }
}

/// A red fragment of pixel (x, 0).
pub fn record(slot: u32, x: u32, alpha: f32) -> Record {
    let colour = [1.0, 0.0, 0.0, alpha];
    Record { place: x, slot, coverage: 1, z: 0.5, colour, ..Record::default() }
}
