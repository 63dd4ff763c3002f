//! What the layer writes, declared once for both sides.
//!
//! Each Vulkan device of each process has three files in the capture's folder, named by the
//! process and a number ([`Files`]): a log of [`Entry`]s, the [`Record`]s of fragments, and the
//! pixels of pictures read from the program's images.

use std::path::{Path, PathBuf};

use crate::wire::{Wire, wire_enum, wire_struct};

/// What a log begins with.
pub const MAGIC: &[u8] = b"screendoor vulkan log 1\n";

/// Bytes of a record.
pub const RECORD_BYTES: usize = 48;

wire_struct! {
    /// One fragment, as the shader leaves it: twelve words.
    Record {
        /// Pixel: x below, y in the upper 16 bits; from the upper left, down.
        place: u32,
        /// Which draw: [`Draw::slot`].
        slot: u32,
        /// `gl_PrimitiveID`: counts from 0 in each instance of each draw.
        primitive: u32,
        /// `gl_InstanceIndex`: with the draw's first instance.
        instance: u32,
        /// Covered samples; bit 31: front-facing.
        coverage: u32,
        /// Window depth at the pixel's centre, 0 to 1, or as the shader gave it.
        z: f32,
        /// Its slopes by pixel; 0 where the shader gives depth, or is run for each sample.
        dzdx: f32,
        dzdy: f32,
        /// The shader's output at the location asked for, before blending.
        colour: [f32; 4],
    }
}

impl Record {
    pub fn x(&self) -> u32 {
        self.place & 0xffff
    }

    pub fn y(&self) -> u32 {
        self.place >> 16
    }

    /// Of `bytes`, of which there are [`RECORD_BYTES`].
    pub fn from_bytes(mut bytes: &[u8]) -> Option<Self> {
        Self::take(&mut bytes)
    }
}

wire_struct! {
    /// The first entry of each log.
    Device {
        process: u32,
        /// The program's file, as it was started.
        program: String,
        /// The GPU's name, and its driver's version number.
        name: String,
        /// Records that fit into memory; what comes beyond is counted, not kept.
        capacity: u64,
        /// Of which colour output the records tell.
        location: u32,
    }
}

wire_struct! {
    /// A graphics pipeline. Numbers are the layer's own and are never used twice.
    Pipeline {
        number: u64,
        /// As the program named it, or empty.
        name: String,
        /// Why its draws leave no records; empty where they do.
        refused: String,
        /// The fragment shader asks for tests before it is run: what is hidden leaves no record.
        early_tests: bool,
        /// It is run for each sample.
        per_sample: bool,
        /// It writes depth.
        writes_depth: bool,
        /// Samples a pixel.
        samples: u32,
    }
}

wire_struct! {
    /// An image that is drawn into. Numbers are the layer's own and are never used twice.
    Image {
        number: u64,
        name: String,
        /// `VkFormat`.
        format: i32,
        width: u32,
        height: u32,
        samples: u32,
        /// Whether it is presented.
        swapchain: bool,
    }
}

wire_struct! {
    /// One image as a pass uses it.
    Attachment {
        /// [`Image::number`].
        image: u64,
        /// `VkFormat` of the view.
        format: i32,
        /// Array layer and mip level.
        layer: u32,
        level: u32,
        /// `VkAttachmentLoadOp`: what becomes of what was there.
        load: i32,
        /// To what it is cleared; depth in the first.
        clear: [f32; 4],
    }
}

wire_struct! {
    /// A pass, or a subpass of one, begins.
    Pass {
        /// The colour attachment at the location asked for.
        colour: Option<Attachment>,
        /// What it is resolved into at the end.
        resolve: Option<Attachment>,
        depth: Option<Attachment>,
        /// Colour attachments in use besides.
        others: u32,
        /// Pixels: left, upper, width, height.
        area: [i32; 4],
        /// Views of a multiview pass, or layers of its framebuffer: 1 where it is plain.
        layers: u32,
        /// Debug labels around it, outermost first, joined by " / ".
        label: String,
    }
}

wire_struct! {
    /// `vkCmdClearAttachments`, one attachment and one rectangle of it.
    Clear {
        /// Whether depth is cleared, and not the colour at the location asked for.
        depth: bool,
        value: [f32; 4],
        /// Pixels: left, upper, width, height.
        area: [i32; 4],
    }
}

