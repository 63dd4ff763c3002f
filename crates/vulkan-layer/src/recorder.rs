//! The memory that shaders write records to, and the files that they go to.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use ash::vk;

use crate::device::Device;
use crate::instance::{Physical, name};
use crate::log::{self, Entry, Event, Files, MAGIC, RECORD_BYTES};
use crate::memory::Buffer;
use crate::settings::{Settings, Span};
use crate::spirv::HEADER_WORDS;
use crate::table::{DeviceTable, next};

/// Draws that can be told apart at a time: those of all command buffers that hold any.
pub(crate) const SLOTS: u32 = 1 << 17;

/// Words of the header (`spirv`).
const COUNT: usize = 0;
const CAPACITY: usize = 1;
const ENABLED: usize = 2;
const ADDRESS: usize = 4;

const HEADER_BYTES: u64 = HEADER_WORDS as u64 * 4;

/// What is bound for each draw.
pub(crate) struct Resources {
    made: Option<Made>,
}

struct Made {
    /// The header; the records behind it where they have no address.
    header: Buffer,
    /// The records, where they have one.
    data: Option<Mutex<Buffer>>,
    slots: Buffer,
    stride: u32,
    layout: vk::DescriptorSetLayout,
    /// Of a set that holds nothing, for the places between the program's and ours.
    empty: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
    set: vk::DescriptorSet,
}

impl Resources {
    /// Where nothing can be recorded.
    pub(crate) fn none() -> Self {
        Self { made: None }
    }

    pub(crate) fn new(
        device: vk::Device,
        table: &DeviceTable,
        facts: &Physical,
        address: bool,
        settings: &Settings,
    ) -> Result<Self, String> {
        use vk::BufferUsageFlags as Usage;
        let memory = &facts.memory;
        let limits = &facts.properties.limits;
        let told = |what: &str, result: vk::Result| format!("{what}: {result}");
        let buffer = |size, usage, what: &str| {
            Buffer::new(device, table, memory, size, usage).map_err(|e| told(what, e))
        };
        let bytes = settings.capacity.max(1) * RECORD_BYTES as u64;
        let (behind, data) = if address {
            let usage = Usage::STORAGE_BUFFER | Usage::SHADER_DEVICE_ADDRESS;
            (0, Some(buffer(bytes, usage, "no memory for records")?))
        } else {
            // A shader sees no more of a buffer than this.
            let most = u64::from(limits.max_storage_buffer_range) - HEADER_BYTES;
            (bytes.min(most), None)
        };
        let header = buffer(HEADER_BYTES + behind, Usage::STORAGE_BUFFER, "no memory for records")?;
        let stride = (limits.min_uniform_buffer_offset_alignment as u32).max(16);
        let size = u64::from(SLOTS) * u64::from(stride);
        let slots = buffer(size, Usage::UNIFORM_BUFFER, "no memory for draws' numbers")?;
        for word in 0..HEADER_WORDS as usize {
            header.write(word, 0);
        }

        let binding = |n, kind| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(n)
                .descriptor_type(kind)
                .descriptor_count(1)
                .stage_flags(vk::ShaderStageFlags::FRAGMENT)
        };
        let kinds =
            [vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC, vk::DescriptorType::STORAGE_BUFFER];
        let bindings = [binding(0, kinds[0]), binding(1, kinds[1])];
        let null = std::ptr::null();
        let layout = |bindings: &[_]| {
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(bindings);
            let mut made = vk::DescriptorSetLayout::null();
            let result: vk::Result = next!(table.create_set_layout, device, &info, null, &mut made);
            result.result().map(|()| made).map_err(|e| told("no descriptor set", e))
        };
        let (layout, empty) = (layout(&bindings)?, layout(&[])?);
        let sizes =
            kinds.map(|kind| vk::DescriptorPoolSize::default().ty(kind).descriptor_count(1));
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        let mut pool = vk::DescriptorPool::null();
        let result: vk::Result = next!(table.create_pool, device, &info, null, &mut pool);
        result.result().map_err(|e| told("no descriptor pool", e))?;
        let layouts = [layout];
        let info =
            vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
        let mut set = vk::DescriptorSet::null();
        let result: vk::Result = next!(table.allocate_sets, device, &info, &mut set);
        result.result().map_err(|e| told("no descriptor set", e))?;
        let slot = [vk::DescriptorBufferInfo::default().buffer(slots.handle).range(16)];
        let records =
            [vk::DescriptorBufferInfo::default().buffer(header.handle).range(vk::WHOLE_SIZE)];
        let write = |n, kind, buffer| {
            vk::WriteDescriptorSet::default()
                .dst_set(set)
                .dst_binding(n)
                .descriptor_type(kind)
                .buffer_info(buffer)
        };
        let writes = [write(0, kinds[0], &slot), write(1, kinds[1], &records)];
        let () = next!(table.update_sets, device, 2, writes.as_ptr(), 0, std::ptr::null());

