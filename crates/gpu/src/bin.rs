//! Sorting a chunk's rows by pixel, on the device.

use crate::chunk::Uploaded;
use crate::device::{Access, Gpu};
use crate::params::Params;
use crate::shader;
use crate::time::Timer;
use screendoor_rop::Constant;
use screendoor_trace::error::Result;
use screendoor_trace::tile::TILE_PIXELS;

/// Bits of a digit; `DIGITS` in `shaders/bin.wgsl` is the number of its values.
const DIGIT_BITS: u32 = 6;
/// Keys that a group sorts: `GROUP` threads of `KEYS_EACH` keys.
const BLOCK: u64 = 64 * 16;
/// Numbers that a group of `shaders/scan.wgsl` sums.
const SCANNED: u64 = 64 * 16;

/// The programs.
#[derive(Debug)]
pub(super) struct Binner {
    layout: wgpu::BindGroupLayout,
    scan_layout: wgpu::BindGroupLayout,
    touch_layout: wgpu::BindGroupLayout,
    touch: wgpu::ComputePipeline,
    first: [wgpu::ComputePipeline; 2],
    next: [wgpu::ComputePipeline; 2],
    bound: wgpu::ComputePipeline,
    scan: wgpu::ComputePipeline,
    add: wgpu::ComputePipeline,
    longest: wgpu::ComputePipeline,
}

/// Rows sorted by pixel.
#[derive(Debug)]
pub(super) struct Sorted {
    pub rows: wgpu::Buffer,
    /// Where each pixel's rows begin and end.
    pub ends: wgpu::Buffer,
    /// How many pixels that are.
    pub pixels: u32,
    /// How many rows a pixel has, at most.
    pub longest: u32,
    /// How many rows there are of all pixels.
    pub kept: u32,
}

/// Memory that sorting needs and does not keep.
#[derive(Debug)]
pub(super) struct Scratch {
    keys: [wgpu::Buffer; 2],
    rows: wgpu::Buffer,
    counts: wgpu::Buffer,
    /// Sums of blocks, of blocks of blocks, …
    sums: Vec<wgpu::Buffer>,
}

impl Scratch {
    /// For chunks of up to `rows` rows.
    ///
    /// # Errors
    /// As [`Gpu::buffer`].
    pub fn new(gpu: &Gpu, rows: usize) -> Result<Self> {
        let usage = wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_SRC
            | wgpu::BufferUsages::COPY_DST;
        let words = |label, count: u64| gpu.buffer(label, 4 * count, usage);
        let rows = rows as u64;
        let mut length = counted(rows);
        let mut sums = Vec::new();
        while length > 1 {
            length = length.div_ceil(SCANNED);
            sums.push(words("sums", length)?);
        }
        Ok(Scratch {
            keys: [words("keys", rows + 1)?, words("keys", rows + 1)?],
            rows: words("rows", rows)?,
            counts: words("counts", counted(rows))?,
            sums,
        })
    }
}

/// Counts of all digits and blocks, and their sum.
fn counted(rows: u64) -> u64 {
    rows.div_ceil(BLOCK).max(1) * (1 << DIGIT_BITS) + 1
}