wire_struct! {
    /// What of a pipeline's state, dynamic or not, decides what becomes of a fragment.
    State {
        blend: bool,
        /// `VkBlendFactor` and `VkBlendOp`: of colour, of alpha.
        source: i32,
        destination: i32,
        op: i32,
        source_alpha: i32,
        destination_alpha: i32,
        op_alpha: i32,
        /// `VkColorComponentFlags`.
        mask: u32,
        constants: [f32; 4],
        depth_test: bool,
        depth_write: bool,
        /// `VkCompareOp`.
        depth_op: i32,
        /// A stencil test that can fail.
        stencil: bool,
        logic_op: bool,
        alpha_to_coverage: bool,
    }
}

wire_struct! {
    /// A draw; the parts of a multi-draw are one each.
    Draw {
        /// What its records carry; none else in the submission has the same, but for draws that are
        /// refused. `u32::MAX` where it leaves none.
        slot: u32,
        /// [`Pipeline::number`].
        pipeline: u64,
        /// The command's name.
        command: String,
        /// As the command has them; 0 where they lie in a buffer.
        vertices: u32,
        instances: u32,
        state: State,
        /// Why its records are not to be used, though there may be some; empty where they are.
        refused: String,
        /// Debug labels around it, outermost first, joined by " / ".
        label: String,
    }
}

wire_struct! {
    /// An image is written otherwise than by draws.
    Write {
        image: u64,
        /// The command's name.
        command: String,
    }
}

wire_enum! {
    /// What a command buffer does, in its order.
    Event {
        Pass = 0,
        Clear = 1,
        Draw = 2,
        Write = 3,
    }
}

wire_struct! {
    /// Command buffers were submitted, and have been run.
    Submission {
        /// Counted from 0 on each device.
        number: u64,
        /// Presentations before it.
        frame: u64,
        /// Records of it: the first in the file, how many are there, and how many there would be
        /// with memory enough.
        first: u64,
        records: u64,
        needed: u64,
        events: Vec<Event>,
    }
}

wire_struct! {
    /// Pixels of an image, rows from the top without gaps, in the file of pictures.
    Picture {
        image: u64,
        /// Before the submission of this number, or after it.
        submission: u64,
        after: bool,
        /// Where the bytes begin, and how many there are.
        first: u64,
        bytes: u64,
    }
}

wire_struct! {
    /// Something that a user should know, said once.
    Note {
        text: String,
    }
}

wire_struct! {
    /// Everything asked for has been captured.
    End {
        /// The last of it.
        frame: u64,
    }
}

wire_struct! {
    /// The program presents: the frame of this number ends.
    Present {
        frame: u64,
        /// The images presented.
        images: Vec<u64>,
    }
}

wire_enum! {
    /// What a log is made of.
    Entry {
        Device = 0,
        Pipeline = 1,
        Image = 2,
        Submission = 3,
        Picture = 4,
        Note = 5,
        Present = 6,
        End = 7,
    }
}

impl Entry {
    /// Its bytes in a log: their number, then they.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = vec![0; 4];
        self.put(&mut bytes);
        let n = (bytes.len() - 4) as u32;
        bytes[..4].copy_from_slice(&n.to_le_bytes());
        bytes
    }
}

/// The entries of a log, and whether it broke off within one.
///
/// `None` where `bytes` are no log of this version, or hold what none holds.
pub fn entries(bytes: &[u8]) -> Option<(Vec<Entry>, bool)> {
    let mut bytes = bytes.strip_prefix(MAGIC)?;
    let mut entries = Vec::new();
    while !bytes.is_empty() {
        let mut rest = bytes;
        let Some(n) = u32::take(&mut rest).filter(|n| rest.len() >= *n as usize) else {
            return Some((entries, true));
        };
        let (mut entry, after) = rest.split_at(n as usize);
        entries.push(Entry::take(&mut entry).filter(|_| entry.is_empty())?);
        bytes = after;
    }
    Some((entries, false))
}

/// The files of one device.
#[derive(Clone, Debug)]
pub struct Files {
    pub log: PathBuf,
    pub records: PathBuf,
    pub pictures: PathBuf,
}

impl Files {
    /// Of the `n`th device of a process.
    pub fn new(folder: &Path, process: u32, n: u32) -> Self {
        let name = |ending: &str| folder.join(format!("{process}-{n}.{ending}"));
        Self { log: name("log"), records: name("records"), pictures: name("pictures") }
    }

    /// Those that belong to a log.
    pub fn of(log: &Path) -> Self {
        let other = |ending: &str| log.with_extension(ending);
        Self { log: log.into(), records: other("records"), pictures: other("pictures") }
    }
}
