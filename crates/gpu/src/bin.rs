//! Sorting a chunk's rows by pixel, on the device.

use crate::chunk::Uploaded;
use crate::device::Gpu;
use crate::params::Params;
use crate::program::Program;
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
    touch: Program,
    first: [Program; 2],
    next: [Program; 2],
    bound: Program,
    scan: Program,
    add: Program,
    longest: Program,
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
    pub(crate) fn new(gpu: &Gpu, rows: usize) -> Result<Self> {
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
    /// As [`Gpu::program`].
    pub(crate) fn new(gpu: &Gpu, samples: u32, constants: &[(String, Constant)]) -> Result<Self> {
        let text = |name, constants| shader::program(&[shader::named(name)], samples, constants);
        let (bin, scan) = (text("bin", constants), text("scan", &[]));
        let two = |entries: [&str; 2]| -> Result<[Program; 2]> {
            Ok([gpu.program(&bin, entries[0])?, gpu.program(&bin, entries[1])?])
        };
        Ok(Binner {
            touch: gpu.program(&text("touch", constants), "touch")?,
            first: two(["count_rows", "scatter_rows"])?,
            next: two(["count_keys", "scatter_keys"])?,
            bound: gpu.program(&bin, "bound")?,
            scan: gpu.program(&scan, "scan")?,
            add: gpu.program(&scan, "add")?,
            longest: gpu.program(&text("longest", &[]), "find")?,
        })
    }

    /// The tiles of `tiles` that the chunk touches: a bit for each.
    ///
    /// # Errors
    /// As [`Gpu::run`].
    pub(crate) fn touched(
        &self,
        gpu: &Gpu,
        timer: &Timer,
        chunk: &Uploaded,
        tiles: usize,
    ) -> Result<Vec<u32>> {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        let touched = gpu.buffer("touched tiles", 4 * tiles.div_ceil(32) as u64, usage)?;
        let uniform = uniform(gpu, &chunk.params)?;
        let buffers = [("params", &uniform), ("columns", &chunk.columns), ("touched", &touched)];
        let bound = gpu.bind(&self.touch, &buffers)?;
        let groups = u64::from(chunk.params.rows).div_ceil(256);
        gpu.submit("finding the touched tiles", |encoder| {
            timer.run(gpu, encoder, "bin", (&self.touch, &bound), groups);
            Ok(())
        })?;
        gpu.read(&touched, "finding the touched tiles", <[u32]>::to_vec)
    }

    /// Sorts a chunk's rows; `slots` holds each tile's place among `touched` ones.
    ///
    /// # Errors
    /// As [`Gpu::run`].
    pub(crate) fn sort(
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
        let usage = usage | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        let longest = gpu.buffer("the longest list", 8, usage)?;
        // For any program of the file: all see the same buffers.
        let bind = |params: &Params, [from, to]: [usize; 2], to_result: bool| {
            let [other, own] = match to_result {
                true => [&scratch.rows, &sorted.rows],
                false => [&sorted.rows, &scratch.rows],
            };
            let buffers = [
                ("params", &uniform(gpu, params)?),
                ("columns", &chunk.columns),
                ("slots", slots),
                ("keys_from", &scratch.keys[from]),
                ("rows_from", other),
                ("keys_to", &scratch.keys[to]),
                ("rows_to", own),
                ("counts", &scratch.counts),
                ("ends", &sorted.ends),
            ];
            gpu.bind(&self.bound, &buffers)
        };
        gpu.submit("sorting a chunk", |encoder| {
            for digit in 0..digits {
                let params =
                    Params { digit_at: digit * DIGIT_BITS, blocks: blocks as u32, ..chunk.params };
                let keys = [(digit as usize + 1) % 2, digit as usize % 2];
                // The last digit's rows are the result.
                let bound = bind(&params, keys, (digits - 1 - digit).is_multiple_of(2))?;
                let [count, scatter] = if digit == 0 { &self.first } else { &self.next };
                encoder.clear_buffer(&scratch.counts, 0, None);
                timer.run(gpu, encoder, "bin", (count, &bound), blocks);
                self.sum(gpu, timer, encoder, scratch, counted(u64::from(chunk.params.rows)))?;
                timer.run(gpu, encoder, "bin", (scatter, &bound), blocks);
            }
            // The sorted keys are read from where the last digit left them.
            let last = (digits as usize - 1) % 2;
            let bound = bind(&chunk.params, [last, 1 - last], true)?;
            let groups = u64::from(chunk.params.rows).div_ceil(256);
            timer.run(gpu, encoder, "bin", (&self.bound, &bound), groups);
            let params = length(gpu, u64::from(sorted.pixels))?;
            let buffers = [("params", &params), ("ends", &sorted.ends), ("longest", &longest)];
            let bound = gpu.bind(&self.longest, &buffers)?;
            timer.run(gpu, encoder, "bin", (&self.longest, &bound), pixels.div_ceil(256));
            let behind = 4 * u64::from(chunk.params.rows);
            encoder.copy_buffer_to_buffer(&scratch.keys[last], behind, &longest, 4, 4);
            Ok(())
        })?;
        let found = gpu.read(&longest, "sorting a chunk", |words| [words[0], words[1]])?;
        [sorted.longest, sorted.kept] = found;
        Ok(sorted)
    }

    /// Replaces each of the first `counts` counts by the sum of those before it.
    fn sum(
        &self,
        gpu: &Gpu,
        timer: &Timer,
        encoder: &mut wgpu::CommandEncoder,
        scratch: &Scratch,
        counts: u64,
    ) -> Result<()> {
        let mut lists = vec![(&scratch.counts, counts)];
        for sums in &scratch.sums {
            let (_, length) = lists[lists.len() - 1];
            lists.push((sums, length.div_ceil(SCANNED)));
        }
        let levels: Vec<_> = lists.windows(2).filter(|pair| pair[0].1 > 1).collect();
        let mut run = |program, level: &[(&wgpu::Buffer, u64)]| {
            let params = length(gpu, level[0].1)?;
            let buffers = [("params", &params), ("values", level[0].0), ("sums", level[1].0)];
            let bound = gpu.bind(program, &buffers)?;
            let groups = level[0].1.div_ceil(SCANNED);
            timer.run(gpu, encoder, "bin", (program, &bound), groups);
            Ok(())
        };
        levels.iter().try_for_each(|level| run(&self.scan, level))?;
        // A single block has nothing before it.
        let several = levels.iter().rev().filter(|level| level[1].1 > 1);
        several.into_iter().try_for_each(|level| run(&self.add, level))
    }
}

/// Parameters on the device.
pub(super) fn uniform(gpu: &Gpu, params: &Params) -> Result<wgpu::Buffer> {
    gpu.filled("parameters", bytemuck::bytes_of(params), wgpu::BufferUsages::UNIFORM)
}

/// The length of a list, as the programs that know nothing else of it are given it.
fn length(gpu: &Gpu, length: u64) -> Result<wgpu::Buffer> {
    let params = [length as u32, 0, 0, 0];
    gpu.filled("parameters", bytemuck::bytes_of(&params), wgpu::BufferUsages::UNIFORM)
}