impl Binner {
    /// Compiles the programs for columns of these types.
    ///
    /// # Errors
    /// As [`Gpu::pipeline`].
    pub fn new(gpu: &Gpu, samples: u32, constants: &[(String, Constant)]) -> Result<Self> {
        use Access::{Read, Uniform, Write};
        let layout = gpu.layout(&[
            (0, Uniform),
            (1, Read),
            (3, Read),
            (4, Read),
            (5, Read),
            (6, Write),
            (7, Write),
            (8, Write),
            (9, Write),
        ]);
        let scan_layout = gpu.layout(&[(0, Uniform), (1, Write), (2, Write)]);
        let touch_layout = gpu.layout(&[(0, Uniform), (1, Read), (3, Write)]);
        let (bin, scan) = (
            shader::program(&[shader::named("bin")], samples, constants),
            shader::program(&[shader::named("scan")], samples, &[]),
        );
        let touch = shader::program(&[shader::named("touch")], samples, constants);
        Ok(Binner {
            touch: gpu.pipeline(&touch, "touch", &touch_layout)?,
            first: [
                gpu.pipeline(&bin, "count_rows", &layout)?,
                gpu.pipeline(&bin, "scatter_rows", &layout)?,
            ],
            next: [
                gpu.pipeline(&bin, "count_keys", &layout)?,
                gpu.pipeline(&bin, "scatter_keys", &layout)?,
            ],
            bound: gpu.pipeline(&bin, "bound", &layout)?,
            scan: gpu.pipeline(&scan, "scan", &scan_layout)?,
            add: gpu.pipeline(&scan, "add", &scan_layout)?,
            longest: gpu.pipeline(
                &shader::program(&[shader::named("longest")], samples, &[]),
                "find",
                &scan_layout,
            )?,
            layout,
            scan_layout,
            touch_layout,
        })
    }

    /// The tiles of `tiles` that the chunk touches: a bit for each.
    ///
    /// # Errors
    /// As [`Gpu::check`].
    pub fn touched(
        &self,
        gpu: &Gpu,
        timer: &Timer,
        chunk: &Uploaded,
        tiles: usize,
    ) -> Result<Vec<u32>> {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        let touched = gpu.buffer("touched tiles", 4 * tiles.div_ceil(32) as u64, usage)?;
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let uniform = uniform(gpu, &chunk.params)?;
        let buffers = [(0, &uniform), (1, &chunk.columns), (3, &touched)];
        let bound = gpu.bind(&self.touch_layout, &buffers);
        let groups = u64::from(chunk.params.rows).div_ceil(256);
        timer.run(gpu, &mut encoder, "bin", (&self.touch, &bound), groups);
        gpu.submit(encoder, "finding the touched tiles")?;
        gpu.read(&touched, "finding the touched tiles", <[u32]>::to_vec)
    }