        let data = data.map(Mutex::new);
        let made = Made { header, data, slots, stride, layout, empty, pool, set };
        made.point();
        Ok(Self { made: Some(made) })
    }

    /// Whether draws can be recorded.
    pub(crate) fn usable(&self) -> bool {
        self.made.is_some()
    }

    /// Whether records lie where an address says.
    pub(crate) fn address(&self) -> bool {
        self.made.as_ref().is_some_and(|made| made.data.is_some())
    }

    /// The layouts of our set and of an empty one.
    pub(crate) fn layouts(&self) -> Option<[vk::DescriptorSetLayout; 2]> {
        self.made.as_ref().map(|made| [made.layout, made.empty])
    }

    /// Our set, and the offset at which it says the number of a draw.
    pub(crate) fn bind(&self, slot: u32) -> Option<(vk::DescriptorSet, u32)> {
        let made = self.made.as_ref()?;
        let offset = slot * made.stride;
        made.slots.write(offset as usize / 4, slot);
        Some((made.set, offset))
    }

    pub(crate) fn capacity(&self) -> u64 {
        self.made.as_ref().map_or(0, Made::capacity)
    }

    /// Has shaders record from now on.
    fn start(&self) {
        if let Some(made) = &self.made {
            made.header.write(COUNT, 0);
            made.header.write(ENABLED, 1);
        }
    }

    pub(crate) fn stop(&self) {
        if let Some(made) = &self.made {
            made.header.write(ENABLED, 0);
        }
    }

    /// Records that there would be with memory enough.
    fn needed(&self) -> u64 {
        self.made.as_ref().map_or(0, |made| u64::from(made.header.read(COUNT)))
    }

    /// The first `n` records.
    fn write_to(&self, file: &mut File, n: u64) -> std::io::Result<()> {
        let Some(made) = &self.made else { return Ok(()) };
        let bytes = n as usize * RECORD_BYTES;
        let mut write = |buffer: &Buffer, from: u64| {
            let all = unsafe { std::slice::from_raw_parts(buffer.bytes.add(from as usize), bytes) };
            file.write_all(all)
        };
        match &made.data {
            Some(data) => write(&data.lock().unwrap_or_else(PoisonError::into_inner), 0),
            None => write(&made.header, HEADER_BYTES),
        }
    }

    /// Makes room for `needed` records and some more, where that can be done while command buffers
    /// hold the set: where records have an address. No command may be running that records.
    fn grow(&self, device: &Device, needed: u64) -> bool {
        let Some(made) = &self.made else { return false };
        let Some(data) = &made.data else { return false };
        use vk::BufferUsageFlags as Usage;
        let usage = Usage::STORAGE_BUFFER | Usage::SHADER_DEVICE_ADDRESS;
        let bytes = (needed + needed / 4) * RECORD_BYTES as u64;
        let (handle, table) = (device.handle, &device.table);
        let Ok(larger) = Buffer::new(handle, table, &device.memory, bytes, usage) else {
            return false;
        };
        let mut data = data.lock().unwrap_or_else(PoisonError::into_inner);
        std::mem::replace(&mut *data, larger).destroy(handle, table);
        drop(data);
        made.point();
        true
    }

    pub(crate) fn destroy(&self, device: &Device) {
        let Some(made) = &self.made else { return };
        let (handle, table) = (device.handle, &device.table);
        let null = std::ptr::null();
        let () = next!(table.destroy_pool, handle, made.pool, null);
        for layout in [made.layout, made.empty] {
            let () = next!(table.destroy_set_layout, handle, layout, null);
        }
        made.header.destroy(handle, table);
        made.slots.destroy(handle, table);
        if let Some(data) = &made.data {
            data.lock().unwrap_or_else(PoisonError::into_inner).destroy(handle, table);
        }
    }
}

impl Made {
    fn capacity(&self) -> u64 {
        let bytes = match &self.data {
            Some(data) => data.lock().unwrap_or_else(PoisonError::into_inner).size,
            None => self.header.size - HEADER_BYTES,
        };
        // Indices are words of 32 bits.
        (bytes / RECORD_BYTES as u64).min(u64::from(u32::MAX) / 12)
    }