    /// Sorts a chunk's rows; `slots` holds each tile's place among `touched` ones.
    ///
    /// # Errors
    /// As [`Gpu::check`].
    pub fn sort(
        &self,
        gpu: &Gpu,
        timer: &Timer,
        scratch: &Scratch,
        chunk: &Uploaded,
        (slots, touched): (&wgpu::Buffer, usize),
    ) -> Result<Sorted> {
        let pixels = (touched * TILE_PIXELS) as u64;
        let usage = wgpu::BufferUsages::STORAGE;
        let mut sorted = Sorted {
            longest: 0,
            kept: 0,
            rows: gpu.buffer("sorted rows", 4 * u64::from(chunk.params.rows), usage)?,
            ends: gpu.buffer("the pixels' rows", 8 * pixels, usage)?,
            pixels: pixels as u32,
        };
        let bits = (u64::BITS - pixels.saturating_sub(1).leading_zeros()).max(1);
        let digits = bits.div_ceil(DIGIT_BITS);
        let blocks = u64::from(chunk.params.rows).div_ceil(BLOCK).max(1);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        for digit in 0..digits {
            let params =
                Params { digit_at: digit * DIGIT_BITS, blocks: blocks as u32, ..chunk.params };
            let (from, to) = ((digit as usize + 1) % 2, digit as usize % 2);
            // The last digit's rows are the result.
            let places = |to_result: bool| if to_result { &sorted.rows } else { &scratch.rows };
            let to_result = (digits - 1 - digit).is_multiple_of(2);
            let bound = gpu.bind(
                &self.layout,
                &[
                    (0, &uniform(gpu, &params)?),
                    (1, &chunk.columns),
                    (3, slots),
                    (4, &scratch.keys[from]),
                    (5, places(!to_result)),
                    (6, &scratch.keys[to]),
                    (7, places(to_result)),
                    (8, &scratch.counts),
                    (9, &sorted.ends),
                ],
            );
            let [count, scatter] = if digit == 0 { &self.first } else { &self.next };
            encoder.clear_buffer(&scratch.counts, 0, None);
            timer.run(gpu, &mut encoder, "bin", (count, &bound), blocks);
            self.sum(gpu, timer, &mut encoder, scratch, counted(u64::from(chunk.params.rows)))?;
            timer.run(gpu, &mut encoder, "bin", (scatter, &bound), blocks);
        }
        // The sorted keys are read from where the last digit left them.
        let last = (digits as usize - 1) % 2;
        let bound = gpu.bind(
            &self.layout,
            &[
                (0, &uniform(gpu, &chunk.params)?),
                (1, &chunk.columns),
                (3, slots),
                (4, &scratch.keys[last]),
                (5, &scratch.rows),
                (6, &scratch.keys[1 - last]),
                (7, &sorted.rows),
                (8, &scratch.counts),
                (9, &sorted.ends),
            ],
        );
        let groups = u64::from(chunk.params.rows).div_ceil(256);
        timer.run(gpu, &mut encoder, "bin", (&self.bound, &bound), groups);
        let usage = wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_SRC
            | wgpu::BufferUsages::COPY_DST;
        let longest = gpu.buffer("the longest list", 8, usage)?;
        let length = [sorted.pixels, 0, 0, 0];
        let params =
            gpu.filled("parameters", bytemuck::bytes_of(&length), wgpu::BufferUsages::UNIFORM)?;
        let buffers = [(0, &params), (1, &sorted.ends), (2, &longest)];
        let bound = gpu.bind(&self.scan_layout, &buffers);
        timer.run(gpu, &mut encoder, "bin", (&self.longest, &bound), pixels.div_ceil(256));
        let behind = 4 * u64::from(chunk.params.rows);
        encoder.copy_buffer_to_buffer(&scratch.keys[last], behind, &longest, 4, 4);
        gpu.submit(encoder, "sorting a chunk")?;
        let found = gpu.read(&longest, "sorting a chunk", |words| [words[0], words[1]])?;
        [sorted.longest, sorted.kept] = found;
        Ok(sorted)
    }

    /// Replaces each of the first `length` counts by the sum of those before it.
    fn sum(
        &self,
        gpu: &Gpu,
        timer: &Timer,
        encoder: &mut wgpu::CommandEncoder,
        scratch: &Scratch,
        length: u64,
    ) -> Result<()> {
        let mut lists = vec![(&scratch.counts, length)];
        for sums in &scratch.sums {
            let (_, length) = lists[lists.len() - 1];
            lists.push((sums, length.div_ceil(SCANNED)));
        }
        let levels: Vec<_> = lists.windows(2).filter(|pair| pair[0].1 > 1).collect();
        let mut program = |pipeline, level: &[(&wgpu::Buffer, u64)]| {
            let length = [level[0].1 as u32, 0, 0, 0];
            let usage = wgpu::BufferUsages::UNIFORM;
            let uniform = gpu.filled("parameters", bytemuck::bytes_of(&length), usage)?;
            let buffers = [(0, &uniform), (1, level[0].0), (2, level[1].0)];
            let bound = gpu.bind(&self.scan_layout, &buffers);
            let groups = level[0].1.div_ceil(SCANNED);
            timer.run(gpu, encoder, "bin", (pipeline, &bound), groups);
            Ok(())
        };
        levels.iter().try_for_each(|level| program(&self.scan, level))?;
        // A single block has nothing before it.
        let several = levels.iter().rev().filter(|level| level[1].1 > 1);
        several.into_iter().try_for_each(|level| program(&self.add, level))
    }
}

/// Parameters on the device.
pub(super) fn uniform(gpu: &Gpu, params: &Params) -> Result<wgpu::Buffer> {
    gpu.filled("parameters", bytemuck::bytes_of(params), wgpu::BufferUsages::UNIFORM)
}