    /// Tells shaders where the records are, and how many there can be.
    fn point(&self) {
        self.header.write(CAPACITY, self.capacity() as u32);
        if let Some(data) = &self.data {
            let address = data.lock().unwrap_or_else(PoisonError::into_inner).address;
            self.header.write(ADDRESS, address as u32);
            self.header.write(ADDRESS + 1, (address >> 32) as u32);
        }
    }
}

/// Frames that programs record ahead, at most.
const AHEAD: u64 = 4;

/// A submission that has not been waited for.
pub(crate) struct Pending {
    pub number: u64,
    pub events: Vec<Event>,
    pub fence: vk::Fence,
    /// Whether it may wait for what the program does later.
    pub short: bool,
    pub queue: vk::Queue,
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
    notes: BTreeSet<String>,
    /// Images that were drawn into or read in this frame.
    pub known: BTreeSet<u64>,
    /// Images and pipelines that the log tells of.
    logged: BTreeSet<(bool, u64)>,
    /// Command pools of our own, by queue family.
    pub pools: BTreeMap<u32, vk::CommandPool>,
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

/// Devices of one process, at most.
const MOST_DEVICES: u32 = 10_000;

impl Recorder {
    pub(crate) fn open(settings: &Settings, properties: &vk::PhysicalDeviceProperties) -> Self {
        let process = std::process::id();
        let open = settings.folder.as_ref().and_then(|folder| Open::create(folder, process));
        if open.is_none() {
            eprintln!("screendoor: the capture's folder cannot be written; nothing is captured");
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
            notes: BTreeSet::new(),
            known: BTreeSet::new(),
            logged: BTreeSet::new(),
            pools: BTreeMap::new(),
        }
    }

    /// Begins the log.
    pub(crate) fn begin(&mut self, capacity: u64) {
        self.device.capacity = capacity;
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
        let Some(open) = &mut self.open else { return };
        if let Err(error) = what(open) {
            eprintln!("screendoor: the capture cannot be written ({error}); it is given up");
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
        if self.at_home() && self.notes.insert(text.to_string()) {
            eprintln!("screendoor: {text}");
            if self.device.capacity > 0 {
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

    /// Whether the log tells of a pipeline.
    pub(crate) fn told(&self, pipeline: u64) -> bool {
        self.logged.contains(&(false, pipeline))
    }

    /// Tells of a pipeline before it is first named.
    pub(crate) fn pipeline(&mut self, pipeline: log::Pipeline) {
        if self.logged.insert((false, pipeline.number)) {
            self.entry(&Entry::Pipeline(pipeline));
        }
    }

    /// Has shaders record, unless they do for what runs already.
    pub(crate) fn start(&mut self, device: &Device) {
        if self.pending.is_empty() && self.in_flight == 0 {
            device.resources.start();
        }
        self.in_flight += 1;
    }

    /// Writes what the pending submissions left, all of which have been run.
    pub(crate) fn read_out(&mut self, device: &Device) {
        let pending = std::mem::take(&mut self.pending);
        let Some(number) = pending.iter().map(|p| p.number).min() else { return };
        device.resources.stop();
        let needed = device.resources.needed();
        let records = needed.min(device.resources.capacity());
        self.with(|open| device.resources.write_to(&mut open.records, records));
        let submission = log::Submission {
            number,
            frame: self.frame,
            first: self.records,
            records,
            needed,
            events: pending.into_iter().flat_map(|p| p.events).collect(),
        };
        self.records += records;
        self.of_frame += needed;
        self.entry(&Entry::Submission(submission));
        if needed > records {
            self.overflowed = true;
            let more = device.resources.grow(device, needed);
            let what = if more { "the next frame has room for them" } else { "" };
            self.note(&format!(
                "{needed} fragments in one submission, room for {records}{}{what}",
                if more { "; " } else { "" }
            ));
        }
        if let Span::Submissions(_, last) = self.span
            && number >= last
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
        if self.wants(self.submission) {
            self.entry(&Entry::Present(log::Present { frame, images }));
        }
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

    pub(crate) fn destroy(&mut self, device: &Device) {
        for pool in std::mem::take(&mut self.pools).into_values() {
            let () =
                next!(device.table.destroy_command_pool, device.handle, pool, std::ptr::null());
        }
    }
}
